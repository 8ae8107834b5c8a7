#!/bin/sh
# Sobol's sets (`scipy.stats.qmc.Sobol`) of SciPy 1.10.1 (Debian 12) and 1.14.1 where several threads make the first ones of a
# process at once: one line "Exception ignored" goes to stderr, nothing is raised, and all sets but one hold points that fill
# the cube no better than a few lines do: their discrepancy is 10^4 times that of the set asked for. So a mean over a study of
# uncertainty made in threads is silently wrong, and other at the next call. The report of the fault speaks of a ValueError that
# is raised; none is. SciPy 1.15 makes its table of direction numbers under a lock. Fails where that changes.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet "scipy==1.14.1" "numpy==1.26.4"
cat > "$folder/sets.py" <<'PYTHON'
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import scipy
from scipy.stats import qmc

THREADS, POINTS = 4, 2048


def made(seed):
    return qmc.Sobol(8, scramble=True, seed=seed).random(POINTS)


def integral(points):  # of 12 (x - 1/2)^2 over eight coordinates, whose mean is 1
    return float((12.0 * (points - 0.5) ** 2).mean())


with ThreadPoolExecutor(THREADS) as pool:
    together = list(pool.map(made, range(THREADS)))
alone = [made(seed) for seed in range(THREADS)]
same = [bool(np.array_equal(one, other)) for one, other in zip(together, alone)]
print(f"SciPy {scipy.__version__}: the same as alone {same}")
for name, sets in (("in threads", together), ("alone", alone)):
    print(f"  {name}: discrepancy", *(f"{qmc.discrepancy(one):.1e}" for one in sets), "; mean", *(f"{integral(one):.3f}" for one in sets))
worst = max(qmc.discrepancy(one) for one in together) / max(qmc.discrepancy(one) for one in alone)
sys.exit(0 if (worst > 100.0) == (sys.argv[1] == "wrong") and all(same) != (sys.argv[1] == "wrong") else 1)
PYTHON
"$folder/env/bin/python" "$folder/sets.py" wrong 2> "$folder/stderr"
grep "Exception ignored" "$folder/stderr"
"$folder/env/bin/pip" install --quiet "scipy==1.15.3"
"$folder/env/bin/python" "$folder/sets.py" right
echo "as described: before SciPy 1.15 sets made at once are silently wrong"
