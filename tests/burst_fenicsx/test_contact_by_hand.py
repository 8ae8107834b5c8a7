"""What holds a burst's contact together: budget of stiffness, penetrations, impulses, whom it may push and when."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from mpi4py import MPI

from burst_fenicsx.contact import ContactForces
from burst_fenicsx.contact.accounting import CONTACT_FORCES, NodeContact, PlaneImpulse
from burst_fenicsx.contact.collisions import CollidingSurfaces
from burst_fenicsx.contact.forces import Penetrations, max_squared_phase
from burst_fenicsx.contact.sliding import SlidingInterface
from burst_fenicsx.kernels.vectors.exact import quantise, rounding_constant
from burst_fenicsx.problem import ContactSettings, RigidPlane, TimeStep
from tests.burst_fenicsx.boxes import BARE, box, burst

pytestmark = pytest.mark.dolfinx

WALL = RigidPlane("wall", (0.0, 0.0, -0.01), (0.0, 0.0, 2.0))


@pytest.mark.parametrize("cfl", [0.2, 0.5, 0.8, 0.95])
def test_springs_and_cells_together_stay_stable_and_use_nearly_all(cfl):
    """(omega dt)^2 of the cells, 4 c^2, and of the springs add up to less than 4: to nine tenths of what is left."""
    left = 4.0 - 4.0 * cfl**2
    assert 0.85 * left < max_squared_phase(TimeStep(cfl=cfl)) < 0.95 * left


def test_a_fixed_step_leaves_the_springs_less_than_a_fifth():
    """It may be near the stable one, whatever the CFL number says."""
    budget = max_squared_phase(TimeStep(fixed=1e-9, cfl=0.1))
    assert budget == max_squared_phase(TimeStep(fixed=1e-7, cfl=0.9))
    assert budget == pytest.approx(max_squared_phase(TimeStep(cfl=0.9)), rel=1e-12)


class Noted:
    """A part of contact that notes what it is asked for."""

    def __init__(self, deepest=0.0, interior=0.0, given=0.0):
        self.deepest, self.deepest_interior = deepest, interior
        self.given = np.full((2, 3), given)
        self.budgets, self.searches = [], 0
        self.due = False

    def add_forces(self, budget, step, velocity, force, bins=None):
        """As every part's; gives no force."""
        self.budgets.append(budget)

    def search_is_due(self, step):
        """As of colliding surfaces."""
        return self.due

    def search(self):
        """As of colliding surfaces."""
        self.searches += 1


def forces(**parts):
    """Contact made of such parts."""
    empty = {"interface": None, "collisions": None, "planes": []}
    return SimpleNamespace(**{**empty, **parts}, penetrations=Penetrations(), force=None, impulse=Impulse())


class Impulse:
    """What planes have given, as it was added."""

    constants = (1.0, 1.0)

    def __init__(self):
        self.added = []

    def add(self, step, force):
        """As of `PlaneImpulse`."""
        self.added.append((step, force))


def test_the_deepest_penetrations_so_far_are_kept_each_in_its_place():
    found = forces(interface=Noted(), collisions=Noted(), planes=[Noted(), Noted()])
    names = ("interface_at_front", "interface_after", "collision", "interior_collision", "plane", "interior_plane")
    largest = dict.fromkeys(names, 0.0)
    for number, depth in enumerate((3.0, 7.0, 2.0, 6.0)):
        found.interface.deepest = depth
        found.collisions.deepest, found.collisions.deepest_interior = 10.0 + depth, 20.0 + depth
        for k, plane in enumerate(found.planes):
            plane.deepest, plane.deepest_interior = 30.0 + (depth if k == number % 2 else 0.0), 40.0 + depth * k
        at_front = number in (0, 3)
        ContactForces._join(found, 1.0, 1e-6, None, front_is_active=at_front)
        ContactForces._collide(found, 1.0, 1e-6, None)
        ContactForces._push_from_planes(found, 1.0, 1e-6, None)
        now = dict(zip(names, (depth * at_front, depth * (not at_front), 10.0 + depth, 20.0 + depth, 30.0 + depth,
                               40.0 + depth), strict=True))  # fmt: skip
        largest = {name: max(largest[name], now[name]) for name in names}
        assert vars(found.penetrations) == largest
    assert largest["interface_at_front"] == 6.0
    assert largest["interface_after"] == 7.0


