"""The products: effective Gurney velocity over the expansion, energy balance of a charge over the cell size."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fragfield.report.figures.drawing import GREY, INK, LINES
from validation.figures import picture
from validation.products.check import MODELS, REFERENCE, cylinder_gurney, model_of
from validation.products.energies import gurney_velocity, progressive_share

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

__all__ = ["draw"]


def draw(balances: Mapping[tuple[str, float], float], path: Path) -> Path:
    """Write the figure as PNG; `balances` are those of TNT by product model and cell size (m)."""
    with picture(path, 2, height=3.4) as (gurney, balance):
        volumes = np.linspace(1.5, 10.0, 120)
        gurney.axhspan(*REFERENCE["gurney"]["tnt"], color="0.85", label="Gurney velocity, printed range")
        for model, style in zip(MODELS, LINES, strict=False):
            products, charge = model_of("tnt", model)
            speeds = [gurney_velocity(products, charge, float(volume)) for volume in volumes]
            gurney.plot(volumes, speeds, label=model, **style)
            sizes = sorted(size for one, size in balances if one == model)
            found = [balances[model, size] for size in sizes]
            balance.plot(1e3 * np.array(sizes), found, marker="o", markersize=3.5, label=model, **style)
            theory = progressive_share(charge, model)
            balance.plot(0.0, theory, marker="x", markersize=6, color=style["color"], clip_on=False)
        points = np.array(cylinder_gurney())
        gurney.plot(*points.T, "o", color=INK, markersize=4, label="copper cylinder test")
        gurney.set(
            title="(a) TNT: effective Gurney velocity", xlabel="Volume over the initial one", ylabel="√(2E) (m/s)"
        )
        gurney.legend(loc="lower right")
        balance.axhline(1.0, color=GREY, linewidth=0.8)
        balance.set(title="(b) initiated progressively (×: theory)", xlabel="Cell size (mm)", xlim=(0, None))
        balance.set(ylabel="Work done and left over the heat")
        balance.legend(loc="center right")
    return path
