"""Ricochet: the law against the impact it is deduced from, and flights against closed forms."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import quad, solve_ivp

from flight import Cylinder, Fragments, HeightMap, InputError, Ricochet, Status, fly
from flight.hazard import Criteria, DensityGroups, Directions, PolarGrid, density_counts, expected_distance
from flight.hazard.exposed import Prism, count_exposed, surfaces_of
from flight.kernels.events import SLOWEST_LIFT, ricochet
from flight.scene.ricochet import EXPONENT, KINDS, RANGE
from tests.flight.clouds import GRAVITY, cloud


def shot(angle: float, speed: float = 300.0, mass: float = 1.0, height: float = 1.0) -> Fragments:
    """One fragment from a height (m) along +x, at an angle below the horizontal (degrees)."""
    turn = math.radians(angle)
    return Fragments(mass, (0.0, 0.0, height), (speed * math.cos(turn), 0.0, -speed * math.sin(turn)))


def test_forces_on_the_cap_of_a_sphere() -> None:
    """Pressure 1/2 rho v_n^2 on the front half of a shallow cap: lift pi/4 h^2, drag 0.754 h^2.5 (rho v^2 = R = 1)."""
    depth = 1e-4
    end = math.acos(1.0 - depth)
    front, front_cubed = math.pi / 2.0, 4.0 / 3.0  # integrals of cos^2 and cos^3 over the front half
    lift = 0.5 * front * quad(lambda a: math.sin(a) ** 3 * math.cos(a), 0.0, end)[0]
    drag = 0.5 * front_cubed * quad(lambda a: math.sin(a) ** 4, 0.0, end)[0]
    assert lift == pytest.approx(0.25 * math.pi * depth**2, rel=1e-3)
    assert drag == pytest.approx(0.754 * depth**2.5, rel=1e-3)


@pytest.mark.parametrize("ratio", [40.0, 400.0])
def test_the_form_of_the_law_is_that_of_the_sphere(ratio: float) -> None:
    """Sphere on an inertial medium, integrated: depth, symmetric departure, and the loss with the angle's 4/3 power."""
    mass = 4.0 / 3.0 * math.pi * ratio  # rho = R = 1

    def forces(_, state):
        h, u, w = state[1:]
        speed2, wet = u * u + w * w, max(h, 0.0)
        return [u, w, -0.754 * speed2 * wet**2.5 / mass, -0.25 * math.pi * speed2 * wet**2 / mass]

    def out(_, state):
        return state[1]

    out.terminal, out.direction = True, -1
    losses = []
    for share in (0.25, 0.5):
        angle = share / math.sqrt(8.0 * ratio)
        start = [0.0, 1e-12, math.cos(angle), math.sin(angle)]
        way = solve_ivp(forces, (0.0, 1e5), start, events=out, rtol=1e-10, atol=1e-14, max_step=20.0)
        u, w = way.y[2, -1], way.y[3, -1]
        assert way.y[1].max() == pytest.approx(2.0 * (ratio * angle**2) ** (1.0 / 3.0), rel=0.03)
        assert math.atan2(-w, u) == pytest.approx(angle, rel=0.03)
        losses.append(-math.log(math.hypot(u, w)))
        assert losses[-1] == pytest.approx(2.473 * ratio ** (1.0 / 6.0) * angle ** (4.0 / 3.0), rel=0.05)
    assert math.log2(losses[1] / losses[0]) == pytest.approx(EXPONENT, abs=0.03)


@pytest.mark.parametrize("name", ["soft_soil", "rock"])
def test_both_sides_of_the_critical_angle(name: str) -> None:
    """In vacuum at a launch so fast that gravity does not bend the first metre."""
    law = KINDS[name].scaled(roughness=0.0)
    for angle, leaves in ((0.97 * law.critical_angle, True), (1.03 * law.critical_angle, False)):
        result = fly(shot(angle, 2000.0), air="vacuum", ricochet=law, time_limit=0.5)
        assert (result.landing["ricochets"][0] > 0) == leaves
        kept, departure = law.after(result.landing["angle"][0])
        assert (kept > 0.0) == leaves
        if leaves:
            first = result.ricochets[0]
            assert math.sqrt(first["energy_after"] / first["energy"]) == pytest.approx(kept, rel=1e-9)
            assert departure == pytest.approx(law.departure * result.landing["angle"][0])
        else:
            assert result.landing["last_status"][0] == Status.LANDED
            assert np.array_equal(result.landing["last_position"], result.landing["position"])


