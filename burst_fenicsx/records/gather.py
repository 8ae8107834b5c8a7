"""Fields in the order of the mesh that was given, gathered on rank 0: for the time series and for the snapshot."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from collections.abc import Mapping

    from burst_fenicsx.mechanics.fields import BurstFields
    from burst_fenicsx.meshing.distributed import DistributedMesh


_Arrays = dict[str, np.ndarray]


def output_fields(
    state: BurstFields, contact_force: np.ndarray | None = None, *, with_nodal_stress: bool = False
) -> tuple[_Arrays, _Arrays]:
    """Fields of nodes and of cells for visualisation; empty on ranks other than 0. Collective.

    `contact_force` (nodes, 3) N where there is contact; `with_nodal_stress` adds `nodal_stress` (nodes, 6).
    """
    mesh = state.mesh
    count = mesh.cells
    stress = state.solid.stress[:count].mean(axis=1)
    charge = mesh.part == Part.CHARGE
    pressure = state.charge.pressure[:count] * state.charge.leakage[state.charge.axial_slice]
    pressure = np.where(charge, pressure, -stress[:, :3].mean(axis=1))
    stress[charge, :3] -= pressure[charge, None]
    volume = state.blocks.by_cell(state.grid.volume)
    points = {
        "position": state.nodes.position,
        "velocity": state.nodes.velocity,
        "displacement": state.nodes.position - state.start,
    }
    if contact_force is not None:
        points["contact_force"] = contact_force
    cells = {
        "pressure": pressure,
        "stress": stress,
        "shear_stress": _largest_shear(stress),
        "plastic_shear_strain": state.solid.shear_strain[:count].mean(axis=1),
        "plastic_volumetric_strain": state.solid.volume_strain[:count].mean(axis=1),
        "burn_fraction": state.charge.burn_fraction[:count],
        "density": state.cell_mass / volume,
        "torn_metal": state.eroded_metal.astype(np.uint8),
        "part": mesh.part,
        "round": mesh.round,
        "segment": mesh.segment,
    }
    if not with_nodal_stress:
        return _gathered(mesh, points, cells)
    of_projection = {"_nodes": mesh.node[mesh.dofmap], "_weight": np.where(state.eroded, 0.0, volume)}
    points, cells = _gathered(mesh, points, cells | of_projection)
    if cells:
        corners, weight = cells.pop("_nodes"), cells.pop("_weight")
        metal = cells["part"] != Part.CHARGE
        points["nodal_stress"] = nodal_stress(corners, len(points["position"]), cells["stress"], weight, metal)
    return points, cells


def nodal_stress(
    corners: np.ndarray, nodes: int, stress: np.ndarray, weight: np.ndarray, metal: np.ndarray
) -> np.ndarray:
    """L2 projection with lumped mass, the mean of a node's cells by volume: (nodes, 6) in Pa.

    The consistent mass would need a solve and overshoots beside jumps such as shocks; this mean does not. Where metal
    and charge share nodes, these have the metal's. Cells without weight do not count; a node with none but these has
    zero.

    Parameters
    ----------
    corners : (cells, corners) nodes of the cells. nodes : how many there are.
    stress : of the cells (cells, 6) in Pa. weight : their volumes (cells,) in m3. metal : (cells,) bool.
    """
    result = np.zeros((nodes, 6))
    for kind in (~metal, metal):
        own = kind & (weight > 0.0)
        node, volume = corners[own].ravel(), np.repeat(weight[own], corners.shape[1])
        total = np.bincount(node, volume, minlength=nodes)
        met = total > 0.0
        for column, values in enumerate(stress[own].T):
            weighted = np.bincount(node, volume * np.repeat(values, corners.shape[1]), minlength=nodes)
            result[met, column] = weighted[met] / total[met]
    return result


def snapshot_fields(state: BurstFields) -> tuple[_Arrays, _Arrays]:
    """Fields of nodes and of cells that the break-up needs; empty on ranks other than 0. Collective."""
    count = state.mesh.cells
    points = {"reference": state.start, "position": state.nodes.position, "velocity": state.nodes.velocity}
    cells = {
        "mass": state.cell_mass,
        "plastic_shear_strain": state.solid.shear_strain[:count].mean(axis=1),
        "plastic_volumetric_strain": state.solid.volume_strain[:count].mean(axis=1),
    }
    return _gathered(state.mesh, points, cells)


def _gathered(
    mesh: DistributedMesh, points: Mapping[str, np.ndarray], cells: Mapping[str, np.ndarray]
) -> tuple[_Arrays, _Arrays]:
    all_points = {name: mesh.gather_nodes(values) for name, values in points.items()}
    all_cells = {name: mesh.gather_cells(values) for name, values in cells.items()}
    return (
        {name: values for name, values in all_points.items() if values is not None},
        {name: values for name, values in all_cells.items() if values is not None},
    )


def _largest_shear(stress: np.ndarray) -> np.ndarray:
    """(s1 - s3)/2 of stresses (cells, 6), Pa: sqrt(J2) sin(theta + pi/3), theta Lode's angle from s1."""
    xx, yy, zz, xy, yz, zx = stress.T
    mean = (xx + yy + zz) / 3.0
    xx, yy, zz = xx - mean, yy - mean, zz - mean
    second = 0.5 * (xx**2 + yy**2 + zz**2) + xy**2 + yz**2 + zx**2
    third = xx * (yy * zz - yz**2) - xy * (xy * zz - yz * zx) + zx * (xy * yz - yy * zx)
    scale = np.maximum(second, 1e-200) ** 1.5  # no stress at all has no angle
    angle = np.arccos(np.clip(1.5 * np.sqrt(3.0) * third / scale, -1.0, 1.0)) / 3.0
    return np.sqrt(second) * np.sin(angle + np.pi / 3.0)
