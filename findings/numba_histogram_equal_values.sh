#!/bin/sh
# `np.histogram(values, bins)` in a function compiled by numba 0.68.1 where all values are the same, such as fragments of one
# size: every count is zero and all edges are that value, so the histogram holds none of the values. NumPy widens the range by
# a half to both sides and counts them all. The same with the range given as (value, value). No warning. Fails where that
# changes.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet numba==0.68.1 numpy==2.4.6
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
import numpy as np
from numba import njit


def counted(values):
    return np.histogram(values, 4)


compiled = njit(counted)
for name, values in (("one size", np.full(500, 0.02)), ("and one more", np.append(np.full(500, 0.02), 0.03))):
    plain, edges = counted(values)
    found, found_edges = compiled(values)
    print(f"{name}: NumPy {plain} from {edges[0]:g} to {edges[-1]:g}; compiled {found} from {found_edges[0]:g} to {found_edges[-1]:g}")
    assert plain.sum() == len(values)
    assert found.sum() == (0 if name == "one size" else len(values)), "changed: equal values are counted"
assert njit(lambda values: np.histogram(values, 4, (0.02, 0.02))[0])(np.full(500, 0.02)).sum() == 0
PYTHON
echo "as described: compiled, a histogram of equal values is empty"