def test_successive_ricochets_in_vacuum() -> None:
    """The angle stays, each leaves the share k of the speed: hops shorten by k^2 until the lift is spent."""
    law = Ricochet(10.0, 0.5)
    row = fly(shot(5.0, 100.0), air="vacuum", ricochet=law).landing[0]
    angle, speed = math.radians(row["angle"]), row["speed"]
    kept = law.after(row["angle"])[0]
    number = math.floor(math.log(SLOWEST_LIFT / (speed * math.sin(angle))) / math.log(kept))
    assert row["ricochets"] == number > 5
    speeds = speed * kept ** np.arange(1, number + 1)
    way = (speeds**2).sum() * math.sin(2.0 * angle) / GRAVITY
    assert row["last_position"][0] - row["position"][0] == pytest.approx(way, rel=1e-6)
    assert row["last_time"] - row["time"] == pytest.approx(2.0 * speeds.sum() * math.sin(angle) / GRAVITY, rel=1e-6)
    assert row["last_distance"] == pytest.approx(row["last_position"][0])
    assert row["last_status"] == Status.LANDED


def test_the_way_after_an_impact_is_the_flights_own() -> None:
    """In air: from where it leaves the ground a fragment flies as one that is launched there."""
    law = Ricochet(10.0, 0.7, 1.5)
    impact, following = fly(shot(5.0, 500.0, mass=0.02), ricochet=law).ricochets[:2]
    kept, departure = law.after(impact["angle"])
    turn, speed = math.radians(departure), kept * math.sqrt(2.0 * impact["energy"] / 0.02)
    again = Fragments(0.02, impact["position"], (speed * math.cos(turn), 0.0, speed * math.sin(turn)))
    row = fly(again, ricochet="none").landing[0]
    assert following["time"] - impact["time"] == pytest.approx(row["time"], rel=1e-5)
    for name in ("position", "energy"):
        assert following[name] == pytest.approx(row[name], rel=1e-5, abs=1e-9), name
    assert following["position"][0] > impact["position"][0] + 20.0


def test_a_ricochet_never_adds_energy_and_stays_in_its_plane() -> None:
    """Random velocities on random faces, laws to the ends of their ranges; what is not turned is left as it came."""
    generator = np.random.default_rng(2)
    kinds = [law.scaled(a, k, d, q) for law in KINDS.values() for a in RANGE["critical_angle"]
             for k in RANGE["speed_kept"] for d in RANGE["departure"] for q in (0.0, *RANGE["roughness"])]  # fmt: skip
    table = Ricochet.table(list(kinds))
    turned = 0
    for number in range(4000):
        normal, velocity = generator.normal(size=(2, 3))
        normal /= np.linalg.norm(normal)
        along = velocity - (velocity @ normal) * normal
        velocity = 500.0 * (along - generator.uniform(0.0, 0.6) * np.linalg.norm(along) * normal)
        state = np.array([0.0, 0.0, 0.0, 0.0, *velocity])
        row, variate = table[number % len(table)], generator.normal()
        if not ricochet(state, *normal, row, variate):
            assert np.array_equal(state[4:], velocity)
            continue
        turned += 1
        angle = math.hypot(math.asin(-(velocity @ normal) / np.linalg.norm(velocity)), row[3] * variate)
        assert angle <= row[0] * (1.0 + 1e-12)
        assert np.linalg.norm(state[4:]) <= np.linalg.norm(velocity) * (1.0 + 1e-12)
        assert math.asin(state[4:] @ normal / np.linalg.norm(state[4:])) == pytest.approx(row[2] * angle, rel=1e-9)
        across = np.cross(normal, velocity)
        assert abs(state[4:] @ across) < 1e-9 * np.linalg.norm(across) * np.linalg.norm(velocity)
    assert 500 < turned < 3500


