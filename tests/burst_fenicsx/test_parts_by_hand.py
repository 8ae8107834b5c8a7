"""Parts of the burst by themselves: bounds, what is near a plane, owners of nodes, counts and quantiles."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from mpi4py import MPI

from burst_fenicsx.contact.planes import PlaneContact
from burst_fenicsx.contact.sliding import SlidingInterface
from burst_fenicsx.contact.surfaces import contact_surfaces
from burst_fenicsx.kernels.cells.hourglass import _vector_square
from burst_fenicsx.kernels.geometry.shapes import min_corner_volume
from burst_fenicsx.mechanics.fields import make_fields
from burst_fenicsx.mechanics.material_tables import largest_pressure
from burst_fenicsx.meshing import HexahedralMesh, merge
from burst_fenicsx.meshing.distributed import distribute
from burst_fenicsx.problem import Part, RigidPlane, Round
from burst_fenicsx.records.measures import Measures, RoundMeasures, speed_quantiles
from tests.burst_fenicsx.boxes import BARE, COMP_B, STEEL, TNT, box, no_leakage, plain_inputs

pytestmark = pytest.mark.dolfinx

SOFT = replace(STEEL, elastic_modulus=1e9)
CUBE = np.array([[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)], dtype=float)


@pytest.mark.parametrize("modulus", [2e9, 210e9, 900e9])
def test_forces_are_rounded_for_the_largest_pressure_of_charge_and_casing(modulus):
    """Four times that of Chapman and Jouguet, rho D^2 / 4; and that of plates which meet at half their speed of sound.

    Each side takes a quarter of it, so that they bear rho c c / 4.
    """
    casing = replace(STEEL, elastic_modulus=modulus)
    jouguet = TNT.density * TNT.detonation_velocity**2 / 4.0
    shear = 0.5 * modulus / (1.0 + casing.poisson_ratio)
    sound = np.sqrt(2.0 * shear * (1.0 - casing.poisson_ratio) / (1.0 - 2.0 * casing.poisson_ratio) / casing.density)
    plates = casing.density * sound * 0.25 * sound
    assert largest_pressure(Round("round", TNT, casing)) == pytest.approx(max(4.0 * jouguet, plates), rel=1e-12)


def test_forces_are_rounded_for_the_strongest_of_all_rounds():
    """The order of the rounds and a weaker one beside the strongest change nothing."""
    mesh = box((1, 1, 2), (0.01, 0.01, 0.02), Part.CHARGE)
    mesh = replace(mesh, round=np.array([0, 1], dtype=np.int32), lengths=(0.02, 0.02))
    weak = replace(TNT, detonation_velocity=0.3 * TNT.detonation_velocity)
    found = []
    for explosives in ((COMP_B, weak), (weak, COMP_B), (COMP_B, COMP_B), (weak, weak)):
        distributed = distribute(MPI.COMM_SELF, mesh)
        rounds = [Round(name, explosive, SOFT) for name, explosive in zip("ab", explosives, strict=True)]
        inputs = plain_inputs(distributed, mesh, no_leakage(BARE, MPI.COMM_SELF))
        found.append(make_fields(distributed, rounds, BARE, **inputs).nodes.rounding)
    assert found[0] == found[1] == found[2]
    assert found[3] < found[0]


def hourglass_vectors(corner):
    """Flanagan and Belytschko's vectors (4, 8) of a hexahedron, its modes' moments (4, 3), mean gradients (8, 3)."""
    modes = np.array([CUBE[:, 1] * CUBE[:, 2], CUBE[:, 2] * CUBE[:, 0], CUBE[:, 0] * CUBE[:, 1], CUBE.prod(axis=1)])
    gradient, volume = np.zeros((8, 3)), 0.0
    for point in CUBE / np.sqrt(3.0):
        shape = 1.0 + CUBE * point
        local = 0.125 * CUBE * np.stack([shape[:, 1] * shape[:, 2], shape[:, 2] * shape[:, 0],
                                         shape[:, 0] * shape[:, 1]], axis=1)  # fmt: skip
        jacobian = local.T @ corner
        volume += np.linalg.det(jacobian)
        gradient += np.linalg.det(jacobian) * local @ np.linalg.inv(jacobian).T
    moments = modes @ corner
    return modes - moments @ (gradient / volume).T, moments, gradient / volume


def test_no_hourglass_vector_is_longer_than_its_bound():
    """Of hexahedra at random; and axes may be exchanged."""
    random = np.random.default_rng(5)
    tightest = 0.0
    for _ in range(100):
        corner = (CUBE + random.uniform(-0.5, 0.5, CUBE.shape)) * random.uniform(0.2, 1.0, 3)
        vectors, moments, gradient = hourglass_vectors(corner)
        norms = np.linalg.norm(gradient, axis=0)
        for vector, moment in zip(vectors, moments, strict=True):
            bound = _vector_square(tuple(moment), tuple(norms))
            assert vector @ vector <= bound * (1.0 + 1e-12)
            tightest = max(tightest, vector @ vector / bound)
            for turn in ([1, 2, 0], [2, 0, 1]):
                assert _vector_square(tuple(moment[turn]), tuple(norms[turn])) == pytest.approx(bound, rel=1e-12)
    assert tightest > 0.7
    assert _vector_square((0.0, 0.0, 0.0), (1.0, 2.0, 3.0)) == pytest.approx(8.0, rel=1e-12)


def test_the_smallest_corner_is_the_smallest_triple_product_of_its_edges():
    """Of hexahedra at random, some of them folded, whose nodes have any numbers."""
    random = np.random.default_rng(6)
    folded = 0
    for _ in range(60):
        nodes = random.permutation(11)[:8]
        position = random.normal(size=(11, 3))
        position[nodes] = CUBE + random.uniform(-1.2, 1.2, CUBE.shape)
        corners = []
        for k in range(8):
            # Towards the neighbours along x, y and z; their triple product is positive where both of two flips or none
            # turn an axis round.
            edges = [position[nodes[k ^ (1 << axis)]] - position[nodes[k]] for axis in range(3)]
            corners.append(-np.prod(CUBE[k]) * np.linalg.det(edges))
        folded += min(corners) < 0.0
        assert min_corner_volume(position, nodes) == pytest.approx(min(corners), rel=1e-9, abs=1e-12)
    assert 10 < folded < 50


@pytest.mark.parametrize(("seen", "later"), [(8e3, 16e3), (500.0, 10e3)])
def test_no_node_comes_to_a_plane_unseen(seen, later):
    """As fast as is allowed for, twice what was seen or 10 km/s, from any distance: it is near before it passes."""
    distance = np.arange(0.05e-3, 30e-3, 0.05e-3)
    normal, level, step, reach = np.array([0.0, 0.6, 0.8]), 0.03, 2e-9, 6e-3
    nodes = SimpleNamespace(
        position=np.outer(level + distance, normal), velocity=np.tile(-seen * normal, (len(distance), 1))
    )
    fields = SimpleNamespace(nodes=nodes)
    plane = RigidPlane("wall", tuple(level * normal), tuple(normal))
    rows = np.arange(len(distance))
    contact = PlaneContact(plane, fields, rows, len(rows), reach)
    contact._find_near(step)
    nodes.velocity[:] = -later * normal
    shown = 0
    for _ in range(600):
        nodes.position[:] = nodes.position + step * nodes.velocity
        contact._find_near(step)
        passed = np.flatnonzero(nodes.position @ normal < level)
        assert np.isin(passed, contact.near).all()
        shown = max(shown, len(contact.near) - len(passed))
        assert len(contact.near) < len(rows)
    assert len(passed) > 200
    assert shown > 5


def test_a_node_belongs_to_the_round_of_its_faces_at_whichever_of_their_corners():
    """Four cells of a charge around an axis, each turned so that the node on top is the last corner of its faces."""
    corner = np.array([(1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 0), (1, 0, 1), (1, 1, 1), (0, 1, 1), (0, 0, 1)])
    quarter = np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]])
    corners = np.concatenate([corner @ np.linalg.matrix_power(quarter, number).T for number in range(4)])
    nodes, cells = np.unique(corners, axis=0, return_inverse=True)
    cells = cells.reshape(4, 8)
    assert len(nodes) == 18
    assert len(set(cells[:, 7].tolist())) == 1
    whole = np.zeros(4, dtype=np.int32)
    charge = HexahedralMesh(
        nodes=0.01 * nodes + [0.1, 0.0, 0.0], cells=cells.astype(np.int64),
        part=np.full(4, Part.CHARGE, dtype=np.int32), round=whole + 1,
        segment=whole - 1, station=np.zeros(4), segments=((),), lengths=(0.01,),
    )  # fmt: skip
    assert (charge.volumes > 0.0).all()
    mesh = merge([replace(box((1, 1, 1), (0.01, 0.01, 0.01)), segments=((),)), charge])
    surfaces = contact_surfaces(mesh)
    of_node = np.zeros(len(mesh.nodes), dtype=int)
    of_node[mesh.cells] = mesh.round[:, None]
    np.testing.assert_array_equal(surfaces.node_round, of_node[surfaces.node])
    assert set(surfaces.node_round.tolist()) == {0, 1}


class OtherRank:
    """A communicator of two ranks, of which the other one adds its own values."""

    size, rank = 2, 0

    def __init__(self, values):
        self.values = values

    def Allreduce(self, inplace, array):
        """As mpi4py's."""
        assert inplace is MPI.IN_PLACE
        array += self.values


