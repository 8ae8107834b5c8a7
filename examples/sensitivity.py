"""What single inputs do to the expected distance: one changed at a time, drawn as a tornado.

Distances of variants are compared with their standard errors. For many inputs at once, with their distributions, see
`fragfield uncertainty`. Run it: `python examples/sensitivity.py [FOLDER]`.
"""

from __future__ import annotations

import sys
from pathlib import Path

from matplotlib.figure import Figure

import fragfield

CASES = Path(__file__).resolve().parent.parent / "cases"
INPUTS = {
    "radius ratio of venting 1.6, 2.1": ("burst.leakage.radius_ratio", 1.6, 2.1),
    "prefactor of the mean mass 3, 5": ("break_up.prefactor", 3.0, 5.0),
    "shape factor 2370, 3147 kg/m3": ("flight.shape_factor", "2370 kg/m^3", "3147 kg/m^3"),
}


def distance(case: fragfield.Case, out: Path) -> tuple[float, float]:
    """Expected distance and its standard error (m); burst, break-up and flight, without a report."""
    for stage in ("burst", "break-up", "fly"):
        run = fragfield.run(case, out=out, only=stage, overwrite=stage == "burst", progress=False)
    return run.hazard.expected, run.hazard.standard_error


def main(folder: Path) -> Path:
    """Compute the variants into a folder; the picture's path."""
    nominal = fragfield.Case.from_toml(
        CASES / "tube.toml",
        set={"burst.cell_size": "10 mm", "burst.convergence": "off", "hazard.tolerance": 0.02},
    )
    middle, error = distance(nominal, folder / "nominal")
    print(f"nominal: {middle:.0f} m, standard error {error:.1f} m")
    found = {}
    for number, (words, (key, low, high)) in enumerate(INPUTS.items()):
        ends = []
        for side, value in (("low", low), ("high", high)):
            ends.append(distance(nominal.changed({key: value}), folder / f"{number}_{side}"))
            print(f"{key} = {value}: {ends[-1][0]:.0f} m, standard error {ends[-1][1]:.1f} m")
        found[words] = ends

    figure = Figure(figsize=(7.4, 2.6), layout="constrained")
    axes = figure.subplots()
    ordered = sorted(found.items(), key=lambda item: abs(item[1][1][0] - item[1][0][0]))
    for row, (_, ((low, low_error), (high, high_error))) in enumerate(ordered):
        axes.barh(row, high - low, left=low, height=0.5, color="#b8c4d4")
        axes.errorbar([low, high], [row, row], xerr=[low_error, high_error], fmt="o", color="#16365c", capsize=3)
    axes.axvline(middle, color="#b3361e", label=f"nominal {middle:.0f} m")
    axes.set(yticks=range(len(ordered)), yticklabels=[words for words, _ in ordered])
    axes.set_xlabel("Expected distance and its standard error (m)")
    axes.legend(loc="lower right")
    picture = folder / "sensitivity.png"
    figure.savefig(picture, dpi=150)
    return picture


if __name__ == "__main__":
    print("picture:", main(Path(sys.argv[1] if len(sys.argv) > 1 else "runs/examples/sensitivity")))