def test_a_level_path_meets_the_facets_that_face_it() -> None:
    """At a fraction of a degree the loss and the departure are those of the facet; far above its slope they are not."""
    law = Ricochet(8.0, 0.7)
    assert law.after(0.0, 2.0) == (pytest.approx(law.after(2.0)[0]), pytest.approx(2.0))
    assert law.after(0.0) == (1.0, 0.0)
    assert law.after(6.0, 2.0)[0] == pytest.approx(law.after(math.sqrt(40.0))[0])
    assert law.after(7.9, 2.0)[0] == 0.0
    assert law.after(7.9)[0] > 0.0


def test_slopes_are_drawn_with_the_roughness_as_their_standard_deviation() -> None:
    """Departures at one angle of impact: a^2 = b^2 + s^2 with s normal, other slopes for another seed and impact."""
    law = Ricochet(30.0, 0.9, 1.0, 3.0)
    angle = 2.0 * np.ones(4000)
    turn = np.radians(angle)
    velocity = 2000.0 * np.column_stack([np.cos(turn), np.zeros_like(turn), -np.sin(turn)])
    fragments = Fragments(0.01, (0.0, 0.0, 0.01), velocity)
    drawn = []
    for seed in (1, 2):
        result = fly(fragments, air="vacuum", gravity=1e-6, ricochet=law, time_limit=0.1, seed=seed)
        first = result.ricochets[result.ricochets["number"] == 0]
        kept = np.sqrt(first["energy_after"] / first["energy"])
        facet = 30.0 * (np.log(kept) / math.log(0.9)) ** (1.0 / EXPONENT)  # degrees
        slope = np.sqrt(np.maximum(facet**2 - 4.0, 0.0))
        assert len(first) == 4000
        assert math.sqrt(float((slope**2).mean())) == pytest.approx(3.0, rel=0.05)  # 4.5 standard errors
        assert float(np.quantile(slope, 0.6827)) == pytest.approx(3.0, rel=0.07)
        drawn.append(slope)
    assert abs(np.corrcoef(drawn)[0, 1]) < 0.08
    assert not np.array_equal(drawn[0], drawn[1])


def test_on_a_slope_the_angle_is_that_to_the_slope() -> None:
    """Level shots into ground that rises by 3 and by 12 degrees: only the first leaves, along its slope upward."""
    for slope, leaves in ((3.0, True), (12.0, False)):
        x = np.linspace(-200.0, 200.0, 41)
        ground = HeightMap(np.tile(math.tan(math.radians(slope)) * x, (41, 1)), 10.0, (-200.0, -200.0))
        scene = {"ground": ground, "ricochet": Ricochet(7.9, 0.7)}
        result = fly(shot(0.0, 1500.0, height=0.5), air="vacuum", **scene, sample=[0], time_limit=1.0)
        assert (result.landing["ricochets"][0] > 0) == leaves
        if leaves:
            velocity = result.trajectories.velocity
            after = velocity[np.argmax(velocity[:, 2] > 1.0)]
            assert math.degrees(math.atan2(after[2], after[0])) == pytest.approx(2.0 * slope, rel=0.02)


