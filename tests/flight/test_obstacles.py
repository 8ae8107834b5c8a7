"""Walls, barricades and buildings: nothing passes through them, and hits are counted by face."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from flight import (
    Barricade,
    Building,
    Cylinder,
    FixedStep,
    Fragments,
    HeightMap,
    InputError,
    Panel,
    Ricochet,
    Status,
    Wall,
    fly,
)
from flight.files.hdf5 import read_table
from tests.flight.clouds import GRAVITY, cloud


def vacuum_cloud(number: int, seed: int) -> Fragments:
    generator = np.random.default_rng(seed)
    direction = generator.normal(size=(number, 3)) * [1.0, 1.0, 0.4]
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    return Fragments(0.01, (0.0, 0.0, 1.5), direction * generator.uniform(20.0, 2000.0, (number, 1)))


def inside_intervals(fragments: Fragments, faces: list) -> tuple[np.ndarray, np.ndarray]:
    """Time of the first entry of parabolas into a convex body, and its face; inf where there is none.

    A parabola is behind a face between or outside of two times; the body is where it is behind all.
    """
    n = len(fragments)
    events = [np.zeros(n)]
    for point, normal in faces:
        a = np.full(n, -0.5 * GRAVITY * normal[2])
        b, c = fragments.velocity @ normal, (fragments.position - point) @ normal
        with np.errstate(invalid="ignore", divide="ignore"):
            q = -0.5 * (b + np.copysign(np.sqrt(b * b - 4.0 * a * c), b))
            events += [q / a, c / q]
    times = np.sort(np.where(np.isfinite(events) & (np.array(events) >= 0.0), events, np.inf), axis=0)
    first, face = np.full(n, np.inf), np.full(n, -1)
    for start, end in pairwise(times):
        middle = np.where(np.isfinite(end), 0.5 * (start + end), start + 1.0)
        middle = np.where(np.isfinite(start), middle, 0.0)
        place = fragments.position + fragments.velocity * middle[:, None]
        place[:, 2] -= 0.5 * GRAVITY * middle**2
        depth = np.array([(place - p) @ m for p, m in faces])
        new = (depth < 0.0).all(axis=0) & np.isinf(first) & np.isfinite(start) & (end > start)
        at = fragments.position + fragments.velocity * np.where(new, start, 0.0)[:, None]
        at[:, 2] -= 0.5 * GRAVITY * np.where(new, start, 0.0) ** 2
        nearest = np.argmin(np.abs([(at - p) @ m for p, m in faces]), axis=0)
        first[new], face[new] = start[new], nearest[new]
    return first, face


OBSTACLES = [
    Wall((8.0, -30.0), (8.0, 30.0), 1.8, thickness=1e-3, name="thin wall"),
    Wall((-60.0, 10.0), (-20.0, 55.0), 12.0, thickness=1e-4, name="slanting sheet"),
    Barricade((-12.0, -10.0), (12.0, -10.0), 3.0, crest_width=0.5, slope=1.5, name="bank"),
    Building((80.0, 60.0), 20.0, 12.0, 6.0, azimuth=33.0, name="house"),
    Building((300.0, 0.0), 0.5, 0.5, 40.0, name="mast"),
]


def check_none_passes(number: int, seed: int) -> None:
    fragments = vacuum_cloud(number, seed)
    result = fly(fragments, air="vacuum", obstacles=OBSTACLES, ricochet="none")
    w, z = fragments.velocity[:, 2], fragments.position[:, 2]
    root = np.sqrt(w * w + 2.0 * GRAVITY * z)
    landing = np.where(w > 0.0, (w + root) / GRAVITY, 2.0 * z / (root - w))
    entries = [inside_intervals(fragments, obstacle.sides(obstacle.height, -1.0)[0]) for obstacle in OBSTACLES]
    times = np.array([time for time, _ in entries])
    first = times.argmin(axis=0)
    hit = times.min(axis=0) < landing
    row = result.landing
    assert np.array_equal(row["status"] == Status.STOPPED, hit)
    assert np.array_equal(row["obstacle"], np.where(hit, first, -1))
    faces = np.array([face for _, face in entries])[first, np.arange(number)]
    # paths that graze an edge may be assigned to either of its faces
    assert (row["face"] != np.where(hit, faces, -1)).sum() <= 2e-5 * number
    assert row["time"] == pytest.approx(np.where(hit, times.min(axis=0), landing), rel=1e-7, abs=1e-9)
    assert np.array_equal(result.obstacle_hits["fragment"], np.flatnonzero(hit))
    for index, obstacle in enumerate(OBSTACLES):
        assert (row["obstacle"] == index).sum() > number * 2e-5, f"{obstacle.name}: the test meets too few"
    numbers = result.summary["status"]
    assert numbers["stopped"]["fragments"] + numbers["landed"]["fragments"] == number


def test_none_passes_in_vacuum() -> None:
    check_none_passes(40_000, seed=0)


@pytest.mark.slow
def test_none_passes_of_a_million() -> None:
    check_none_passes(1_000_000, seed=1)


@pytest.mark.parametrize("thickness", [1e-6, 0.01, 1.0])
@pytest.mark.parametrize("integrator", [None, FixedStep(0.02)])
def test_fast_and_thin(thickness: float, integrator: FixedStep | None) -> None:
    """2000 m/s through paper: every one that comes below the top stops."""
    z = np.linspace(0.0, 4.0, 2001)
    place = np.stack([np.zeros_like(z), np.zeros_like(z), z], axis=1)
    shots = Fragments(0.01, place, (2000.0, 100.0, 0.0))
    result = fly(
        shots, air="vacuum", gravity=0.0, ground=0.0, time_limit=0.2, integrator=integrator,
        obstacles=[Wall((100.0, -50.0), (100.0, 50.0), 2.0, thickness)],
    )  # fmt: skip
    assert np.array_equal(result.landing["status"] == Status.STOPPED, z < 2.0)
    assert result.obstacle_hits["position"][:, 0] == pytest.approx(100.0 - 0.5 * thickness, abs=1e-9)


def test_edge_on() -> None:
    """Straight at an upright edge, exactly and next to it: it stops on one side or the other, never passes."""
    offset = np.array([-1e-3, -1e-9, -1e-15, 0.0, 1e-15, 1e-9, 1e-3])
    place = np.stack([np.zeros(7), offset, np.ones(7)], axis=1)
    shots = Fragments(0.01, place, (300.0, 0.0, 0.0))
    house = Building((20.0, 0.0), 5.0, 5.0, 3.0, azimuth=45.0)
    landing = fly(shots, air="vacuum", gravity=0.0, time_limit=1.0, obstacles=[house]).landing
    assert (landing["status"] == Status.STOPPED).all()
    assert landing["position"][:, 0] == pytest.approx(20.0 - 2.5 * math.sqrt(2.0), abs=2e-3)


def test_shadow_of_a_barricade() -> None:
    """Straight lines: fragments below the line over the crest stop, those above pass. In front it is one angle."""
    bank = Barricade((10.0, -500.0), (10.0, 500.0), 4.0, crest_width=1.0, slope=2.0)
    elevation = np.radians(np.linspace(0.05, 60.0, 2000))
    direction = np.stack([np.cos(elevation), 0.0 * elevation, np.sin(elevation)], axis=1)
    shots = Fragments(0.01, (0.0, 0.0, 1.0), 500.0 * direction)
    landing = fly(shots, air="vacuum", gravity=0.0, time_limit=1.0, obstacles=[bank]).landing
    shadow = math.atan2(4.0 - 1.0, 10.0 - 0.5)  # up to the near edge of the crest
    assert np.array_equal(landing["status"] == Status.STOPPED, elevation < shadow)
    stopped = landing[landing["status"] == Status.STOPPED]
    assert (stopped["face"] == bank.faces.index("left")).all()
    x, z = stopped["position"][:, 0], stopped["position"][:, 2]
    assert z == pytest.approx(4.0 - (9.5 - x) / 2.0, abs=1e-9)


def test_faces_of_a_building() -> None:
    """Shot at from each side and from above."""
    house = Building((0.0, 0.0), 10.0, 6.0, 4.0, azimuth=90.0, name="house")
    place = [(0.0, 50.0, 2.0), (0.0, -50.0, 2.0), (-50.0, 0.0, 2.0), (50.0, 0.0, 2.0), (1.0, 1.0, 50.0)]
    velocity = [(0, -100.0, 5.0), (0, 100.0, 5.0), (100.0, 0, 5.0), (-100.0, 0, 5.0), (0, 0, -10.0)]
    mass = [0.01, 0.02, 0.03, 0.04, 1e-4]
    shots = Fragments(mass, place, velocity)
    result = fly(shots, obstacles=[house], origin=(30.0, 30.0))
    assert [house.faces[i] for i in result.obstacle_hits["face"]] == ["front", "back", "left", "right", "roof"]
    assert result.obstacle_hits["position"][:, 1] == pytest.approx([5.0, -5.0, 0.0, 0.0, 1.0], abs=1e-9)
    (entry,) = result.by_face()
    assert (entry["name"], entry["kind"], entry["hits"], entry["stopped"]) == ("house", "building", 5, 5)
    assert entry["stopped_mass"] == pytest.approx(sum(mass))
    faces = {face["face"]: face for face in entry["faces"]}
    assert list(faces) == ["left", "right", "back", "front", "roof"]
    assert [faces[name]["azimuth_deg"] for name in ("front", "left", "back", "right")] == pytest.approx(
        [90, 180, 270, 0]
    )
    assert faces["roof"]["azimuth_deg"] is None
    assert [face["hits"] for face in entry["faces"]] == [1] * 5
    hazardous = int((result.obstacle_hits["energy"] >= 20.0).sum())
    assert sum(face["hazardous_hits"] for face in result.by_face(20.0)[0]["faces"]) == hazardous == 3
    assert result.summary["status"]["stopped"] == {"fragments": 5, "mass": pytest.approx(sum(mass))}


def test_ricochet_off_a_wall() -> None:
    """Along a wall at 11 degrees without gravity: it leaves by the law of its own, in the plane of the impact."""
    law = Ricochet(30.0, 0.5, 0.4)
    wall = Wall((10.0, -50.0), (10.0, 50.0), 5.0, 1.0, ricochet=law)
    shot = Fragments(0.02, (0.0, -40.0, 1.0), (20.0, 100.0, 0.0))
    result = fly(shot, air="vacuum", gravity=0.0, time_limit=1.0, obstacles=[wall], sample=[0])
    time = 9.5 / 20.0
    hit, row = result.obstacle_hits[0], result.landing[0]
    assert (hit["stopped"], hit["time"], hit["speed"]) == (0, pytest.approx(time), pytest.approx(math.hypot(100, 20)))
    assert (row["status"], row["obstacle"]) == (Status.TIME_OUT, -1)
    kept, departure = law.after(math.degrees(math.atan2(20.0, 100.0)))
    speed, left = kept * math.hypot(100.0, 20.0), 1.0 - time
    off, along = speed * math.sin(math.radians(departure)), speed * math.cos(math.radians(departure))
    assert row["position"] == pytest.approx([9.5 - off * left, 100.0 * time - 40.0 + along * left, 1.0], abs=1e-6)
    assert (row["ricochets"], result.summary["ricochets"]) == (0, 0)  # off the ground, and it has not come there
    assert result.trajectories.time[0] == 0.0
    assert (np.diff(result.trajectories.time) >= 0.0).all()


def test_straight_at_a_wall_it_stops_whatever_the_wall() -> None:
    wall = Wall((10.0, -50.0), (10.0, 50.0), 5.0, 1.0, ricochet="rock")
    shot = Fragments(0.02, (0.0, 0.0, 1.0), (100.0, 20.0, 0.0))  # 79 degrees from its face
    row = fly(shot, air="vacuum", obstacles=[wall]).landing[0]
    assert (row["status"], row["last_status"], row["obstacle"]) == (Status.STOPPED, Status.STOPPED, 0)


def test_only_ricochets_off_the_ground_are_counted() -> None:
    """Off a wall at 5.7 degrees and then off the ground at less than one: the wall is not counted."""
    wall = Wall((10.0, -50.0), (10.0, 250.0), 5.0, 1.0, ricochet="rock")
    shot = Fragments(0.02, (0.0, 0.0, 1.0), (30.0, 300.0, 0.0))
    result = fly(shot, air="vacuum", obstacles=[wall], ricochet=Ricochet(4.0, 0.3))
    row = result.landing[0]
    assert result.obstacle_hits["time"] == pytest.approx([9.5 / 30.0])
    assert row["time"] > 9.5 / 30.0
    assert 0.0 < row["angle"] < 1.0
    assert row["ricochets"] == (result.ricochets["energy_after"] > 0.0).sum() >= 1


def test_ricochet_off_a_roof_then_over_its_edge() -> None:
    house = Building((0.0, 0.0), 8.0, 8.0, 3.0, ricochet="concrete")
    shot = Fragments(0.02, (0.0, 0.0, 3.2), (300.0, 0.0, -20.0))
    result = fly(shot, obstacles=[house], origin=(50.0, 0.0), ricochet="none")
    row = result.landing[0]
    assert (row["status"], row["last_status"], row["face"]) == (Status.LANDED, Status.LANDED, -1)
    assert result.obstacle_hits["face"].tolist() == [4]
    assert result.obstacle_hits["stopped"].tolist() == [0]
    steep = Fragments(0.02, (0.0, 0.0, 8.0), (0.3, 0.0, 0.0))
    row = fly(steep, obstacles=[house], origin=(50.0, 0.0)).landing[0]
    assert (row["status"], row["last_status"], row["face"]) == (Status.STOPPED, Status.STOPPED, 4)
    assert row["last_position"][2] == pytest.approx(3.0, abs=1e-6)


def test_hits_on_witnesses_stop_at_the_wall() -> None:
    wall = Wall((10.0, -50.0), (10.0, 50.0), 500.0)
    panels = [Panel((x, 0.0, 2.0), (1.0, 0.0, 0.0), 4.0, 4.0, name=f"{x}") for x in (9.0, 11.0)]
    shot = Fragments(0.02, (0.0, 0.0, 1.0), (300.0, 0.0, 1.0))
    assert fly(shot, obstacles=[wall], witnesses=panels).hits["witness"].tolist() == [0]


def test_obstacles_on_a_slope_stand_on_the_ground() -> None:
    """On ground that falls along x nothing passes under the wall; its height counts from the ground at its centre."""
    x = np.linspace(-100.0, 100.0, 21)
    ground = HeightMap(np.tile(-0.3 * x, (21, 1)), 10.0, (-100.0, -100.0))
    walls = [Wall((40.0, -60.0), (40.0, 60.0), 2.0, 0.3), Wall((-50.0, -60.0), (-40.0, 60.0), 2.0, 0.3, base=14.0)]
    z = np.linspace(-11.8, -8.0, 100)
    place = np.stack([np.full(100, 39.5), np.zeros(100), z], axis=1)
    shots = Fragments(0.02, place, (100.0, 0.0, 0.0))
    landing = fly(shots, air="vacuum", gravity=0.0, ground=ground, obstacles=walls).landing
    assert np.array_equal(landing["status"] == Status.STOPPED, z < -10.0)
    along = Fragments(0.02, (0.0, 0.0, 0.5), (-30.0, 0.0, 11.0))
    row = fly(along, air="vacuum", gravity=0.0, ground=ground, obstacles=walls).landing[0]
    assert row["obstacle"] == -1  # over the second, which ends at 16 m
    assert row["status"] in (Status.TIME_OUT, Status.LANDED)


def everything() -> dict:
    """All features together."""
    heights = np.random.default_rng(5).uniform(0.0, 6.0, (81, 81))
    heights[38:43, 38:43] = 1.0
    return {
        "ground": HeightMap(heights, 25.0, (-1000.0, -1000.0)),
        "ricochet": "soft_soil",
        "obstacles": [
            Barricade((-8.0, 12.0), (8.0, 12.0), 3.0),
            Wall((15.0, -8.0), (15.0, 8.0), 4.0, ricochet="concrete"),
            Building((-60.0, -40.0), 20.0, 10.0, 6.0, azimuth=20.0, ricochet="rock"),
        ],
        "witnesses": [Cylinder(7.62, name="ring"), Cylinder(100.0, name="far")],
        "time_limit": 12.0,
    }


def test_none_disappears_and_threads_do_not_matter() -> None:
    fragments = cloud(4500, seed=4, height=2.0)
    one, three = (fly(fragments, threads=threads, sample=20, **everything()) for threads in (1, 3))
    for table in ("landing", "hits", "obstacle_hits"):
        assert getattr(one, table).tobytes() == getattr(three, table).tobytes(), table
    assert one.trajectories.position.tobytes() == three.trajectories.position.tobytes()
    for field in ("status", "last_status"):
        counts = one.summary[field]
        assert sum(entry["fragments"] for entry in counts.values()) == 4500
        assert sum(entry["mass"] for entry in counts.values()) == pytest.approx(fragments.mass.sum(), rel=1e-12)
        assert set(one.landing[field].tolist()) <= {status.value for status in Status}
    row = one.landing
    assert np.array_equal(row["fragment"], np.arange(4500))
    assert np.array_equal(row["obstacle"] >= 0, row["last_status"] == Status.STOPPED)
    stopped = one.obstacle_hits[one.obstacle_hits["stopped"] == 1]
    assert np.array_equal(stopped["fragment"], np.flatnonzero(row["last_status"] == Status.STOPPED))
    assert np.array_equal(stopped["obstacle"], row["obstacle"][stopped["fragment"]])
    assert np.array_equal(stopped["face"], row["face"][stopped["fragment"]])
    assert (row["last_time"] >= row["time"]).all()
    assert {s for s in Status if counts[s.name.lower()]["fragments"]} >= {Status.LANDED, Status.STOPPED}
    assert (one.landing["ricochets"] > 0).any()
    ground = everything()["ground"]
    on = row[row["last_status"] == Status.LANDED]
    assert on["last_position"][:, 2] == pytest.approx(ground.at(*on["last_position"][:, :2].T), abs=1e-9)
    assert (np.diff(one.hits["fragment"]) >= 0).all()
    assert (np.diff(one.obstacle_hits["fragment"]) >= 0).all()


def test_files(tmp_path) -> None:
    fragments = cloud(2000, seed=4, height=2.0)
    result = fly(fragments, **everything())
    names = [path.name for path in result.write(tmp_path)]
    assert {"obstacle_hits.h5", "obstacle_hits.csv"} <= set(names)
    hits, obstacles = read_table(tmp_path / "obstacle_hits.h5", "obstacle_hits")
    assert hits.tobytes() == result.obstacle_hits.tobytes()
    assert obstacles == ["barricade", "wall", "building"]
    lines = [line for line in (tmp_path / "obstacle_hits.csv").read_text().splitlines() if not line.startswith("#")]
    assert lines[0].startswith("name,face_name,obstacle,face,fragment")
    assert len(lines) == 1 + len(hits)
    assert read_table(tmp_path / "landing.h5", "landing")[0].tobytes() == result.landing.tobytes()


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Wall((0, 0), (0, 0), 2.0), r"obstacle wall: start and end are both \(0, 0\); they must differ"),
        (lambda: Wall((0, 0), (1, 0), 2.0, 0.0), "thickness is 0.0 m, needed: above zero"),
        (lambda: Wall((0, 0), (1, math.nan), 2.0), "end is .*, needed: 2 finite numbers"),
        (lambda: Barricade((0, 0), (1, 0), -2.0), "height is -2.0 m"),
        (lambda: Barricade((0, 0), (1, 0), 2.0, slope=-1.0), "slope is -1.0"),
        (lambda: Building((0, 0), 1.0, 0.0, 1.0), "width is 0.0 m"),
        (lambda: Building((0, 0), 1.0, 1.0, 1.0, base=math.inf), "base is inf"),
        (
            lambda: Wall((0, 0), (1, 0), 2.0, ricochet="stone"),
            "obstacle wall: ricochet: unknown kind of surface 'stone'",
        ),
        (
            lambda: fly(cloud(3), obstacles=[Cylinder(1.0)]),
            r"found Cylinder\(.*; allowed: flight.Wall, Barricade or B",
        ),
        (
            lambda: fly(cloud(3), obstacles=[Building((0.5, 0.5), 4.0, 4.0, 3.0, name="store")]),
            r"obstacle store: 3 fragments start inside it, the first is number 0 at \(0.0, 0.0, 1.5\) m",
        ),
        (
            lambda: fly(cloud(3), obstacles=[Wall((-5, 0), (5, 0), 1.0)]),
            r"obstacle wall: it stands on the origin \(0.0, 0.0\) m, from which distances are counted",
        ),
        (lambda: fly(cloud(3), obstacles=[Wall((2, 0), (3, 0), 1.0, base=-2.0)]), "its top at -1 m is not above the"),
        (lambda: fly(cloud(3), ground=None, obstacles=[Wall((2, 0), (3, 0), 1.0)]), "give it a base"),
    ],
)
def test_messages(make, message: str) -> None:
    with pytest.raises(InputError, match=message):
        make()


def gully(x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """Level ground with a gully 8 m deep and 26 m wide across y = 0, rising by 5 % along y."""
    return 0.05 * y - 8.0 * np.clip(1.0 - np.abs(y) / 13.0, 0.0, 1.0) + 0.0 * x


@pytest.mark.parametrize("kind", [Wall, Barricade])
def test_a_crest_follows_the_ground_below_each_point(kind: type) -> None:
    """Level shots across one line over a gully stop up to its height over the ground there, and no higher."""
    axis = np.arange(-100.0, 101.0, 2.0)
    ground = HeightMap(gully(*np.meshgrid(axis, axis)), 2.0, (axis[0], axis[0]))
    line = kind((20.0, -50.0), (20.0, 50.0), 4.0)
    generator = np.random.default_rng(5)
    y, over = generator.uniform(-49.0, 49.0, 4000), generator.uniform(0.1, 8.0, 4000)
    start = np.column_stack([np.full_like(y, -15.0), y, ground.at(np.full_like(y, 20.0), y) + over])
    shots = Fragments(0.01, start, (1000.0, 0.0, 0.0))
    scene = {"air": "vacuum", "gravity": 0.0, "ground": ground, "ricochet": "none", "time_limit": 0.05,
             "origin": (-90.0, 0.0)}  # fmt: skip
    stopped = fly(shots, obstacles=[line], **scene).landing["status"] == Status.STOPPED
    clear = np.abs(over - 4.0) > 0.02 * 4.0 + 1e-3
    assert np.array_equal(stopped[clear], over[clear] < 4.0)
    level = kind((20.0, -50.0), (20.0, 50.0), 4.0, base=0.0)
    stopped = fly(shots, obstacles=[level], **scene).landing["status"] == Status.STOPPED
    assert np.array_equal(stopped, start[:, 2] < 4.0), "with a level of its own its top is level"


def test_no_path_slips_in_where_parts_of_a_crest_join() -> None:
    """Shots exactly at the joints, and hits counted as of one obstacle with the faces of a level one."""
    axis = np.arange(-100.0, 101.0, 2.0)
    ground = HeightMap(gully(*np.meshgrid(axis, axis)), 2.0, (axis[0], axis[0]))
    walls = [Wall((40.0, -90.0), (40.0, -89.0), 2.0, name="other"), Wall((20.0, -50.0), (20.0, 50.0), 4.0)]
    along, tops = walls[1].crest(ground.at)
    assert 4 <= len(along) <= 12
    y = np.concatenate([-50.0 + 100.0 * along[1:-1], np.linspace(-49.0, 49.0, 99)])
    height = np.interp(y, -50.0 + 100.0 * along, tops)
    start = np.column_stack([np.zeros_like(y), y, height - 1.0])
    result = fly(Fragments(0.01, start, (1000.0, 0.0, 0.0)), air="vacuum", gravity=0.0, ground=ground,
                 ricochet="none", obstacles=walls)  # fmt: skip
    assert (result.landing["obstacle"] == 1).all()
    assert (result.landing["face"] == 0).all()
    assert np.abs(result.landing["position"][:, 0] - 19.9).max() < 1e-9