def test_what_a_checkpoint_keeps_of_sliding_contacts_is_that_of_all_ranks():
    own = np.array([1.0, 0.0, 3.0])
    of_two = SimpleNamespace(_comm=OtherRank(np.array([0.0, 2.0, 0.0])))
    assert SlidingInterface._summed(of_two, own.copy()).tolist() == [1.0, 2.0, 3.0]
    assert SlidingInterface._summed(SimpleNamespace(_comm=MPI.COMM_SELF), own.copy()).tolist() == own.tolist()


def test_distortion_counts_lost_folded_and_released_cells_of_all_images():
    part = np.array([Part.CASING] * 5 + [Part.CHARGE] * 4)
    mark = np.zeros((3, 9), dtype=bool)
    lost, folded, released = mark
    lost[[4]], folded[[0, 1, 5]], released[[1, 2, 3, 6, 7]] = True, True, True
    state = SimpleNamespace(
        folded=lambda: folded, volumes=lambda: np.where(lost, -1e-9, 1e-9), eroded=released,
        mesh=SimpleNamespace(part=part, cell_sums=lambda values: values.sum(axis=0)), cell_mass=2.0 ** np.arange(9.0),
    )  # fmt: skip
    measures = SimpleNamespace(_state=state, _images=4)
    found = Measures.distortion(measures)
    assert (found.lost, found.folded, found.released) == (4, 12, 20)
    assert (found.folded_casing_mass, found.released_casing_mass) == (4 * (1 + 2), 4 * (2 + 4 + 8))


