"""The figure after the paper's Fig. 3.8: speed and number by azimuth, pair and single round, with their bands."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from validation.paper_3_2.check import PANEL, REFERENCE
from validation.paper_3_2.ratios import FOCUS

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from validation.ensembles import RingEnsemble
    from validation.ring_counts import RingCounts

__all__ = ["by_azimuth_table", "draw"]

PAIR, SINGLE = "black", "0.45"


def draw(pair: RingEnsemble, single: RingEnsemble, path: Path) -> Path:
    """Write the figure as PNG: ensemble means in bins of five degrees, and 5 to 95 % of the realisations."""
    import matplotlib as mpl

    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure, (speed, number) = plt.subplots(1, 2, figsize=(11.0, 4.4), layout="constrained")
    for ensemble, label, colour, hatch in ((single, "single round", SINGLE, ""), (pair, "pair", PAIR, "////")):
        wide = ensemble.every_height.in_bins_of(PANEL)
        style = "-" if ensemble is pair else "--"
        _line(speed, wide, wide.largest_initial_speed, label, colour, style, hatch)
        _line(number, wide, wide.hits.astype(float), label, colour, style, hatch)
    base = single.every_height.in_bins_of(PANEL)
    levels = (
        (speed, REFERENCE["speed_ratio"] * base.largest_initial_speed.mean(), "the paper: +83.3 %"),
        (number, REFERENCE["number_ratio"] * base.hits.mean(), "the paper: +263 %"),
    )
    for axes, level, words in levels:
        axes.axhline(level, color="0.2", linewidth=0.9, linestyle=":")
        axes.annotate(words, (180.0, level), ha="center", va="bottom", fontsize=8)
        for centre in FOCUS:
            axes.axvline(centre, color="0.75", linewidth=0.8, zorder=0)
        axes.set(xlim=(0.0, 360.0), ylim=(0.0, None), xticks=range(0, 361, 45), xlabel="azimuth (degrees)")
        axes.spines[["top", "right"]].set_visible(False)
    speed.set(ylabel=f"largest initial speed in {PANEL:g} degrees (m/s)", title="(a) speed")
    number.set(ylabel=f"fragments in {PANEL:g} degrees", title="(b) number")
    speed.legend(frameon=False, loc="lower center", ncols=2)
    path.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(path, dpi=150)
    plt.close(figure)
    return path


def _line(
    axes: Axes, counts: RingCounts, values: NDArray[np.float64], label: str, colour: str, style: str, hatch: str
) -> None:
    low, high = np.percentile(values, (5.0, 95.0), axis=0)
    around = counts.azimuth
    axes.fill_between(
        around, low, high, step="mid", facecolor="none" if hatch else "0.88", edgecolor="0.6" if hatch else "none",
        hatch=hatch, linewidth=0.0, label=f"{label}, 5 to 95 % of {counts.realisations}",
    )  # fmt: skip
    axes.plot(around, values.mean(axis=0), style, color=colour, linewidth=1.6, drawstyle="steps-mid", label=label)


def by_azimuth_table(pair: RingEnsemble, single: RingEnsemble, path: Path) -> Path:
    """Write the curves as CSV, one line a degree: ensemble means of pair and single on both surfaces, SI."""
    columns: dict[str, NDArray[np.float64]] = {"azimuth_deg": pair.every_height.azimuth}
    for name, ensemble in (("pair", pair), ("single", single)):
        for surface in ("every_height", "band"):
            counts: RingCounts = getattr(ensemble, surface)
            hits = counts.hits.sum(axis=0)
            filled = (counts.hits > 0).sum(axis=0)
            start = f"{name}_{surface}"
            columns[f"{start}_hits"] = counts.hits.mean(axis=0)
            columns[f"{start}_hits_standard_error"] = counts.hits.std(axis=0, ddof=1) / np.sqrt(counts.realisations)
            columns[f"{start}_mean_initial_speed"] = counts.initial_speed.sum(axis=0) / np.maximum(hits, 1)
            largest = counts.largest_initial_speed.sum(axis=0)
            columns[f"{start}_largest_initial_speed"] = largest / np.maximum(filled, 1)
            columns[f"{start}_mean_speed_at_ring"] = counts.speed.sum(axis=0) / np.maximum(hits, 1)
    path.parent.mkdir(parents=True, exist_ok=True)
    table = np.column_stack(list(columns.values()))
    np.savetxt(path, table, delimiter=",", header=",".join(columns), comments="", fmt="%.6g")
    return path
