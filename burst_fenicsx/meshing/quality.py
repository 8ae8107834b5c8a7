"""How good a hexahedral mesh is: scaled Jacobian, aspect ratio, smallest edge, and masses against the profile's."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.errors import InputError
from burst_fenicsx.meshing.mesh import part_volumes
from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from burst_fenicsx.geometry import Profile
    from burst_fenicsx.meshing.mesh import HexahedralMesh

__all__ = [
    "MeshQuality",
    "check_quality",
    "edge_lengths",
    "quadrilateral_edges",
    "quadrilateral_jacobians",
    "quadrilateral_quality",
    "quality",
    "scaled_jacobians",
]

_MIN_SCALED_JACOBIAN = 0.2
_LARGEST_MASS_ERROR = 0.02


@dataclass(frozen=True)
class MeshQuality:
    """Figures of a mesh.

    Attributes
    ----------
    min_scaled_jacobian : float
        Smallest over cells, corners and centres; 1 for a box, 0 for a flat corner.
    max_aspect_ratio : float
        Largest ratio of the longest to the shortest edge of a cell.
    min_edge : float
        Shortest edge (m).
    cells, nodes : int
        Counts.
    worst_cell : int
        Cell of the smallest scaled Jacobian.
    mass_errors : mapping of Part to float
        Volume of each part relative to the profile's exact volume, less one; empty without a profile.
    """

    min_scaled_jacobian: float
    max_aspect_ratio: float
    min_edge: float
    cells: int
    nodes: int
    worst_cell: int
    mass_errors: Mapping[Part, float] = field(default_factory=dict)


def check_quality(found: MeshQuality, station: NDArray[np.float64], profile: Profile, cell_size: float) -> None:
    """Refuse a mesh of a profile that is too oblique or misses its masses.

    Parameters
    ----------
    found : figures of the mesh. station : of its cells, (cells,) m. profile, cell_size : what was meshed, and by what.
    """
    where = f"{profile.name} meshed with {cell_size * 1e3:g} mm"
    if found.min_scaled_jacobian < _MIN_SCALED_JACOBIAN:
        raise InputError(
            f"{where}: scaled Jacobian {found.min_scaled_jacobian:.3f} at station "
            f"{station[found.worst_cell] * 1e3:.4g} mm; at least {_MIN_SCALED_JACOBIAN:g} is needed: make the "
            "contours there less steep, or the cells smaller"
        )
    for part, error in found.mass_errors.items():
        if abs(error) > _LARGEST_MASS_ERROR:
            raise InputError(
                f"{where}: the mass of the {part.name.lower()} is off by {error:+.1%}; at most "
                f"{_LARGEST_MASS_ERROR:.0%} is allowed: the contours need smaller cells"
            )


def scaled_jacobians(mesh: HexahedralMesh) -> NDArray[np.float64]:
    """Return each cell's smallest scaled Jacobian over its corners and its centre, shape (m,)."""
    from burst_fenicsx.kernels.geometry.shapes import min_scaled_jacobians  # kernels are imported where they are used

    found: NDArray[np.float64] = min_scaled_jacobians(mesh.nodes, mesh.cells)
    return found


def quadrilateral_jacobians(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Smallest scaled Jacobian over the corners of quadrilaterals in a plane, (m,): below 0 where turned over.

    Parameters
    ----------
    corners : (m, 4, 2)
        Places (m), counter-clockwise.
    """
    onward, back = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    length = np.linalg.norm(onward, axis=2) * np.linalg.norm(back, axis=2)
    cross = onward[..., 0] * back[..., 1] - onward[..., 1] * back[..., 0]
    return np.asarray((cross / np.maximum(length, 1e-300)).min(axis=1))


def quadrilateral_edges(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Lengths (m, 4) of the edges of quadrilaterals (m, 4, k)."""
    return np.asarray(np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2))


def quadrilateral_quality(corners: NDArray[np.float64], nodes: int, errors: Mapping[Part, float]) -> MeshQuality:
    """Return the figures of a mesh of quadrilaterals in a plane, corners (m, 4, 2), with its nodes and mass errors."""
    scaled, length = quadrilateral_jacobians(corners), quadrilateral_edges(corners)
    return MeshQuality(
        min_scaled_jacobian=float(scaled.min()),
        max_aspect_ratio=float((length.max(axis=1) / length.min(axis=1)).max()),
        min_edge=float(length.min()),
        cells=len(corners),
        nodes=nodes,
        worst_cell=int(scaled.argmin()),
        mass_errors=errors,
    )


def edge_lengths(mesh: HexahedralMesh) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return each cell's shortest and longest edge (m), shapes (m,)."""
    from burst_fenicsx.kernels.geometry.shapes import edge_extremes

    shortest, longest = edge_extremes(mesh.nodes, mesh.cells)
    return shortest, longest


def quality(mesh: HexahedralMesh, profile: Profile | None = None, fraction: float = 1.0) -> MeshQuality:
    """Return the figures of a mesh; with the profile of its (only) round also the errors of the masses.

    `fraction` is that of the round which the mesh holds.
    """
    scaled = scaled_jacobians(mesh)
    shortest, longest = edge_lengths(mesh)
    errors: dict[Part, float] = {}
    if profile is not None:
        exact = profile.volumes()
        found = {part: volume / fraction for part, volume in part_volumes(mesh).items()}
        for part, volume in ((Part.CASING, exact.casing), (Part.CHARGE, exact.charge), (Part.FUZE, exact.fuze)):
            if volume > 0.0 or part in found:
                errors[part] = found.get(part, 0.0) / volume - 1.0 if volume > 0.0 else np.inf
    return MeshQuality(
        min_scaled_jacobian=float(scaled.min()),
        max_aspect_ratio=float((longest / np.maximum(shortest, 1e-300)).max()),
        min_edge=float(shortest.min()),
        cells=len(mesh.cells),
        nodes=len(mesh.nodes),
        worst_cell=int(scaled.argmin()),
        mass_errors=errors,
    )
