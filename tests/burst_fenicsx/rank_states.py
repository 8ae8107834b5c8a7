"""Two coarse tubes, their state kept to the last bit: `python -m tests.burst_fenicsx.rank_states FILE OPTION...`.

The options are random (cells are dealt to the ranks at random), shared (charge and casing share their nodes, no
contact), full (2x2x2 points), jwl, shock (the right tube waits for the shock of the left), symmetry (three tubes in a
row, the left half and a quarter of the middle one computed), walls (the left tube stands on a deck and by a wall),
resume (from the checkpoint in the folder).
"""

from __future__ import annotations

import json
import sys
from contextlib import contextmanager, nullcontext
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI

from burst_fenicsx import geometries
from burst_fenicsx.problem import ContactSettings, Leakage, RigidPlane, ShockInitiation
from burst_fenicsx.simulation import Simulation
from tests.burst_fenicsx.tubes import SETTINGS, tube

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from burst_fenicsx.simulation import BurstResult

OF_THE_RUN = (
    "ranks", "threads", "wall_seconds", "start_seconds", "stepping_seconds", "seconds_per_cell_step",
    "peak_memory_bytes",
)  # fmt: skip
OF_RANKS = ("ranks", "received")  # what is saved besides the state
GAP = 5e-3
END = 70e-6
END_WITHOUT_CONTACT = 45e-6
END_BY_SHOCK = 60e-6


def tubes(folder: Path, comm: MPI.Comm, options: frozenset[str] = frozenset()) -> Simulation:
    """Two tubes side by side at rest, initiated together but for the option shock; the gap closes on the way."""
    end = END_BY_SHOCK if "shock" in options else END_WITHOUT_CONTACT if "shared" in options else END
    settings = replace(
        SETTINGS,
        end_time=end,
        leakage=Leakage(radius_ratio=1.1),
        quadrature="full" if "full" in options else "one_point",
        products="jwl" if "jwl" in options else "landau_cj",
        contact=ContactSettings(charge_casing="shared", surfaces=False) if "shared" in options else ContactSettings(),
    )
    rounds = [tube(name="left"), tube(name="right", position=(0.155 + GAP, 0.01, 0.0))]
    if "walls" in options:
        wall = RigidPlane("wall", (-0.0795, 0.0, 0.0), (1.0, 0.0, 0.0))
        deck = RigidPlane("deck", (0.0, 0.0, 0.0), (0.0, 0.05, 1.0))
        settings = replace(settings, planes=(wall, deck), end_time=34e-6)
        rounds = [replace(item, position=(*item.position[:2], 0.02)) for item in rounds]
    if "symmetry" in options:
        pitch = 0.155 + GAP
        rounds = [tube(name=f"tube_{k}", position=(k * pitch, 0.0, 0.0)) for k in (-1, 0, 1)]
        settings = replace(settings, symmetry="auto", cell_size=16e-3, end_time=34e-6)
    if "shock" in options:
        rounds[1] = replace(rounds[1], ignition=(), initiation=ShockInitiation(pressure=0.5e9, duration=0.1e-6))
    return Simulation(rounds, settings, folder, comm, {})


def burst(folder: Path, comm: MPI.Comm, options: frozenset[str] = frozenset()) -> Simulation:
    """Burst the two tubes."""
    going = tubes(folder, comm, options)
    if "resume" in options:
        going.resume()
    going.run()
    return going


def state(going: Simulation) -> dict[str, np.ndarray]:
    """What the burst goes on from, in the order of the mesh that was given; empty but on rank 0."""
    fields = going.fields
    mesh = fields.mesh
    nodes = {"position": fields.nodes.position, "velocity": fields.nodes.velocity, "mass": fields.mass}
    nodes["force"] = fields.nodes.force
    cells = {
        "stress": fields.solid.stress,
        "shear_strain": fields.solid.shear_strain,
        "volume_strain": fields.solid.volume_strain,
        "burn_fraction": fields.charge.burn_fraction,
        "pressure": fields.charge.pressure,
        "ignition_time": fields.charge.ignition_time,
        "energy": fields.charge.energy,
    }
    gathered = {name: mesh.gather_nodes(values) for name, values in nodes.items()}
    gathered |= {name: mesh.gather_cells(values) for name, values in cells.items()}
    gathered |= {
        "leakage": going.leakage.factor,
        "initial_radius": going.leakage.initial_radius,
        "steps": np.array(going.solver.steps),
        "stable_step": np.array(going.solver.control.stable_step),
    }
    return {name: values for name, values in gathered.items() if values is not None} if going.comm.rank == 0 else {}


def differences(one: Mapping[str, np.ndarray], other: Mapping[str, np.ndarray]) -> list[str]:
    """Names of the arrays that differ in any bit but the sign of a zero."""
    assert sorted(one) == sorted(other)
    return [name for name in one if not np.array_equal(one[name], other[name])]


def summary_text(result: BurstResult) -> str:
    """The summary but for what is measured of the run itself, and what names the ranks."""
    kept = {key: value for key, value in result.summary.items() if key not in OF_THE_RUN}
    return json.dumps(kept, indent=1, sort_keys=True)


def share_received(going: Simulation) -> float:
    """Of all surface nodes, how many of other ranks' the last search was sent."""
    collisions = going.contact.collisions
    return collisions.received / len(collisions.surfaces.node) if collisions else 0.0


@contextmanager
def dealt_at_random() -> Iterator[None]:
    """Deal the cells to the ranks at random instead of in runs, within the block."""
    usual = geometries.distribute

    def at_random(comm, mesh, *, destination):
        assert mesh is None or comm.size == 1 or len(destination) == len(mesh.cells)
        owner = None
        if mesh is not None:
            owner = np.random.default_rng(2).integers(0, comm.size, len(mesh.cells)).astype(np.int32)
        return usual(comm, mesh, destination=owner)

    geometries.distribute = at_random
    try:
        yield
    finally:
        geometries.distribute = usual


def main() -> None:
    """Run on the ranks of MPI's world."""
    path, options = Path(sys.argv[1]), frozenset(sys.argv[2:])
    with dealt_at_random() if "random" in options else nullcontext():
        going = burst(path.parent, MPI.COMM_WORLD, options)
    result = going.finish()
    found, received = state(going), MPI.COMM_WORLD.allreduce(share_received(going), op=MPI.MAX)
    if found:
        np.savez(path, ranks=MPI.COMM_WORLD.size, received=received, **found)
        path.with_suffix(".json").write_text(summary_text(result))


if __name__ == "__main__":
    main()
