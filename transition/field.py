"""A burst that a program of one's own computed in dolfinx: velocity field, mesh and tags as the break-up takes them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield_base.burst_snapshot import CASING, CHARGE, FUZE, SegmentRecord
from transition.cells import VTK_ORDER, modes, ring_volumes
from transition.errors import InputError
from transition.law.segments import measured
from transition.snapshot import RoundData, Snapshot

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Vector = tuple[float, float, float]


@dataclass(frozen=True)
class CasingInMesh:
    """A casing in a mesh of dolfinx. SI units.

    Attributes
    ----------
    density : float
        Of the casing before the burst (kg/m3).
    length : float
        From the base to the nose end, along the axis (m).
    tags : tuple of int
        Cell tags of the casing; none: all cells that no other tag names.
    charge_tags : tuple of int
        Cell tags of the charge, whose mass two of the laws of the mean mass take; none: no charge in the mesh.
    explosive, explosive_density, detonation_velocity
        Of the charge (kg/m3, m/s), as far as the law of the mean mass asks for them.
    position, axis : tuple of float
        Centre of the base plane (m), and direction from the base to the nose. In a mesh of a meridian, whose
        coordinates are radius and height, the position is the height's origin.
    name : str
        Of the round.
    casing_yield : float, optional
        Yield strength (Pa), for the range that published mean masses cover.
    """

    density: float
    length: float
    tags: tuple[int, ...] = ()
    charge_tags: tuple[int, ...] = ()
    explosive: str = ""
    explosive_density: float = 0.0
    detonation_velocity: float = 0.0
    position: Vector = (0.0, 0.0, 0.0)
    axis: Vector = (0.0, 0.0, 1.0)
    name: str = "casing"
    casing_yield: float | None = None


def snapshot_of(
    velocity: Any,  # noqa: ANN401 - a dolfinx function, whose types are not there without dolfinx
    casings: CasingInMesh | Sequence[CasingInMesh],
    *,
    displacement: Any = None,  # noqa: ANN401
    mesh_moved: bool = False,
    cell_tags: Any = None,  # noqa: ANN401
    time: float = 0.0,
) -> Snapshot:
    """State of a burst of one's own from its live velocity field; collective, the same on every rank.

    The field is interpolated to continuous functions of degree 1 on hexahedra, or on the quadrilaterals of a meridian:
    in two dimensions radius and height, in three a half plane through the axis of the one round. Cells stand in the
    order in which the mesh was given, whatever the number of ranks.

    Parameters
    ----------
    velocity : dolfinx.fem.Function
        Velocity (m/s), a vector of the mesh's dimensions.
    casings : CasingInMesh or sequence of them
        What in the mesh is a casing.
    displacement : dolfinx.fem.Function, optional
        Of the metal since before the burst (m); left out: none.
    mesh_moved : bool
        The mesh's nodes lie where the metal is now, not where it was before the burst.
    cell_tags : dolfinx.mesh.MeshTags, optional
        Of all cells of the mesh; left out: all are of the one casing.
    time : float
        Simulated time (s).

    Raises
    ------
    InputError
        Another kind of cell, of element or of mesh; tags that no cell has; a casing without cells.
    """
    mesh = velocity.function_space.mesh
    several = [casings] if isinstance(casings, CasingInMesh) else list(casings)
    nodes, dimension = _checked(mesh, several, cell_tags)
    ids, given, corners = _cells(mesh, nodes)
    here = mesh.geometry.x[corners][..., :dimension]
    moved = 0.0 if displacement is None else _at_corners(displacement, mesh, nodes)
    fields = {"velocity": _at_corners(velocity, mesh, nodes), "reference": here - moved if mesh_moved else here,
              "position": here if mesh_moved else here + moved}  # fmt: skip
    tags = np.full(len(ids), -1)
    if cell_tags is not None:
        owned = np.asarray(cell_tags.indices) < len(ids)
        tags[np.asarray(cell_tags.indices)[owned]] = np.asarray(cell_tags.values)[owned]
    node, tags, *values = _gathered(mesh.comm, ids, given, tags, *fields.values())
    _, first, cells = np.unique(node.ravel(), return_index=True, return_inverse=True)
    cells = cells.reshape(node.shape)
    at_nodes = {name: value.reshape(-1, dimension)[first] for name, value in zip(fields, values, strict=True)}
    part, owner = _parts(tags, several)
    if dimension == 2:
        at_nodes = {name: _in_half_plane(name, value, several[0]) for name, value in at_nodes.items()}
    return _snapshot(at_nodes, _oriented(at_nodes["reference"], cells, several[0]), part, owner, several, time)


def _checked(mesh: Any, casings: Sequence[CasingInMesh], cell_tags: Any) -> tuple[int, int]:  # noqa: ANN401
    name, dimension = str(mesh.topology.cell_type.name), int(mesh.geometry.dim)
    nodes = {("hexahedron", 3): 8, ("quadrilateral", 2): 4, ("quadrilateral", 3): 4}.get((name, dimension), 0)
    if not nodes:
        raise InputError(
            f"mesh: found cells of the kind {name} in {dimension} dimensions; allowed: hexahedra, or quadrilaterals of "
            "a meridian"
        )
    cells = mesh.topology.index_map(mesh.topology.dim)
    width = np.asarray(getattr(_nodes(mesh), "array", _nodes(mesh))).size
    width //= max(cells.size_local + cells.num_ghosts, 1)
    if width not in (0, nodes):
        raise InputError(f"mesh: found cells of {width} nodes; allowed: {nodes}, with straight edges")
    if nodes == 4 and len(casings) != 1:
        raise InputError(f"casings: found {len(casings)}; a meridian has one")
    if cell_tags is None and (len(casings) != 1 or casings[0].tags or casings[0].charge_tags):
        raise InputError("cell_tags: found none; needed where casings name tags, or are several")
    return nodes, dimension


def _nodes(mesh: Any) -> Any:  # noqa: ANN401
    geometry = mesh.geometry
    return geometry.dofmaps[0] if hasattr(geometry, "dofmaps") else geometry.dofmap  # from 0.11 on a list


def _two_dimensional(dofmap: Any, cells: int, width: int) -> NDArray[np.int64]:  # noqa: ANN401
    """Rows of the cells that this rank owns; dolfinx before 0.7 has a list of lists."""
    return np.asarray(getattr(dofmap, "array", dofmap)).reshape(-1, width)[:cells].astype(np.int64)


def _cells(mesh: Any, nodes: int) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.int64]]:  # noqa: ANN401
    """Numbers of the owned cells and of their nodes (n, nodes) as the mesh was given, and their nodes here."""
    owned = mesh.topology.index_map(mesh.topology.dim).size_local
    corners = _two_dimensional(_nodes(mesh), owned, nodes)[:, list(VTK_ORDER[nodes])]
    ids = np.asarray(mesh.topology.original_cell_index, dtype=np.int64)[:owned]
    return ids, np.asarray(mesh.geometry.input_global_indices, dtype=np.int64)[corners], corners


def _at_corners(function: Any, mesh: Any, nodes: int) -> Array:  # noqa: ANN401
    """Values (cells, nodes, dimensions) of a vector-valued function at the nodes of the owned cells."""
    from dolfinx import fem

    dimension = mesh.geometry.dim
    if hasattr(fem, "functionspace"):
        space = fem.functionspace(mesh, ("Lagrange", 1, (dimension,)))
    else:  # dolfinx 0.5
        space = fem.VectorFunctionSpace(mesh, ("Lagrange", 1))
    straight = fem.Function(space)
    try:
        straight.interpolate(function)
    except RuntimeError as error:
        raise InputError(f"field: it is no vector of {dimension} components on the mesh ({error})") from None
    owned = mesh.topology.index_map(mesh.topology.dim).size_local
    dofs = _two_dimensional(space.dofmap.list, owned, nodes)[:, list(VTK_ORDER[nodes])]
    return np.asarray(straight.x.array.reshape(-1, dimension)[dofs], dtype=np.float64)


def _gathered(comm: Any, ids: NDArray[np.int64], *arrays: NDArray[Any]) -> list[NDArray[Any]]:  # noqa: ANN401
    numbers, *parts = (np.concatenate(one) for one in zip(*comm.allgather((ids, *arrays)), strict=True))
    order = np.argsort(numbers, kind="stable")
    return [one[order] for one in parts]


def _parts(tags: NDArray[np.int64], casings: Sequence[CasingInMesh]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Material and round of every cell; what no casing names is left without a part of its own (fuze)."""
    part, owner = np.full(len(tags), FUZE), np.zeros(len(tags), dtype=np.int64)
    named = {tag for one in casings for tag in (*one.tags, *one.charge_tags)}
    for number, one in enumerate(casings):
        own = np.isin(tags, one.tags) if one.tags else ~np.isin(tags, list(named))
        for cells, kind, wanted in ((own, CASING, one.tags), (np.isin(tags, one.charge_tags), CHARGE, one.charge_tags)):
            missing = sorted(set(wanted) - set(tags[cells].tolist()))
            if missing:
                found = ", ".join(map(str, sorted(set(tags.tolist()))))
                raise InputError(f"casing {one.name!r}: no cell has the tag {missing[0]}; found: {found}")
            part[cells], owner[cells] = kind, number
        if not own.any():
            raise InputError(f"casing {one.name!r}: no cell of the mesh is of it")
    return part, owner


