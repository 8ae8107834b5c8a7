"""Computed over measured mean mass by the wall of the casing, a panel a law."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fragfield.report.figures.drawing import GREY, INK
from transition.law.mean_mass import FACTORS
from validation.figures import picture
from validation.mean_mass.scatter import LAWS, computed

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from validation.mean_mass.data import Casing

__all__ = ["draw"]

_MARKERS = {
    "ordnance_1944": ("o", "shells, 1944"),
    "mott_linfoot_1943": ("s", "shells, 1943"),
    "tolch_1938": ("^", "75 mm, pit, 1938"),
    "tp12": ("x", "cylinder, nine fillings"),
}


def draw(casings: Sequence[Casing], path: Path) -> Path:
    """Write the figure as PNG."""
    with picture(path, len(LAWS), height=3.0, sharey=True) as axes:
        for axis, law in zip(axes, LAWS, strict=True):
            for source, (marker, label) in _MARKERS.items():
                own = [casing for casing in casings if casing.source == source]
                walls = [1e3 * casing.wall for casing in own]
                axis.plot(walls, [computed(law, c) / c.mean for c in own], marker, color=INK, markersize=4, label=label)
            for level in (1.0, FACTORS[law], 1.0 / FACTORS[law]):
                axis.axhline(level, color=GREY, linewidth=0.9, linestyle="-" if level == 1.0 else ":")
            axis.set(title=law, xlabel="Wall (mm)", xscale="log", yscale="log", ylim=(0.4, 4.0))
            axis.set_xticks([5.0, 10.0, 20.0, 40.0], ["5", "10", "20", "40"])
        axes[0].set(ylabel="Computed over measured mean mass")
        axes[0].set_yticks([0.5, 1.0, 2.0, 3.0], ["0.5", "1", "2", "3"])
        axes[0].minorticks_off()
        axes[1].legend(loc="upper left", fontsize=6.5)
    return path
