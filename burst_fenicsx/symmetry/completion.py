"""From the computed part to the whole: mesh, fields and records of all rounds, cut ones joined at the planes."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from burst_fenicsx.kernels.geometry.faces import reordered
from burst_fenicsx.records.measures import RoundMeasures
from burst_fenicsx.symmetry.detection import triple
from burst_fenicsx.symmetry.part import reflected

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from numpy.typing import NDArray

    from burst_fenicsx.files.snapshot import RoundRecord
    from burst_fenicsx.mechanics.initiation import Source
    from burst_fenicsx.meshing import HexahedralMesh
    from burst_fenicsx.records.exposure import Exposure
    from burst_fenicsx.symmetry.part import SymmetricPart

    Arrays = dict[str, NDArray]


Placed = TypeVar("Placed", "Source", "Exposure")

# Corners of a reflected hexahedron or quadrilateral in the order in which it is not inverted, by their number.
_REFLECTED = {8: (2, 3, 0, 1, 6, 7, 4, 5), 4: (3, 2, 1, 0)}
VECTORS = ("velocity", "displacement", "contact_force")
POINTS = ("position", "reference")

STRESSES = ("stress", "nodal_stress")
"""Symmetric tensors, six columns, of cells and of nodes."""

EXTENSIVE = (
    "kinetic",
    "kinetic_casing",
    "strain",
    "plastic",
    "viscous",
    "hourglass",
    "contact",
    "contact_gain",
    "damping",
    "external_work",
    "products_work",
    "products_viscous",
    "products_energy_left",
)
"""Columns of the ledger that grow with the number of rounds (J)."""


@dataclass(frozen=True)
class _Copy:
    """Nodes and cells of the part and the planes at which they are reflected, for round `index` of the whole."""

    index: int
    mirrors: int
    nodes: NDArray[np.int64]
    cells: NDArray[np.int64]


class Completion:
    """The whole mesh and how fields of the part are carried to it.

    A cut round is joined from its images: nodes in a plane of symmetry are common to both sides. Nothing is left of
    the planes, so that the break-up's fragments do not end there.

    Parameters
    ----------
    part : what is computed. mesh : of the part.

    Attributes
    ----------
    cells : (all cells, 8 or 4) int64, nodes in VTK order. names : `part`, `round`, `segment` and `station` of
        the whole's cells. nodes : number of nodes of the whole.
    """

    def __init__(self, part: SymmetricPart, mesh: HexahedralMesh) -> None:
        self._part = part
        self.trivial = part.images == 1
        self._copies: list[_Copy] = []
        if self.trivial:
            self.nodes, self.cells = len(mesh.nodes), reordered(mesh.cells)
        else:
            self.nodes, self.cells = self._join(mesh)
        self.names = self.cell_fields(
            {"part": mesh.part, "round": mesh.round, "segment": mesh.segment, "station": mesh.station}
        )

    def _join(self, mesh: HexahedralMesh) -> tuple[int, NDArray[np.int64]]:
        part = self._part
        held = np.zeros(len(mesh.nodes), dtype=np.int64) if mesh.held is None else mesh.held.astype(np.int64)
        of_round = np.empty(len(mesh.nodes), dtype=np.int64)
        of_round[mesh.cells] = mesh.round[:, None]
        number = np.full((part.images, len(mesh.nodes)), -1, dtype=np.int64)  # behind each set of planes
        count, cells = 0, []
        for index, source in enumerate(part.source.tolist()):
            own = np.flatnonzero(of_round == source)
            own_cells = np.flatnonzero(mesh.round == source)
            cutting = sum(1 << plane.bit for plane in part.cuts[source])
            for sides in sorted((some for some in range(part.images) if some & ~cutting == 0), key=int.bit_count):
                # Reflection at a plane in which a node lies does nothing: it is a node of the other side as well.
                behind = sides & ~held
                fresh = own[behind[own] == sides]
                number[sides, fresh] = count + np.arange(len(fresh))
                count += len(fresh)
                mirrors = int(part.mirrors[index]) ^ sides
                corners = mesh.cells[own_cells]
                if mirrors.bit_count() % 2:
                    corners = corners[:, _REFLECTED[corners.shape[1]]]
                cells.append(number[behind[corners], corners])
                self._copies.append(_Copy(index, mirrors, fresh, own_cells))
        return count, reordered(np.concatenate(cells))

    def point_fields(self, fields: Mapping[str, NDArray]) -> Arrays:
        """Fields of the whole's nodes from those of the part's: places, vectors (nodes, 3), a stress (nodes, 6)."""
        unknown = fields.keys() - {*POINTS, *VECTORS, *STRESSES}
        if unknown:
            raise KeyError(f"no rule for the reflection of {sorted(unknown)}")
        return self._of_copies(fields, lambda copy: copy.nodes)

    def cell_fields(self, fields: Mapping[str, NDArray]) -> Arrays:
        """Fields of the whole's cells from those of the part's; `stress` (cells, 6) is turned, `round` renumbered."""
        return self._of_copies(fields, lambda copy: copy.cells)

    def _of_copies(self, fields: Mapping[str, NDArray], rows: Callable[[_Copy], NDArray]) -> Arrays:
        if self.trivial:
            return dict(fields)
        return {
            name: np.concatenate([self._reflected(name, values[rows(copy)], copy) for copy in self._copies])
            for name, values in fields.items()
        }

    def _reflected(self, name: str, own: NDArray, copy: _Copy) -> NDArray:
        if name in POINTS:
            return self._part.place(own, copy.mirrors)
        if name in VECTORS:
            return reflected(own, self._part.matrix(copy.mirrors))
        if name in STRESSES:
            return turned_stress(own, self._part.matrix(copy.mirrors))
        return np.full(len(own), copy.index, dtype=own.dtype) if name == "round" else own

    def measures(self, along: Sequence[RoundMeasures]) -> list[RoundMeasures]:
        """Measures of all rounds from those of the computed parts, whose masses are those of whole rounds already."""
        return [along[source] for source in self._part.source]

    def records(self, records: Sequence[RoundRecord]) -> list[RoundRecord]:
        """Records of all rounds, with names and places of their own."""
        whole = self._part.whole
        return [
            replace(records[source], name=item.name, position=tuple(item.position), axis=tuple(item.axis))
            for source, item in zip(self._part.source.tolist(), whole, strict=True)
        ]

    def of_rounds(self, found: Sequence[Placed | None]) -> list[Placed | None]:
        """What shocks did in the computed rounds, for each round of the whole, with its place there."""
        part = self._part
        return [
            replace(one, place=triple(part.place(np.array(one.place), mirrors))) if (one := found[source]) else None
            for source, mirrors in zip(part.source.tolist(), part.mirrors.tolist(), strict=True)
        ]

    def history(self, columns: Mapping[str, NDArray]) -> Arrays:
        """The ledger's columns for the whole: energies are those of all images."""
        images = float(self._part.images)
        return {name: values * images if name in EXTENSIVE else values for name, values in columns.items()}


def turned_stress(stress: NDArray, matrix: NDArray) -> NDArray:
    """Stresses (n, 6) in the order xx, yy, zz, xy, yz, zx after the transformation `matrix`."""
    signs = np.diag(matrix)
    if np.array_equal(matrix, np.diag(signs)):
        x, y, z = signs
        return stress if (signs > 0.0).all() else stress * np.array([1.0, 1.0, 1.0, x * y, y * z, z * x], stress.dtype)
    xx, yy, zz, xy, yz, zx = stress.T
    full = np.stack([xx, xy, zx, xy, yy, yz, zx, yz, zz], axis=-1).reshape(-1, 3, 3)
    full = matrix @ full @ matrix.T
    return np.stack([full[:, 0, 0], full[:, 1, 1], full[:, 2, 2], full[:, 0, 1], full[:, 1, 2], full[:, 2, 0]], axis=-1)