def _in_half_plane(name: str, flat: Array, casing: CasingInMesh) -> Array:
    """Vectors (n, 3) of radius and height in a half plane through a round's axis."""
    along = np.asarray(casing.axis) / np.linalg.norm(casing.axis)
    outward = np.cross(np.eye(3)[np.abs(along).argmin()], along)
    outward /= np.linalg.norm(outward)
    origin = np.zeros(3) if name == "velocity" else np.asarray(casing.position)
    return origin + flat[:, :1] * outward + flat[:, 1:] * along


def _flat(corners: Array, casing: CasingInMesh) -> Array:
    """Radius and height (m, 4, 2) of nodes in a half plane through the axis of a round."""
    along = np.asarray(casing.axis) / np.linalg.norm(casing.axis)
    away = corners - np.asarray(casing.position)
    height = away @ along
    return np.stack([np.linalg.norm(away - height[..., None] * along, axis=-1), height], axis=-1)


def _volumes(corners: Array, casing: CasingInMesh) -> Array:
    """Volumes (m,) of hexahedra, or of the rings of quadrilaterals (m3), from nodes (m, 8 or 4, 3); signed."""
    if corners.shape[1] == 4:
        return ring_volumes(_flat(corners, casing))
    made = modes(corners)
    volume = np.zeros(len(corners))
    for x, y, z in np.stack(np.meshgrid(*[[-1.0, 1.0]] * 3), axis=-1).reshape(-1, 3) / np.sqrt(3.0):  # Gauss points
        slopes = np.array([[0, 1, 0, 0, y, z, 0, y * z], [0, 0, 1, 0, x, 0, z, x * z], [0, 0, 0, 1, 0, x, y, x * y]])
        volume += np.linalg.det(np.einsum("ia,mak->mik", slopes, made))
    return volume


