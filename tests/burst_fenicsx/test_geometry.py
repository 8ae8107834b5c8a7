"""Contours and profiles: exact volumes against closed forms, the built-in rounds' masses, and the messages."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from burst_fenicsx.errors import InputError
from burst_fenicsx.geometry import Contour, Fuze, Profile, load_profile, profile_from_table, profile_names

FULL = {
    "unit": "mm",
    "outer": {"points": [[0, 30], [200, 77.5], [600, 77.5]], "arcs": [900, 0]},
    "cavity": {"points": [[60, 25], [200, 60], [550, 60]]},
    "charge": {"front": 60},
}


def table(**changes):
    """Return a sound profile table with some keys replaced."""
    return {**FULL, **changes}


def test_cylinder_and_cone_have_their_closed_volumes():
    contour = Contour.from_points([(0, 0.02), (0.1, 0.05), (0.4, 0.05)])
    cone = np.pi * 0.1 * (0.02**2 + 0.02 * 0.05 + 0.05**2) / 3
    cylinder = np.pi * 0.05**2 * 0.3
    assert contour.volume() == pytest.approx(cone + cylinder, rel=1e-14)
    assert contour.volume(0.1) == pytest.approx(cylinder, rel=1e-14)


@pytest.mark.parametrize("radius", [0.01, 1.0, 40.0])
def test_half_circle_makes_a_sphere(radius):
    contour = Contour.from_points([(0, 0), (2 * radius, 0)], [radius])
    assert contour.volume() == pytest.approx(4 / 3 * np.pi * radius**3, rel=1e-13)
    assert contour.max_radius == pytest.approx(radius, rel=1e-14)
    height = 0.3 * radius
    cap = np.pi * height**2 * (3 * radius - height) / 3
    assert contour.volume(0, height) == pytest.approx(cap, rel=1e-12)


@pytest.mark.parametrize("arc", [0.3, -0.3, 1.6, -20.0])
def test_arcs_pass_through_their_points_and_agree_with_quadrature(arc):
    first, last = (0.02, 0.05), (0.25, 0.07)
    contour = Contour.from_points([first, last], [arc])
    assert contour.radius([first[0], last[0]]) == pytest.approx([first[1], last[1]], rel=1e-12)
    chord_middle = 0.5 * (first[1] + last[1])
    assert np.sign(contour.radius(0.135) - chord_middle) == np.sign(arc)
    points, weights = np.polynomial.legendre.leggauss(60)
    stations = 0.135 + 0.115 * points
    assert contour.volume() == pytest.approx(np.pi * 0.115 * np.sum(weights * contour.radius(stations) ** 2), rel=1e-12)


def test_parts_of_every_built_in_profile_fill_the_outer_contour():
    for name in profile_names():
        profile = load_profile(name)
        parts = profile.volumes()
        total = parts.casing + parts.charge + parts.fuze + parts.void
        assert total == pytest.approx(profile.outer.volume(), rel=1e-13)
        pieces = [profile.volumes(segment.start, segment.end) for segment in profile.segments]
        assert sum(piece.casing for piece in pieces) == pytest.approx(parts.casing, rel=1e-12)
        assert sum(piece.charge for piece in pieces) == pytest.approx(parts.charge, rel=1e-12)
        assert profile.source


def test_m107_has_the_masses_of_its_drawing():
    profile = load_profile("m107")
    assert profile.casing_volume * 7850 == pytest.approx(34.53, rel=1e-3)
    assert profile.charge_volume * 1630 == pytest.approx(6.863, rel=1e-3)
    assert profile.fuze_mass == pytest.approx(42.98 - 34.53 - 0.544 - 6.863, abs=1e-9)
    assert profile.length == pytest.approx(0.604, abs=2e-4)
    section = profile.section([0.4, 0.5])
    assert section.wall == pytest.approx([0.018, 0.018], abs=1e-12)


def test_m1_has_the_masses_of_its_drawing_and_the_lengths_of_its_list():
    profile = load_profile("m1_105")
    assert profile.casing_volume * 7850 == pytest.approx(26.04 * 0.45359237, rel=1e-3)
    assert profile.charge_volume * 1630 == pytest.approx(4.84 * 0.45359237, rel=1e-3)
    ogive, band_and_cylinder, boat_tail = np.diff(profile.outer.stations)
    assert (ogive, boat_tail) == pytest.approx((0.1468, 0.0516), abs=1e-6)
    assert band_and_cylinder > 0.1574
    assert profile.length - profile.cavity.end == pytest.approx(0.0177, abs=1e-6)


@pytest.mark.parametrize(
    ("name", "radius", "wall", "plate"), [("generic_thin", 0.09, 0.009, 0.02), ("generic_heavy", 0.0775, 0.028, 0.04)]
)
def test_generic_bodies_are_closed_cylinders(name, radius, wall, plate):
    profile = load_profile(name)
    stations = np.linspace(profile.charge_front, profile.charge_end, 5)[1:-1]
    assert profile.section(stations).wall == pytest.approx(np.full(3, wall), abs=1e-12)
    inside = np.pi * (radius - wall) ** 2 * (0.6 - 2.0 * plate)
    assert profile.charge_volume == pytest.approx(inside, rel=1e-9)
    assert profile.casing_volume == pytest.approx(np.pi * radius**2 * 0.6 - inside, rel=1e-9)


@pytest.mark.parametrize(("name", "casing"), [("grenade_155", 40.0), ("grenade_155_32kg", 32.0)])
def test_projectile_meets_all_numbers_of_the_paper_at_once(name, casing):
    profile = load_profile(name)
    assert profile.length == pytest.approx(0.660, abs=1e-12)
    assert 2 * profile.max_radius == pytest.approx(0.155, abs=1e-9)
    assert profile.charge_volume * 1630 == pytest.approx(8.0, rel=5e-4)
    assert profile.casing_volume * 7800 == pytest.approx(casing, rel=5e-4)
    bore = 2 * np.sqrt(profile.cavity.volume() / (np.pi * profile.cavity.length))
    assert bore == pytest.approx(0.110, rel=5e-4)
    stations = np.linspace(profile.charge_front, profile.charge_end, 501)
    section = profile.section(stations)
    ratio = section.charge_radius**2 / (section.outer_radius**2 - section.inner_radius**2)
    assert 0.25 < stations[np.argmax(ratio)] / profile.length < 0.50


def test_section_distinguishes_solid_hollow_and_fuze():
    profile = load_profile("m107")
    section = profile.section([0.02, 0.4, 0.59])
    assert section.inner_radius == pytest.approx([0.020, 0.0595, 0.0])
    assert section.charge_radius == pytest.approx([0.0, 0.0595, 0.0])
    assert section.wall[2] == section.outer_radius[2]
    with pytest.raises(
        InputError, match=r"stations 700 mm to 700 mm asked for, the contour runs from 0 mm to 603\.9 mm"
    ):
        profile.section(0.7)


def test_automatic_segments_follow_the_contour():
    profile = profile_from_table(table(), "inline")
    kinds = [segment.kind for segment in profile.segments]
    assert kinds[0] == "nose"
    assert kinds[-1] == "base"
    assert set(kinds[1:-1]) == {"wall"}
    assert profile.segments[0].start == 0.0
    assert profile.segments[-1].end == profile.length
    ends = [segment.end for segment in profile.segments]
    assert any(end == pytest.approx(0.2) for end in ends)  # the shoulder
    for before, after in pairwise(profile.segments):
        assert before.end == after.start


def test_profile_file_of_a_user(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(
        'unit = "in"\n[outer]\npoints = [[0, 3], [10, 3]]\n[cavity]\npoints = [[0, 2], [9, 2]]\n[charge]\nfront = 0\n'
    )
    profile = load_profile(path)
    assert profile.name == "mine"
    assert profile.length == pytest.approx(0.254)
    assert profile.charge_volume == pytest.approx(np.pi * (2 * 0.0254) ** 2 * 9 * 0.0254, rel=1e-13)
    assert [segment.kind for segment in profile.segments] == ["wall", "base"]


def test_void_front_is_no_part():
    profile = profile_from_table(table(charge={"front": 100}, fuze={"fill": "void"}), "inline")
    parts = profile.volumes()
    assert parts.fuze == 0.0
    assert parts.void == pytest.approx(profile.cavity.volume(0.06, 0.1), rel=1e-13)
    assert profile.fuze_density == 0.0


BAD = [
    (
        {"cavity": {"points": [[60, 25], [120, 70], [550, 60]]}},
        r"inline: the cavity crosses the outer contour; worst at station 120 mm, where the wall is -5\.\d+ mm",
    ),
    (
        {"outer": {"points": [[0, 30], [200, 77.5], [150, 70]]}},
        r"\[outer\]: stations must increase .* found 200 mm followed by 150 mm",
    ),
    (
        {"outer": {"points": [[0, 30], [200, -1], [600, 70]]}},
        r"\[outer\]: radius -1 mm at station 200 mm; it may not be negative",
    ),
    (
        {"outer": {"points": [[0, 30], [200, 77.5], [600, 77.5]], "arcs": [90, 0]}},
        r"arc radius 90 mm between .* is too small for its chord of 205.563 mm; at least 102.782 mm",
    ),
    (
        {"cavity": {"points": [[60, 25], [70, 60], [550, 60]], "arcs": [18.3, 0]}},
        r"\[cavity\]: arc radius 18.3 mm .* turns back along the axis; a radius of at least 66.25 mm",
    ),
    (
        {"outer": {"points": [[0, 30], [600, 30]], "arcs": [1e9]}},
        r"flatter than 10000 chords; use 0 for a straight line",
    ),
    (
        {"charge": {"front": 590}},
        r"\[charge\]: front = 590 mm lies outside the cavity; allowed: 60 \(full\) to below 550 mm",
    ),
    ({"charge": {"front": 80}}, r"\[fuze\]: missing; the cavity before the charge \(60 to 80 mm\)"),
    ({"fuze": {"fill": "inert", "mass": 1.0}}, r"\[fuze\]: the charge fills the whole cavity"),
    (
        {"charge": {"front": 80}, "fuze": {"fill": "inert"}},
        r"\[fuze\]: key 'mass' is missing; a number above 0 \(kg\) is expected",
    ),
    (
        {"charge": {"front": 80}, "fuze": {"fill": "inrt"}},
        r"fill = 'inrt'; did you mean 'inert'\? allowed: inert, void",
    ),
    (
        {"cavity": {"points": [[60, 25], [650, 60]]}},
        r"\[cavity\]: runs from 60 to 650 mm; it must lie within .* 0 to 600 mm",
    ),
    (
        {"outer": {"points": [[10, 30], [600, 77.5]]}},
        r"\[outer\]: the first station is 10 mm; the nose end must be station 0",
    ),
    ({"unit": "millimetre"}, r"inline: unit = 'millimetre'; .*allowed: cm, in, m, mm"),
    ({"outer": {"pionts": []}}, r"\[outer\]: unknown key 'pionts'; did you mean 'points'\?"),
    ({"outer": {"points": [[0, 30], [600]]}}, r"\[outer\]: points\[1\] = \[600\]; a list of 2 numbers is expected"),
    ({"outer": {"points": [[0, 30], [600, 40]], "arcs": [1, 2]}}, r"arcs = \[1, 2\]; a list of 1 numbers is expected"),
    ({"cavity": 3}, r"\[cavity\]: found 3, a table is expected"),
    (
        {"segment": [{"start": 0, "end": 100}, {"start": 150, "end": 600}]},
        r"segment 'wall 2' runs from 150 to 600 mm; it must start where the one before ends \(100 mm\)",
    ),
    ({"segment": [{"start": 0, "end": 500}]}, r"the segments end at 500 mm, the round at 600 mm"),
    ({"segment": [{"start": 0, "end": 600, "kind": "bse"}]}, r"kind = 'bse'; did you mean 'base'\?"),
]


@pytest.mark.parametrize(("changes", "message"), BAD)
def test_bad_profile_is_refused_with_what_to_change(changes, message):
    with pytest.raises(InputError, match=message):
        profile_from_table(table(**changes), "inline")


def test_contour_shorter_than_two_points_or_uneven_is_refused():
    with pytest.raises(InputError, match="found 1 point"):
        Contour((0.0,), (1.0,))
    with pytest.raises(InputError, match="2 stations, 1 radii and 1 arcs"):
        Contour((0.0, 1.0), (1.0,))


def test_void_with_a_mass_is_refused():
    outer = Contour.from_points([(0, 0.05), (0.3, 0.05)])
    cavity = Contour.from_points([(0, 0.04), (0.3, 0.04)])
    with pytest.raises(InputError, match="a void has no mass"):
        Profile("mine", outer, cavity, 0.1, Fuze("void", 2.0))


def test_unknown_profile_names_the_nearest_one(tmp_path):
    with pytest.raises(
        InputError, match=r"profile 'm170' is unknown; did you mean 'm107'\? allowed: copper_cylinder, .*tube"
    ):
        load_profile("m170")
    with pytest.raises(InputError, match=r"none\.toml: no such file"):
        load_profile(tmp_path / "none.toml")
    broken = tmp_path / "broken.toml"
    broken.write_text("unit = ")
    with pytest.raises(InputError, match=r"broken\.toml: not a TOML file"):
        load_profile(broken)
