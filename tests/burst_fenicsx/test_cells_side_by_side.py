"""A cell's result depends neither on the other cells of its block, nor on its place among them, nor on padded lanes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import h5py
import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from mpi4py import MPI

from burst_fenicsx.files.checkpoint import read_checkpoint, write_checkpoint
from burst_fenicsx.kernels.lanes import LANES
from burst_fenicsx.mechanics import schedule
from burst_fenicsx.problem import Hourglass, Part, Viscosity
from burst_fenicsx.simulation import Simulation
from tests.burst_fenicsx.axisymmetric.meridians import rectangle, ring_burst
from tests.burst_fenicsx.boxes import BARE, STEEL, box, burst, run_until
from tests.burst_fenicsx.tubes import SETTINGS as TUBE
from tests.burst_fenicsx.tubes import tube

pytestmark = pytest.mark.dolfinx


EDGE, INNER, COUNT = 2e-3, 0.03, 2 * LANES + 1
CASING = replace(STEEL, shear_softening_strain=0.5, tensile_softening_strain=0.5)
CONTROL = Hourglass(casing_viscous=0.05, casing_stiffness=0.05, charge_viscous=0.1)
SETTINGS = replace(BARE, viscosity=Viscosity(linear=0.1, quadratic=1.5), hourglass=CONTROL)
STEP = 1e-9


@dataclass
class States:
    """Random states by cell of the column, and of its nodes by height and corner."""

    kind: str
    part: Part
    quadrature: str

    def __post_init__(self) -> None:
        """Draw them."""
        random = np.random.default_rng(1)
        self.corners = 2 if self.kind == "rings" else 4
        self.moved = random.uniform(-0.08, 0.08, (COUNT + 1, self.corners, 3)) * EDGE
        self.velocity = random.normal(0.0, 40.0, (COUNT + 1, self.corners, 3))
        if self.kind == "rings":
            self.moved[..., 1] = self.velocity[..., 1] = 0.0
        self.stress = random.normal(0.0, 2e8, (COUNT, 8, 6))
        self.strain = random.uniform(0.0, 0.45, (2, COUNT, 8))
        self.burnt = np.clip(random.uniform(-0.3, 1.3, COUNT), 0.0, 1.0)
        self.energy = random.uniform(0.6, 1.0, COUNT)
        self.before = random.uniform(0.9, 1.1, COUNT)  # volume one step ago over that at rest
        self.ignition = random.uniform(-1e-6, 1e-6, COUNT)
        self.released = np.arange(COUNT) % 5 == 3
        if self.kind == "rings":
            self.stress[..., 3:5] = 0.0

    def column(self, first: int, count: int):
        """Solver of the cells `first` on, in these states, advanced by one step."""
        settings = replace(SETTINGS, quadrature=self.quadrature, burn="time", products="jwl")
        if self.kind == "rings":
            mesh = rectangle((1, count), (INNER, INNER + EDGE), count * EDGE, self.part)
            mesh = replace(mesh, nodes=mesh.nodes + np.array([0.0, 0.0, first * EDGE]))
            solver = ring_burst(mesh, settings, casing=CASING)
        else:
            mesh = box((1, 1, count), (EDGE, EDGE, count * EDGE), self.part)
            mesh = replace(mesh, nodes=mesh.nodes + np.array([0.0, 0.0, first * EDGE]))
            solver = burst(mesh, settings, casing=CASING)
        state = solver.fields
        layer, corner = self.places(state.start)
        cell = np.rint((state.start[state.mesh.dofmap].mean(axis=1)[:, 2]) / EDGE - 0.5).astype(int)
        points = state.solid.stress.shape[1]
        state.nodes.velocity[:] = self.velocity[layer, corner]
        state.solid.stress[:] = self.stress[cell, :points]
        state.solid.shear_strain[:], state.solid.volume_strain[:] = self.strain[:, cell, :points]
        charge = state.charge
        charge.burn_fraction[:] = self.burnt[cell]
        charge.energy[:] *= self.energy[cell]
        charge.ignition_time[:] = self.ignition[cell]
        charge.burn_rate[:] = 5e5
        solver.time = 1e-9
        # Those that are to be released have grown without strength (metal), or lost their volume (products).
        chosen = self.released[cell]
        state.nodes.position[:] += self.moved[layer, corner]
        volumes = self.before[cell] * state.blocks.by_cell(state.grid.volume)
        state.grid.volume[:] = state.blocks.by_slot(volumes)
        if self.kind == "rings" and self.part == Part.CASING:
            state.solid.shear_strain[chosen] = state.solid.volume_strain[chosen] = 1.0
        if self.kind == "boxes" and self.part == Part.CASING:
            state.solid.eroded[:] = state.blocks.by_slot(chosen.astype(np.int8))
        if self.part == Part.CHARGE:
            charge.burn_fraction[chosen] = 1.0
            state.solid.stress[charge.burn_fraction == 1.0] = 0.0  # products have no strength
        solver.add_forces(STEP)
        return solver, layer, corner, cell

    def places(self, start: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Layer and corner of nodes (n, 3)."""
        layer = np.rint(start[:, 2] / EDGE).astype(int)
        if self.kind == "rings":
            return layer, (start[:, 0] > INNER + 0.5 * EDGE).astype(int)
        return layer, (start[:, 0] > 0.5 * EDGE).astype(int) + 2 * (start[:, 1] > 0.5 * EDGE)


