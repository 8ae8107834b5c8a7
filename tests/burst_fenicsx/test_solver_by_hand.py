"""How steps are chosen, by hand: bounds of the macro step, when levels are chosen again, cells near a front, stops."""

from __future__ import annotations

from collections import namedtuple
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from mpi4py import MPI

from burst_fenicsx.errors import NumericalStop
from burst_fenicsx.kernels.step.assembly import _min_level as min_level
from burst_fenicsx.mechanics.erosion import check_cells
from burst_fenicsx.mechanics.nodal_loads import NodalLoads
from burst_fenicsx.mechanics.step_control import BurningTimes, StepControl
from burst_fenicsx.mechanics.subcycling import Subcycling
from burst_fenicsx.problem import IgnitionPoint, Part, TimeStep
from tests.burst_fenicsx.boxes import BARE, box, burst, turned_inside_out, with_fixed_step

pytestmark = pytest.mark.dolfinx

STABLE, CFL = 1e-7, 0.8
WANTED = CFL * STABLE
AFTER = 2e-3  # s, when nothing burns any more


def control(*, local=False, fixed=None, macro_step=np.inf, fastest=1e9, **changed):
    """Control of steps whose cells burn until 1 ms."""
    levels, burning = SimpleNamespace(step=macro_step, contact=False), SimpleNamespace(end=1e-3, fastest=fastest)
    choice = TimeStep(cfl=CFL, fixed=fixed, subcycling=local)
    one = StepControl(None, choice, levels, burning, SimpleNamespace(any=False))
    one.stable_step = STABLE
    for name, value in changed.items():
        setattr(one, name, value)
    return one


def test_a_step_is_a_share_of_the_stable_one_or_fixed():
    assert control().next_step(AFTER, np.inf) == pytest.approx(WANTED, rel=1e-12)
    assert control(fixed=7e-8).next_step(AFTER, np.inf) == 7e-8
    assert control(local=True, macro_step=0.5 * WANTED).next_step(AFTER, np.inf) == 0.5 * WANTED


@pytest.mark.parametrize(("time", "step"), [(0.9e-3, 2.5e-10), (1.1e-3, WANTED)])
def test_no_cell_burns_by_more_than_a_quarter_in_a_step(time, step):
    """While anything burns; a fixed step stays what it is."""
    assert control().next_step(time, np.inf) == pytest.approx(step, rel=1e-12)
    assert control(fixed=7e-8).next_step(time, np.inf) == 7e-8
    assert control(fastest=1e6).next_step(time, np.inf) == pytest.approx(WANTED, rel=1e-12)


def test_a_step_is_at_most_a_twentieth_longer_than_the_one_before():
    assert control(uncut_step=1e-8).next_step(AFTER, np.inf) == pytest.approx(1.05e-8, rel=1e-12)
    assert control(uncut_step=1e-6).next_step(AFTER, np.inf) == pytest.approx(WANTED, rel=1e-12)


@pytest.mark.parametrize(
    ("left", "expected"), [(0.7, 0.7), (1.0, 1.0), (1.5, 0.75), (1.9, 0.95), (2.5, 1.0), (40, 1.0)]
)
def test_an_output_is_met_by_two_equal_steps_rather_than_a_tiny_one(left, expected):
    """And what was wanted is remembered, so that the next step need not grow from what was left."""
    one = control()
    assert one.next_step(AFTER, AFTER + left * WANTED) == pytest.approx(expected * WANTED, rel=1e-8)
    assert one.uncut_step == pytest.approx(WANTED, rel=1e-12)


@pytest.mark.parametrize(
    ("chosen", "since", "in_turn", "due"),
    [
        (1.05, 20, False, False),  # hardly longer than what cells bear now
        (1.05, 16, True, True),  # its time has come
        (1.2, 3, False, False),  # much longer, but chosen just now
        (1.2, 5, False, True),
        (2.2, 1, False, True),  # more than twice as long: at once
        (0.5, 9, False, False),
    ],
)  # fmt: skip
def test_levels_are_chosen_again_when_due_and_early_where_cells_have_got_thin(chosen, since, in_turn, due):
    """`chosen` macro step over the wanted one, and how many of those ago."""
    step, again = chosen * WANTED, AFTER if in_turn else np.inf
    one = control(local=True, macro_step=step, chosen_at=AFTER - since * step, choose_again=again)
    assert one.levels_are_due(AFTER) is due
    assert not control(macro_step=step, chosen_at=0.0, choose_again=0.0).levels_are_due(AFTER)  # all take one step


