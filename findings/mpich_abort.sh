#!/bin/sh
# MPI_Abort comes back in MPICH 5.0.2 from PyPI: on the rank that calls `comm.Abort(4)` the next lines of the program still
# run, until the launcher ends the process some milliseconds later. With Open MPI nothing runs after it. A program whose
# error handler aborts and then lets the exception go on thus reports it twice, or writes a file that it should not. The
# launcher's exit code is right (4). Cure: os._exit after Abort.
# Seen with mpi4py 4.1.2. Fails where that changes.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet mpich==5.0.2 mpi4py==4.1.2
cat > "$folder/abort.py" <<'PYTHON'
import sys

from mpi4py import MPI

comm = MPI.COMM_WORLD
comm.Barrier()
if comm.rank == 1:
    comm.Abort(4)
    sys.stderr.write("the line after Abort\n")
    sys.stderr.flush()
comm.Barrier()
PYTHON
code=0
"$folder/env/bin/mpiexec" -n 2 "$folder/env/bin/python" "$folder/abort.py" 2> "$folder/errors" || code=$?
cat "$folder/errors"
echo "exit code $code"
test "$code" -eq 4
grep -q "the line after Abort" "$folder/errors" || { echo "changed: nothing runs after Abort"; exit 1; }
echo "as described: the line after Abort has run"
