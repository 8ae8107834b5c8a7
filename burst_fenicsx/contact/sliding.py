"""Contact of charge and casing in three dimensions: the charge's nodes on the casing's faces, on all ranks."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from burst_fenicsx.contact.charge_contacts import ChargeContacts
from burst_fenicsx.kernels.cells.layout import CHARGE_PARAMETERS
from burst_fenicsx.kernels.constants import SMOOTH
from burst_fenicsx.kernels.contact.facets import Surface
from burst_fenicsx.kernels.contact.sliding import attached_state, slide_charges
from burst_fenicsx.kernels.geometry.faces import area_vectors
from burst_fenicsx.meshing.mesh import across_edges, outer_faces, shared_edges
from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from burst_fenicsx.contact.nodes import ContactNodes
    from burst_fenicsx.mechanics.fields import BurstFields
    from burst_fenicsx.meshing import HexahedralMesh
    from burst_fenicsx.problem import ContactSettings

_RINGS = 4  # faces around those in contact that a rank keeps up to date ...
_MARGIN = 2  # ... until a contact has come this close to others


class SlidingInterface(ChargeContacts):
    """Contact between the charges and what encloses them.

    The rank that owns a charge's node computes its contacts. It follows them over the casing's faces, of which it
    keeps those near by up to date, and gives the reactions to the ranks that own the faces' nodes.

    Parameters
    ----------
    mesh : the whole mesh, its charges split from their casings.
    fields : this rank's fields.
    nodes : contact's rows, those of `interface_faces` and their twins among them.
    settings : strength and friction of unreacted explosive on the casing.
    """

    def __init__(
        self, mesh: HexahedralMesh, fields: BurstFields, nodes: ContactNodes, settings: ContactSettings
    ) -> None:
        faces, cell, covered = interface_faces(mesh)
        surface, group_node = smooth_surface(mesh.nodes, faces, *_mirrors(mesh))
        # The charge's node at each of the casing's: its twin, or itself at the rim of a fuze, where it is of both.
        in_charge = np.zeros(len(mesh.nodes), dtype=bool)
        in_charge[mesh.cells[mesh.part == Part.CHARGE]] = True
        twin = np.where(in_charge, np.arange(len(mesh.nodes)), -1)
        twin[mesh.interface_pairs[:, 1]] = mesh.interface_pairs[:, 0]
        slave = twin[group_node]
        split = np.zeros(len(mesh.nodes), dtype=bool)
        split[mesh.interface_pairs[:, 1]] = True
        local = fields.mesh.local_node(np.maximum(slave, 0))
        mine = split[group_node] & (local >= 0) & (local < fields.mesh.owned_nodes)
        group = np.flatnonzero(mine).astype(np.int32)
        beside = np.full_like(faces, -1)
        beside[:covered] = nodes.rows_of(twin[faces[:covered]])
        of_round = np.zeros(len(mesh.nodes), dtype=np.int32)
        of_round[mesh.cells] = mesh.round[:, None]
        material = len(Part) * of_round[slave[group]] + Part.CHARGE
        cells = np.bincount(mesh.cells[mesh.part == Part.CHARGE].ravel(), minlength=len(mesh.nodes))
        super().__init__(
            fields,
            nodes,
            settings,
            surface._replace(facets=nodes.rows_of(faces)),
            cell,
            beside.astype(np.int32),
            group,
            nodes.rows_of(slave[group]),
            cells[slave[group]].astype(float),
            fields.charge.parameters[material, CHARGE_PARAMETERS.index("unreacted_strength")],
        )
        self._border = np.zeros(len(faces), dtype=bool)
        self.look_around()

    def look_around(self) -> None:
        """Choose the faces that this rank keeps up to date, and the rows that it needs for that."""
        surface, near = self.surface, np.ones(len(self.surface.facets), dtype=bool)
        if self._fields.mesh.comm.size > 1:
            near[:] = False
            near[self.pairs.facet] = True
            inner = near
            for ring in range(_RINGS):
                near = self._widened(near)
                if ring == _RINGS - _MARGIN - 1:
                    inner = near
            surface.known[:] = near
            self._border = near & ~inner
            self.groups = np.unique(surface.corner[near]).astype(np.int32)
        own, near = _members(surface, self.bonds.group), _members(surface, self.groups)
        self.around = np.unique(np.concatenate([own, near])).astype(np.int32)
        beside = self.bonds.beside[own]
        rows = [self.pairs.node, beside[beside >= 0], surface.facets[near].ravel(), self.attached.row]
        self.watched = np.unique(np.concatenate(rows))

    def _widened(self, chosen: np.ndarray) -> np.ndarray:
        """The chosen faces (faces,) bool and all that share a node with them."""
        facets = self.surface.facets
        touched = np.zeros(len(self._nodes.rows.mass), dtype=bool)
        touched[facets[chosen]] = True
        widened: np.ndarray = touched[facets].any(axis=1)
        return widened

    @property
    def comes_to_border(self) -> bool:
        """Whether a contact has come close to faces that are not kept up to date: ranks then look around."""
        return bool(self._border[self.pairs.facet].any())

    def sum_attached(self) -> np.ndarray:
        """Sums (rows, 3) over the charge's cells of this rank around the nodes, to be added up over ranks."""
        fields, attached = self._fields, self.attached
        attached.total[self.pairs.node] = 0.0
        attached_state(attached._replace(slot=fields.blocks.slot_of_cell), fields.charge, fields.solid.eroded)
        return attached.total

    def add_forces(self, max_squared_frequency: float, step: float) -> None:
        """Add the forces of springs with at most that squared frequency (1/s2) after a step (s) to the rows."""
        law = self.law(max_squared_frequency, step)
        slide_charges(
            law, self.around, self.groups, self.surface, self.pairs, self.bonds, self.attached.total, self._nodes.rows
        )
        self.add()