def measured(speed, mass):
    nothing = np.zeros(0)
    return RoundMeasures(nothing, nothing, nothing, nothing, nothing, np.asarray(speed), np.asarray(mass))


def test_quantiles_of_speed_are_those_of_the_mass():
    """A mass that grows evenly with the speed: the speed itself, whatever the whole mass and however it is shared."""
    speed = np.linspace(0.0, 1000.0, 2001)[1::2]  # of cells of 1 m/s, at their middles
    for whole in (0.02, 7.0):
        mass = np.full(1000, whole / 1000)
        both = [measured(speed[:300], mass[:300]), measured(speed[300:], mass[300:])]
        for rounds in ([measured(speed, mass)], both, both[::-1]):
            found = speed_quantiles(rounds)
            assert found == {"90": pytest.approx(900.0, abs=0.01), "99": pytest.approx(990.0, abs=0.01)}
    # Three quarters of the mass at 100 m/s, the rest at 500: on the line between the middles of both, 0.375 and 0.875.
    assert speed_quantiles([measured([500.0, 100.0], [0.5, 1.5])])["90"] == 500.0
    assert speed_quantiles([measured([500.0, 100.0], [0.1, 0.9])])["90"] == pytest.approx(100.0 + 400.0 * 0.45 / 0.5)
    assert speed_quantiles([measured([], [])]) == {"90": 0.0, "99": 0.0}
