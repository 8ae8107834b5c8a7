"""Studies of single bodies and tubes, on made-up records: copper cylinder, steel tubes, colliding tubes, stacks."""

from __future__ import annotations

from dataclasses import replace

import h5py
import numpy as np
import pytest

from validation.axisymmetric import study as axisymmetric
from validation.colliding_tubes.study import REFERENCE as COLLIDING
from validation.colliding_tubes.study import Metal, counted_metal
from validation.copper_cylinder.streak import streak
from validation.paper_3_2 import study as paper_3_2
from validation.paper_3_2.ring import HITS, Ring
from validation.rows import Rows
from validation.stack_trends import study as stacks
from validation.steel_tubes.study import Along, gurney_speed

LENGTH, RADIUS, FRONT = 0.3, 0.0153, 6940.0
SPEED, TURN = 1400.0, 0.1  # of the wall, m/s; part of it that points away from the initiated end


def missed(rows: Rows) -> list[str]:
    return [row.quantity for row in rows if row.passed is False]


# --- copper cylinder ----------------------------------------------------------------------------------------


def _wall(time):
    """Rings of a wall that moves at one velocity once the front has passed; (nodes, 3), initiated end up."""
    heights = np.linspace(0.0, LENGTH, 61)
    away = np.maximum(time - (LENGTH - heights) / FRONT, 0.0)
    around = np.linspace(0.0, 2.0 * np.pi, 16, endpoint=False)
    rings = []
    for share in (1.0, 0.5):  # the outer surface, and nodes within
        radius = share * RADIUS + SPEED * away
        height = np.repeat((heights - TURN * SPEED * away)[:, None], 16, axis=1)
        flat = [np.outer(radius, np.cos(around)), np.outer(radius, np.sin(around)), height]
        rings.append(np.stack(flat, axis=-1).reshape(-1, 3))
    return np.concatenate(rings)


@pytest.fixture(scope="module", params=["3d", "axisymmetric"])
def series(request, tmp_path_factory):
    folder = tmp_path_factory.mktemp("burst")
    for number, time in enumerate(np.arange(0.0, 50e-6, 0.5e-6)):
        with h5py.File(folder / f"{number:04d}.h5", "w") as file:
            position = _wall(time)
            if request.param == "axisymmetric":  # one ray of it, as a meridian's states lie
                position = position[::16, [0, 2, 1]]
            file["position"] = position
            file.attrs["time"] = time
    return folder


def test_the_slit_sees_the_radius_at_a_fixed_station(series):
    """A steady wall r(z, t): at fixed z, dr/dt = v_r - v_z dr/dz = v_r / (1 - v_z / D), v_z from the initiated end."""
    record = streak(series, 0.2, LENGTH)
    seen = SPEED / (1.0 - TURN * SPEED / FRONT)
    for displacement in (6e-3, 19e-3):
        assert record.speed_at(displacement, 2e-3) == pytest.approx(seen, rel=2e-3)


# --- steel tubes --------------------------------------------------------------------------------------------


def test_gurneys_formula():
    """C/M = 1 and sqrt(2E) = 2405 m/s: 2405/sqrt(1.5); a heavy casing takes nearly all of the energy."""
    assert gurney_speed(2405.0, 1.0) == pytest.approx(1963.67, abs=0.01)
    assert gurney_speed(2405.0, 1e-4) == pytest.approx(24.05, rel=1e-4)


def test_the_middle_of_a_tube_is_weighted_by_mass():
    tube = Along((np.arange(20) + 0.5) / 20, np.where(np.arange(20) < 10, 900.0, 1000.0), np.arange(1.0, 21.0))
    assert tube.mean(0.4, 0.6) == pytest.approx((9 * 900 + 10 * 900 + 11 * 1000 + 12 * 1000) / 42)
    assert tube.mean(0.0, 0.5) == 900.0


# --- colliding tubes ----------------------------------------------------------------------------------------


def test_shares_count_either_side_of_the_plane_by_mass():
    degrees, mass = np.radians([5.0, 5.0, 15.0, 80.0]), np.array([1.0, 2.0, 3.0, 4.0])
    side = np.array([1.0, -1.0, 1.0, -1.0])
    metal = Metal(mass, 100.0 * np.stack([np.sin(degrees), side * np.cos(degrees), 0.0 * degrees], axis=1))
    assert [metal.share(angle) for angle in (10.0, 20.0)] == pytest.approx([0.3, 0.6])
    assert metal.mean_velocity == pytest.approx(10.0 * (mass @ np.sin(degrees)))
    assert Metal.together([metal, metal]).share(10.0) == pytest.approx(0.3)


