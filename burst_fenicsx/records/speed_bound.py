"""The speed that products can give to metal, and casing metal that is faster."""

from __future__ import annotations

import logging
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from collections.abc import Sequence

    from burst_fenicsx.materials.products import Products
    from burst_fenicsx.mechanics.fields import BurstFields

__all__ = ["escape_speed", "speeds_and_bound"]

_log = logging.getLogger(__name__)


def escape_speed(products: Sequence[Products]) -> float:
    """Largest speed (m/s) at which any of the `products` expands into a vacuum from behind a plane front.

    On its own isentrope, see `LandauProducts.escape_speed`; metal that it pushes is slower.
    """
    return max(item.escape_speed for item in products)


def speeds_and_bound(fields: BurstFields, images: int) -> dict[str, Any]:
    """The fastest node of any casing beside `escape_speed`, and the casings' mass above it; collective.

    Metal that rounds squeeze between them may be thrown as a jet; above the bound no products have pushed it there, and
    a warning is logged. `images` is how many times the arrangement is the computed part.
    """
    mesh, bound = fields.mesh, escape_speed(fields.products)
    of_casings = np.unique(mesh.dofmap[mesh.part != Part.CHARGE])
    own = of_casings[of_casings < mesh.owned_nodes]
    speed = np.linalg.norm(fields.nodes.velocity[own], axis=1)
    fastest, above = float(speed.max(initial=0.0)), float(images * fields.mass[own][speed > bound].sum())
    if mesh.comm.size > 1:
        fastest, above = mesh.comm.allreduce(fastest, op=MPI.MAX), mesh.comm.allreduce(above)
    if above > 0.0 and mesh.comm.rank == 0:
        _log.warning(
            "%.3g kg of the casings are faster than products expand into a vacuum: up to %.0f m/s, the bound: %.0f m/s",
            above,
            fastest,
            bound,
            extra={"code": "faster_than_products"},
        )
    return {"fastest_casing_node": fastest, "escape_speed_of_products": bound, "casing_mass_above_escape_speed": above}
