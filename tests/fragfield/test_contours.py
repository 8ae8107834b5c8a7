"""Contours from drawings: the same shell however it is drawn, what is mended and said, and what is refused."""

from __future__ import annotations

import itertools
import json
import math
import random

import ezdxf
import numpy as np
import openpyxl
import pytest
from ezdxf.math import Matrix44

from burst_fenicsx.geometry import profile_from_table
from fragfield.case.tables.round import ContourTable
from fragfield.contours.read import profile_of_contour
from fragfield.errors import InputError
from tests.fragfield.drawn_shells import CHARGE, SHELL, polyline, write_dxf

FINE = 2e-4  # of the volumes, with a tolerance of 0.01 mm


def tables_of(path, **options):
    return profile_of_contour(ContourTable(file=path.name, **(CHARGE | options)), path)[0]


def assert_shell(tables, exact=FINE):
    """The volumes of the shell, and its radii at 200 stations to the tolerance."""
    profile = profile_from_table(tables, where="drawing")
    assert profile.casing_volume == pytest.approx(SHELL.casing_volume, rel=exact)
    assert profile.charge_volume == pytest.approx(SHELL.charge_volume, rel=exact)
    at = np.linspace(1e-4, SHELL.cavity.end - 1e-4, 200)
    assert np.abs(profile.section(at).outer_radius - SHELL.section(at).outer_radius).max() < 2e-5
    assert np.abs(profile.section(at).inner_radius - SHELL.section(at).inner_radius).max() < 2e-5


def apart(document, corners):
    """Lines and arcs one by one, in any order and direction, some of them twice, ends up to 0.02 mm off."""
    dice = random.Random(4)
    space = document.modelspace()
    pairs = list(zip(corners, [*corners[1:], corners[0]], strict=True))
    dice.shuffle(pairs)
    for start, end in [*pairs, pairs[2]]:
        if dice.random() < 0.5:
            start, end = end._replace(bulge=-start.bulge), start
        if start.bulge:
            center, first, last, radius = ezdxf.math.bulge_to_arc(start[:2], end[:2], start.bulge)
            space.add_arc(center, radius, math.degrees(first), math.degrees(last), dxfattribs={"layer": "CASING"})
        else:
            space.add_line(start[:2], (end.x, end.y + (0.02 if end.y > 40.0 else 0.0)), dxfattribs={"layer": "CASING"})


def in_blocks(document, corners):
    """Within two blocks, the inner one in inches and on layer 0, turned upright and mirrored."""
    inner, outer = document.blocks.new("INNER"), document.blocks.new("OUTER")
    inner.add_lwpolyline([(x / 25.4, y / 25.4, bulge) for x, y, bulge in corners], format="xyb", close=True)
    outer.add_blockref("INNER", (5, 0), dxfattribs={"xscale": 25.4, "yscale": -25.4, "layer": "CASING"})
    document.modelspace().add_blockref("OUTER", (100, 50), dxfattribs={"rotation": 90})
    document.modelspace().add_line((100, 0), (100, 600), dxfattribs={"layer": "Mittellinie"})


def as_spline(document, corners):
    """Arcs as splines, the rest as lines, in a drawing with both halves, notes, dimensions and a hatch."""
    space = document.modelspace()
    for side in (1, -1):
        for start, end in zip(corners, [*corners[1:], corners[0]], strict=True):
            if start.bulge:
                center, first, last, radius = ezdxf.math.bulge_to_arc(start[:2], end[:2], start.bulge)
                angles = np.linspace(first, last if last > first else last + math.tau, 40)
                points = [
                    (center.x + radius * math.cos(a), side * (center.y + radius * math.sin(a)), 0) for a in angles
                ]
                space.add_spline(points)
            else:
                space.add_line((start.x, side * start.y), (end.x, side * end.y))
    space.add_line((-5, 0), (390, 0), dxfattribs={"linetype": "DASHDOT"})
    space.add_text("105 mm", dxfattribs={"layer": "NOTES"}).set_placement((10, 80))
    space.add_linear_dim(base=(0, -80), p1=(0, 0), p2=(383, 0)).render()
    space.add_hatch().paths.add_polyline_path([(0, 30), (10, 30), (10, 31)])


def as_chords(document, corners):
    """Arcs as chords of half a degree, as exporters write them, on the outer and the inner line alone."""
    space = document.modelspace()
    for part in (corners[:4], corners[5:]):
        line = []
        for start, end in itertools.pairwise(part):
            line.append(start[:2])
            if start.bulge:
                center, first, last, radius = ezdxf.math.bulge_to_arc(start[:2], end[:2], start.bulge)
                angles = np.linspace(first, last if last > first else last + math.tau, 120)[1:-1]
                points = [(center.x + radius * math.cos(a), center.y + radius * math.sin(a)) for a in angles]
                line += points if math.dist(points[0], start[:2]) < math.dist(points[-1], start[:2]) else points[::-1]
        space.add_lwpolyline([*line, part[-1][:2]])
    space.add_line((-5, 0), (390, 0), dxfattribs={"layer": "CL"})