def test_the_largest_of_all_is_that_of_outer_nodes():
    for place in range(4):
        values = [1.0, 1.0, 1.0, 1.0]
        values[place] = 5.0
        assert Penetrations(*values, 9.0, 9.0).largest == 5.0


def test_surfaces_and_planes_share_the_budget():
    """Where both push one node its springs are as stiff together as one of them alone; neither gets next to nothing."""
    both = forces(collisions=Noted(), planes=[Noted()])
    alone = forces(collisions=Noted())
    for one in (both, alone):
        ContactForces._collide(one, 8.0, 1e-6, None)
        ContactForces._push_from_planes(one, 8.0, 1e-6, None)
    (of_surfaces,), (of_plane,) = both.collisions.budgets, both.planes[0].budgets
    assert of_surfaces + of_plane == pytest.approx(8.0, rel=1e-12)
    assert min(of_plane, of_surfaces) > 8.0 / 3.0
    assert alone.collisions.budgets == [8.0]
    assert alone.impulse.added == []


def test_surfaces_are_searched_where_it_is_due():
    found = forces(collisions=Noted())
    for due, searches in ((False, 0), (True, 1), (False, 1), (True, 2)):
        found.collisions.due = due
        ContactForces._collide(found, 1.0, 1e-6, None)
        assert found.collisions.searches == searches


def test_all_planes_together_give_the_impulse():
    found = forces(planes=[Noted(given=2.0), Noted(given=5.0)])
    ContactForces._push_from_planes(found, 1.0, 3e-6, None)
    ((step, force),) = found.impulse.added
    assert step == 3e-6
    np.testing.assert_array_equal(force, np.full((2, 3), 7.0))


class TwoAlike:
    """A communicator of two ranks that hold the same."""

    def __init__(self, rank=0):
        self.size, self.rank, self.messages = 2, rank, 0

    def allreduce(self, value, op=MPI.SUM):
        """As mpi4py's."""
        self.messages += 1
        return 2 * value if op == MPI.SUM else value


def impulse_of(comm):
    index_map = SimpleNamespace(size_global=100)
    domain = SimpleNamespace(geometry=SimpleNamespace(index_map=lambda: index_map))
    fields = SimpleNamespace(
        nodes=SimpleNamespace(rounding=rounding_constant(1e6)), mesh=SimpleNamespace(domain=domain)
    )
    return PlaneImpulse(comm, fields)


@pytest.mark.parametrize("comm", [MPI.COMM_SELF, TwoAlike()])
def test_the_impulse_of_a_force_that_grows_evenly_is_exact(comm):
    """F = a t from rest: a t^2 / 2, by steps of any size; half of the force lies in each of two bins."""
    found, growth, time = impulse_of(comm), np.array([2e9, -1e9, 5e8]), 0.0
    steps = [1e-6, 3e-6, 0.5e-6, 2e-6, 2e-6]
    for step in steps[:3]:
        time += step
        found.add(step, np.stack([0.5 * growth * time] * 2))
    assert found.given() == pytest.approx(comm.size * 0.5 * growth * time**2, rel=1e-12)
    again = impulse_of(comm)
    again.restore(found.state())
    assert found.state()[3:] == pytest.approx(comm.size * growth * time, rel=1e-12)
    for step in steps[3:]:
        time += step
        for one in (found, again):
            one.add(step, np.stack([0.5 * growth * time] * 2))
    np.testing.assert_array_equal(found.given(), again.given())
    assert found.given() == pytest.approx(comm.size * 0.5 * growth * time**2, rel=1e-12)


def test_ranks_are_asked_for_the_impulse_only_where_it_is_wanted():
    comm = TwoAlike()
    found = impulse_of(comm)
    for _ in range(5):
        found.add(1e-6, np.ones((2, 3)))
    assert comm.messages == 0
    found.given()
    found.given()
    assert comm.messages == 1
    assert impulse_of(MPI.COMM_SELF).given().tolist() == [0.0, 0.0, 0.0]


