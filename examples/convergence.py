"""How a result settles as the cells get smaller: casing speed of a tube for five cell sizes.

A run of one round of revolution does this by itself (`burst.convergence`); here it is done by hand. Run it:
`python examples/convergence.py [FOLDER]`.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import fragfield

CASES = Path(__file__).resolve().parent.parent / "cases"
SIZES = (12.0, 8.5, 6.0, 4.2, 3.0)  # mm, each about 1.4 of the next


def main(folder: Path) -> Path:
    """Compute the bursts into a folder; the picture's path."""
    case = fragfield.Case.from_toml(CASES / "tube.toml", set=["burst.convergence=off"])
    sizes, speeds = [], []
    for size in SIZES:
        variant = case.changed({"burst.cell_size": f"{size} mm"})
        run = fragfield.run(variant, out=folder / f"{size}_mm", only="burst", overwrite=True, progress=False)
        burst = run.burst.summary
        sizes.append(size)
        speeds.append(burst.mean_initial_speed)
        print(f"{size:4} mm: {burst.cells:5} cells, {speeds[-1]:.1f} m/s, energy error {burst.energy_error:.2%}")
    # The last three sizes: order by the ratio of their differences (their own ratio is about 1.42), and the limit.
    ratio = (sizes[-3] / sizes[-1]) ** 0.5
    first, second = speeds[-2] - speeds[-3], speeds[-1] - speeds[-2]
    limit, words = None, "the differences do not fall: no order, no limit"
    if 0.0 < second / first < 1.0:
        order = np.log(first / second) / np.log(ratio)
        limit = speeds[-1] + second / (ratio**order - 1.0)
        words = f"limit {limit:.0f} m/s, by an observed order of {order:.1f}"
        if not 0.8 <= order <= 2.2:
            words += ": doubtful, take smaller cells"
    print(words)

    figure = Figure(figsize=(6.4, 3.6), layout="constrained")
    axes = figure.subplots()
    axes.plot(sizes, speeds, "o-", color="#16365c", label="computed")
    if limit is not None:
        axes.plot(0.0, limit, "o", markerfacecolor="white", color="#b3361e", label=words)
    axes.set(xlabel="Cell size (mm)", ylabel="Mean casing speed (m/s)", xlim=(-0.3, None))
    axes.margins(y=0.25)
    axes.legend(loc="lower left")
    picture = folder / "convergence.png"
    figure.savefig(picture, dpi=150)
    return picture


if __name__ == "__main__":
    print("picture:", main(Path(sys.argv[1] if len(sys.argv) > 1 else "runs/examples/convergence")))