@pytest.mark.parametrize(("before", "after"), [(2, 3), (3, 1), (0, 2)])
def test_the_step_of_contact_is_the_same_before_and_after_a_choice_of_levels(before, after):
    grid = namedtuple("grid", ["stable", "longest"])(np.full(2, STABLE), 0.0)
    charge = SimpleNamespace(ignition_time=np.full(2, np.inf), burn_rate=np.ones(2))
    blocks = SimpleNamespace(cell_levels=np.zeros(2, dtype=int), by_cell=lambda values: values)
    mesh = SimpleNamespace(comm=SimpleNamespace(size=1))
    levels = SimpleNamespace(step=WANTED, contact=True, contact_level=before)

    def choose(*_):
        levels.contact_level = after
        return blocks.cell_levels

    levels.choose = choose
    fields = SimpleNamespace(blocks=blocks, grid=grid, charge=charge, mesh=mesh, at_rest_until=np.zeros(2))
    one = control(_levels=levels, _fields=fields, contact_step=WANTED, uncut_step=WANTED)
    np.testing.assert_array_equal(one.choose_levels(AFTER), blocks.cell_levels)
    assert one.uncut_step / 2**after == pytest.approx(WANTED / 2**before, rel=1e-12)


@pytest.mark.parametrize("highest", [0, 1, 3, 7])
def test_cells_end_a_step_with_the_substeps_that_their_own_step_divides(highest):
    """Of 2^highest substeps those of level l end one with every 2^(highest - l): all of that level or a higher one."""
    for substep in range(2**highest + 1):
        ends = [level for level in range(highest + 1) if substep % 2 ** (highest - level) == 0]
        assert min_level(substep, highest) == ends[0]


def charge_of(cells=6, size=2e-3):
    mesh = box((1, 1, cells), (size, size, cells * size), Part.CHARGE)
    return burst(mesh, BARE, ignition=(IgnitionPoint(0.0, (0.5 * size, 0.5 * size)),))


def test_cells_that_a_front_may_reach_before_the_next_choice_and_those_behind_it_step_with_the_burn():
    """A front may come sooner than timed by the square root of 27/32; products are kept for twenty burning times."""
    solver = charge_of()
    charge, state = solver.fields.charge, solver.fields
    rate, step, now = 1e8, 1e-8, 1e-5
    horizon = now + 16 * step
    charge.burn_rate[:] = rate
    sooner = np.sqrt(27.0 / 32.0)
    charge.ignition_time[:] = [horizon / sooner, 1.25 * horizon, now - 19.0 / rate, now - 21.0 / rate, now, np.inf]
    state.grid.stable[:] = 1e-6
    solver.time = now
    seen = {}

    def choose(allowed, whole, contact_step):
        seen["own"], seen["whole"], seen["contact"] = allowed(step), whole, contact_step
        return np.zeros(6, dtype=np.int8)

    solver.levels.choose = choose
    solver.levels.step = step
    solver.choose_levels()
    burns = 0.25 / rate
    held = np.array([True, False, True, False, True, False])
    assert seen["own"][held] == pytest.approx(burns, rel=1e-12)
    # Below sin(pi/4) of its stable step a cell does not resonate with a neighbour's of half its length.
    free = seen["own"][~held] / 1e-6
    assert (free < np.sin(np.pi / 4.0)).all()
    assert (free > 0.95 * np.sin(np.pi / 4.0)).all()
    assert seen["whole"] == pytest.approx(burns, rel=1e-12)
    assert seen["contact"] is None
    assert solver.control.chosen_at == now
    assert solver.control.choose_again == pytest.approx(now + 16 * step, rel=1e-12)
    charge.ignition_time[:] = np.inf
    solver.choose_levels()
    assert seen["whole"] == pytest.approx(BARE.time_step.cfl * 1e-6, rel=1e-12)