def test_contact_of_nodes_gives_the_energies_of_all_of_them():
    energies = np.array([[1.0, 2.0], [8.0, 16.0], [64.0, 128.0]])
    rounding = SimpleNamespace(grid=SimpleNamespace(rounding=rounding_constant(1e3)))
    found = NodeContact.energies.fget(SimpleNamespace(state=SimpleNamespace(energies=energies), _fields=rounding))
    assert found.tolist() == [73.0, 146.0]


def test_contacts_of_many_kinds_on_one_node_are_summed_exactly():
    """Forces of two hundred times the largest one of a cell: in any order the same to the last bit."""
    largest = 3e4
    rounding = CONTACT_FORCES * rounding_constant(largest)
    values = np.random.default_rng(3).uniform(50.0, 200.0, 8) * largest
    rounded = quantise(values, rounding)
    np.testing.assert_allclose(rounded, values, rtol=0.0, atol=CONTACT_FORCES * largest / 2.0**50)
    sums = {float(np.add.accumulate(np.random.default_rng(k).permutation(rounded))[-1]) for k in range(50)}
    assert len(sums) == 1
    assert sums.pop() < 4.0 * CONTACT_FORCES * largest
    # a multiple of the cells' own quantum that is a power of two: sums with their forces are exact as well
    assert 2.0 ** round(np.log2(CONTACT_FORCES)) == CONTACT_FORCES


def contact_of(mesh, surfaces, planes=()):
    settings = replace(BARE, contact=ContactSettings(surfaces=surfaces), planes=planes)
    return ContactForces(mesh, burst(mesh, settings).fields, settings)


@pytest.mark.parametrize(("surfaces", "planes"), [(False, ()), (False, (WALL,)), (True, ()), (True, (WALL, WALL))])
def test_what_may_touch_follows_the_settings(surfaces, planes):
    """Without colliding surfaces and planes nothing; a plane alone needs the nodes of the casing."""
    contact = contact_of(box((2, 2, 2), (0.02,) * 3), surfaces, planes)
    assert contact.exists == (surfaces or bool(planes))
    assert (contact.surfaces is not None) == (surfaces or bool(planes))
    assert (contact.collisions is not None) == surfaces
    assert len(contact.planes) == len(planes)
    assert contact.interface is None
    # The node in the middle of a lone body is on no surface, but a plane must not let it pass.
    assert contact.touched.sum() == (27 if planes else 26 if surfaces else 0)
    assert [int((contact.touched == 0).argmax())] == ([0] if not contact.exists or planes else [13])
    for plane in contact.planes:
        assert len(plane.rows) == 27
        assert plane._on_surface == 26
        assert plane._level == pytest.approx(-0.01)
        assert plane._normal.tolist() == [0.0, 0.0, 1.0]
    if not contact.exists:
        before = contact._fields.nodes.force.copy()
        contact.add_forces(1e-6, 1e-6, front_is_active=False)
        np.testing.assert_array_equal(contact._fields.nodes.force, before)


def test_before_the_first_step_there_is_no_force():
    """A box that lies in a wall from the start is pushed out once there is a step for which springs are stable."""
    inside = RigidPlane("wall", (0.0, 0.0, 0.005), (0.0, 0.0, 1.0))
    contact = contact_of(box((1, 1, 1), (0.02,) * 3), False, (inside,))
    contact.add_forces(0.0, 0.0, front_is_active=False)
    assert np.abs(contact.force).max() == 0.0
    contact.add_forces(1e-6, 0.0, front_is_active=False)
    assert (contact.force[:, 2] > 0.0).sum() == 4


def test_who_may_be_pushed_is_found_again_where_that_has_changed():
    plane, collisions = SimpleNamespace(pushed=np.array([5, 2])), SimpleNamespace(pushed=np.array([2, 7]))
    contact = SimpleNamespace(
        planes=[plane], collisions=collisions, _met=[], _always=np.array([1]), _pushed=np.array([1]),
        force=np.zeros((9, 3)),
    )  # fmt: skip
    contact._any_of = lambda *parts: ContactForces._any_of(contact, *parts)
    ContactForces._find_pushed(contact)
    assert contact._pushed.tolist() == [1, 2, 5, 7]
    before = contact._pushed
    ContactForces._find_pushed(contact)
    assert contact._pushed is before
    collisions.pushed = np.array([8])
    ContactForces._find_pushed(contact)
    assert contact._pushed.tolist() == [1, 2, 5, 8]
    contact.collisions = None
    ContactForces._find_pushed(contact)
    assert contact._pushed.tolist() == [1, 2, 5]


