"""DDESB TP-12's procedure: its printed values, closed forms, and what must not change it."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from flight import Drag, Fragments, InputError
from flight.hazard.criteria import Criteria, hit_probability
from flight.shape import FORGED_STEEL_SHELL, HEAVY_PIECES_OF_STACKS
from fragfield.hazard.tp12 import (
    MottField,
    PolarField,
    Retardation,
    beam_distance,
    effective_number,
    procedure,
    solid_angle,
    stack_distance,
)

PRINTED_AIR = 1.196  # kg/m3: that with which the paper's L1 = 247 and 369 m/kg^(1/3) both come out
CRITERIA = Criteria()
LIMIT = CRITERIA.density


def retardation(shape_factor: float = FORGED_STEEL_SHELL, **changes) -> Retardation:
    values = {"drag": Drag.constant(1.28), "density": PRINTED_AIR, "sound_speed": 340.0, **changes}
    return Retardation(shape_factor=shape_factor, **values)


def sphere(number: int, mass, speed: float = 1000.0, seed: int = 1) -> PolarField:
    """Fragments in all directions alike; cosines in even steps, so that every zone has its share."""
    cosine = 1.0 - (2.0 * np.arange(number) + 1.0) / number
    masses = np.broadcast_to(np.asarray(mass, dtype=float), number).copy()
    np.random.default_rng(seed).shuffle(masses)
    return PolarField(np.degrees(np.arccos(cosine)), masses, np.full(number, speed))


def mott_masses(number: int, mean: float) -> np.ndarray:
    """Masses of a Mott law of this mean at even quantiles: N(m) = n exp(-(2 m / m0)^(1/2))."""
    return 0.5 * mean * np.log((np.arange(number) + 0.5) / number) ** 2


@pytest.mark.parametrize(("shape_factor", "printed"), [(FORGED_STEEL_SHELL, 247.0), (HEAVY_PIECES_OF_STACKS, 369.0)])
def test_the_distance_of_one_e_folding_is_the_printed_one(shape_factor, printed):
    """L1 for k = 2.6 and 4.74 g/cm3 with C_D = 1.28 (p. 9 and 13); of 1 kg, and with the cube root of the mass."""
    found = retardation(shape_factor).distance([1.0, 0.008], 900.0, 900.0 / math.e)
    assert found == pytest.approx([printed, 0.2 * printed], rel=1.5e-3)


def test_fragments_are_hazardous_in_free_fall_from_the_printed_mass_on():
    """0.096 kg for 79 J and k = 4.74 g/cm3 (p. 14)."""
    assert retardation(HEAVY_PIECES_OF_STACKS).lightest_in_free_fall(79.0) == pytest.approx(0.096, abs=5e-4)


def test_the_acceptable_density_is_a_probability_of_about_one_per_cent():
    assert hit_probability(1.0 / (600.0 * 0.3048**2), CRITERIA.person_area) == pytest.approx(0.01, abs=5e-4)  # p. 12


def test_the_flight_against_a_drag_table_is_that_of_its_equation():
    table = Retardation(Drag.named("shell_fragment"), 1.225, 340.294, FORGED_STEEL_SHELL)
    mass, start, end = 0.03, 1500.0, 70.0

    def slope(_, speed):
        area = (mass / FORGED_STEEL_SHELL) ** (2.0 / 3.0)
        return -0.5 * table.drag.at(speed / 340.294) * 1.225 * speed * area / mass

    def slow(_, speed):
        return float(speed[0] - end)

    slow.terminal = True
    found = solve_ivp(slope, (0.0, 2000.0), [start], events=slow, rtol=1e-9, atol=1e-9)
    assert table.distance(mass, start, end) == pytest.approx(found.t_events[0][0], rel=1e-5)


def test_what_falls_freely_has_the_energy_at_its_terminal_speed():
    table = Retardation(Drag.named("shell_fragment"), 1.225, 340.294, FORGED_STEEL_SHELL)
    mass = table.lightest_in_free_fall(79.0)
    speed = math.sqrt(2.0 * 79.0 / mass)
    area = (mass / FORGED_STEEL_SHELL) ** (2.0 / 3.0)
    drag = 0.5 * float(table.drag.at(speed / 340.294)) * 1.225 * area * speed**2
    assert drag == pytest.approx(mass * table.gravity, rel=1e-9)


def test_reach_is_zero_below_the_energy_and_bounded_by_the_throw():
    air = retardation()
    heavy = 2.0 * air.lightest_in_free_fall(79.0)
    slow = math.sqrt(2.0 * 79.0 / 0.01)
    assert air.reach([0.01, 0.01], [0.999 * slow, 1.001 * slow], 79.0)[0] == 0.0
    assert 0.0 < air.reach(0.01, 1.001 * slow, 79.0) < 1.0
    assert air.reach(heavy, 30.0, 79.0) == pytest.approx(30.0**2 / air.gravity)
    light = 0.5 * air.lightest_in_free_fall(79.0)
    assert air.reach(light, 900.0, 79.0) == air.distance(light, 900.0, math.sqrt(2.0 * 79.0 / light))
    assert retardation(gravity=0.0).reach(heavy, 900.0, 79.0) == air.distance(heavy, 900.0, math.sqrt(158.0 / heavy))


@pytest.mark.parametrize("number", [1.0, 4.4, 40.0])
def test_the_printed_steps_close(number):
    """At the distance found the lightest hazardous fragment has just 79 J, and the density is one per 600 ft2."""
    single, air = MottField(1400.0, 0.011, 1200.0), retardation(HEAVY_PIECES_OF_STACKS)
    distance, lightest, free_fall = procedure(single, number, air, CRITERIA)
    one_fold = 2.0 * HEAVY_PIECES_OF_STACKS ** (2.0 / 3.0) / (1.28 * PRINTED_AIR)
    assert not free_fall
    energy = 0.5 * lightest * single.speed**2 * math.exp(-2.0 * distance / (one_fold * lightest ** (1.0 / 3.0)))
    assert energy == pytest.approx(79.0, rel=1e-6)
    density = number * single.per_steradian / distance**2 * math.exp(-math.sqrt(2.0 * lightest / single.mean_mass))
    assert density == pytest.approx(LIMIT, rel=1e-6)


def test_coarse_fragments_are_hazardous_by_free_fall():
    """Then R = (N Q0 / q)^(1/2) exp(-(2 m / m0)^(1/2) / 2) with m = 0.096 kg, the larger of the two solutions."""
    single, air = MottField(1000.0, 2.0, 1000.0), retardation(HEAVY_PIECES_OF_STACKS)
    distance, lightest, free_fall = procedure(single, 5000.0, air, CRITERIA)
    assert free_fall
    assert lightest == air.lightest_in_free_fall(79.0)
    assert distance == pytest.approx(math.sqrt(5000.0 * 1000.0 / LIMIT * math.exp(-math.sqrt(lightest))), rel=1e-9)
    alone, _, _ = procedure(single, 5000.0, retardation(HEAVY_PIECES_OF_STACKS, gravity=0.0), CRITERIA)
    assert distance > alone > 0.0


def test_without_air_the_inverse_square_law_alone_is_left():
    single = MottField(1400.0, 0.011, 1200.0)
    distance, _, _ = procedure(single, 3.0, retardation(density=0.0), CRITERIA)
    assert distance == pytest.approx(math.sqrt(3.0 * 1400.0 / LIMIT), rel=1e-6)


def test_a_mott_law_is_found_from_its_coarse_end():
    number, mean = 400_000, 0.012
    field = sphere(number, mott_masses(number, mean))
    found = MottField.fitted(field, 85.0, 95.0)
    assert found.mean_mass == pytest.approx(mean, rel=0.08)  # 5,000 fragments in the coarse end: 3 % of m0
    assert found.speed == pytest.approx(1000.0)
    inside = field.zone(85.0, 95.0)
    for mass in (0.03, 0.06):
        counted = (inside.mass > mass).sum() / solid_angle(85.0, 95.0)
        assert found.heavier(mass) == pytest.approx(counted, rel=0.05)
    whole = MottField.fitted(field, 0.0, 180.0)
    assert whole.mean_mass == pytest.approx(mean, rel=0.02)
    assert whole.per_steradian == pytest.approx(number / (4.0 * math.pi), rel=0.03)


def coarse_end(number: int, heavy: float) -> PolarField:
    """So many fragments of a mass (g), one of 2 g at seven tenths of the mass, the rest of 1 g, all across the axis."""
    rest = round((number * heavy + 1.0) / 0.7 - number * heavy - 2.0)
    mass = 1e-3 * np.array([heavy] * number + [2.0] + [1.0] * rest)
    return PolarField(np.full(len(mass), 90.0), mass, np.full(len(mass), 1000.0))


def test_the_law_of_the_coarse_end_by_hand():
    """Ten of 4 g above an edge of 2 g: m0^(1/2) = 8^(1/2) - 2, and ten a zone above the edge."""
    found = MottField.fitted(coarse_end(10, 4.0), 85.0, 95.0)
    root = math.sqrt(8e-3) - math.sqrt(4e-3)
    assert found.mean_mass == pytest.approx(root**2, rel=1e-9)
    assert found.heavier(2e-3) == pytest.approx(10.0 / solid_angle(85.0, 95.0), rel=1e-9)


def test_a_law_needs_ten_fragments_in_the_coarse_end_and_a_tenth_between_their_masses():
    with pytest.raises(InputError, match="9 fragments in the coarse end"):
        MottField.fitted(coarse_end(9, 4.0), 85.0, 95.0)
    MottField.fitted(coarse_end(10, 2.0 * 1.101**2), 85.0, 95.0)
    with pytest.raises(InputError, match="of different masses"):
        MottField.fitted(coarse_end(10, 2.0 * 1.099**2), 85.0, 95.0)


def test_a_stack_of_isotropic_rounds_is_the_closed_procedure():
    number, mean = 400_000, 0.012
    field = sphere(number, mott_masses(number, mean))
    law = MottField(number / (4.0 * math.pi), mean, 1000.0)
    expected, _, _ = procedure(law, 4.4, retardation(HEAVY_PIECES_OF_STACKS, density=1.225), CRITERIA)
    found = stack_distance(field, 4.4, CRITERIA)
    assert found.distance == pytest.approx(expected, rel=0.03)
    assert found.low <= 90.0 <= found.high == found.low + 10.0
    closed, _, _ = procedure(found.single, 4.4, retardation(4740.0, density=1.225), CRITERIA)
    assert found.distance == pytest.approx(closed, rel=1e-9)
    denser_air = stack_distance(field, 4.4, CRITERIA, density=1.4)
    assert denser_air.distance < found.distance < stack_distance(field, 8.0, CRITERIA).distance


def test_the_perpendicular_counts_not_the_ends():
    """Twice the fragments about the axis change nothing; a beam at 94 degrees is seen whole."""
    field = sphere(40_000, mott_masses(40_000, 0.012))
    ends = (field.polar < 60.0) | (field.polar > 120.0)
    more = PolarField(*(np.append(one, one[ends]) for one in (field.polar, field.mass, field.speed)))
    assert stack_distance(more, 2.0, CRITERIA) == stack_distance(field, 2.0, CRITERIA)
    beam = PolarField(94.0 + 0.02 * (field.polar - 90.0), field.mass, field.speed)
    found = stack_distance(beam, 2.0, CRITERIA)
    assert found.low <= 92.2
    assert found.high >= 95.8
    assert found.single.per_steradian == pytest.approx(40_000 / solid_angle(found.low, found.high), rel=0.03)


@pytest.mark.parametrize("number", [2000, 200_000])
def test_the_beam_of_equal_fragments_in_all_directions(number):
    """Few are too few before they are too slow, (n / (4 pi q))^(1/2); many count as far as they have the energy."""
    air = retardation()
    found = beam_distance(sphere(number, 0.02), air, CRITERIA)
    spread, reach = math.sqrt(number / (4.0 * math.pi * LIMIT)), float(air.reach(0.02, 1000.0, 79.0))
    assert (spread < reach) == (number == 2000)
    assert found.distance == pytest.approx(min(spread, reach), rel=0.02)
    assert found.high - found.low == pytest.approx(10.0)


@pytest.mark.parametrize("centre", [87.0, 90.0, 94.4, 100.0])
def test_no_edge_of_a_zone_cuts_a_beam(centre):
    generator = np.random.default_rng(3)
    polar = centre + generator.uniform(-2.0, 2.0, 4000)
    field = PolarField(polar, np.full(4000, 0.05), np.full(4000, 1000.0), realisations=2)
    air = retardation(density=0.0)
    found = beam_distance(field, air, CRITERIA)
    assert found.low <= polar.min()
    assert found.high >= polar.max()
    assert found.distance == pytest.approx(math.sqrt(2000.0 / solid_angle(found.low, found.high) / LIMIT))
    assert found.per_steradian == pytest.approx(2000.0 / solid_angle(found.low, found.high))


def test_a_narrower_zone_about_a_beam_gives_more():
    field = sphere(20_000, mott_masses(20_000, 0.012))
    beam = PolarField(94.0 + 0.02 * (field.polar - 90.0), field.mass, field.speed)
    wide, narrow = (beam_distance(beam, retardation(), CRITERIA, width=width).distance for width in (10.0, 5.0))
    assert wide < narrow < math.sqrt(2.0) * wide


def test_mixed_speeds_count_each_with_its_own():
    """Of two groups the fast one alone reaches far: its number decides there, both near."""
    fast, slow = sphere(3000, 0.02, 1500.0), sphere(300_000, 0.02, 200.0)
    field = PolarField(*(np.append(getattr(fast, n), getattr(slow, n)) for n in ("polar", "mass", "speed")))
    air = retardation()
    alone = beam_distance(fast, air, CRITERIA).distance
    near = float(air.reach(0.02, 200.0, 79.0))
    assert near < alone
    assert beam_distance(field, air, CRITERIA).distance == pytest.approx(alone, rel=1e-9)


def test_neither_attitude_nor_number_of_realisations_matters():
    generator = np.random.default_rng(5)
    velocity = generator.normal(size=(4000, 3)) * [300.0, 300.0, 60.0]
    mass = mott_masses(4000, 0.012)
    turn = np.linalg.qr(generator.normal(size=(3, 3)))[0]
    upright = Fragments(mass, (0.0, 0.0, 1.0), velocity)
    lying = Fragments(mass, (5.0, 0.0, 3.0), velocity @ turn.T)
    one = PolarField.of([upright])
    for other in (PolarField.of([lying], 2.0 * turn[:, 2]), PolarField.of([upright, upright, upright])):
        for find in (
            lambda field: beam_distance(field, retardation(), CRITERIA).distance,
            lambda field: stack_distance(field, 2.0, CRITERIA).distance,
        ):
            assert find(other) == pytest.approx(find(one), rel=1e-6)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: effective_number(1, 1, "erth"), r"cover is 'erth'.*earth"),
        (lambda: effective_number(-1, 1), "side is -1"),
        (lambda: effective_number(0, 0), "no round on the side"),
        (lambda: stack_distance(sphere(2000, mott_masses(2000, 0.01)), math.inf, CRITERIA), "effective number is inf"),
        (lambda: stack_distance(sphere(40, 0.01), 2.0, CRITERIA), "in the coarse end of the zone"),
        (
            lambda: stack_distance(sphere(4000, 0.01), 2.0, CRITERIA),
            "0 fragments in .* of different masses",
        ),
        (lambda: beam_distance(sphere(40, 0.01), retardation(), CRITERIA, width=0.5), "width is 0.5 degrees"),
        (lambda: PolarField.of([]), "no fragment"),
        (lambda: PolarField.of([Fragments(1.0, (0, 0, 0), (1, 0, 0))], (0, 0, 0)), "axis is"),
        (lambda: retardation(shape_factor=0.0), "shape_factor is 0.0 kg/m3, needed: above zero"),
        (lambda: retardation(density=-1.0), "density is -1.0 kg/m3, needed: zero or more"),
    ],
)
def test_messages(make, message: str) -> None:
    with pytest.raises(InputError, match=message):
        make()