def mirrored_extrusion(document, corners):
    """An outline whose plane looks down, as after a command that mirrors in space."""
    made = polyline(document, [one._replace(x=-one.x, bulge=-one.bulge) for one in corners])
    made.dxf.extrusion = (0, 0, -1)


def with_other_layers(document, corners):
    """A rotating band, a charge that abuts, a frozen layer and hidden edges beside the casing."""
    polyline(document, corners)
    document.layers.add("OLD").freeze()
    polyline(document, [one._replace(x=one.x + 3.0) for one in corners], layer="OLD")
    document.modelspace().add_lwpolyline(
        [(300, 52.4), (310, 52.4), (310, 54), (300, 54)], close=True, dxfattribs={"layer": "BAND"}
    )
    document.modelspace().add_line((50, 0), (50, 20), dxfattribs={"layer": "CHARGE"})


DRAWN = {
    "polyline, centre line": (None, {}, "axis y = 0, a centre line"),
    "lines and arcs in any order": (apart, {}, "gaps closed"),
    "blocks, upright, mirrored": (in_blocks, {}, "axis x = 100"),
    "splines, both halves, notes": (as_spline, {}, "1 DIMENSION, 1 HATCH, 1 TEXT"),
    "chords, two lines": (as_chords, {}, "a centre line"),
    "mirrored extrusion": (mirrored_extrusion, {}, "the section begins at y = 0"),
    "other layers": (with_other_layers, {"layers": ["casing"]}, "1 on a layer that is off or frozen"),
}


@pytest.mark.parametrize("name", DRAWN)
def test_the_shell_comes_out_of_every_way_to_draw_it(tmp_path, name):
    draw, options, said = DRAWN[name]
    tables = tables_of(write_dxf(tmp_path / "shell.dxf", draw), **options)
    assert_shell(tables, 1e-3 if name == "lines and arcs in any order" else FINE)
    assert said in f"{tables['source']} {tables.get('notes')}"
    assert len(tables["outer"]["points"]) < 40  # as few chords as the tolerance allows


def test_chords_are_within_the_tolerance_of_the_arcs_drawn(tmp_path):
    for path in (write_dxf(tmp_path / "a.dxf"), write_dxf(tmp_path / "b.dxf", release="R12")):
        tables = tables_of(path, **({"unit": "1 mm"} if path.stem == "b" else {}))  # R12 knows no unit
        for name, contour in (("outer", SHELL.outer), ("cavity", SHELL.cavity)):
            found = np.array(tables[name]["points"])
            assert found[[0, -1]] == pytest.approx(1e3 * np.array([contour.stations, contour.radii])[:, [0, -1]].T)
            fine = np.linspace(found[0, 0], found[-1, 0], 20_000)
            off = np.interp(fine, *found.T) - 1e3 * contour.radius(1e-3 * fine)
            assert np.abs(off).max() < 0.0105
    assert tables["charge"] == {"front": 50.0}
    assert tables["fuze"] == {"fill": "inert", "mass": 0.192}


def moved(corners, at, by):
    return [one._replace(x=one.x + by[0], y=one.y + by[1]) if index == at else one for index, one in enumerate(corners)]


def opened(gap):
    def draw(document, corners):
        lines = [*corners[:3], corners[3]._replace(y=corners[3].y + 0.0), *corners[4:]]
        space = document.modelspace()
        first, second = lines[:4], lines[3:] + lines[:1]
        second[0] = second[0]._replace(x=second[0].x + gap)
        for part in (first, second):
            space.add_lwpolyline([tuple(one) for one in part], format="xyb", dxfattribs={"layer": "CASING"})

    return draw


def above_zero(document, corners):
    opened(0.8)(document, [one._replace(y=one.y + 7.0) for one in corners])
    document.modelspace().add_line((-5, 7), (390, 7), dxfattribs={"layer": "AXIS"})


def standing(document, corners):
    turned = [one._replace(x=one.y + 7.0, y=one.x, bulge=-one.bulge) for one in corners]
    for part in (turned[:4], [turned[3]._replace(y=turned[3].y + 0.8), *turned[4:], turned[0]]):
        document.modelspace().add_lwpolyline([tuple(one) for one in part], format="xyb", dxfattribs={"layer": "CASING"})
    document.modelspace().add_line((7, -5), (7, 390), dxfattribs={"layer": "AXIS"})


