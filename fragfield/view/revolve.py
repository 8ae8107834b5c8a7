"""The meridian of an axisymmetric burst, revolved for pictures and pages."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from burst_fenicsx.files.revolve import Revolution
    from fragfield.report.reading.run_files import RunFiles

__all__ = ["MOST_CELLS", "Revolved", "revolved"]

MOST_CELLS = 200_000
"""Of a picture: the 3-D page thins them further."""


@dataclass(frozen=True, eq=False)
class Revolved:
    """Cells around the axis with the nodes' speed.

    Attributes
    ----------
    points, speed : (n, 3), (n,)
        Nodes (m) and their speed (m/s).
    hexahedra, wedges : (k, 8), (w, 6)
        Cells in VTK's order; those at the axis are wedges.
    part_of_hexahedra, part_of_wedges : (k,), (w,)
        Their parts.
    """

    points: NDArray[np.float64]
    speed: NDArray[np.float64]
    hexahedra: NDArray[np.int64]
    wedges: NDArray[np.int64]
    part_of_hexahedra: NDArray[np.int32]
    part_of_wedges: NDArray[np.int32]


def revolved(
    run: RunFiles, points: NDArray[np.float64], speed: NDArray[np.float64], part: NDArray[np.int32]
) -> Revolved:
    """Revolve a state of the meridian: nodes (n, 3) in m, their speed (n,) in m/s, parts of the cells (m,)."""
    sweep = _revolution(run)
    parts, wedges = sweep.cell_field(part).astype(np.int32), sweep.wedges
    return Revolved(
        sweep.positions(points), np.asarray(speed)[sweep.node], sweep.cells[~wedges], sweep.wedge_nodes(),
        parts[~wedges], parts[wedges],
    )  # fmt: skip


def _revolution(run: RunFiles) -> Revolution:
    """The sweep of the run's meridian; made once a run."""
    if run.revolution is None:
        from burst_fenicsx.files.revolve import revolution

        attributes = run.rounds[0].attributes
        run.revolution = revolution(
            run.nodes["reference"], run.cells["nodes"], attributes["position"], attributes["axis"], MOST_CELLS
        )
    return run.revolution