@pytest.mark.parametrize("own", [[0, 1, 2, 3], [2, 3]])
def test_faces_of_torn_cells_are_dropped_once(own):
    """Cells go by their numbers in the whole mesh; products leave them at every look, faces go at the first."""
    calls = []
    interface = SimpleNamespace(leave_eroded=lambda torn: calls.append(("leave", torn.tolist())))
    mesh = SimpleNamespace(cell=np.array([5, 3, 0, 2]))
    contact = SimpleNamespace(
        _fields=SimpleNamespace(mesh=mesh), torn=np.zeros(6, dtype=bool), comm=MPI.COMM_SELF, interface=interface,
        restore_torn=lambda torn: calls.append(("drop", torn.tolist())),
    )  # fmt: skip
    released = np.zeros(4, dtype=bool)
    ContactForces.drop_faces(contact, released)
    assert calls == []
    released[own[0]] = True
    torn = [number == mesh.cell[own[0]] for number in range(6)]
    ContactForces.drop_faces(contact, released)
    assert calls == [("drop", torn), ("leave", torn)]
    ContactForces.drop_faces(contact, released)
    assert calls[2:] == [("leave", torn)]
    contact.interface = None
    released[own[1]] = True
    ContactForces.drop_faces(contact, released)
    assert [name for name, _ in calls] == ["drop", "leave", "leave", "drop"]


def test_torn_faces_are_known_to_what_there_is():
    dropped = []
    collisions = SimpleNamespace(drop_faces=lambda torn, opened: dropped.append((torn.tolist(), opened)))
    opened = SimpleNamespace(opened=lambda torn: "opened")
    contact = SimpleNamespace(torn=np.zeros(3, dtype=bool), collisions=collisions, _torn_faces=None)
    torn = np.array([False, True, False])
    ContactForces.restore_torn(contact, np.zeros(3, dtype=bool))
    assert dropped == []
    ContactForces.restore_torn(contact, torn)
    contact._torn_faces = opened
    ContactForces.restore_torn(contact, torn)
    contact.collisions = None
    ContactForces.restore_torn(contact, torn)
    assert dropped == [(torn.tolist(), None), (torn.tolist(), "opened")]


def test_contacts_are_counted_as_bonded_touching_or_gone():
    """Of this rank's own alone."""
    contacts = SimpleNamespace(
        contact=np.array([0, 1, 2, 4, 5]), bonded=np.array([1, 1, 0, 1, 0, 0]),
        stiffness=np.array([5.0, 0.0, 5.0, 5.0, 5.0, 0.0]), off=np.array([0, 0, 0, 1, 1, 1]),
    )  # fmt: skip
    assert SlidingInterface.counts(SimpleNamespace(contacts=contacts)).tolist() == [2.0, 2.0, 2.0]


@pytest.mark.parametrize(("speed", "steps"), [(100.0, 51), (1000.0, 6)])
def test_surfaces_are_searched_again_before_two_of_them_can_have_met(speed, steps):
    """Each of two comes nearer by the largest speed: the reach of 10 mm is passed by both within half as many steps."""
    velocity = np.zeros((5, 3))
    velocity[3] = [0.0, 0.6 * speed, 0.8 * speed]
    surfaces = SimpleNamespace(
        _fields=SimpleNamespace(nodes=SimpleNamespace(velocity=velocity)), _local=np.array([1, 3], dtype=np.int32),
        _comm=MPI.COMM_SELF, travel=0.0, _reach=0.01,
    )  # fmt: skip
    due = [CollidingSurfaces.search_is_due(surfaces, 1e-6) for _ in range(steps)]
    assert due == [False] * (steps - 1) + [True]
    surfaces.travel, surfaces._local = 0.0, np.array([1, 2], dtype=np.int32)
    assert not any(CollidingSurfaces.search_is_due(surfaces, 1e-6) for _ in range(steps))
