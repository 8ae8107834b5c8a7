"""Hexahedra around the axis from the quadrilaterals of a meridian: for ParaView, pictures and the 3-D page.

Arrays in, arrays out. The number of sectors follows from a bound on the number of cells. Nodes on the axis are shared
by all sectors, so that cells there are wedges, written as hexahedra with two pairs of equal nodes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.files.output import TimeSeries
from burst_fenicsx.meshing.placement import frame

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from numpy.typing import ArrayLike, NDArray


MOST_CELLS = 300_000
FEWEST_SECTORS, MOST_SECTORS = 24, 96
_MANY = 10  # times the bound: beyond that four sectors have to do
_TOGETHER = 4  # sectors are a multiple of four, so that planes through the axis cut between cells
_ON_AXIS = 1e-9  # of the largest radius
_MATRIX = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2]])  # of six components xx, yy, zz, xy, yz, zx
_SIX = ([0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0])


@dataclass(frozen=True, eq=False)
class Revolution:
    """A meridian swept around its axis; made once, applied to the state at any time.

    Attributes
    ----------
    sectors : number of sectors of the circle, a multiple of four.
    cells : (k, 8) nodes of the hexahedra in VTK's order; wedges at the axis have equal nodes.
    node, angle : (n,) node of the meridian that each node comes from, and its angle about the axis (rad).
    cell, cell_angle : (k,) cell of the meridian that each cell comes from, and the angle of its centre (rad).
    origin, frame : (3,) and (3, 3): a point of the axis (m); rows outward, across and axis.
    """

    sectors: int
    cells: NDArray[np.int64]
    node: NDArray[np.int64]
    angle: NDArray[np.float64]
    cell: NDArray[np.int64]
    cell_angle: NDArray[np.float64]
    origin: NDArray[np.float64]
    frame: NDArray[np.float64]

    @property
    def wedges(self) -> NDArray[np.bool_]:
        """Which cells (k,) are wedges at the axis."""
        return np.asarray(self._wedge_start >= 0)

    def wedge_nodes(self) -> NDArray[np.int64]:
        """Nodes (w, 6) of the wedges in the order of VTK 9.7; before it VTK's triangles went the other way round."""
        cells, start = self.cells[self.wedges], self._wedge_start[self.wedges]
        rows = np.arange(len(cells))
        # Nodes start and start + 1 lie on the axis; the triangles lie across it.
        low, high, out_high, out_low = ((start + i) % 4 for i in range(4))
        return np.column_stack(
            [
                cells[rows, low], cells[rows, out_low], cells[rows, out_low + 4],
                cells[rows, high], cells[rows, out_high], cells[rows, out_high + 4],
            ]
        )  # fmt: skip

    @property
    def _wedge_start(self) -> NDArray[np.int64]:
        """First of the two neighbouring local nodes (k,) on the axis, in the order of the quadrilateral; -1: none."""
        same = self.cells[:, :4] == self.cells[:, 4:]
        pair = same & np.roll(same, -1, axis=1)
        return np.where(pair.any(axis=1), pair.argmax(axis=1), -1)

    def positions(self, positions: ArrayLike) -> NDArray[np.float64]:
        """Nodes (n, 3) in m from those of the meridian (nodes, 3), which lie in its half plane."""
        away = np.asarray(positions, dtype=np.float64) - self.origin
        return self.origin + self._turned(away[self.node], self.angle)

    def point_field(self, values: ArrayLike) -> NDArray[np.generic]:
        """Nodal field of the meridian at the nodes: scalars copied, vectors (nodes, 3) turned."""
        values = np.asarray(values)[self.node]
        if values.ndim == 2 and values.shape[1] == 3:
            return self._turned(values, self.angle)
        return values

    def cell_field(self, values: ArrayLike) -> NDArray[np.generic]:
        """Cell field of the meridian in the cells.

        Vectors (m, 3) and symmetric tensors (m, 6), ordered xx, yy, zz, xy, yz, zx, are turned.
        """
        found = np.asarray(values)[self.cell]
        if found.ndim == 2 and found.shape[1] == 3:
            return self._turned(found, self.cell_angle)
        if found.ndim == 2 and found.shape[1] == 6:
            turn = self._rotations(self.cell_angle)
            tensor = turn @ found[:, _MATRIX] @ turn.transpose(0, 2, 1)
            return np.asarray(tensor[:, _SIX[0], _SIX[1]])
        return found

    def _turned(self, vectors: NDArray[np.float64], angle: NDArray[np.float64]) -> NDArray[np.float64]:
        outward, across, axis = (vectors @ row for row in self.frame)
        cosine, sine = np.cos(angle), np.sin(angle)
        local = np.column_stack([cosine * outward - sine * across, sine * outward + cosine * across, axis])
        return np.asarray(local @ self.frame)

    def _rotations(self, angle: NDArray[np.float64]) -> NDArray[np.float64]:
        one, zero = np.ones_like(angle), np.zeros_like(angle)
        cosine, sine = np.cos(angle), np.sin(angle)
        local = np.array([[cosine, -sine, zero], [sine, cosine, zero], [zero, zero, one]]).transpose(2, 0, 1)
        return np.asarray(self.frame.T @ local @ self.frame)


