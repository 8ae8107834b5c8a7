"""The only module that knows dolfinx's versions (0.5.2 of Debian 12, 0.9 of Debian 13, up to 0.11) and its wheel.

The wheel needs an order of imports: its libraries find MPI's only once mpi4py has loaded it, and where numba is loaded
`dolfinx.fem.petsc` puts its HDF5 in the way of an h5py that comes later. Debian 12's leaves RTLD_GLOBAL set: GEOS of a
rasterio that comes later would take the place of shapely's.
"""

from __future__ import annotations

import logging
import os
import sys
from typing import TYPE_CHECKING, Any

import h5py  # noqa: F401
import numpy as np
from mpi4py import MPI

# isort: split
import dolfinx
import ufl
from dolfinx import fem, la, mesh

sys.setdlopenflags(os.RTLD_NOW)

if TYPE_CHECKING:
    from collections.abc import Callable


_VERSION = tuple(int(part) for part in dolfinx.__version__.split(".")[:2])
_MODERN = _VERSION >= (0, 7)
_COMPILE_SECONDS = 300
_MAP_TAG = 17_405

if _VERSION < (0, 5):
    raise ImportError(f"dolfinx {dolfinx.__version__} is too old; 0.5.2, 0.9, 0.10 and 0.11 are supported")


def _domain(cell_name: str) -> Any:
    if _MODERN:
        import basix.ufl

        return ufl.Mesh(basix.ufl.element("Lagrange", cell_name, 1, shape=(3,)))
    cell = ufl.Cell(cell_name, geometric_dimension=3)
    return ufl.Mesh(ufl.VectorElement("Lagrange", cell, 1))


def _create(comm: MPI.Comm, cells: np.ndarray, nodes: np.ndarray, cell_name: str, partitioner: Any) -> Any:
    if _MODERN:
        return mesh.create_mesh(comm, cells=cells, x=nodes, e=_domain(cell_name), partitioner=partitioner)
    from dolfinx.cpp.graph import AdjacencyList_int64

    corners = cells.shape[1]
    offsets = np.arange(0, corners * len(cells) + 1, corners, dtype=np.int32)
    adjacency = AdjacencyList_int64(cells.reshape(-1), offsets)
    return mesh.create_mesh(comm, adjacency, nodes, _domain(cell_name), mesh.GhostMode.shared_facet, partitioner)


def create_quadrilateral_mesh(comm: MPI.Comm, cells: np.ndarray, nodes: np.ndarray) -> Any:
    """Make a mesh of bilinear quadrilaterals in space, all of it on this communicator's only rank.

    Parameters
    ----------
    comm : communicator of one rank.
    cells : (m, 4) int64, nodes in tensor-product order.
    nodes : (n, 3) float64 places (m).
    """
    cells = np.ascontiguousarray(cells, dtype=np.int64)
    nodes = np.ascontiguousarray(nodes, dtype=np.float64)
    return _create(comm, cells, nodes, "quadrilateral", _partitioner(cells, np.zeros(len(cells), dtype=np.int32)))


def create_hexahedral_mesh(
    comm: MPI.Comm, cells: np.ndarray, nodes: np.ndarray, destination: np.ndarray, pairs: np.ndarray | None = None
) -> Any:
    """Distribute a mesh of trilinear hexahedra.

    A rank that owns a cell at a place also gets every other cell there as a ghost, on both sides of a split.

    Parameters
    ----------
    comm : communicator.
    cells : (m, 8) int64, nodes in tensor-product order (x fastest), all on rank 0, none elsewhere.
    nodes : (n, 3) float64 places (m), all on rank 0, none elsewhere.
    destination : (m,) int32, rank of every cell, on rank 0.
    pairs : (pairs, 2) int64, coincident nodes, on rank 0; none by default.

    Returns
    -------
    The dolfinx mesh; its number of nodes is the number given (checked).

    Raises
    ------
    RuntimeError
        If dolfinx tore the mesh between ranks.
    """
    cells = np.ascontiguousarray(cells.reshape(-1, 8), dtype=np.int64)
    nodes = np.ascontiguousarray(nodes.reshape(-1, 3), dtype=np.float64)
    places = _merged(cells, pairs)
    partitioner = _partitioner(places, np.asarray(destination, dtype=np.int32))
    created = _create(comm, cells, nodes, "hexahedron", partitioner)
    expected = comm.bcast(_count_used(cells) if comm.rank == 0 else None, root=0)
    found = created.geometry.index_map().size_global
    if found != expected:
        raise RuntimeError(f"dolfinx tore the mesh between ranks: {found} nodes from {expected}")
    return created


def _count_used(cells: np.ndarray) -> int:
    used = np.zeros(int(cells.max(initial=-1)) + 1, dtype=bool)
    used[cells] = True
    return int(used.sum())