@pytest.mark.parametrize("name", KINDS)
def test_what_comes_before_the_first_impact_does_not_depend_on_it(name: str) -> None:
    """Landings, crossings and densities without ricochet are those of a flight without it, to the last bit.

    But for the two angles of a crossing, which numpy rounds by the row's place in the array.
    """
    fragments = cloud(2500, height=1.0)
    near = Criteria().fluence_grid(PolarGrid.of(72, 10.0, 10.0, 300.0))
    ring = [Cylinder(20.0, name="ring")]
    dead, alive = (fly(fragments, witnesses=ring, ricochet=one, fluence=near) for one in ("none", name))
    for field in ("status", "time", "position", "velocity", "energy", "distance", "angle"):
        assert np.array_equal(dead.landing[field], alive.landing[field]), field
    assert alive.hits["azimuth"] == pytest.approx(dead.hits["azimuth"], rel=1e-14)
    assert alive.hits["elevation"] == pytest.approx(dead.hits["elevation"], rel=1e-14, abs=1e-12)
    for field in set(alive.hits.dtype.names or ()) - {"azimuth", "elevation"}:
        assert np.array_equal(dead.hits[field], alive.hits[field]), field
    for one, other in zip(density_counts(alive, ricochet=False), density_counts(dead), strict=True):
        assert np.array_equal(one, other)
    assert not len(dead.ricochets)
    assert not len(dead.ricochet_hits)
    assert alive.summary["ricocheted"] > 50
    assert (alive.ricochets["energy_after"] <= alive.ricochets["energy"]).all()
    assert (alive.landing["last_time"] >= alive.landing["time"]).all()
    assert KINDS[name].source
    first = alive.ricochets[alive.ricochets["number"] == 0]
    assert np.array_equal(first["position"], alive.landing["position"][first["fragment"]])
    counts = np.bincount(alive.ricochets["fragment"], minlength=len(fragments))
    embedded = (alive.landing["ricochets"] > 0) & (alive.landing["last_status"] == Status.LANDED)
    assert np.array_equal(counts[embedded], alive.landing["ricochets"][embedded] + 1)


def arc(speed: float, start: float, end: float) -> float:
    """Length of a parabola of a level speed (m/s) between two upward speeds."""
    return quad(lambda w: math.hypot(speed, w) / GRAVITY, end, start)[0]


def test_path_lengths_before_and_after_the_first_impact() -> None:
    """All below a person's height: arcs of parabolas while 79 J are left; short steps count as their chords."""
    law, fragments = Ricochet(6.0, 0.7), shot(2.0, 60.0)
    criteria = Criteria()
    near = criteria.fluence_grid(PolarGrid.of(72, 10.0, 10.0, 2000.0))
    result = fly(fragments, air="vacuum", ricochet=law, fluence=near)
    row, counted = result.landing[0], result.fluence
    down, level = -row["velocity"][2], row["velocity"][0]
    assert counted.before.sum() == pytest.approx(arc(level, -60.0 * math.sin(math.radians(2.0)), -down), rel=1e-5)
    angle, speed, kept = math.radians(row["angle"]), row["speed"], law.after(row["angle"])[0]
    expected, each = 0.0, speed
    while True:
        each *= kept
        if 0.5 * each**2 < criteria.energy:
            break
        rise = each * math.sin(angle)
        assert rise**2 / (2.0 * GRAVITY) < criteria.person_height
        expected += arc(each * math.cos(angle), rise, -rise)
    assert counted.after.sum() == pytest.approx(expected, rel=5e-4)
    assert counted.lengths.sum() == pytest.approx(counted.before.sum() + expected, rel=5e-4)
    with_it, without = density_counts(result), density_counts(result, ricochet=False)
    assert without[0].sum() == 1.0
    assert with_it[0].sum() == (result.ricochets["energy"] >= criteria.energy).sum() > 1
    assert (with_it[1].sum() - without[1].sum()) * criteria.person_height == pytest.approx(expected, rel=5e-4)


def test_without_a_height_every_impact_counts_by_its_angle() -> None:
    near = Criteria(person_height=0.0).fluence_grid(PolarGrid.of(72, 10.0, 10.0, 2000.0))
    result = fly(shot(2.0, 60.0), air="vacuum", ricochet=Ricochet(6.0, 0.7), fluence=near)
    hazardous = result.ricochets[result.ricochets["energy"] >= 79.0]
    assert len(hazardous) > 2
    assert density_counts(result)[1].sum() == pytest.approx((1.0 / np.sin(np.radians(hazardous["angle"]))).sum())
    assert density_counts(result, ricochet=False)[1].sum() == pytest.approx(
        1.0 / math.sin(math.radians(hazardous["angle"][0]))
    )


