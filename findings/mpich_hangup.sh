#!/bin/sh
# MPICH 5.0.2 as a wheel (mpi4py 4.1.2): the UCX below it takes SIGHUP for its debugger when MPI starts. A handler that
# the program had set in Python before is not called any more, and the signal by which a lost terminal ends a program
# only has UCX trace itself on standard output. UCX_DEBUG_SIGNO=0 leaves the signal alone.
# Needs Linux on x86-64. Fails where that changes.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"${PYTHON:-python3}" -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet mpich==5.0.2 mpi4py==4.1.2

cat >"$folder/hangup.py" <<'PYTHON'
import os
import signal
import time

called = []
signal.signal(signal.SIGHUP, lambda *_: called.append(1))
from mpi4py import MPI  # noqa: E402

os.kill(os.getpid(), signal.SIGHUP)
time.sleep(0.2)
print("handler called" if called else "signal lost", MPI.COMM_WORLD.size)
PYTHON
# UCX goes on to trace itself on standard output.
usual=$(UCX_TLS=self "$folder/env/bin/python" "$folder/hangup.py" 2>/dev/null | sed -n 1p)
cured=$(UCX_TLS=self UCX_DEBUG_SIGNO=0 "$folder/env/bin/python" "$folder/hangup.py" 2>/dev/null)
printf 'as it is:          %s\nUCX_DEBUG_SIGNO=0: %s\n' "$usual" "$cured"
[ "$usual" = "signal lost 1" ] || { echo "changed: SIGHUP reaches the program" && exit 1; }
[ "$cured" = "handler called 1" ] || { echo "changed: UCX_DEBUG_SIGNO=0 does not help" && exit 1; }
echo "as described: SIGHUP is lost once MPI has started"
