#!/bin/sh
# The wheel of dolfinx 0.11.0.post0 beside PyPI's h5py 3.16.0 and numba 0.68.1: after `import dolfinx.fem.petsc`, which
# finds numba and has LLVM load the library of PETSc for all the process to see, an `import h5py` binds to the HDF5 of
# the wheel and not to its own, and ends with "Not a datatype". With h5py loaded first, or without numba, both work. Documented is that dolfinx_solver comes before dolfinx; of h5py nothing is said.
# Needs Python 3.12 or newer (PYTHON=...), x86-64. Fails where that changes.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"${PYTHON:-python3}" -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet dolfinx-solver-real==0.11.0.post0 h5py==3.16.0

write='
import sys
try:
    import h5py
    with h5py.File(sys.argv[1], "w") as file:
        file["number"] = 1.0
        print("written:", file["number"][()])
except ValueError as error:
    print("refused:", error)
'
tried() { (cd "$folder" && env/bin/python -c "$1$write" number.h5 2>/dev/null); }

without=$(tried "import dolfinx_solver, dolfinx.fem.petsc")
"$folder/env/bin/pip" install --quiet numba==0.68.1
after=$(tried "import dolfinx_solver, dolfinx.fem.petsc")
before=$(tried "import h5py, dolfinx_solver, dolfinx.fem.petsc")
printf 'without numba:           %s\nwith numba, h5py after:  %s\nwith numba, h5py before: %s\n' "$without" "$after" "$before"
[ "$without" = "written: 1.0" ] && [ "$before" = "written: 1.0" ] || { echo "changed: h5py fails in another order" && exit 1; }
case $after in "refused: Not a datatype"*) ;; *) echo "changed: h5py works after dolfinx.fem.petsc" && exit 1 ;; esac
echo "as described: h5py has to be loaded before dolfinx.fem.petsc"
