"""What may touch in a section: edges of casings drawn out along the axis to faces, and where radii are measured.

An edge becomes a rectangle as deep as a cell, so that the point-face contact of three dimensions finds and pushes what
meets it. The nodes of the section look for faces in the middle of them; corners are copies of the edges' ends, each
with half of the end's mass, before and behind the section.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.axisymmetric.surfaces import outer_edges
from burst_fenicsx.contact.surfaces import ContactSurfaces, outward_sides
from burst_fenicsx.problem import Part
from burst_fenicsx.records.surfaces import RadialSurfaces

if TYPE_CHECKING:
    from burst_fenicsx.plane_section.mesh import SectionMesh
    from burst_fenicsx.plane_section.section import PlaneSection

__all__ = ["SectionSurfaces", "nodes_at_planes", "section_radii", "section_surfaces"]


@dataclass(frozen=True)
class SectionSurfaces(ContactSurfaces):
    """As `ContactSurfaces`; the first rows are nodes of the section, the others copies of them on faces.

    Copies have numbers beyond those of the mesh's nodes.

    Attributes
    ----------
    copy_of : (copies,) row of the node of which each of the last rows is a copy: first all before, then all behind.
    height : (rows,) m, the coordinate y of every row: 0, and plus or minus half of a face's depth.
    """

    copy_of: np.ndarray = None  # type: ignore[assignment]
    height: np.ndarray = None  # type: ignore[assignment]

    def flatten(self, vectors: np.ndarray) -> None:
        """Give the nodes on the outside the sum of their copies' vectors (rows, 3), those within casings none."""
        nodes, half = len(self.node) - len(self.copy_of), len(self.copy_of) // 2
        vectors[:nodes] = 0.0
        vectors[self.copy_of[:half]] = vectors[nodes : nodes + half] + vectors[nodes + half :]
        vectors[:nodes][~self.outside[:nodes]] = 0.0
        vectors[:, 1] = 0.0


def section_surfaces(mesh: SectionMesh, depth: float) -> SectionSurfaces:
    """Find the surfaces of all casings of a section; faces are `depth` (m) deep.

    All nodes of a casing that do not lie on the outside of its round are interior ones, which meet other rounds' faces:
    those at the charge as well.
    """
    split = len(mesh.twins) > 0
    solid = mesh.part != Part.CHARGE
    group = np.where(split & ~solid, -1, mesh.round)
    edges, cell, behind = outer_edges(mesh, group)
    of_edge = 2 * mesh.round[cell]
    order = np.argsort(of_edge, kind="stable")
    edges, of_edge, free = edges[order], of_edge[order], behind[order] < 0
    inner, inner_cell = _edges_of_layers(mesh, solid)
    bodies = np.concatenate([of_edge, 2 * mesh.round[inner_cell]]).astype(np.int32)
    every = np.concatenate([edges, inner])

    used = np.zeros(len(mesh.nodes), dtype=bool)
    used[mesh.cells[solid]] = True
    used[every] = True
    node = np.flatnonzero(used)
    row = np.cumsum(used) - 1
    ends = row[every]
    copied = np.unique(ends)
    place = np.full(len(node), -1)
    place[copied] = len(node) + np.arange(len(copied))
    start, end, count = place[ends[:, 0]], place[ends[:, 1]], len(copied)
    # The cell lies to the left of its edge: in this order the normal points to the right.
    faces = np.stack([end, start, start + count, end + count], axis=1).astype(np.int32)
    copy_of = np.concatenate([copied, copied])
    of_node = np.zeros(len(mesh.nodes), dtype=np.int32)
    of_node[mesh.cells] = 2 * mesh.round[:, None]
    outside = np.zeros(len(mesh.nodes), dtype=bool)
    outside[edges[free]] = True
    rows, no = len(node) + 2 * count, np.zeros(2 * count, dtype=bool)
    length = np.linalg.norm(mesh.nodes[every[:, 1]] - mesh.nodes[every[:, 0]], axis=1)
    return SectionSurfaces(
        node=np.concatenate([node, len(mesh.nodes) + np.arange(2 * count)]),
        faces=faces,
        face_body=bodies,
        node_body=np.concatenate([of_node[node], of_node[node][copy_of]]),
        cell=np.concatenate([cell[order], inner_cell]),
        edge=np.sqrt(length * depth),
        outside=np.concatenate([outside[node], no]),
        interior=np.concatenate([~outside[node], no]),
        on_surface=len(edges),
        held=np.zeros(rows, dtype=np.uint8),
        copy_of=copy_of,
        height=np.repeat([0.0, -0.5 * depth, 0.5 * depth], [len(node), count, count]),
    )


def _edges_of_layers(mesh: SectionMesh, solid: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Edges between the layers of the casings' cells, the outer layer to the right, and the cells they belong to."""
    if len(mesh.lengths) < 2:
        return np.zeros((0, 2), dtype=np.int64), np.zeros(0, dtype=np.int64)
    cell, side = np.nonzero(outward_sides(mesh) & (mesh.neighbours >= 0) & solid[:, None])
    return np.stack([mesh.cells[cell, side], mesh.cells[cell, (side + 1) % 4]], axis=1), cell


def nodes_at_planes(mesh: SectionMesh) -> tuple[np.ndarray, np.ndarray]:
    """Nodes that no plane lets pass, ascending, and whether each lies on no outside of a casing or charge (k,)."""
    outline, _, _ = outer_edges(mesh, np.where(mesh.part == Part.CHARGE, 2 * mesh.round + 1, 2 * mesh.round))
    on_edge = np.zeros(len(mesh.nodes), dtype=bool)
    on_edge[outline] = True
    meets = on_edge.copy()
    meets[mesh.cells[mesh.part != Part.CHARGE]] = True
    nodes = np.flatnonzero(meets)
    return nodes, ~on_edge[nodes]


def section_radii(mesh: SectionMesh, section: PlaneSection) -> RadialSurfaces:
    """Nodes on the outlines of charges and casings, one part and bin for each round, as `records.surfaces`."""
    count, nodes = len(section.stations), len(mesh.nodes)
    charge_part = np.full(nodes, -1, dtype=np.int32)
    casing_bin = np.full(nodes, -1, dtype=np.int32)
    of_node = np.zeros(nodes, dtype=np.int64)
    of_node[mesh.cells] = mesh.round[:, None]
    for marks, group in (
        (charge_part, np.where(mesh.part == Part.CHARGE, mesh.round, -1)),
        (casing_bin, mesh.round),
    ):
        edges, _, behind = outer_edges(mesh, group)
        marked = np.unique(edges[behind < 0] if marks is casing_bin else edges)
        marks[marked] = of_node[marked]
    away = mesh.nodes.copy()
    away[:, [0, 2]] -= section.centres[of_node]
    radius = np.linalg.norm(away, axis=1)
    return RadialSurfaces(
        charge_part=charge_part,
        cell_part=np.where(mesh.part == Part.CHARGE, mesh.round, count).astype(np.int32),
        parts=count,
        casing_bin=casing_bin,
        bin_round=np.arange(count, dtype=np.int32),
        bin_station=section.stations.copy(),
        radius=radius,
        outward=away / np.maximum(radius, 1e-300)[:, None],
    )