def of_cells(solver):
    """What the step leaves in the cells, by name (cells, ...)."""
    state = solver.fields
    found = {
        "stress": state.solid.stress, "shear": state.solid.shear_strain, "volume": state.solid.volume_strain,
        "burnt": state.charge.burn_fraction, "energy": state.charge.energy, "pressure": state.charge.pressure,
        "stable": state.blocks.by_cell(state.grid.stable), "size": state.blocks.by_cell(state.grid.volume),
        "viscous": state.blocks.by_cell(state.grid.viscous), "eroded": state.eroded,
    }  # fmt: skip
    return {name: np.array(values, dtype=float) for name, values in found.items()}


@pytest.mark.parametrize(
    ("kind", "part", "quadrature"),
    [
        ("rings", Part.CASING, "one_point"),
        ("rings", Part.CHARGE, "one_point"),
        ("boxes", Part.CASING, "one_point"),
        ("boxes", Part.CHARGE, "one_point"),
        ("boxes", Part.CASING, "full"),
        ("boxes", Part.CHARGE, "full"),
    ],
)
def test_many_cells_do_what_each_does_alone(kind, part, quadrature):
    states = States(kind, part, quadrature)
    together, layer, corner, cell = states.column(0, COUNT)
    many = of_cells(together)
    force = np.zeros((COUNT + 1, states.corners, 3))
    force[layer, corner] = together.fields.nodes.force
    summed, sums, largest = np.zeros_like(force), np.zeros(5), 0.0
    for number in range(COUNT):
        alone, own_layer, own_corner, (own,) = states.column(number, 1)
        assert own == number
        where = int(np.flatnonzero(cell == number)[0])
        for name, values in of_cells(alone).items():
            scale = np.abs(many[name][np.isfinite(many[name])]).max(initial=0.0)
            np.testing.assert_allclose(many[name][where], values[0], rtol=1e-9, atol=1e-10 * scale, err_msg=name)
        np.add.at(summed, (own_layer, own_corner), alone.fields.nodes.force)
        largest = max(largest, float(np.abs(alone.fields.nodes.force).max()))
        sums += alone.ledger.sums
    np.testing.assert_allclose(force, summed, rtol=0.0, atol=1e-9 * largest)
    np.testing.assert_allclose(together.ledger.sums, sums, rtol=1e-9, atol=1e-12 * np.abs(sums).max())
    assert together.control.stable_step == pytest.approx(many["stable"].min(), rel=1e-12)
    assert np.unique(many["stress"][:, 0, 0]).size > COUNT // 2
    if part == Part.CHARGE:
        assert 0.0 < many["burnt"].mean() < 1.0