def test_the_step_of_contact_at_rest_lets_no_cell_burn_by_more_than_a_quarter():
    solver = charge_of()
    assert solver.control.contact_step == pytest.approx(0.25 / solver.fields.charge.burn_rate.max(), rel=1e-12)


def burning(ignition, rate):
    charge = SimpleNamespace(ignition_time=np.array(ignition), burn_rate=np.array(rate))
    return BurningTimes(SimpleNamespace(charge=charge, mesh=SimpleNamespace(comm=MPI.COMM_SELF)))


def test_the_burn_ends_with_the_last_cell_and_its_front_is_reflected_for_ten_microseconds():
    found = burning([1e-5, 3e-5, np.inf, 0.0], [1e6, 5e5, 1e9, 0.0])
    assert found.fastest == 1e6
    assert found.end == pytest.approx(3.2e-5, rel=1e-12)
    assert found.front_until == pytest.approx(4.2e-5, rel=1e-12)
    nothing = burning([np.inf], [1e6])
    assert nothing.end == 0.0
    assert np.isfinite(0.25 / nothing.fastest)
    assert 0.25 / nothing.fastest > 1e9


def test_a_step_that_is_no_number_stops_the_run_and_a_rank_without_a_cell_has_nothing_to_lose():
    state = SimpleNamespace(mesh=SimpleNamespace(comm=MPI.COMM_SELF))
    with pytest.raises(NumericalStop, match="the stable step is NaN"):
        check_cells(state, SimpleNamespace(smallest_volume=np.array([1.0, 2.0])), np.nan, 3e-6)
    check_cells(state, SimpleNamespace(smallest_volume=np.zeros(0)), np.inf, 0.0)


def test_the_message_says_which_cell_is_lost_and_where_it_is_now():
    """Number, part, round, station from the nose (mm), and its centre now (mm)."""
    solver = burst(box((1, 1, 5), (0.02, 0.04, 0.1)))
    solver.fields.nodes.position[:] += [1.0, -2.0, 0.5]
    turned_inside_out(solver, 3)
    with pytest.raises(NumericalStop) as caught:
        solver.check_cells()
    words = "cell 3 of the casing of round 0, station 30.0 mm from the nose, now at (1010.0, -1980.0, 570.0) mm"
    assert words in str(caught.value)


@pytest.mark.parametrize("part", [Part.CASING, Part.CHARGE])
def test_work_of_a_force_and_of_damping_is_what_the_motion_gains_and_loses(part):
    """A rigid flight under a constant weight and a drag c m v: v follows m dv/dt = m g - c m v; energies close."""
    rate, weight = 2e4, 1e5
    solver = burst(box((1, 1, 1), (0.01,) * 3, part), with_fixed_step(BARE, 1e-7))
    mass = solver.fields.mass[:, None]

    def external(time, force):
        force += mass * [0.0, 0.0, weight]

    solver.loads = NodalLoads(solver.fields, rate, external)
    assert solver.loads.any
    assert NodalLoads(solver.fields, rate, None).any
    assert NodalLoads(solver.fields, 0.0, external).any
    assert not NodalLoads(solver.fields, 0.0, None).any
    solver.add_forces(0.0)
    end = 1e-4
    while solver.time < end * (1.0 - 1e-12):
        solver.step(end)
    whole = float(mass.sum())
    speed = weight / rate * (1.0 - np.exp(-rate * end))
    height = weight / rate * end - speed / rate
    found = solver.fields.nodes.velocity + 0.5 * solver.time_step * solver.fields.nodes.force / mass
    assert found[:, 2] == pytest.approx(speed, rel=1e-3)
    assert solver.ledger.external_work == pytest.approx(whole * weight * height, rel=1e-3)
    lost = whole * weight * height - 0.5 * whole * speed**2
    assert solver.ledger.damping == pytest.approx(lost, rel=2e-3)


