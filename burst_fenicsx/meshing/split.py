"""Parting of charge and casing: every node that they share becomes two, which contact joins."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from burst_fenicsx.meshing.mesh import HexahedralMesh

__all__ = ["split_charges"]


def split_charges(mesh: HexahedralMesh) -> HexahedralMesh:
    """Give every charge nodes of its own where it meets casing or fuze (the paper's Fig. 2.2).

    The new nodes are the charge's and come after all others, so that those of the casing keep their numbers.

    Parameters
    ----------
    mesh : a mesh whose parts share their nodes.

    Returns
    -------
    The same mesh with the pairs in `twins`, in the order of the casing's nodes.
    """
    charge = mesh.part == Part.CHARGE
    in_charge, in_solid = np.zeros(len(mesh.nodes), dtype=bool), np.zeros(len(mesh.nodes), dtype=bool)
    in_charge[mesh.cells[charge]] = True
    in_solid[mesh.cells[~charge]] = True
    shared = np.flatnonzero(in_charge & in_solid)
    own = np.arange(len(mesh.nodes), dtype=np.int64)
    own[shared] = len(mesh.nodes) + np.arange(len(shared))
    cells = mesh.cells.copy()
    cells[charge] = own[cells[charge]]
    return replace(
        mesh,
        nodes=np.concatenate([mesh.nodes, mesh.nodes[shared]]),
        cells=cells,
        twins=np.stack([own[shared], shared], axis=1),
        held=None if mesh.held is None else np.concatenate([mesh.held, mesh.held[shared]]),
    )