def revolution(
    reference: ArrayLike,
    cells: ArrayLike,
    position: Sequence[float],
    axis: Sequence[float],
    most_cells: int = MOST_CELLS,
) -> Revolution:
    """Sweep the quadrilaterals of a meridian around their axis.

    Parameters
    ----------
    reference : (nodes, 3) nodes before the burst (m), in the half plane through the axis along `frame(axis)[0]`.
    cells : (m, 4) their nodes, counter-clockwise in (r, z).
    position, axis : A point of the axis (m) and its direction, from the base to the nose.
    most_cells : wanted bound on the number of cells: as many sectors as it allows are taken, a multiple of four between
        `FEWEST_SECTORS` and `MOST_SECTORS`. It is exceeded where it allows less than `FEWEST_SECTORS`: these are taken
        up to ten times as many cells, beyond that four, so that there are never more cells than ten times the bound or
        four for every quadrilateral, whichever is more.
    """
    quads = np.asarray(cells, dtype=np.int64)
    fewest = FEWEST_SECTORS if FEWEST_SECTORS * len(quads) <= _MANY * most_cells else _TOGETHER
    sectors = min(MOST_SECTORS, max(fewest, most_cells // len(quads) // _TOGETHER * _TOGETHER))
    base, origin = frame(axis), np.asarray(position, dtype=np.float64)
    radius = (np.asarray(reference, dtype=np.float64) - origin) @ base[0]
    on_axis = radius <= _ON_AXIS * radius.max()

    used = np.unique(quads)
    once, around = used[on_axis[used]], used[~on_axis[used]]
    number = np.empty((sectors, len(radius)), dtype=np.int64)
    number[:, once] = np.arange(len(once))
    number[:, around] = len(once) + np.arange(sectors * len(around)).reshape(sectors, -1)
    step = 2.0 * np.pi / sectors
    ahead = np.roll(number, -1, axis=0)
    # Seen along the axis quadrilaterals face backwards: the sector's far side comes first.
    swept = np.concatenate([ahead[:, quads], number[:, quads]], axis=2).reshape(-1, 8)
    return Revolution(
        sectors=sectors,
        cells=swept,
        node=np.concatenate([once, np.tile(around, sectors)]),
        angle=np.concatenate([np.zeros(len(once)), np.repeat(step * np.arange(sectors), len(around))]),
        cell=np.tile(np.arange(len(quads)), sectors),
        cell_angle=np.repeat(step * (np.arange(sectors) + 0.5), len(quads)),
        origin=origin,
        frame=base,
    )


def write_revolved(
    path: Path,
    swept: Revolution,
    time: float,
    positions: ArrayLike,
    point_data: Mapping[str, ArrayLike],
    cell_data: Mapping[str, ArrayLike],
    provenance: Mapping[str, str] | None = None,
) -> None:
    """Write one state, swept around the axis, as `<path>.xdmf` and its folder `<path>` for ParaView.

    Parameters
    ----------
    path : without suffix, for example `run/burst_revolved`.
    swept : the sweep of the meridian.
    time : simulated time (s).
    positions : (nodes, 3) nodes of the meridian now (m), in its half plane.
    point_data, cell_data : fields of the meridian, as `TimeSeries.write` takes them, tensors with six columns.
    provenance : optional, written as attributes of the HDF5 file.

    Raises
    ------
    InputError
        The folder cannot be written.
    """
    TimeSeries(path, swept.cells, provenance).write(
        time,
        swept.positions(positions),
        {name: swept.point_field(values) for name, values in point_data.items()},
        {name: swept.cell_field(values) for name, values in cell_data.items()},
    )