def differing(document, corners):
    polyline(document, corners)
    polyline(document, [one._replace(y=-one.y, bulge=-one.bulge) for one in moved(corners, 2, (0.0, 0.5))])
    document.modelspace().add_line((-5, 0), (390, 0), dxfattribs={"layer": "AXIS"})


def crossing(document, corners):
    swapped = list(corners)
    swapped[7], swapped[8] = swapped[8]._replace(bulge=0.0), swapped[7]._replace(bulge=0.0)
    polyline(document, swapped)


def grooved(document, corners):
    groove = [corners[2]._replace(x=335.0, y=48.0), corners[2]._replace(x=325.0, y=45.0)]
    polyline(document, [*corners[:3], *groove, *corners[3:]])


def touching(document, corners):
    polyline(document, corners)
    document.modelspace().add_line((383.419, 45.148), (390, 60), dxfattribs={"layer": "LEADER"})


def solid_only(document, corners):
    document.modelspace().add_3dface([(0, 0), (1, 0), (1, 1), (0, 1)])


def inclined(document, corners):
    made = polyline(document, corners)
    made.transform(Matrix44.z_rotate(0.3))
    document.modelspace().add_line((0, 0), (400 * math.cos(0.3), 400 * math.sin(0.3)), dxfattribs={"layer": "AXIS"})


def tube(document, corners):
    document.modelspace().add_lwpolyline([(0, 30), (400, 30), (400, 40), (0, 40)], close=True)
    document.modelspace().add_line((0, 0), (400, 0), dxfattribs={"layer": "AXIS"})


def far_off(document, corners):
    polyline(document, [one._replace(x=one.x + 80.0, y=one.y + 35.0) for one in corners])


def without_inner_wall(document, corners):
    for start, end in itertools.pairwise(corners[:-3]):
        document.modelspace().add_line(start[:2], end[:2])


def without_hollow(document, corners):
    document.modelspace().add_lwpolyline([(0, 0), (0, 20), (400, 40), (400, 0)], close=True)


