"""Outer surfaces of charge and casing, found once on the whole mesh: where radii are measured during the burst."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.axisymmetric.mesh import outer_edges
from burst_fenicsx.kernels.geometry.faces import area_vectors
from burst_fenicsx.meshing.mesh import HexahedralMesh, outer_faces
from burst_fenicsx.meshing.placement import frame, to_local
from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from collections.abc import Sequence

    from burst_fenicsx.axisymmetric.mesh import MeridianMesh
    from burst_fenicsx.problem import Round


# A face belongs to the lateral surface if its normal leans less than this from the radial direction (cosine).
LATERAL = 0.5


@dataclass(frozen=True)
class RadialSurfaces:
    """Bins of nodes on lateral surfaces, over all rounds; -1 marks a node that is in no bin.

    Attributes
    ----------
    charge_slice : (nodes,) int32, axial slice of the charge, counted over all rounds.
    cell_slice : (cells,) int32, axial slice of each charge cell, the number of slices elsewhere.
    slices : number of axial slices over all rounds.
    casing_bin : (nodes,) int32, station bin of the casing's outer surface, counted over all rounds.
    bin_round, bin_station : (bins,) round and station of each bin's centre (m from the nose end).
    radius : (nodes,) m and outward : (nodes, 3), from the axis of the node's round.
    """

    charge_slice: np.ndarray
    cell_slice: np.ndarray
    slices: int
    casing_bin: np.ndarray
    bin_round: np.ndarray
    bin_station: np.ndarray
    radius: np.ndarray
    outward: np.ndarray


def radial_surfaces(
    mesh: HexahedralMesh | MeridianMesh, rounds: Sequence[Round], slices_per_round: int, bins_per_round: int
) -> RadialSurfaces:
    """Find the lateral surfaces of every round's charge and casing, in the meridian lines, and cut them along the axis.

    Parameters
    ----------
    mesh : the whole mesh. rounds : in the order of `mesh.round`.
    slices_per_round : axial slices of each charge (Eq. 6). bins_per_round : station bins of each casing.
    """
    nodes = len(mesh.nodes)
    charge_slice = np.full(nodes, -1, dtype=np.int32)
    casing_bin = np.full(nodes, -1, dtype=np.int32)
    cell_slice = np.full(len(mesh.cells), slices_per_round * len(rounds), dtype=np.int32)
    radius = np.zeros(nodes)
    outward = np.zeros((nodes, 3))
    bin_station = []
    for index, item in enumerate(rounds):
        mine = np.flatnonzero(mesh.round == index)
        used = np.flatnonzero(_marked(mesh.cells[mine], nodes))
        local = to_local(mesh.nodes[used], item.position, item.axis)
        distance = np.hypot(local[:, 0], local[:, 1])
        radius[used] = distance
        direction = local[:, :2] / np.maximum(distance, 1e-300)[:, None]
        e1, e2, _ = frame(item.axis)
        outward[used] = direction[:, :1] * e1 + direction[:, 1:] * e2
        if not isinstance(mesh, HexahedralMesh):
            outward[:] = e1  # on the axis as well
        length = mesh.lengths[index]
        height = np.zeros(nodes)
        height[used] = local[:, 2]

        charge = mine[mesh.part[mine] == Part.CHARGE]
        if len(charge):
            front = length - height[mesh.cells[charge]].max()
            back = length - height[mesh.cells[charge]].min()
            fraction = (mesh.station[charge] - front) / (back - front)
            cell_slice[charge] = index * slices_per_round + cut_along(fraction, slices_per_round)
            surface = np.flatnonzero(_lateral_nodes(mesh, charge, outward))
            fraction = (length - height[surface] - front) / (back - front)
            charge_slice[surface] = index * slices_per_round + cut_along(fraction, slices_per_round)

        # The outer surface of the whole round, of which the casing's share is kept.
        lateral = _lateral_nodes(mesh, mine, outward)
        casing = _marked(mesh.cells[mine[mesh.part[mine] == Part.CASING]], nodes)
        surface = np.flatnonzero(lateral & casing)
        fraction = (length - height[surface]) / length
        casing_bin[surface] = index * bins_per_round + cut_along(fraction, bins_per_round)
        bin_station.append((np.arange(bins_per_round) + 0.5) * length / bins_per_round)
    return RadialSurfaces(
        charge_slice=charge_slice,
        cell_slice=cell_slice,
        slices=slices_per_round * len(rounds),
        casing_bin=casing_bin,
        bin_round=np.repeat(np.arange(len(rounds), dtype=np.int32), bins_per_round),
        bin_station=np.concatenate(bin_station) if bin_station else np.zeros(0),
        radius=radius,
        outward=outward,
    )


def cut_along(fraction: np.ndarray, pieces: int) -> np.ndarray:
    """Number (int32) of the equal piece of the length in which each fraction of it lies."""
    return np.clip(np.floor(fraction * pieces), 0, pieces - 1).astype(np.int32)


def _lateral_nodes(mesh: HexahedralMesh | MeridianMesh, cells: np.ndarray, outward: np.ndarray) -> np.ndarray:
    """Mark the nodes (nodes,) of the outer faces or edges of `cells` that look away from the axis."""
    group = np.full(len(mesh.cells), -1, dtype=np.int8)
    group[cells] = 0
    if isinstance(mesh, HexahedralMesh):
        faces, _, _ = outer_faces(mesh, group)
        normal = area_vectors(mesh.nodes[faces])
    else:
        faces, _, _ = outer_edges(mesh, group)
        along = mesh.nodes[faces[:, 1]] - mesh.nodes[faces[:, 0]]
        normal = along[:, [2, 1, 0]] * [1.0, 0.0, -1.0]
    normal /= np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
    middle = outward[faces].mean(axis=1)
    looks_out = np.einsum("ij,ij->i", normal, middle) > LATERAL
    return _marked(faces[looks_out], len(mesh.nodes))


def _marked(numbers: np.ndarray, count: int) -> np.ndarray:
    marked = np.zeros(count, dtype=bool)
    marked[numbers] = True
    return marked
