"""A pallet of four rounds on its deck: hazard distance by direction.

The program finds the planes of symmetry and computes a quarter. Run it: `python examples/pallet.py [FOLDER]`.
"""

from __future__ import annotations

import sys
from pathlib import Path

import fragfield

CASES = Path(__file__).resolve().parent.parent / "cases"


def main(folder: Path) -> Path:
    """Compute the pallet into a folder; the picture's path."""
    case = fragfield.Case.from_toml(
        CASES / "m107_pallet_2x4.toml",
        set={
            "title": "Pallet of 2 x 2 155 mm M107, Comp B",
            "stack.counts": [2, 2, 1],
            "burst.cell_size": "16 mm",
            "burst.convergence": "off",
            "hazard.tolerance": 0.05,
        },
    )
    symmetry = fragfield.check(case).found.symmetry
    print(f"{len(symmetry.planes)} planes of symmetry, {100.0 * symmetry.share:.0f} % is computed")
    run = fragfield.run(case, out=folder / "run", overwrite=True)
    print(run)
    print(f"worst direction: {run.hazard.direction:.0f} degrees from +x")
    picture = folder / "pallet.png"
    run.figure("landing_map").savefig(picture, dpi=150, bbox_inches="tight")
    return picture


if __name__ == "__main__":
    print("picture:", main(Path(sys.argv[1] if len(sys.argv) > 1 else "runs/examples/pallet")))
