"""Interpolation in cells from the values at their nodes (Eq. 31), and the ring measure of an axisymmetric burst.

The shape functions are those of dolfinx's Lagrange elements of degree 1, tabulated by basix. A function of this space
is also a sum over modes, the products of the reference coordinates from -1 to 1 (1, xi, eta, zeta, xi eta, ...). The
sign of each under a reflection of the coordinates is known, which is what `transition.points` needs.

Quadrilaterals lie in one half plane through the round's axis and stand for the rings that they sweep around it. The
mass of a ring is distributed as the burst stage lumps it: constant density before the burst, so that the mass at node a
is m_a = rho times the integral of N_a 2 pi r dA over the reference quadrilateral. Near the axis that is not a quarter
of the ring's mass.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np

from transition.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import ArrayLike, NDArray

    Array = NDArray[np.float64]


VTK_ORDER = {8: (0, 1, 3, 2, 4, 5, 7, 6), 4: (0, 1, 3, 2)}
"""Nodes of dolfinx's hexahedra and quadrilaterals in VTK's order, by their number."""
_FACTORS = {8: ((), (0,), (1,), (2,), (0, 1), (0, 2), (1, 2), (0, 1, 2)), 4: ((), (0,), (1,), (0, 1))}


@cache
def _element(nodes: int):  # type: ignore[no-untyped-def]  # noqa: ANN202 - basix has no types in all versions
    import basix

    cell = basix.CellType.hexahedron if nodes == 8 else basix.CellType.quadrilateral
    return basix.create_element(basix.ElementFamily.P, cell, 1)


@cache
def corner_coordinates(nodes: int) -> Array:
    """Reference coordinates (nodes, dimensions), -1 or 1, of the nodes of a cell in VTK's order."""
    return 2.0 * np.asarray(_element(nodes).points)[list(VTK_ORDER[nodes])] - 1.0


def interpolated(corners: Array, point: Array) -> Array:
    """Values (k, j) in cells from the values (k, 8 or 4, j) at their nodes in VTK's order.

    `point` (k, 3 or 2): coordinates 0 to 1 in the reference cell.
    """
    nodes = corners.shape[1]
    weights = _element(nodes).tabulate(0, np.ascontiguousarray(point))[0, :, :, 0][:, list(VTK_ORDER[nodes])]
    return np.asarray((weights[:, None] @ corners)[:, 0])


def modes(corners: Array) -> Array:
    """Coefficients (m, 8 or 4, j) of the modes from the values (m, 8 or 4, j) at the nodes in VTK's order."""
    return np.asarray(_modes_at_nodes(corners.shape[1]) @ corners)


@cache
def _modes_at_nodes(nodes: int) -> Array:
    at = corner_coordinates(nodes)
    return np.stack([at[:, list(factors)].prod(axis=1) for factors in _FACTORS[nodes]]) / nodes


@dataclass(frozen=True, eq=False)
class HalfPlane:
    """The half plane of the meridian."""

    origin: Array
    """(3,) float64: centre of the round's base plane (m)."""
    frame: Array
    """(3, 3) float64: rows: the outward direction e1, e2 = axis x e1, and the unit axis, from the base to the nose."""

    @classmethod
    def of(cls, position: ArrayLike, axis: ArrayLike, reference: Array, where: str) -> HalfPlane:
        """Half plane from the axis of a round towards its outermost node before the burst.

        `position` is the centre of its base plane (m), `reference` (n, 3) are the nodes before the burst; `where` names
        file and round in messages. Raises InputError: all nodes lie on the axis.
        """
        along = np.asarray(axis, dtype=np.float64)
        along = along / np.linalg.norm(along)
        origin = np.asarray(position, dtype=np.float64)
        away = reference - origin
        away = away - np.outer(away @ along, along)
        radius = np.linalg.norm(away, axis=1)
        farthest = int(radius.argmax())
        if not radius[farthest] > 0.0:
            raise InputError(f"{where}: all nodes lie on its axis")
        outward = away[farthest] / radius[farthest]
        return cls(origin, np.stack([outward, np.cross(along, outward), along]))

    def coordinates(self, positions: Array) -> Array:
        """Radius and height above the base (..., 2) in m of positions (..., 3)."""
        return self.components(positions - self.origin)

    def components(self, vectors: Array) -> Array:
        """Radial and axial components (..., 2) of vectors (..., 3)."""
        return np.asarray(vectors @ self.frame[::2].T)


