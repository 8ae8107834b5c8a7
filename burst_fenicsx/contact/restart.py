"""The state of all contact in arrays that do not depend on ranks or threads, for the checkpoint."""

from __future__ import annotations

from dataclasses import astuple
from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.contact.forces import Penetrations

if TYPE_CHECKING:
    from collections.abc import Mapping

    from mpi4py import MPI

    from burst_fenicsx.contact.collisions import CollidingSurfaces
    from burst_fenicsx.contact.forces import ContactForces
    from burst_fenicsx.contact.planes import PlaneContact

__all__ = ["contact_arrays", "own_sums", "restore_contact", "sums_of_ranks"]

_OF_COLLISIONS = (
    "touching", "normal", "slip", "penetration", "unloaded", "active_penetration", "stiffness", "sharing",
)  # fmt: skip


def sums_of_ranks(local: np.ndarray, comm: MPI.Comm) -> np.ndarray:
    """What every rank has summed up, (ranks, ...), on rank 0; to be ignored elsewhere. Collective.

    Kept apart: added up sooner than in a run that goes on they would differ from it in the last bit.
    """
    return np.array(comm.gather(local) if comm.size > 1 else [local])


def own_sums(rows: np.ndarray, comm: MPI.Comm, shape: tuple[int, ...]) -> np.ndarray:
    """What a rank goes on from of sums (ranks, *shape): its own; on another number of ranks rank 0 from all of them."""
    rows = rows.reshape(-1, *shape)
    if len(rows) == comm.size:
        return np.array(rows[comm.rank])
    return np.array(rows.sum(axis=0)) if comm.rank == 0 else np.zeros(shape)


def contact_arrays(contact: ContactForces) -> dict[str, np.ndarray | None]:
    """The whole state of contact, by name; whole on rank 0, to be ignored elsewhere. Collective."""
    comm, mesh = contact.comm, contact.mesh
    sums = np.array([contact.friction, contact.work])
    deepest = contact.penetrations.over(comm)
    arrays: dict[str, np.ndarray | None] = {
        "sums": sums_of_ranks(sums, comm),
        "plane_impulse": contact.impulse.state(),
        "penetrations": np.array(astuple(deepest)),
        "torn": contact.torn,
        **{f"forces/{name}": mesh.gather_nodes(values) for name, values in contact.forces.items()},
    }
    if contact.interface is not None:
        arrays |= {f"interface/{name}": values for name, values in contact.interface.arrays().items()}
    if contact.collisions is not None:
        arrays |= {f"collisions/{name}": values for name, values in _of_collisions(contact.collisions).items()}
    for number, plane in enumerate(contact.planes):
        arrays |= {f"planes/{number}/{name}": values for name, values in _of_plane(comm, plane).items()}
    return arrays


def restore_contact(contact: ContactForces, arrays: Mapping[str, np.ndarray]) -> None:
    """Put all contact where `contact_arrays` found it, on any number of ranks; raises KeyError for a missing array."""
    sums = own_sums(arrays["sums"], contact.comm, (2,))
    contact.friction, contact.work = float(sums[0]), float(sums[1])
    contact.impulse.restore(arrays["plane_impulse"])
    contact.penetrations = Penetrations(*(float(value) for value in arrays["penetrations"]))
    contact.restore_torn(arrays["torn"])
    contact.restore_forces({name: arrays[f"forces/{name}"] for name in contact.forces})
    if contact.interface is not None:
        contact.interface.restore({name: arrays[f"interface/{name}"] for name in contact.interface.array_names})
    if contact.collisions is not None:
        collisions = contact.collisions
        for name in _OF_COLLISIONS:
            getattr(collisions.state, name)[:] = arrays[f"collisions/{name}"]
        if len(arrays["collisions/searched_at"]):
            collisions.search_from(arrays["collisions/searched_at"])
            collisions.travel = float(arrays["collisions/travel"])
        collisions.searches = int(arrays["collisions/searches"])
    for number, plane in enumerate(contact.planes):
        for name in ("slip", "penetration", "stiffness"):
            getattr(plane.state, name)[:] = arrays[f"planes/{number}/{name}"][plane.rows]
        plane.look_again()


def _of_collisions(collisions: CollidingSurfaces) -> dict[str, np.ndarray]:
    state = collisions.state
    kept = collisions.own_everywhere(
        np.column_stack(
            [
                state.touching.astype(float),
                state.slip,
                state.normal,
                state.penetration,
                state.unloaded,
                state.active_penetration,
                state.stiffness,
                state.sharing,
            ]
        )
    )
    return {
        "touching": kept[:, 0].astype(np.int32),
        "slip": kept[:, 1:4],
        "normal": kept[:, 4:7],
        "penetration": kept[:, 7],
        "unloaded": kept[:, 8],
        "active_penetration": kept[:, 9],
        "stiffness": kept[:, 10],
        "sharing": kept[:, 11],
        "searched_at": collisions.searched_at,
        "travel": np.array(collisions.travel),
        "searches": np.array(collisions.searches),
    }


def _of_plane(comm: MPI.Comm, plane: PlaneContact) -> dict[str, np.ndarray]:
    state = plane.state
    pieces = comm.gather((plane.rows, state.slip, state.penetration, state.stiffness))
    if pieces is None:
        return {}
    rows, slip, penetration, stiffness = (np.concatenate(column) for column in zip(*pieces, strict=True))
    order = np.argsort(rows)
    return {"slip": slip[order], "penetration": penetration[order], "stiffness": stiffness[order]}