def _oriented(reference: Array, cells: NDArray[np.int64], casing: CasingInMesh) -> NDArray[np.int64]:
    """Cells whose nodes run counter-clockwise, as VTK has them: a mesh of dolfinx may have mirrored ones."""
    mirrored = _volumes(reference[cells], casing) < 0.0
    turned = cells[:, [0, 3, 2, 1] if cells.shape[1] == 4 else [4, 5, 6, 7, 0, 1, 2, 3]]
    return np.where(mirrored[:, None], turned, cells)


def _snapshot(
    nodes: Mapping[str, Array], cells: NDArray[np.int64], part: NDArray[np.int64], owner: NDArray[np.int64],
    casings: Sequence[CasingInMesh], time: float,
) -> Snapshot:  # fmt: skip
    """The snapshot, with one segment a round, measured on its cells."""
    none = float("nan")  # until the segment is measured
    rounds = [
        RoundData(
            one.name, one.length, one.density, one.explosive, one.explosive_density, one.detonation_velocity,
            one.position, one.axis,
            (SegmentRecord(one.name, "wall", 0.0, one.length, none, none, 0.0, none, none, none),), one.casing_yield,
        )
        for one in casings
    ]  # fmt: skip
    density = np.array([[one.density, one.explosive_density, 0.0] for one in casings])[owner, part]
    along = np.array([one.along for one in rounds])[owner]
    base = np.array([one.position for one in casings])[owner]
    heights = np.einsum("cj,cj->c", nodes["reference"][cells].mean(axis=1) - base, along)
    station = np.array([one.length for one in casings])[owner] - heights
    volume = _volumes(nodes["reference"][cells], casings[0])
    made = Snapshot(
        f"{len(cells)} cells of dolfinx", time, {"program": "a velocity field of dolfinx"}, nodes["reference"],
        nodes["position"], nodes["velocity"], cells, part, owner, np.where(part == CASING, 0, -1), station,
        density * volume, tuple(rounds), (),
        "axisymmetric" if cells.shape[1] == 4 else "3d",
    )  # fmt: skip
    of_casing = owner[made.casing]
    whole = [
        replace(data, segments=(measured(made, index, data, np.flatnonzero(of_casing == index), 0.0, data.length),))
        for index, data in enumerate(rounds)
    ]
    return replace(made, rounds=tuple(whole))
