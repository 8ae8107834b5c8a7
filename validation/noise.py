"""`python -m validation.noise [--single SIZE] [--pair SIZE] [--out DIR]`: what last bits move, once a release.

Eight bursts of one M107 in its meridian and of a pair in three dimensions, with the casings' elastic modulus times
1 + k 1e-13, k = 0 to 7: no result should feel it. The table is for `docs/developer/tests.md`.
"""

from __future__ import annotations

import argparse
import sys
from math import sqrt
from pathlib import Path
from typing import TYPE_CHECKING, Any

from validation.runs import FOLDER, ROOT, Runs, StudyError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from validation.runs import Geometry

_BURSTS = 8
_ARRANGEMENTS: dict[str, tuple[str, Geometry]] = {
    "single": ("cases/m107_tnt.toml", "axisymmetric"),
    "pair": ("cases/m107_pair.toml", "3d"),
}


def quantities(burst: Mapping[str, Any]) -> dict[str, float]:
    """What is compared, from the part "burst" of a summary: times in us, speeds in m/s."""
    speed, left = burst["mean_speed_at_end"], burst["acceleration_left"]
    found = {"end (us)": 1e6 * burst["end_time"], "mean speed at the end (m/s)": speed}
    if left is not None:
        found["its asymptote (m/s)"] = speed * sqrt(1.0 + left)
    return found | {"mean speed handed over (m/s)": burst["mean_initial_speed"]}


def table(name: str, size: str, bursts: Sequence[Mapping[str, Any]]) -> list[str]:
    """Rows of the table: mean and spread, largest less smallest, of every quantity of an arrangement's bursts."""
    columns = [quantities(burst) for burst in bursts]
    rows = []
    for key in columns[0]:
        values = [column[key] for column in columns if key in column]
        rows.append(f"| {name}, {size} | {key} | {sum(values) / len(values):.2f} | {max(values) - min(values):.3g} |")
    return rows


def _moduli(case: str) -> float:
    from fragfield.case import load_case

    return float(load_case(ROOT / case).round[0].casing.elastic_modulus)


def main(arguments: Sequence[str] | None = None) -> int:
    """Make the bursts and print the table."""
    parser = argparse.ArgumentParser(prog="validation.noise", description=__doc__)
    parser.add_argument("--single", default="6 mm", metavar="SIZE", help="cell size of the single round; off: none")
    parser.add_argument("--pair", default="12 mm", metavar="SIZE", help="cell size of the pair; off: none")
    parser.add_argument("--out", type=Path, default=FOLDER, metavar="DIR", help="make the runs here")
    options = parser.parse_args(arguments)
    rows = ["| bursts | quantity | mean | largest less smallest |", "| --- | --- | --- | --- |"]
    try:
        for name, (case, geometry) in _ARRANGEMENTS.items():
            if (size := getattr(options, name)) == "off":
                continue
            runs, modulus = Runs(options.out.resolve()), _moduli(case)
            for k in range(_BURSTS):
                change = {"round.*.casing.elastic_modulus": f"{modulus * (1.0 + 1e-13 * k)!r} Pa"}
                runs.burst(f"noise_{name}_{k}", case, size, change, geometry)
            rows += table(name, size, [burst for _, burst in runs.bursts])
    except StudyError as error:
        print(f"validation.noise: {error}", file=sys.stderr)
        return error.code
    print("\n".join(rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
