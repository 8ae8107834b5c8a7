"""Subdivision of the interface of charge and casing: every node that they share becomes two, which contact joins."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from burst_fenicsx.meshing.mesh import CellMesh

__all__ = ["split_charges"]

_Mesh = TypeVar("_Mesh", bound="CellMesh")


def split_charges(mesh: _Mesh) -> _Mesh:
    """Give every charge nodes of its own where it meets the casing (the paper's Fig. 2.2).

    Not where it meets a fuze: its front does not slide on it, and a weak fuze that products press on without friction
    is drawn out into fingers, behind which the charge comes to lie. The new nodes are the charge's and come after all
    others, so that those of the casing keep their numbers.

    Parameters
    ----------
    mesh : a mesh whose parts share their nodes.

    Returns
    -------
    The same mesh with the pairs in `twins`, in the order of the casing's nodes.
    """
    charge = mesh.part == Part.CHARGE
    touches = {part: np.zeros(len(mesh.nodes), dtype=bool) for part in Part}
    for part, touched in touches.items():
        touched[mesh.cells[mesh.part == part]] = True
    shared = np.flatnonzero(touches[Part.CHARGE] & touches[Part.CASING] & ~touches[Part.FUZE])
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
