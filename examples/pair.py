"""Two rounds side by side against one: where their casings meet, fragments focus.

Both cases carry the same witness ring, so that their hits can be divided azimuth by azimuth. The cells are coarse and
the flights few: a first look. Run it: `python examples/pair.py [FOLDER]`.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import fragfield

CASES = Path(__file__).resolve().parent.parent / "cases"
COARSE = {"burst.cell_size": "14 mm", "burst.convergence": "off", "hazard.tolerance": 0.05}
WIDTH = 15.0  # degrees of a sector


def by_sector(run: fragfield.Run) -> np.ndarray:
    """Hits of one event on the ring by sector, the first about azimuth 0."""
    hits = run.hits
    ring = run.table("witness")["name"] == "ring"
    sector = np.round(hits["azimuth"][ring] / WIDTH).astype(int) % round(360.0 / WIDTH)
    return np.bincount(sector, minlength=round(360.0 / WIDTH))


def main(folder: Path) -> Path:
    """Compute both into a folder; the picture's path."""
    runs = {}
    for name in ("m107_comp_b", "m107_pair"):
        case = fragfield.Case.from_toml(CASES / f"{name}.toml", set=COARSE)
        runs[name] = fragfield.run(case, out=folder / name, overwrite=True)
        print(f"{case.title}: {len(runs[name].fragments)} fragments, {runs[name].burst.summary.cells} cells computed")
        print(runs[name].hazard)
    single, pair = by_sector(runs["m107_comp_b"]), by_sector(runs["m107_pair"])
    ratio = pair / single.mean()  # over the single round's mean over all azimuths
    middle = np.arange(len(ratio)) * WIDTH
    print(f"at 90 and 270 degrees {ratio[(middle == 90.0) | (middle == 270.0)].mean():.2f} times the single round")

    figure = Figure(figsize=(6.0, 5.6), layout="constrained")
    axes = figure.add_subplot(projection="polar")
    turn = np.radians(np.append(middle, 360.0))
    axes.plot(turn, np.append(ratio, ratio[0]), color="#b3361e", label="pair")
    axes.plot(turn, np.append(single, single[0]) / single.mean(), color="#16365c", linestyle="--", label="single round")
    axes.set_title("Hits on the ring over the single round's mean, one event", fontsize=10)
    axes.legend(loc="upper left", bbox_to_anchor=(-0.1, 1.05))
    picture = folder / "pair.png"
    figure.savefig(picture, dpi=150)
    return picture


if __name__ == "__main__":
    print("picture:", main(Path(sys.argv[1] if len(sys.argv) > 1 else "runs/examples/pair")))
