#!/bin/sh
# Scatter of a direction by `np.random.vonmises` in a function compiled by numba 0.68.1: angles from 0 to 2 pi, where NumPy's
# function of that name, which it stands for, documents and gives -pi to pi. About direction 0 half of the draws so lie near 2
# pi: the fraction within 10 degrees of it is half of the true one, the mean is 180 degrees, and a kernel gives other numbers
# than the same lines without `njit`. As points of the circle the draws are right, so sines and cosines do not show it. Fails
# where that changes.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet numba==0.68.1 numpy==2.4.6 scipy==1.17.1
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
import numpy as np
from numba import njit
from scipy.stats import vonmises

CONCENTRATION, DRAWS, LIMIT = 50.0, 100_000, np.radians(10.0)


def scatter(seed):
    np.random.seed(seed)
    angles = np.empty(DRAWS)
    for draw in range(DRAWS):
        angles[draw] = np.random.vonmises(0.0, CONCENTRATION)
    return angles


right = vonmises(CONCENTRATION).cdf(LIMIT) - vonmises(CONCENTRATION).cdf(-LIMIT)
seen = {}
for name, function in (("plain", scatter), ("compiled", njit(scatter))):
    angles = function(1)
    within = float((np.abs(angles) < LIMIT).mean())
    around = abs(np.exp(1j * angles).mean())
    seen[name] = within
    print(
        f"{name}: {np.degrees(angles.min()):.1f} to {np.degrees(angles.max()):.1f} degrees, mean {np.degrees(angles.mean()):.1f};"
        f" within 10 degrees {within:.3f}, to be {right:.3f}; length of the mean vector {around:.4f}"
    )
    assert abs(around - np.exp(1j * vonmises(CONCENTRATION).rvs(DRAWS, random_state=2)).mean().real) < 2e-3
assert abs(seen["plain"] - right) < 0.01
assert abs(seen["compiled"] - 0.5 * right) < 0.01, "changed: compiled draws lie about the direction asked for"
PYTHON
echo "as described: compiled, the angles run from 0 to 2 pi"