def mass_density(corners: Array) -> Array:
    """Radius times Jacobian determinant of quadrilaterals (m, 4, 2) in (r, z): coefficients (m, 3, 3) of xi^i eta^j.

    A ring's mass by area of the reference square is in proportion to it, in m3.
    """
    found = modes(corners)
    r, z = found[..., 0], found[..., 1]
    area = np.stack([r[:, i] * z[:, j] - r[:, j] * z[:, i] for i, j in ((1, 2), (1, 3), (3, 2))], axis=1)
    density = np.zeros((len(corners), 3, 3))
    # r = r0 + r1 xi + r2 eta + r3 xi eta; determinant = a0 + a1 xi + a2 eta
    for k, (i, j) in enumerate(((0, 0), (1, 0), (0, 1), (1, 1))):
        for n, (p, q) in enumerate(((0, 0), (1, 0), (0, 1))):
            density[:, i + p, j + q] += r[:, k] * area[:, n]
    return density


def _node_volumes(corners: Array) -> Array:
    """Integrals (m, 4) of N_a 2 pi r dA (m3): of degree 3 in each coordinate, so that 2 x 2 Gauss points are exact."""
    density = mass_density(corners)
    volumes = np.zeros(corners.shape[:2])
    corner = corner_coordinates(4)
    for xi, eta in corner / np.sqrt(3.0):
        at = 2.0 * np.pi * np.einsum("mij,i,j->m", density, xi ** np.arange(3), eta ** np.arange(3))
        volumes += np.outer(at, 0.25 * (1.0 + corner[:, 0] * xi) * (1.0 + corner[:, 1] * eta))
    return volumes


def ring_volumes(corners: Array) -> Array:
    """Volumes (m,) in m3 of the rings of quadrilaterals (m, 4, 2) in (r, z), counter-clockwise."""
    return np.asarray(_node_volumes(corners).sum(axis=1))


def node_shares(corners: Array) -> Array:
    """Shares (m, 4) of a ring's mass at its nodes, as the burst stage lumps it; `corners` (m, 4, 2) in (r, z).

    The mean by mass over a ring of a function that is bilinear in the reference coordinates is the sum of its nodal
    values by these shares.
    """
    volumes = _node_volumes(corners)
    return np.asarray(volumes / volumes.sum(axis=1, keepdims=True))


_IN_PLANE = 1e-9  # of the largest coordinate, or of the largest speed
_WHOLE_RING = 0.05  # the casing's mass may differ so much from density times ring volume


def check_meridian(
    where: str, half: HalfPlane, nodes: Mapping[str, Array], cells: NDArray[np.int64], mass: Array,
    casing: NDArray[np.bool_], density: float,
) -> None:  # fmt: skip
    """Check what an axisymmetric snapshot, named by `where`, says of its one round.

    `nodes`: arrays (n, 3): reference and position (m), velocity (m/s); `cells` (m, 4): nodes of the quadrilaterals;
    `mass`, `casing` (m,): masses (kg), and which cells are of the casing, of `density` (kg/m3). Raises InputError:
    nodes or velocities that leave the half plane, quadrilaterals that are not convex and counter-clockwise, or masses
    that are not those of whole rings.
    """
    largest = float(np.abs(nodes["reference"]).max())
    for name in ("reference", "position"):
        out = np.abs((nodes[name] - half.origin) @ half.frame[1])
        if out.max() > _IN_PLANE * max(largest, float(np.abs(nodes[name]).max())):
            raise InputError(
                f"{where}: {name} of node {out.argmax()} lies {out.max():.3g} m outside the half plane of the meridian"
            )
    across = np.abs(nodes["velocity"] @ half.frame[1])
    if across.max() > _IN_PLANE * float(np.abs(nodes["velocity"]).max()):
        raise InputError(
            f"{where}: node {across.argmax()} has a velocity of {across.max():.3g} m/s across the half plane of the "
            "meridian; an axisymmetric burst does not turn about its axis"
        )
    flat = half.coordinates(nodes["reference"])
    if flat[:, 0].min() < -_IN_PLANE * largest:
        raise InputError(f"{where}: node {flat[:, 0].argmin()} lies beyond the axis before the burst")
    corners = flat[cells]
    ahead, behind = np.roll(corners, -1, axis=1) - corners, np.roll(corners, 1, axis=1) - corners
    turning = (ahead[..., 0] * behind[..., 1] - ahead[..., 1] * behind[..., 0]).min(axis=1)
    if not (turning > 0.0).all():
        raise InputError(
            f"{where}: cell {turning.argmin()} is not convex and counter-clockwise seen in (r, z) before the burst"
        )
    found, rings = float(mass[casing].sum()), density * float(ring_volumes(corners[casing]).sum())
    if abs(found - rings) > _WHOLE_RING * rings:
        raise InputError(
            f"{where}: casing cells have {found:.6g} kg, their rings {rings:.6g} kg by volume and density; "
            "cells/mass must be that of whole rings"
        )
