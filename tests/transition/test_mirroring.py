"""Rounds behind planes of symmetry: which there are, where they fly, and from which random stream."""

from __future__ import annotations

import numpy as np
import pytest

from flight import Fragments
from tests.transition.synthetic import Tube, azimuth_difference, joined, polar_difference, sealed
from transition import BreakUp, BreakUpSettings, InputError, Snapshot, break_up
from transition.motion import SymmetryPlane, images

PLACE = (0.2, 0.3, 0.05)
X = ("x = 0", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
Y = ("y = 0.1", (0.0, 0.1, 0.0), (0.0, 2.0, 0.0))
GROUND = ("ground", (3.0, 0.0, 0.0), (0.0, 0.0, 1.0))
ARRAYS = ("mass", "position", "velocity", "shape_factor", "round", "segment")


def snapshot(folder, *planes, places=(PLACE,), **others):
    def add(file):
        for number, (name, point, normal) in enumerate(planes):
            file.create_group(f"planes/{number}").attrs.update({"name": name, "point": point, "normal": normal})

    tube = Tube(around=16, axial=12, radial_cells=2, places=places, **others)
    return Snapshot.read(sealed(tube.write(folder / f"{len(planes)}_{len(places)}.h5"), add))


@pytest.fixture(scope="module")
def quarter(tmp_path_factory):
    """A round in the corner of two planes, prepared, and one realisation."""
    prepared = BreakUp(snapshot(tmp_path_factory.mktemp("quarter"), X, Y), BreakUpSettings(direction_scatter=0.0))
    return prepared, prepared.realisation(2)


def test_computed_rounds_break_up_as_without_planes(tmp_path):
    places = (PLACE, (0.5, 0.3, 0.05))
    alone = break_up(snapshot(tmp_path, places=places), seed=4, realisation=3)
    mirrored = break_up(snapshot(tmp_path, X, Y, places=places), seed=4, realisation=3)
    assert set(mirrored.fragments.round) == set(range(8))
    kept = mirrored.fragments.select(mirrored.fragments.round < 2)
    for name in ARRAYS:
        assert np.array_equal(getattr(kept, name), getattr(alone.fragments, name)), name
    assert alone.summary["rounds"] == mirrored.summary["rounds"][:2]


def test_every_image_breaks_by_the_round_s_laws_from_a_random_stream_of_its_own(quarter, tmp_path):
    prepared, result = quarter
    parts = [result.fragments.select(result.fragments.round == number) for number in range(4)]
    for first in range(4):
        numbers = np.bincount(parts[first].segment, minlength=4)
        assert np.abs(numbers - [law.n0 for law in prepared.laws]).max() < 1.0  # each rounded up or down at random
        for second in range(first):
            assert not np.isin(parts[first].mass, parts[second].mass).any()
    swapped = BreakUp(snapshot(tmp_path, Y, X), prepared.settings).fragments(2)
    alone = prepared.fragments(2)
    for name in ARRAYS:
        assert np.array_equal(getattr(swapped, name), getattr(result.fragments, name)), name
        assert np.array_equal(getattr(alone, name), getattr(result.fragments, name)), "without ledgers"


def test_images_fly_as_the_mirrored_cells(quarter, tmp_path):
    _, result = quarter
    signs = {1: (-1.0, 1.0, 1.0), 2: (1.0, -1.0, 1.0), 3: (-1.0, -1.0, 1.0)}
    points, clusters = joined(result)
    places, velocities = clusters.means(points)
    for number, sign in signs.items():
        mine = result.fragments.round == number
        shift = np.array([0.0, 0.2 if sign[1] < 0 else 0.0, 0.0])
        assert np.abs(result.fragments.position[mine] - (places[mine] * sign + shift)).max() < 1e-15
        assert np.array_equal(result.fragments.velocity[mine], velocities[mine] * sign)
    names = [entry["name"] for entry in result.summary["rounds"]]
    assert names == ["round 0", *(f"round 0 mirrored at {at}" for at in ("x = 0", "y = 0.1", "x = 0 and y = 0.1"))]
    assert [entry["mirror_of"] for entry in result.summary["rounds"]] == [None, *["round 0"] * 3]
    assert result.fragments.round_names == tuple(names)
    back = Fragments.read(result.fragments.write(tmp_path / "fragments.h5"))
    assert back.round_names == back.select(slice(0, 3)).round_names == tuple(names)
    assert np.array_equal(back.round, result.fragments.round)


def test_mass_and_momentum_are_kept_round_by_round(tmp_path):
    half = snapshot(tmp_path, X, Y, GROUND, velocity=lambda places: 800.0 + 3000.0 * places)
    result = break_up(half, BreakUpSettings(direction_scatter=0.0), seed=3)
    mass, nodes = half.mass[half.casing].sum(), half.cells[half.casing]
    casing = np.einsum("c,ckj->j", half.mass[half.casing], half.velocity[nodes]) / 8.0
    scale, signs = 0.0, set()
    for number in range(8):
        part = result.fragments.select(result.fragments.round == number)
        scale = mass * np.linalg.norm(half.velocity[nodes], axis=2).mean()
        assert part.total_mass == pytest.approx(mass, rel=1e-12)
        assert np.abs(np.abs(part.momentum) - np.abs(casing)).max() < 1e-12 * scale
        signs.add(tuple(np.sign(part.momentum)))
    assert len(signs) == 8
    assert result.ledger.casing_mass == pytest.approx(8.0 * mass, rel=1e-12)
    assert np.abs(result.ledger.casing_momentum).max() < 1e-9 * mass * 800.0  # the eight cancel
    assert result.summary["momentum_error"] < 1e-12
    single = 0.5 * float(half.mass[half.casing] @ (half.velocity[nodes] ** 2).sum(axis=2).mean(axis=1))
    assert result.ledger.casing_energy == pytest.approx(8.0 * single, rel=1e-12)
    assert -0.06 < result.summary["energy_error"] < 0.0


def test_directions_of_an_image_are_held_against_the_mirrored_cells(tmp_path):
    made = snapshot(tmp_path, X, velocity=lambda places: places * [9e3, 2e3, 1e3])
    mirrored = break_up(made, BreakUpSettings(direction_scatter=0.0), seed=3).directions[1]
    assert mirrored.azimuth_cells[72 // 2 - 8 : 72 // 2 + 9].sum() > 0.99  # towards -x
    assert azimuth_difference(mirrored) < 0.05
    assert polar_difference(mirrored) < 0.05


def test_an_interpolated_velocity_is_mirrored(tmp_path):
    result = break_up(snapshot(tmp_path, X), BreakUpSettings(velocity="interpolation", direction_scatter=0.0), seed=5)
    fragments = result.fragments
    for part, side in ((fragments.round == 0, 1.0), (fragments.round == 1, -1.0)):
        place, velocity = fragments.position[part] * [side, 1.0, 1.0], fragments.velocity[part] * [side, 1.0, 1.0]
        outward = place[:, :2] / np.linalg.norm(place[:, :2], axis=1)[:, None]
        across = velocity[:, :2] @ [1.0, 0.0]
        assert np.abs(across - 1000.0 * outward[:, 0]).max() < 25.0  # the field is linear in each cell
    assert (fragments.position[fragments.round == 1, 0] < 0.0).all()


def _plane(name, normal, point=(0.0, 0.0, 0.0)):
    return SymmetryPlane(name, point, tuple(np.asarray(normal) / np.linalg.norm(normal)))


@pytest.mark.parametrize(
    ("normals", "number"),
    [
        ([], 0),
        ([(1, 0, 0)], 1),
        ([(1, 0, 0), (0, 1, 0)], 3),
        ([(1, 0, 0), (0, 1, 0), (0, 0, 1)], 7),
        ([(0.6, 0.8, 0), (-0.8, 0.6, 0)], 3),
    ],
)
def test_images_are_the_closure_of_the_reflections(normals, number):
    planes = [_plane(f"plane {k}", normal, (0.3, 0.2, 0.1)) for k, normal in enumerate(normals)]
    found = images(planes)
    assert len(found) == number
    point = np.array([0.9, 0.31, 0.77])
    places = np.array([point, *(image.place(point) for image in found)])
    for plane in planes:  # reflecting the whole set gives the set
        normal = np.array(plane.normal)
        reflected = places - 2.0 * ((places - plane.point) @ normal)[:, None] * normal
        nearest = np.abs(reflected[:, None] - places[None]).max(axis=2).min(axis=1)
        assert nearest.max() < 1e-12
    assert all(np.linalg.det(image.matrix) == pytest.approx((-1.0) ** len(image.planes), abs=1e-12) for image in found)


@pytest.mark.parametrize("distance", [0.0, 1e-4, 1e3])
def test_mirrors_close_wherever_they_stand(distance):
    found = images([_plane("a", (1, 0, 0), (distance, 0.0, 0.0)), _plane("b", (0, 1, 0), (0.0, -distance, 0.0))])
    assert [image.planes for image in found] == [("a",), ("b",), ("a", "b")]
    assert found[2].place(np.zeros(3)) == pytest.approx([2.0 * distance, -2.0 * distance, 0.0], rel=1e-12)
    far = np.array([0.3, 0.2, 0.1]) + distance
    assert found[2].place(far) == pytest.approx([distance - 0.3, -3.0 * distance - 0.2, far[2]], rel=1e-12)


@pytest.mark.parametrize(
    ("planes", "message"),
    [
        ([_plane("left", (1, 0, 0)), _plane("right", (-1, 0, 0), (1.0, 0.0, 0.0))], "'left' and 'right' are parallel"),
        ([_plane("a", (0, 1, 0)), _plane("b", (1, -1, 0))], "'a' and 'b' meet at 45 degrees; allowed: planes at right"),
        ([_plane("a", (0, 1, 0)), _plane("b", (1, 2e-6, 0))], "'a' and 'b' meet at 89.9999 degrees"),
    ],
)
def test_planes_that_are_not_at_right_angles_are_refused(planes, message):
    with pytest.raises(InputError, match=message):
        images(planes)


@pytest.mark.parametrize(
    ("planes", "message"),
    [
        ([("x = 0", (0, 0, 0), (-1, 0, 0))], r"casing nodes stand 0.278 m behind the plane of symmetry 'x = 0'"),
        ([("x = 0.2", (0.2, 0, 0), (1, 0, 0))], r"casing nodes stand 0.0775 m behind the plane of symmetry 'x = 0.2'"),
        ([X, X], "2 planes of symmetry are called 'x = 0'"),
        ([("x = 0", (0, 0, 0), (0, 0, 0))], r"planes/0: attribute normal is \[0.0, 0.0, 0.0\]; it has no direction"),
        ([("x = 0", (0, 0), (1, 0, 0))], r"planes/0: attribute point is \[0.0, 0.0\]; three finite numbers"),
    ],
)
def test_planes_that_cannot_be_are_refused(tmp_path, planes, message):
    with pytest.raises(InputError, match=message):
        snapshot(tmp_path, *planes)