def interface_faces(mesh: HexahedralMesh) -> tuple[np.ndarray, np.ndarray, int]:
    """Faces of the casing on which a charge may slide, outward from the casing, as nodes (faces, 4), and their cells.

    First those at which a charge lies, whose number is returned as well; then the free ones to which these lead on
    without a crease, such as the wall of a cavity that the charge does not fill, or that behind a fuze.
    """
    faces, cell, behind = outer_faces(mesh, np.where(mesh.part == Part.CASING, 0, -1))
    covered = (behind >= 0) & (mesh.part[behind] == Part.CHARGE)
    one, other = _smooth_edges(mesh.nodes, faces)
    joined = coo_matrix((np.ones(len(one)), (one // 4, other // 4)), shape=(len(faces), len(faces)))
    _, surface = connected_components(joined, directed=False)
    free = ~covered & np.isin(surface, surface[covered])
    order = np.concatenate([np.flatnonzero(covered), np.flatnonzero(free)])
    return faces[order], cell[order], int(covered.sum())


def _smooth_edges(nodes: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of edges, as of `shared_edges`, at which the surface is smooth."""
    one, other = shared_edges(faces)
    normal = area_vectors(nodes[faces])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    smooth = np.einsum("ij,ij->i", normal[one // 4], normal[other // 4]) > SMOOTH
    return one[smooth], other[smooth]


def smooth_surface(
    nodes: np.ndarray, faces: np.ndarray, held: np.ndarray | None = None, normals: np.ndarray | None = None
) -> tuple[Surface, np.ndarray]:
    """The faces with their smooth groups around each node, and each group's node.

    Corners at a node are of one group where smooth edges lead from one of their faces to the other. Groups are numbered
    by their nodes, then by their first faces. `held` (nodes, planes) bool says which nodes lie in planes of symmetry
    with the `normals` (planes, 3).
    """
    one, other = _smooth_edges(nodes, faces)
    # The faces of an edge run along it in opposite directions.
    ends = np.concatenate([one, _next_corner(one)]), np.concatenate([_next_corner(other), other])
    joined = coo_matrix((np.ones(len(ends[0])), ends), shape=(faces.size, faces.size))
    groups, label = connected_components(joined, directed=False)
    _, first_corner = np.unique(label, return_index=True)
    number = np.empty(groups, dtype=np.int32)
    number[np.lexsort((first_corner, faces.ravel()[first_corner]))] = np.arange(groups, dtype=np.int32)
    corner_group = number[label].reshape(faces.shape)
    order = np.argsort(corner_group.ravel(), kind="stable")
    first = np.concatenate([[0], np.cumsum(np.bincount(number[label], minlength=groups))]).astype(np.int32)
    group_node = faces.ravel()[order[first[:-1]]]
    mirrors = np.zeros((groups, 0, 3)) if held is None or normals is None else held[group_node][..., None] * normals
    surface = Surface(
        facets=faces.astype(np.int32),
        neighbour=across_edges(corner_group),  # where the surface is smooth: both ends are of one group
        hollow=np.full(faces.shape, -1, dtype=np.int32),
        corner=corner_group,
        first=first,
        member=(order // 4).astype(np.int32),
        mirrors=mirrors,
        known=np.ones(len(faces), dtype=bool),
        area=np.zeros((len(faces), 3)),
        vector=np.zeros((groups, 3)),
    )
    return surface, group_node


def _mirrors(mesh: HexahedralMesh) -> tuple[np.ndarray, np.ndarray]:
    """Which nodes lie in planes of symmetry (nodes, planes), and these planes' normals (planes, 3)."""
    if mesh.held is None or not mesh.held_normals:
        return np.zeros((len(mesh.nodes), 0), dtype=bool), np.zeros((0, 3))
    bits = np.array([bit for bit, _ in mesh.held_normals])
    return (mesh.held[:, None] >> bits & 1).astype(bool), np.array([normal for _, normal in mesh.held_normals])


def _next_corner(corner: np.ndarray) -> np.ndarray:
    """The next corner of the same face; corners are numbered face by face."""
    following: np.ndarray = corner - corner % 4 + (corner + 1) % 4
    return following


def _members(surface: Surface, groups: np.ndarray) -> np.ndarray:
    """Faces of the groups, each once for each of them."""
    chosen = np.zeros(len(surface.first) - 1, dtype=bool)
    chosen[groups] = True
    return surface.member[np.repeat(chosen, np.diff(surface.first))]