def _merged(cells: np.ndarray, pairs: np.ndarray | None) -> np.ndarray:
    """Cells by places: the nodes of each set of coincident ones replaced by the lowest of the set."""
    if pairs is None or len(pairs) == 0 or len(cells) == 0:
        return cells
    place = np.arange(max(int(cells.max()), int(pairs.max())) + 1)
    while True:
        lowest = np.minimum(place[pairs[:, 0]], place[pairs[:, 1]])
        if (place[pairs] == lowest[:, None]).all():
            return place[cells]
        for side in range(2):
            np.minimum.at(place, pairs[:, side], lowest)


def _partitioner(cells: np.ndarray, destination: np.ndarray) -> Callable[..., Any]:
    """Partitioner that sends every cell to its rank and, as a ghost, to every other rank that has a cell at its places.

    `cells` name places, coincident nodes being one. The ghosts let dolfinx 0.5 find the nodes that ranks share; without
    them it tears the mesh apart silently.
    """
    from dolfinx import cpp

    def partition(*_: Any) -> Any:
        data, offsets = _destinations(cells, destination)
        return cpp.graph.AdjacencyList_int32(data, offsets)

    return partition


def _destinations(cells: np.ndarray, owner: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Owner first, then the other ranks that share a place, for every cell: data and offsets."""
    if len(owner) == 0 or owner.min() == owner.max():
        return owner.astype(np.int32), np.arange(len(owner) + 1, dtype=np.int32)
    ranks, corners = int(owner.max()) + 1, cells.shape[1]
    # Ranks at every place, by place: what this takes goes with the cells, not with cells times ranks.
    pairs = np.unique(cells.ravel() * ranks + np.repeat(owner.astype(np.int64), corners))
    place, rank = pairs // ranks, pairs % ranks
    count = np.bincount(place, minlength=int(cells.max()) + 1)
    first = np.cumsum(count) - count
    cell, corner = np.nonzero(count[cells] > 1)
    shared = cells[cell, corner]
    each = count[shared]
    within = np.arange(each.sum()) - np.repeat(np.cumsum(each) - each, each)
    cell, rank = np.repeat(cell, each), rank[np.repeat(first[shared], each) + within]
    foreign = rank != owner[cell]
    ghosts = np.unique(cell[foreign] * ranks + rank[foreign])
    ghost_cell, ghost_rank = ghosts // ranks, ghosts % ranks
    counts = 1 + np.bincount(ghost_cell, minlength=len(cells))
    offsets = np.concatenate([[0], np.cumsum(counts)]).astype(np.int32)
    data = np.empty(offsets[-1], dtype=np.int32)
    data[offsets[:-1]] = owner
    before = np.cumsum(counts - 1) - (counts - 1)
    data[offsets[ghost_cell] + 1 + np.arange(len(ghosts)) - before[ghost_cell]] = ghost_rank
    return data, offsets


def _quietly(compiling: Callable[..., Any], *arguments: Any, **options: Any) -> Any:
    """What `compiling` returns, without the compiler's chatter."""
    logging.disable(logging.INFO)
    try:
        return compiling(*arguments, **options)
    finally:
        logging.disable(logging.NOTSET)


def _old_space(domain: Any, element: Any) -> Any:
    return _quietly(fem.FunctionSpace, domain, element, jit_params={"timeout": _COMPILE_SECONDS})


def form(expression: Any) -> Any:
    """Compile a form."""
    return _quietly(fem.form, expression, **{"jit_options" if _MODERN else "jit_params": {"timeout": _COMPILE_SECONDS}})


def vector_space(domain: Any) -> Any:
    """Vector-valued continuous trilinear functions."""
    if _MODERN:
        return fem.functionspace(domain, ("Lagrange", 1, (3,)))
    return _old_space(domain, ufl.VectorElement("Lagrange", domain.ufl_cell(), 1))


def cell_space(domain: Any, size: int = 1) -> Any:
    """Functions constant in each cell, with `size` components."""
    if _MODERN:
        return fem.functionspace(domain, ("DG", 0) if size == 1 else ("DG", 0, (size,)))
    cell = domain.ufl_cell()
    element = ufl.FiniteElement("DG", cell, 0) if size == 1 else ufl.VectorElement("DG", cell, 0, dim=size)
    return _old_space(domain, element)


def quadrature_space(domain: Any, size: int = 1) -> Any:
    """Functions known at the 2x2x2 Gauss points, with `size` components."""
    if _MODERN:
        import basix.ufl

        shape = () if size == 1 else (size,)
        return fem.functionspace(domain, basix.ufl.quadrature_element("hexahedron", value_shape=shape, degree=2))
    cell = domain.ufl_cell()
    if size == 1:
        element = ufl.FiniteElement("Quadrature", cell, degree=2, quad_scheme="default")
    else:
        element = ufl.VectorElement("Quadrature", cell, degree=2, dim=size, quad_scheme="default")
    return _old_space(domain, element)


def _two_dimensional(dofmap: Any, cells: int) -> np.ndarray:
    array = dofmap.array if hasattr(dofmap, "array") else dofmap
    return np.ascontiguousarray(np.asarray(array).reshape(cells, -1)[:, :], dtype=np.int32)


def _local_cells(domain: Any) -> int:
    cell_map = domain.topology.index_map(domain.topology.dim)
    return int(cell_map.size_local + cell_map.num_ghosts)


def cells_dofmap(space: Any) -> np.ndarray:
    """Block indices of the degrees of freedom, (cells with ghosts, per cell) int32."""
    return _two_dimensional(space.dofmap.list, _local_cells(space.mesh))


def geometry_dofmap(domain: Any) -> np.ndarray:
    """Nodes of the geometry, (cells with ghosts, corners) int32, in tensor-product order."""
    geometry = domain.geometry
    dofmap = geometry.dofmaps[0] if hasattr(geometry, "dofmaps") else geometry.dofmap
    if callable(dofmap):
        dofmap = dofmap()
    return _two_dimensional(dofmap, _local_cells(domain))


def shared_nodes(domain: Any) -> np.ndarray:
    """Whether each node of the geometry that this rank owns is a ghost of another (owned nodes,) bool; collective."""
    index_map = domain.geometry.index_map()
    vector = la.vector(index_map, 1)
    vector.array[index_map.size_local :] = 1.0
    add_ghosts(vector)
    found: np.ndarray = vector.array[: index_map.size_local] > 0.0
    return found


def renumber_nodes(domain: Any, number: np.ndarray) -> Any:
    """Give the nodes of a mesh other local numbers; its cells, and all index maps, stay as they are.

    Parameters
    ----------
    domain : the mesh; not to be used any more.
    number : (local nodes,) of each node; those of ghosts, and of nodes that are ghosts elsewhere, are as they were.
    """
    geometry = domain.geometry
    dofmap = number[geometry_dofmap(domain)].astype(np.int32)
    place = np.empty_like(geometry.x)
    place[number] = geometry.x
    if not _MODERN:  # its arrays can be written, but no other geometry can be made
        geometry.dofmap.array[:] = dofmap.ravel()
        geometry.x[:] = place
        return domain
    from dolfinx import cpp

    old = geometry._cpp_object
    given = np.empty(len(number), dtype=np.int64)
    given[number] = geometry.input_global_indices
    element = old.cmap if hasattr(old, "cmap") else old.cmaps[0]
    new = cpp.mesh.Geometry_float64(geometry.index_map(), dofmap, element, place, given)
    created = cpp.mesh.Mesh_float64(domain.comm, domain.topology._cpp_object, new)
    return mesh.Mesh(created, domain.ufl_domain())


def renumbered_map(comm: MPI.Comm, items: Any, number: np.ndarray, block: int = 1) -> Any:
    """Index map of a rank's items by other local numbers; collective.

    Parameters
    ----------
    comm, items : communicator and map of the items as dolfinx numbers them.
    number : (local items,) of each; ghosts keep theirs.
    block : how many entries each item has, one behind the other.
    """
    from dolfinx import cpp

    owned = int(items.size_local)
    if comm.size == 1:
        return cpp.common.IndexMap(comm, block * owned)
    vector = la.vector(items, 1)
    vector.array[:owned] = items.local_range[0] + number[:owned]
    vector.scatter_forward()
    first = block * vector.array[owned:].astype(np.int64)
    ghosts = (first[:, None] + np.arange(block)).ravel()
    return index_map(comm, block * owned, ghosts, np.repeat(np.asarray(items.owners), block))


def renumbered_space(space: Any, index_map: Any, dofmap: np.ndarray) -> Any:
    """The space with other numbers of its degrees of freedom.

    Parameters
    ----------
    space : as dolfinx makes it. index_map : of the degrees of freedom (blocks).
    dofmap : (cells with ghosts, per cell) int32, of the blocks.
    """
    from dolfinx import cpp

    old = space._cpp_object
    offsets = np.arange(0, dofmap.size + 1, dofmap.shape[1], dtype=np.int32)
    dofs = cpp.graph.AdjacencyList_int32(np.ascontiguousarray(dofmap, dtype=np.int32).reshape(-1), offsets)
    layout, block = old.dofmap.dof_layout, old.dofmap.index_map_bs
    own = cpp.fem.DofMap(layout, index_map, block, dofs, old.dofmap.bs)
    shape = ([int(size) for size in old.value_shape],) if _MODERN and _VERSION < (0, 10) else ()
    return fem.FunctionSpace(space.mesh, space.ufl_element(), type(old)(old.mesh, old.element, own, *shape))


def index_map(comm: MPI.Comm, owned: int, ghosts: np.ndarray, owners: np.ndarray) -> Any:
    """Index map of `owned` items and of ghosts with these global numbers (k,) and owners (k,); collective."""
    from dolfinx import cpp

    ghosts, owners = np.asarray(ghosts, dtype=np.int64), np.asarray(owners, dtype=np.int32)
    try:
        return cpp.common.IndexMap(comm, owned, ghosts, owners)
    except TypeError:  # from 0.10 on with a tag of the messages
        return cpp.common.IndexMap(comm, owned, ghosts, owners, _MAP_TAG)


def add_ghosts(vector: Any) -> None:
    """Add what the ghosts of a vector hold to their owners (reverse scatter)."""
    vector.scatter_reverse(la.InsertMode.add if _MODERN else la.ScatterMode.add)