def test_cells_take_steps_of_their_own_but_with_loads_or_a_fixed_step():
    mesh = box((1, 1, 1), (0.01,) * 3)
    assert burst(mesh, BARE).control.local
    assert not burst(mesh, with_fixed_step(BARE, 1e-7)).control.local
    assert not burst(mesh, replace(BARE, damping=1.0)).control.local
    assert not burst(mesh, BARE, external=lambda time, force: None).control.local


def choosing(edges):
    """A row of cells with these edges (m), for the choice of levels: a body none of whose nodes touch anything."""
    mesh = box((len(edges), 1, 1), (1.0, 0.01, 0.01))
    return Subcycling(burst(mesh, BARE).fields)


def graded(level):
    """The lowest levels not below the given ones that differ by one at most between neighbours in a row."""
    level = list(level)
    for k in [*range(1, len(level)), *range(len(level) - 2, -1, -1)]:
        near = [level[j] for j in (k - 1, k + 1) if 0 <= j < len(level)]
        level[k] = max(level[k], max(near) - 1)
    return level


@pytest.mark.parametrize("seed", range(6))
def test_no_other_macro_step_costs_less(seed):
    """Of all the smallest step times a power of two, up to a microsecond, with cells in steps that each bears."""
    random = np.random.default_rng(seed)
    bears = 1e-8 * 2.0 ** random.uniform(0.0, 9.0, 9)
    cycles = choosing(bears)
    whole = 1.1 * bears.min()
    level = cycles.choose(lambda step: bears, whole, None)
    costs = {whole: len(bears) / whole}
    for candidate in range(10):
        step = bears.min() * 2**candidate
        if step <= 1e-6:
            costs[step] = sum(2.0 ** max(int(np.ceil(np.log2(step / one) - 1e-9)), 0) for one in bears) / step
    best = min(costs, key=costs.get)
    assert cycles.step == pytest.approx(best, rel=1e-12)
    assert (cycles.step / 2.0**level <= bears * (1.0 + 1e-6)).all() or cycles.step == whole
    wanted = [max(int(np.ceil(np.log2(best / one) - 1e-9)), 0) for one in bears] if best != whole else [0] * 9
    assert level.tolist() == graded(wanted)
    assert cycles.contact_level == 0


def test_no_macro_step_is_longer_than_a_microsecond():
    cycles = choosing(np.ones(3))
    cycles.choose(lambda step: np.full(3, 0.9e-7), 1e-9, None)
    assert cycles.step == pytest.approx(0.9e-7, rel=1e-12)
    cycles.choose(lambda step: np.array([0.6e-7, 1e-3, 1e-3]), 1e-9, None)
    assert cycles.step == pytest.approx(0.96e-6, rel=1e-12)
    cycles.choose(lambda step: np.array([0.45e-7, 1e-3, 1e-3]), 1e-9, None)
    assert cycles.step == pytest.approx(0.72e-6, rel=1e-12)


@pytest.mark.parametrize(("slow", "level"), [(1e-9, 0), (16e-9, 2)])
def test_contact_keeps_its_step_and_the_macro_step_is_at_most_four_times_that(slow, level):
    cycles = choosing(np.ones(4))
    found = cycles.choose(lambda step: np.full(4, slow), 1e-9, 1e-9)
    assert cycles.contact_level == level
    assert cycles.step == pytest.approx(2.0**level * 1e-9, rel=1e-12)
    assert (cycles.step / 2.0**found <= slow * (1.0 + 1e-6)).all()


def test_cells_beside_contact_lie_one_level_below_it_at_most():
    cycles = choosing(np.ones(8))
    cycles._beside_contact[5] = True
    found = cycles.choose(lambda step: np.full(8, 1.0), 1e-12, 1e-9)
    assert cycles.contact_level == 2
    assert found.tolist() == [0, 0, 0, 0, 0, 1, 0, 0]
    # Where one step for all costs less, contact takes it as well.
    cycles.choose(lambda step: np.full(8, 1e-9), 5e-9, 1e-9)
    assert (cycles.step, cycles.contact_level) == (5e-9, 0)