def test_the_counted_metal_is_the_middle_of_the_casing_and_x_leads_away_from_the_plane(tmp_path):
    """Cells of casing, stations inside and out, a charge; of two tubes, each with x towards its own side."""
    path = tmp_path / "burst_snapshot.h5"
    with h5py.File(path, "w") as file:
        file["nodes/reference"] = np.array([[1.0, 0, 0], [-1.0, 0, 0]])
        file["nodes/velocity"] = np.array([[100.0, 50, 0], [-300.0, 50, 0]])
        file["cells/nodes"] = np.array([[0] * 8, [0] * 8, [0] * 8, [1] * 8, [1] * 8])
        file["cells/part"] = np.array([0, 0, 1, 0, 1])
        file["cells/station"] = np.array([0.05, 0.15, 0.15, 0.19, 0.15])
        file["cells/mass"] = np.array([1.0, 2.0, 4.0, 8.0, 16.0])
        file["cells/round"] = np.array([0, 0, 0, 1, 1])
    first, second = counted_metal(path)
    assert (first.mass.tolist(), second.mass.tolist()) == ([2.0], [8.0])
    assert (first.mean_velocity, second.mean_velocity) == (100.0, 300.0)
    assert COLLIDING["stations"] == [0.1, 0.2]


# --- stacks -------------------------------------------------------------------------------------------------

SINGLE = stacks.Focus(share=20 / 180, half_angle=45.0, place=0.0, fastest=1000.0)


def focus(share=0.25, half_angle=30.0, place=0.0, fastest=1500.0):
    return stacks.Focus(share, half_angle, place, fastest)


def found(check, *arguments):
    rows = Rows("stack_trends")
    check(rows, *arguments)
    return missed(rows)


def snapshot(path, degrees, mass=None):
    """Cells of casing that fly at these angles from +y towards +x, each with nodes of its own; and one of charge."""
    angle = np.radians(np.append(degrees, 0.0))
    velocity = np.repeat(np.stack([np.sin(angle), np.cos(angle), 0.0 * angle], axis=1) * 1000.0, 8, axis=0)
    with h5py.File(path, "w") as file:
        file["nodes/velocity"] = velocity
        file["nodes/position"] = 1e-3 * velocity
        file["cells/nodes"] = np.arange(8 * len(angle)).reshape(-1, 8)
        file["cells/part"] = np.append(np.zeros(len(degrees), dtype=int), 1)
        file["cells/mass"] = np.append(np.ones(len(degrees)) if mass is None else mass, 100.0)
    return path


def test_even_metal_is_a_single_round(tmp_path):
    """18,000 cells over all azimuths: 40 of 360 degrees within 10 of +y or -y, half within 45."""
    even = stacks.focus_of(snapshot(tmp_path / "s.h5", np.arange(18000) * 0.02 + 0.01))
    assert even.share == pytest.approx(40 / 360, rel=1e-3)
    assert even.half_angle == pytest.approx(45.0, abs=0.03)
    assert even.place == pytest.approx(0.0, abs=1e-12)
    assert even.fastest == pytest.approx(1000.0)


def test_the_charge_does_not_count_and_mass_weighs(tmp_path):
    few = stacks.focus_of(snapshot(tmp_path / "s.h5", [5.0, 30.0, 80.0], mass=np.array([2.0, 1.0, 1.0])))
    assert few.share == pytest.approx(0.5)
    # Each lies a metre along its direction.
    assert few.place == pytest.approx((2 * np.sin(np.radians(5)) + np.sin(np.radians(30))) / 3)


def test_the_focus_weakens_and_widens_with_the_gap():
    good = {0.14: focus(0.25, 30.0), 1.0: focus(0.2, 35.0), 3.0: focus(SINGLE.share, 45.0)}
    assert found(stacks.check_gaps, good, SINGLE) == []
    for change, words in (
        ({1.0: focus(0.26, 35.0)}, "gap of 1 over 0.14 calibres: mass within 10 deg, ratio"),
        ({1.0: focus(0.2, 29.0)}, "gap of 1 over 0.14 calibres: angle that holds half the mass, ratio"),
        ({3.0: focus(1.02 * SINGLE.share, 45.0)}, "gap of 3 calibres: mass within 10 deg over the single round's"),
    ):
        assert found(stacks.check_gaps, good | change, SINGLE) == [words]