def test_a_site_behind_the_first_impact_is_reached_by_ricochet_alone() -> None:
    """A prism that every path passes level after its first impact: its length in the prism, and no impact in it."""
    fragments = shot(4.0, 400.0)
    prism = Prism(np.array([[20.0, -2.0], [24.0, -2.0], [24.0, 2.0], [20.0, 2.0]]), -0.5, 1.8)
    law = Ricochet(7.9, 0.7)
    result = fly(fragments, air="vacuum", witnesses=surfaces_of([prism]), ricochet=law)
    begin, speed = fragments.position, np.linalg.norm(fragments.velocity, axis=1)
    alive = count_exposed(result, [prism], 0, begin, speed)[0]
    dead = count_exposed(result, [prism], 0, begin, speed, ricochet=False)[0]
    assert 10.0 < result.landing["position"][0, 0] < 20.0
    assert (dead["hits"], dead["track"]) == (0, 0.0)
    assert alive["hits"] == 1
    assert alive["track"] == pytest.approx(4.0 / math.cos(math.radians(4.0)), rel=2e-3)
    kept = law.after(result.landing["angle"][0])[0]
    assert alive["energy"] == pytest.approx(result.landing["energy"][0] * kept**2, rel=1e-3)
    inside = Prism(np.array([[5.0, -2.0], [24.0, -2.0], [24.0, 2.0], [5.0, 2.0]]), -0.5, 1.8)
    result = fly(fragments, air="vacuum", witnesses=surfaces_of([inside]), ricochet=law)
    one, other = (count_exposed(result, [inside], 0, begin, speed, ricochet=r)[0] for r in (True, False))
    assert one["landings"] == other["landings"] == 1
    assert one["track"] == pytest.approx(19.0 / math.cos(math.radians(4.0)), rel=2e-3)
    assert other["track"] == pytest.approx(
        (result.landing["position"][0, 0] - 5.0) / math.cos(math.radians(4.0)), rel=2e-3
    )


def test_impacts_beyond_the_grid_that_was_asked_for_count() -> None:
    """A field of paths that leaves a grid of 60 m by ricochet has the distance of a grid that holds it."""
    generator = np.random.default_rng(4)
    azimuth = generator.uniform(0.0, 2.0 * math.pi, 4000)
    velocity = 700.0 * np.column_stack([np.cos(azimuth), np.sin(azimuth), np.full(4000, -0.05)])
    fragments = Fragments(0.5, (0.0, 0.0, 1.0), velocity)
    found = []
    for reach in (60.0, 2000.0):
        grid = PolarGrid.of(72, 10.0, 10.0, reach)
        groups = DensityGroups(Directions(grid))
        result = fly(fragments, fluence=Criteria().fluence_grid(grid))
        for _ in range(2):
            groups.add(*density_counts(result))
        found.append(expected_distance(groups, Criteria().density).distance)
    assert found[0] == pytest.approx(found[1], rel=1e-9)
    assert found[1] > 100.0


def test_factors_of_the_ranges() -> None:
    law = KINDS["soft_soil"]
    assert law.scaled() is law
    high = law.scaled(*(factors[2] for factors in RANGE.values()))
    assert high.critical_angle == pytest.approx(1.8 * law.critical_angle)
    assert high.speed_kept == pytest.approx(1.3 * law.speed_kept)
    assert high.roughness == pytest.approx(2.0 * law.roughness)
    assert law.scaled(roughness=0.0).roughness == 0.0
    assert KINDS["water"].scaled(speed_kept=1.3).speed_kept == 1.0
    assert KINDS["rock"].scaled(critical_angle=9.0).critical_angle == 60.0
    assert Ricochet.of("none") is None
    assert Ricochet.of("sand") is KINDS["sand"]


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: fly(cloud(2), ricochet="sandd"), "ricochet: unknown kind of surface 'sandd'; did you mean 'sand'"),
        (lambda: Ricochet(8.0, 1.1), "ricochet own: speed_kept is 1.1, allowed: above 0 to 1"),
        (lambda: Ricochet(30.0, 0.5, 3.0), "departure is 3.0, allowed: above 0, and with .* 30 degrees at most 2"),
        (lambda: KINDS["sand"].scaled(speed_kept=0.0), "ricochet sand: factor of speed_kept is 0.0, needed: above"),
        (lambda: KINDS["sand"].after(91.0), "ricochet sand: angle is 91.0 degrees, allowed: 0 to 90"),
    ],
)
def test_messages(make, message: str) -> None:
    with pytest.raises(InputError, match=message):
        make()
