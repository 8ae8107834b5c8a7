"""A single round from Python: a case file changed, checked, computed, and its hazard distance drawn.

The cells are coarse: a first look. Run it: `python examples/single_round.py [FOLDER]`, with the folder for the results
(default runs/examples/single_round).
"""

from __future__ import annotations

import sys
from pathlib import Path

import fragfield

CASES = Path(__file__).resolve().parent.parent / "cases"


def main(folder: Path) -> Path:
    """Compute the round into a folder; the picture's path."""
    case = fragfield.Case.from_toml(
        CASES / "m107_comp_b.toml", set={"burst.cell_size": "10 mm", "burst.convergence": "off"}
    )
    print(case)
    print(*fragfield.check(case).warnings, sep="\n")

    run = fragfield.run(case, out=folder / "run", overwrite=True)
    print(run)
    hazard = run.hazard
    print(hazard)

    heavy = run.table("fragments")["mass_kg"] > 0.01
    print(f"{heavy.sum()} of {len(heavy)} fragments of the first event are heavier than 10 g")

    picture = folder / "single_round.png"
    run.figure("density_curve").savefig(picture, dpi=150, bbox_inches="tight")
    return picture


if __name__ == "__main__":
    print("picture:", main(Path(sys.argv[1] if len(sys.argv) > 1 else "runs/examples/single_round")))
