"""Hexahedral meshes of rounds: O-grids of profiles, and imported ones, with their quality."""

from __future__ import annotations

from burst_fenicsx.meshing.gmsh_import import read_gmsh
from burst_fenicsx.meshing.mesh import HexahedralMesh, cell_centres, cell_volumes, edge_lengths, merge, part_volumes
from burst_fenicsx.meshing.ogrid import mesh_profile, mesh_round
from burst_fenicsx.meshing.quality import MeshQuality, quality, scaled_jacobians

__all__ = [
    "HexahedralMesh",
    "MeshQuality",
    "cell_centres",
    "cell_volumes",
    "edge_lengths",
    "merge",
    "mesh_profile",
    "mesh_round",
    "part_volumes",
    "quality",
    "read_gmsh",
    "scaled_jacobians",
]
