"""Contact between fragments: two spheres by hand, balances, no pair missed, nothing moved where nothing meets."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from flight import (
    VACUUM,
    Adaptive,
    Contact,
    Cylinder,
    Domain,
    Drag,
    Fragments,
    HeightMap,
    StandardAtmosphere,
    Status,
    Wall,
    fly,
)
from flight.files.hdf5 import read_table
from flight.files.text_tables import read_columns
from flight.integrate.contact import Encounters
from flight.integrate.job import FlightJob
from flight.scene.scene import Scene

STILL = {"air": "vacuum", "gravity": 0.0, "ground": None, "time_limit": 0.05}


def mass_of(radius: float) -> float:
    return 7850.0 * 4.0 / 3.0 * math.pi * radius**3


def stack(number: int, seed: int = 0, lightest: float = 1e-3) -> Fragments:
    """Two tubes of fragments side by side that burst at once; the heaviest weigh a hundred times the lightest (kg)."""
    generator = np.random.default_rng(seed)
    azimuth, side = generator.uniform(0.0, 2.0 * np.pi, number), np.where(np.arange(number) % 2, 0.2, -0.2)
    outward = np.stack([np.cos(azimuth), np.sin(azimuth), np.zeros(number)], axis=1)
    position = 0.1 * outward + np.stack([side, 0.0 * side, generator.uniform(1.0, 1.6, number)], axis=1)
    velocity = outward * generator.uniform(600.0, 1200.0, number)[:, None]
    velocity[:, 2] = generator.normal(0.0, 50.0, number)
    return Fragments(lightest * 100.0 ** generator.uniform(size=number), position, velocity)


@pytest.mark.parametrize("speed", [20.0, 2000.0, 2e4])
@pytest.mark.parametrize("restitution", [0.0, 0.6, 1.0])
def test_head_on(speed: float, restitution: float) -> None:
    """Unequal spheres on one line: closed form of the impact with restitution, however fast they close."""
    r1, r2 = 5e-3, 2e-3
    m1, m2 = mass_of(r1), mass_of(r2)
    pair = Fragments([m1, m2], [[0, 0, 0], [3.0, 0, 0]], [[speed, 0, 0], [-0.5 * speed, 0, 0]])
    result = fly(pair, contact=Contact(restitution=restitution, distance=20.0), **STILL)
    assert len(result.contacts) == 1
    contact = result.contacts[0]
    assert contact["time"] == pytest.approx((3.0 - r1 - r2) / (1.5 * speed), rel=1e-12)
    assert contact["closing_speed"] == pytest.approx(1.5 * speed, rel=1e-12)
    common = (m1 * speed - 0.5 * m2 * speed) / (m1 + m2)
    assert contact["first_after"][0] == pytest.approx(
        common - m2 / (m1 + m2) * restitution * 1.5 * speed, abs=1e-12 * speed
    )
    assert contact["second_after"][0] == pytest.approx(
        common + m1 / (m1 + m2) * restitution * 1.5 * speed, abs=1e-12 * speed
    )
    reduced = m1 * m2 / (m1 + m2)
    assert contact["energy_lost"] == pytest.approx(
        0.5 * reduced * (1.5 * speed) ** 2 * (1.0 - restitution**2), abs=1e-9 * reduced * speed**2
    )
    late = 0.05 - contact["time"]
    expected = contact["second_position"] + late * contact["second_after"]
    assert result.landing["position"][1] == pytest.approx(expected, rel=1e-12, abs=1e-12 * speed)
    assert result.landing["status"].tolist() == [Status.TIME_OUT] * 2


@pytest.mark.parametrize(("angle", "sticks"), [(5.0, False), (60.0, True)])
def test_oblique_impact_slides_or_rolls(angle: float, sticks: bool) -> None:
    """Equal spheres with a step of half a radius: Coulomb friction, at most 2/7 of the sliding taken away."""
    radius, speed = 5e-3, 100.0
    step = radius  # across the flight: the normal stands at 30 degrees
    pair = Fragments(mass_of(radius), [[0, 0, 0], [1.0, step, 0]], [[speed, 0, 0], [0, 0, 0]])
    result = fly(pair, contact=Contact(restitution=0.5, friction_angle_deg=angle), **STILL)
    contact = result.contacts[0]
    normal = np.array([math.cos(math.pi / 6), 0.5, 0.0])
    across = np.array([0.5, -math.cos(math.pi / 6), 0.0])
    taken = contact["second_after"]  # impulse on the second, per mass
    assert taken @ normal == pytest.approx(0.5 * 1.5 * speed * math.cos(math.pi / 6), rel=1e-9)
    slid = speed * 0.5
    full, coulomb = slid / 7.0, math.tan(math.radians(angle)) * (taken @ normal)
    assert (coulomb > full) == sticks
    assert taken @ across == pytest.approx(min(full, coulomb), rel=1e-9)
    assert contact["first_after"] + contact["second_after"] == pytest.approx([speed, 0.0, 0.0], abs=1e-12 * speed)
    assert result.summary["contact"]["energy_of_spin"] > 0.0


@pytest.mark.parametrize("turn", [0, 1, 2])
@pytest.mark.parametrize("aside", [0.0, 0.3, 5.0])
@pytest.mark.parametrize(("inner", "ahead"), [(1.0, 0.0), (0.04, 0.0), (0.04, 4e-3), (0.04, -4e-3)])
def test_two_that_were_struck_strike_each_other(turn: int, aside: float, inner: float, ahead: float) -> None:
    """Four equal spheres on a line, of which the outer two fly at the inner ones: those meet, and come back.

    Perfectly elastic spheres of one mass exchange their velocities; what else flies along beside them changes nothing.
    Inner ones close to each other meet within the window in which they were struck, in cells where neither stood.
    """
    radius, speed = 5e-3, 100.0
    place = np.array([-2.0, -inner, inner, 2.0 - ahead])[:, None] * np.eye(3)[turn] + [aside, 2.0 * aside, -aside]
    velocity = speed * np.array([1.0, 0.0, 0.0, -1.0])[:, None] * np.eye(3)[turn]
    beside = np.random.default_rng(1).uniform(-3.0, 3.0, (60, 3))
    beside[:, (turn + 1) % 3] += 9.0 + 2.0 * aside
    every = Fragments(
        mass_of(radius), np.concatenate([place, beside]), np.concatenate([velocity, 0.0 * beside + [1.0, 0.5, -1.0]])
    )
    result = fly(every, contact=Contact(restitution=1.0, distance=50.0, min_speed=5.0), **STILL)
    pairs = [(int(one["first"]), int(one["second"])) for one in result.contacts if one["second"] < 4]
    assert sorted(pairs[:2]) == [(0, 1), (2, 3)]
    assert pairs[2] == (1, 2)
    assert sorted(pairs[3:]) == [(0, 1), (2, 3)]
    times = [one["time"] for one in result.contacts if one["second"] < 4]
    struck = (2.0 - inner - 2.0 * radius - np.array([0.0, ahead])) / speed
    middle = struck.mean() + (inner - radius) / speed
    assert times == pytest.approx([*sorted(struck), middle, *sorted(2.0 * middle - struck)], rel=1e-9)
    ends = result.landing["velocity"][:4] @ np.eye(3)[turn]
    assert ends == pytest.approx([-speed, 0.0, 0.0, speed], abs=1e-9 * speed)


def test_balances_and_every_fragment_is_there() -> None:
    fragments = stack(3000)
    result = fly(fragments, witnesses=[Cylinder(7.62, name="ring")], contact=Contact())
    summary, contacts = result.summary["contact"], result.contacts
    assert summary["contacts"] == len(contacts) > 500
    assert (np.diff(contacts["time"]) >= 0.0).all()
    assert summary["momentum_error"] < 1e-12
    assert summary["energy_error"] < 1e-12
    assert (contacts["energy_lost"] >= 0.0).all()
    one, other = fragments.mass[contacts["first"]][:, None], fragments.mass[contacts["second"]][:, None]
    change = one * (contacts["first_after"] - contacts["first_before"])
    change += other * (contacts["second_after"] - contacts["second_before"])
    size = one[:, 0] * np.linalg.norm(contacts["first_before"], axis=1)
    size += other[:, 0] * np.linalg.norm(contacts["second_before"], axis=1)
    assert (np.linalg.norm(change, axis=1) <= 1e-12 * size).all()
    gap = np.linalg.norm(contacts["first_position"] - contacts["second_position"], axis=1)
    radius = Contact().radius(fragments)
    assert gap == pytest.approx(radius[contacts["first"]] + radius[contacts["second"]], rel=1e-6)
    assert result.summary["status"]["landed"]["fragments"] == 3000
    assert result.landing["mass"].sum() == fragments.total_mass
    assert result.landing["fragment"].tolist() == list(range(3000))


def test_what_is_never_struck_flies_as_without_contact() -> None:
    fragments = stack(1500, seed=2)
    ring = [Cylinder(7.62, name="ring")]
    off, on = (fly(fragments, witnesses=ring, sample=[3, 4], contact=one) for one in (None, Contact()))
    assert off.contacts is None
    assert "contact" not in off.summary
    struck = np.unique(np.concatenate([on.contacts["first"], on.contacts["second"]]))
    free = np.setdiff1d(np.arange(1500), struck)
    assert 100 < free.size < 1400
    assert (on.landing[free] == off.landing[free]).all()
    kept = np.isin(on.hits["fragment"], free)
    assert (on.hits[kept] == off.hits[np.isin(off.hits["fragment"], free)]).all()
    assert (np.diff(on.trajectories.time[: on.trajectories.start[1]]) >= 0.0).all()


def test_the_way_to_an_impact_is_the_flights_own() -> None:
    """Where two meet, in air, they are where the flight alone would have brought them at that time."""
    fragments = stack(800, seed=5)
    contacts = fly(fragments, contact=Contact()).contacts
    seen: set[int] = set()
    for row in contacts[:40]:
        for name in ("first", "second"):
            if int(row[name]) in seen:
                continue
            alone = fly(
                fragments.select([row[name]]), time_limit=float(row["time"]), integrator=Adaptive(1e-12)
            ).landing
            assert alone["position"][0] == pytest.approx(row[f"{name}_position"], abs=1e-9)
            assert alone["velocity"][0] == pytest.approx(row[f"{name}_before"], rel=1e-7, abs=1e-5)
        seen |= {int(row["first"]), int(row["second"])}


@pytest.mark.parametrize("number", [600, pytest.param(5000, marks=pytest.mark.slow)])
def test_cells_find_what_comparing_all_pairs_finds(number: int) -> None:
    fragments = stack(number, seed=7)
    job = FlightJob(
        fragments, StandardAtmosphere(), Drag.named("shell_fragment"), 9.80665, None, Scene(0.0), (), Adaptive(),
        Domain(), 3600.0, (0.0, 0.0),
    )  # fmt: skip
    cells = Encounters(fragments, Contact(), job.around, 0.0, 2)
    pairs = Encounters(fragments, Contact(), job.around, 0.0, 1, one_cell=True, windows=cells.window_ends)
    assert len(cells.contacts) > 50
    assert (cells.contacts == pairs.contacts).all()


def test_first_collisions_of_straight_paths_by_comparing_all_pairs() -> None:
    """In a vacuum without gravity the first contact of all is a quadratic equation for every pair."""
    fragments = stack(400, seed=3, lightest=1e-4)
    radius = Contact().radius(fragments)
    contacts = fly(fragments, contact=Contact(), **STILL).contacts
    one, other = np.triu_indices(400, 1)
    apart = fragments.position[other] - fragments.position[one]
    towards = fragments.velocity[other] - fragments.velocity[one]
    reach = radius[one] + radius[other]
    a, b = (towards**2).sum(axis=1), (apart * towards).sum(axis=1)
    c = (apart**2).sum(axis=1) - reach**2
    meets = (c > 0.0) & (b < 0.0) & (b * b > a * c)
    time = np.where(meets, c / (-b + np.sqrt(np.maximum(b * b - a * c, 0.0))), np.inf)
    time[(-b) / reach < 0.5] = np.inf
    untouched, found = np.ones(400, dtype=bool), 0
    for pair in np.argsort(time)[: len(contacts)]:  # up to the first pair of which one was struck before
        if not (untouched[one[pair]] and untouched[other[pair]]):
            break
        untouched[[one[pair], other[pair]]] = False
        assert (contacts["first"][found], contacts["second"][found]) == (one[pair], other[pair])
        assert contacts["time"][found] == pytest.approx(time[pair], rel=1e-10)
        found += 1
    assert found >= 5


def test_a_window_holds_any_number_of_impacts() -> None:
    """Pairs in a row that meet head on, each far from the others: all are found in one window, in order of time."""
    number, speed, radius = 1100, 100.0, 5e-3
    row, apart = np.arange(number), np.linspace(0.5, 1.5, number)
    place, velocity = np.zeros((2, number, 3)), np.zeros((2, number, 3))
    place[:, :, 1], place[0, :, 0], place[1, :, 0] = 3.0 * row, -0.5 * apart, 0.5 * apart
    velocity[0, :, 0], velocity[1, :, 0] = speed, -speed
    fragments = Fragments(mass_of(radius), place.reshape(-1, 3), velocity.reshape(-1, 3))
    job = FlightJob(
        fragments, VACUUM, Drag.named("shell_fragment"), 0.0, None, Scene(0.0), (), Adaptive(), Domain(), 3600.0,
        (0.0, 0.0),
    )  # fmt: skip
    contact = Contact(distance=50.0, time_limit=0.02)
    found = Encounters(fragments, contact, job.around, -math.inf, 1, windows=[0.02])
    assert found.window_ends == [0.02]
    assert found.contacts["first"].tolist() == row.tolist()
    assert found.contacts["second"].tolist() == (number + row).tolist()
    assert found.contacts["time"] == pytest.approx((apart - 2.0 * radius) / (2.0 * speed), rel=1e-9)


def test_threads_change_nothing() -> None:
    fragments = stack(2000, seed=9)
    results = [fly(fragments, contact=Contact(), threads=threads) for threads in (1, 2, 3)]
    for other in results[1:]:
        assert (results[0].contacts == other.contacts).all()
        assert (results[0].landing == other.landing).all()


def test_overlap_at_launch_does_not_explode() -> None:
    """Spheres drawn over each other part as if the others were not there."""
    generator = np.random.default_rng(1)
    direction = generator.normal(size=(300, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    heap = Fragments(0.05, 1e-3 * direction, 500.0 * direction)
    result = fly(heap, contact=Contact(), **STILL)
    assert len(result.contacts) == 0
    assert result.landing["speed"] == pytest.approx(500.0, rel=1e-12)


def test_nothing_meets_below_the_ground() -> None:
    pair = Fragments(mass_of(5e-3), [[0, 0, 0.1], [2, 0, 0.1]], [[200, 0, -100], [-200, 0, -100]])
    result = fly(pair, contact=Contact(), air="vacuum")
    assert len(result.contacts) == 0
    assert (result.landing["status"] == Status.LANDED).all()


def of_two_rounds(fragments: Fragments) -> Fragments:
    """The fragments of `stack`, those of either tube as a round of its own."""
    return replace(fragments, round=(fragments.position[:, 0] > 0.0).astype(np.int32), round_names=("west", "east"))


def test_between_rounds_no_two_fragments_of_one_round_meet() -> None:
    """Those that meet are of different rounds; one round alone flies as without contact, to the last bit."""
    both = of_two_rounds(stack(800, seed=5))
    every, between = (fly(both, contact=Contact(between=one)).contacts for one in ("all", "rounds"))
    assert (both.round[between["first"]] != both.round[between["second"]]).all()
    assert len(every) > len(between) > 20
    one = both.select(both.round == 0)
    assert Contact(between="all").possible(one)
    assert not Contact(between="rounds").possible(one)
    alone, free = (fly(one, contact=contact) for contact in (Contact(between="rounds"), None))
    assert alone.landing.tobytes() == free.landing.tobytes()
    assert "contact" not in alone.summary


@pytest.mark.parametrize("threads", [1, 2])
def test_an_obstacle_stops_what_was_struck_before_it(threads: int) -> None:
    """A wall around the stack: all stop on it or fly over it, each once, by its last leg."""
    fragments = of_two_rounds(stack(600, seed=3))
    walls = [Wall((sign * 30.0, -40.0), (sign * 30.0, 40.0), 20.0, name=str(sign)) for sign in (-1.0, 1.0)]
    found = fly(fragments, contact=Contact(), obstacles=walls, ricochet="none", threads=threads)
    free = fly(fragments, contact=Contact(), ricochet="none", threads=threads)
    struck = np.unique(np.concatenate([found.contacts["first"], found.contacts["second"]]))
    stopped = found.landing["status"] == Status.STOPPED
    assert stopped[struck].sum() > 10
    assert np.array_equal(np.sort(found.obstacle_hits["fragment"]), np.flatnonzero(stopped))
    assert (np.abs(np.abs(found.landing["position"][stopped, 0]) - 29.9) < 1e-6).all()  # 0.2 m thick
    # What no wall stops lands where it lands without walls.
    others = ~stopped
    assert np.array_equal(found.landing["position"][others], free.landing["position"][others])


def test_contact_over_a_map_is_that_over_flat_ground() -> None:
    fragments = of_two_rounds(stack(300, seed=4))
    level = HeightMap(np.zeros((2, 2)), step=1e4, corner=(-5e3, -5e3))
    flat, mapped = (fly(fragments, contact=Contact(), ground=one, ricochet="none") for one in (0.0, level))
    assert np.array_equal(flat.contacts["time"], mapped.contacts["time"])
    np.testing.assert_allclose(mapped.landing["position"], flat.landing["position"], atol=1e-6)


def test_ricochet_after_contact() -> None:
    """Fragments that are struck ricochet from their last leg, and those that are not as without contact."""
    fragments = stack(600, seed=3)
    dead = fly(fragments, contact=Contact(), ricochet="none")
    alive, free = (fly(fragments, contact=one, ricochet="rock") for one in (Contact(), None))
    assert np.array_equal(dead.landing["position"], alive.landing["position"])
    assert alive.hits.tobytes() == dead.hits.tobytes()
    struck = np.unique(np.concatenate([alive.contacts["first"], alive.contacts["second"]]))
    others = np.setdiff1d(np.arange(len(fragments)), struck)
    assert len(struck) > 10
    assert alive.landing[others].tobytes() == free.landing[others].tobytes()
    assert (alive.landing["ricochets"][struck] > 0).any()
    first = alive.ricochets[alive.ricochets["number"] == 0]
    assert np.array_equal(first["fragment"], np.flatnonzero(alive.landing["ricochets"] > 0))
    assert np.array_equal(first["position"], alive.landing["position"][first["fragment"]])


def test_contacts_are_written_and_read_back(tmp_path: Path) -> None:
    result = fly(stack(400, seed=3), contact=Contact())
    assert len(result.contacts) > 10
    names = {path.name for path in result.write(tmp_path, {"seed": "3"})}
    assert {"contacts.h5", "contacts.csv"} <= names
    assert read_table(tmp_path / "contacts.h5", "contacts")[0].tobytes() == result.contacts.tobytes()
    columns = read_columns(tmp_path / "contacts.csv")
    assert columns["energy_lost_J"] == pytest.approx(result.contacts["energy_lost"], rel=1e-9)
    assert columns["second_position_y_m"] == pytest.approx(result.contacts["second_position"][:, 1], rel=1e-9)
    assert "contacts.h5" not in {path.name for path in fly(stack(4)).write(tmp_path / "without")}