READ_AT, END = 4e-6, 30e-6
OVER_SLOTS = ("grid/volume", "grid/viscous", "grid/stable", "solid/eroded", "solid/hourglass")


def by_slots(fields):
    """Every array over slots, (slots, ...)."""
    grid, solid = fields.grid, fields.solid
    over = {name: getattr(grid, name) for name in ("mass", "volume", "viscous", "stable")}
    over |= {name: getattr(solid, name) for name in ("eroded", "softening_scale")}
    lanes = {"hourglass": solid.hourglass} | (
        {"inverse_share": fields.inverse_share} if fields.inverse_share.size else {}
    )
    for name, values in lanes.items():
        over[name] = values.reshape(len(values), -1, LANES).transpose(0, 2, 1).reshape(fields.blocks.cells.size, -1)
    return over


def same_state(one, two):
    """Bit by bit: of cells, points, nodes and sums; and the padded lanes hold what the cells' do."""
    padding = two.fields.blocks.slot_of_cell[two.fields.blocks.cells.ravel()]
    for name, values in by_slots(two.fields).items():
        np.testing.assert_array_equal(values, values[padding], err_msg=f"{name} of padded lanes")
        own = one.fields.blocks.by_cell(by_slots(one.fields)[name])
        np.testing.assert_array_equal(two.fields.blocks.by_cell(values), own, err_msg=name)
    for group in ("nodes", "solid", "charge"):
        for name, values in getattr(one.fields, group)._asdict().items():
            if name not in ("eroded", "softening_scale", "hourglass", "mean"):  # the last one: within a step
                np.testing.assert_array_equal(getattr(getattr(two.fields, group), name), values, err_msg=name)
    for name in ("time", "time_step", "steps"):
        assert getattr(one.solver, name) == getattr(two.solver, name), name
    for name in ("sums", "released"):
        np.testing.assert_array_equal(getattr(two.solver.ledger, name), getattr(one.solver.ledger, name))


def spoil_padded_lanes(path, blocks):
    """Put into the padded lanes of a checkpoint what no cell can hold; how many of metal and of charge."""
    padded = np.arange(LANES)[None, :] >= blocks.count[:, None]
    with h5py.File(path, "a") as file:
        for name in OVER_SLOTS:
            item = file[f"ranks/0/{name}"]
            values = item[()].reshape(len(padded), -1, LANES)
            values.transpose(0, 2, 1)[padded] = 1 if name == "solid/eroded" else np.nan
            item[...] = values.reshape(item.shape)
    charge = blocks.material % len(Part) == Part.CHARGE
    return int(padded[~charge].sum()), int(padded[charge].sum())


@pytest.mark.parametrize(
    "changes", [{}, {"quadrature": "full"}, {"geometry": "axisymmetric", "cell_size": 12e-3}], ids=str
)
def test_blocks_that_are_not_full_do_what_others_do(tmp_path, monkeypatch, changes):
    """In the usual chunks, and in many small ones that go on from a checkpoint and are arranged again."""
    settings = replace(TUBE, end_time=END, **changes)

    def run(name):
        folder = tmp_path / name
        folder.mkdir()
        return Simulation([tube()], settings, folder, MPI.COMM_SELF, {})

    whole = run("whole")
    run_until(whole.solver, READ_AT)
    monkeypatch.setattr(schedule, "chunk_size", lambda cells: 37)
    first, second = run("first"), run("second")
    run_until(first.solver, READ_AT)
    same_state(whole, first)
    path = tmp_path / "checkpoint.h5"
    write_checkpoint(path, first.solver, {}, first.key)
    assert min(spoil_padded_lanes(path, first.fields.blocks)) > 0
    read_checkpoint(path, second.solver, second.key)
    same_state(whole, second)
    level = second.fields.blocks.cell_levels
    second.fields.regroup(np.random.default_rng(1).integers(0, 3, len(level)), 2)
    same_state(whole, second)
    second.solver.levels.set_levels(level)
    for simulation in (whole, second):
        run_until(simulation.solver, END)
    same_state(whole, second)