def test_delays_of_either_round_mirror_each_other_and_move_the_focus_to_the_later():
    good = {1e-5: (focus(place=-3e-3), focus(place=3e-3)), 2e-5: (focus(place=-6e-3), focus(place=6e-3))}
    assert found(stacks.check_delays, good, focus()) == []
    back = good | {2e-5: (focus(place=-2e-3), focus(place=2e-3))}
    assert found(stacks.check_delays, back, focus()) == ["delay of 20 us: focus, further to the later round"]
    uneven = {1e-5: (focus(0.26, place=-3.9e-3), focus(0.25, place=5e-3))}
    assert found(stacks.check_delays, uneven, focus()) == [
        "delay of 10 us: mass within 10 deg, left delayed over right delayed",
        "delay of 10 us: focus, sum of the two mirrored places",
    ]


def test_longer_rows_have_more_gaps_to_a_round_and_no_more():
    assert found(stacks.check_counts, {2: focus(0.24), 3: focus(0.28), 4: focus(0.30)}) == []
    assert len(found(stacks.check_counts, {2: focus(0.24), 3: focus(0.33), 4: focus(0.32)})) == 2


# --- the pair and the meridian -------------------------------------------------------------------------------


def ring(number, seed, speed=1000.0, realisations=20):
    """Even hits on a ring."""
    random = np.random.default_rng(seed)
    hits = np.zeros(number * realisations, dtype=HITS)
    hits["realisation"] = np.repeat(np.arange(realisations), number)
    hits["azimuth"] = random.uniform(-180.0, 180.0, len(hits))
    hits["mass"], hits["initial_speed"] = 1e-3, speed
    return Ring(np.full(realisations, number), hits)


def test_the_rings_hits_over_the_azimuth_are_all_hits():
    rows = Rows("paper_3_2")
    two, one = ring(2000, 1), ring(1000, 2)
    paper_3_2.check_ring(rows, "6 mm", two, one)
    two.hits["azimuth"][0] = np.nan
    paper_3_2.check_ring(rows, "6 mm", two, one)
    assert [row.passed for row in rows] == [True, False]
    assert rows[0].reference == pytest.approx(360.0)


def test_forms_of_the_pair_are_judged_by_the_sector_farthest_off():
    rows = Rows("paper_3_2")
    same = ring(20_000, 1)
    faster = replace(same, hits=same.hits.copy())
    near = np.abs(faster.hits["azimuth"] % 180.0 - 90.0) < 5.0
    faster.hits["initial_speed"][near] *= 1.006
    paper_3_2.check_forms(rows, "6 mm", same, {"mirrored": faster, "full": faster})
    assert len(rows) == 8
    assert all("mirrored" in name and "speed" in name and "within 5 deg" in name for name in missed(rows))
    assert len(missed(rows)) == 2


def test_a_jump_between_layers_of_the_wall_is_seen(tmp_path):
    """Three layers of two cells with 10, 12 and 40 m/s; a cell of other stations does not count."""
    with h5py.File(tmp_path / "s.h5", "w") as file:
        radius = np.array([50.0, 50.0, 56.0, 56.0, 62.0, 62.0, 50.0]) * 1e-3
        corners = np.stack([radius, radius + 6e-3, radius + 6e-3, radius], axis=1)
        file["nodes/reference"] = np.stack([corners.ravel(), np.zeros(28), np.zeros(28)], axis=1)
        axial = np.repeat([10.0, 10.0, 12.0, 12.0, 40.0, 40.0, 500.0], 4)
        file["nodes/velocity"] = np.stack([np.zeros(28), np.zeros(28), axial], axis=1)
        file["cells/nodes"] = np.arange(28).reshape(7, 4)
        file["cells/mass"], file["cells/part"] = np.ones(7), np.zeros(7, dtype=int)
        file["cells/station"] = np.array([0.4] * 6 + [0.2])
    assert axisymmetric.wall_jump(tmp_path / "s.h5") == pytest.approx(28.0)