REFUSED = {
    "no unit": (None, {"units": 0}, {}, r"names no unit \(\$INSUNITS is 0.*410 x 52.4.*needed: unit"),
    "gap": (opened(0.8), {}, {}, r"nearest loose ends are 0.8 mm apart, at \(383.419, 45.148\) \(up to 0.1 mm"),
    "gap off zero": (above_zero, {}, {}, r"nearest loose ends are 0.8 mm apart, at \(383.419, 52.148\)"),
    "gap, standing": (standing, {}, {}, r"nearest loose ends are 0.8 mm apart, at \(52.148, 383.419\)"),
    "halves differ": (differing, {}, {}, r"halves differ by 0.499. mm at station 331"),
    "crosses itself": (crossing, {}, {}, r"crosses itself at \("),
    "undercut": (grooved, {}, {}, r"outer contour runs back along the axis at \(325, 45\), by 10 mm"),
    "three lines meet": (touching, {}, {}, r"3 lines meet at \(383.419, 45.148\) \(layers: CASING, LEADER\)"),
    "no curves": (solid_only, {}, {}, r"found no line, arc.*only 1 3DFACE"),
    "inclined axis": (inclined, {}, {}, r"centre line inclined .* turn the drawing"),
    "which end is the nose": (tube, {}, {}, r'about as wide, radii 40 and 40 mm; needed: nose.*"left" or "right"'),
    "no axis": (far_off, {}, {}, r'neither x = 0 nor y = 0 bounds the section; needed: axis.*"y = 61.2"'),
    "inner wall missing": (without_inner_wall, {}, {}, r"inner line ends at \(331.819, 38.755\), neither"),
    "no cavity": (without_hollow, {}, {}, "found no cavity: the outline encloses no hollow"),
    "layer": (None, {}, {"layers": ["CASNG"]}, r'layers: found "CASNG" \(did you mean "CASING"'),
    "axis in words": (None, {}, {"axis": "middle"}, r'axis: found "middle"; allowed: a line such as "y = 0"'),
    "wrong side": (None, {}, {"nose": "top"}, 'nose: found "top" with an axis that is horizontal; allowed: left or'),
    "size": (None, {"units": 6}, {}, "383.4 m large with a unit of 1000 mm; allowed: 1 mm to 20 m; give unit"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_what_is_not_clear_is_refused_with_its_position(tmp_path, name):
    draw, drawn, options, message = REFUSED[name]
    path = write_dxf(tmp_path / "shell.dxf", draw, **drawn)
    with pytest.raises(InputError, match=f"shell.dxf: .*{message}"):
        tables_of(path, **options)


def test_a_gap_within_the_tolerance_is_closed_and_said(tmp_path):
    tables = tables_of(write_dxf(tmp_path / "a.dxf", opened(0.05)))
    assert_shell(tables, 1e-3)
    assert "1 gaps closed, the largest of 0.05 mm" in tables["notes"]
    tables = tables_of(write_dxf(tmp_path / "b.dxf", opened(0.8)), gap="1 mm")
    assert "1 gaps closed, the largest of 0.8 mm" in tables["notes"]


@pytest.mark.parametrize(
    ("name", "data", "message"),
    [
        ("a.dxf", b"AC1027\0\0", "found a DWG; allowed: a DXF"),
        ("a.dxf", b"no drawing", "not a DXF that can be read"),
        ("a.step", b"", "ends in .step; allowed: .dxf, .csv"),
    ],
)  # fmt: skip
def test_files_that_are_no_drawings(tmp_path, name, data, message):
    path = tmp_path / name
    path.write_bytes(data)
    with pytest.raises(InputError, match=message):
        tables_of(path)


TABLE = """\
station_mm;outer diameter [mm];inner diameter [mm]
0;56;40
50;71.2;40
146.8;104.8;77.51
331.819;104.8;77.51
365.719;100.035;67.982
365.719;100.035;
383.419;90.296;
"""


def test_a_table_of_diameters_from_the_nose_and_from_the_base(tmp_path):
    (tmp_path / "a.csv").write_text(TABLE)
    here = tables_of(tmp_path / "a.csv")
    assert here["outer"]["points"][2] == [146.8, 52.4]
    assert here["cavity"]["points"][-1] == [365.719, 33.991]
    rows = [line.split(";") for line in TABLE.splitlines()[1:]]
    turned = [
        f"{383.419 - float(s):.6f},{float(o) / 50.8:.9f},{float(i) / 50.8 if i else ''}" for s, o, i in rows[::-1]
    ]
    (tmp_path / "b.csv").write_text("\n".join(["from_base [mm],outer radius (in),inner_radius_in", *turned]) + "\n")
    there = tables_of(tmp_path / "b.csv")
    for name in ("outer", "cavity"):
        assert there[name]["points"] == pytest.approx(np.array(here[name]["points"]), abs=1e-5)
    (tmp_path / "c.csv").write_text(TABLE.replace(".", ","))
    commas = tables_of(tmp_path / "c.csv")
    assert commas["outer"] == here["outer"]
    assert "decimal sign: comma" in commas["notes"]
    book = openpyxl.Workbook()
    for line in TABLE.splitlines():
        book.active.append([float(cell) if cell[:1].isdigit() else cell or None for cell in line.split(";")])
    book.save(tmp_path / "d.xlsx")
    assert tables_of(tmp_path / "d.xlsx")["cavity"] == here["cavity"]
    assert "nose at the narrower end" in here["source"]
    assert "stations from the base" in there["source"]


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("station_mm", "station", 'column "station" names no unit'),
        ("outer diameter", "outer", "neither diameter nor radius"),
        ("inner diameter", "thickness", "no column of the inner"),
        ("331.819", "131.819", "line 5: the station turns back"),
        ("77.51", "77,51", "decimal signs contradict each other: '77,51' in line 4"),
        ("77.51", "x", "line 4, column inner diameter .mm.: 'x' is not a number"),
        ("0;56;40", "0;92;40", "both ends are about as wide, 92 and 90.3 mm"),
    ],
)
def test_tables_that_are_not_clear(tmp_path, old, new, message):
    (tmp_path / "a.csv").write_text(TABLE.replace(old, new))
    with pytest.raises(InputError, match=message):
        tables_of(tmp_path / "a.csv")


def test_a_step_in_radius_becomes_a_short_cone_of_the_same_volume(tmp_path):
    def stepped(document, corners):
        corners = [(0, 20), (100, 20), (100, 40), (300, 40), (300, 0), (290, 0), (290, 30), (0, 10)]
        document.modelspace().add_lwpolyline(corners, close=True)

    tables = profile_of_contour(ContourTable(file="a", nose="left"), write_dxf(tmp_path / "a.dxf", stepped))[0]
    assert tables["outer"]["points"] == [[0, 20], [99.99, 20], [100.01, 40], [300, 40]]
    profile = profile_from_table(tables, where="step")
    exact = math.pi * 1e-9 * (20**2 * 100 + 40**2 * 200)
    assert profile.outer.volume() == pytest.approx(exact, rel=1e-5)
    assert json.dumps(tables)
