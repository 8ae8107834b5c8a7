"""DXF as modellers and exporters write it: splines that close themselves, empty curves, binary files, cut headers."""

from __future__ import annotations

import itertools
import math

import ezdxf
import numpy as np
import pytest
from ezdxf.xclip import XClip
from scipy.spatial import cKDTree

from fragfield.case.tables.round import ContourTable
from fragfield.contours.dxf import read_dxf
from fragfield.contours.read import profile_of_contour
from fragfield.errors import InputError
from tests.fragfield.drawn_shells import CHARGE, polyline, write_dxf

TOLERANCE = 1e-5


def points_of(path):
    """Points of the only curve of a drawing (mm)."""
    (curve,) = read_dxf(path, unit=None, layers=None, tolerance=TOLERANCE).curves
    return 1e3 * curve.points


def tables_of(path):
    return profile_of_contour(ContourTable(file=path.name, **CHARGE), path)[0]


def splined(degree, control, knots, weights=None):
    def draw(document, _):
        spline = document.modelspace().add_spline(degree=degree)
        spline.control_points, spline.knots = control, knots
        if weights is not None:
            spline.weights = weights
        spline.closed = True

    return draw


@pytest.mark.parametrize("first", [0.0, -3.0, 2.5])
@pytest.mark.parametrize("degree", [2, 3])
def test_a_closed_spline_with_uniform_knots_is_its_blended_control_points(tmp_path, degree, first):
    """By the formula of uniform splines, piece by piece; the last control points repeat the first, as modellers write.

    The deviation of a chord is 5 % of the tolerance.
    """
    turn = 2.0 * math.pi * np.arange(8) / 8
    ring = np.column_stack([60.0 + 30.0 * np.cos(turn), 40.0 + 12.0 * np.sin(turn) + 4.0 * np.cos(3 * turn)])
    control = np.concatenate([ring, ring[:degree]])
    knots = first + np.arange(len(control) + degree + 1.0)
    path = write_dxf(tmp_path / "a.dxf", splined(degree, [(*one, 0.0) for one in control], knots))
    blend = {
        2: np.array([[1, 1, 0], [-2, 2, 0], [1, -2, 1]]) / 2.0,
        3: np.array([[1, 4, 1, 0], [-3, 0, 3, 0], [3, -6, 3, 0], [-1, 3, -3, 1]]) / 6.0,
    }[degree]
    t = np.linspace(0.0, 1.0, 4001)[:, None] ** np.arange(degree + 1)
    true = np.concatenate([t @ blend @ control[at : at + degree + 1] for at in range(8)])
    points = points_of(path)
    assert np.hypot(*(points[0] - points[-1])) < 1e-9
    assert cKDTree(true).query(points)[0].max() < 0.01  # spacing of the true points
    fine = np.concatenate([np.linspace(a, b, 50) for a, b in itertools.pairwise(points)])
    assert cKDTree(fine).query(true)[0].max() < 0.02


def test_a_circle_as_a_rational_spline(tmp_path):
    half = math.sqrt(0.5)
    control = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)]
    knots = [0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4]
    draw = splined(2, [(50 + 20 * x, 40 + 20 * y, 0) for x, y in control], knots, [1, half] * 4 + [1])
    for curve in read_dxf(
        write_dxf(tmp_path / "a.dxf", draw), unit=None, layers=None, tolerance=TOLERANCE
    ).curves:  # quarters
        assert np.hypot(*(1e3 * curve.points - (50, 40)).T) == pytest.approx(20.0, rel=1e-12)


def test_a_spline_out_of_the_sheet_is_refused(tmp_path):
    control = [(0, 0, 0), (10, 5, 3), (20, 5, 3), (30, 0, 0)]
    path = write_dxf(tmp_path / "a.dxf", splined(3, control, [0, 0, 0, 0, 1, 1, 1, 1]))
    with pytest.raises(InputError, match="SPLINE on layer 0 that leaves the plane of the sheet, z 0 to 3"):
        points_of(path)


EMPTY = {
    "CIRCLE": lambda space: space.add_circle((50, 20), 0.0),
    "ARC": lambda space: space.add_arc((50, 20), 5.0, 30.0, 30.0),
    "LINE": lambda space: space.add_line((50, 20), (50, 20)),
    "LWPOLYLINE": lambda space: space.add_lwpolyline([(50, 20), (50, 20)]),
    "SPLINE": lambda space: space.add_open_spline([(50, 20, 0)] * 4),
}


@pytest.mark.parametrize("kind", EMPTY)
def test_a_curve_of_no_length_is_left_out_and_said(tmp_path, kind):
    def draw(document, corners):
        polyline(document, corners)
        EMPTY[kind](document.modelspace())

    plain, more = tables_of(write_dxf(tmp_path / "a.dxf", polyline)), tables_of(write_dxf(tmp_path / "b.dxf", draw))
    assert more["outer"] == plain["outer"]
    assert f"1 {kind} of no length" in more["notes"]


@pytest.mark.parametrize("release", ["R12", "R2010"])
def test_a_bulge_near_zero_is_a_line(tmp_path, release):
    def draw(document, corners):
        polyline(document, [one if one.bulge else one._replace(bulge=1e-10) for one in corners])

    unit = {"unit": "1 mm"} if release == "R12" else {}
    paths = (
        write_dxf(tmp_path / "a.dxf", polyline, release=release),
        write_dxf(tmp_path / "b.dxf", draw, release=release),
    )
    plain, bulged = (profile_of_contour(ContourTable(file=one.name, **CHARGE, **unit), one)[0] for one in paths)
    assert bulged["outer"] == plain["outer"]
    assert bulged["cavity"] == plain["cavity"]


def test_a_binary_dxf_is_read_as_its_text_is(tmp_path):
    path = write_dxf(tmp_path / "a.dxf")
    ezdxf.readfile(path).saveas(tmp_path / "b.dxf", fmt="bin")
    assert tables_of(tmp_path / "b.dxf")["outer"] == tables_of(path)["outer"]
    cut = (tmp_path / "b.dxf").read_bytes()[:3000]
    (tmp_path / "c.dxf").write_bytes(cut)
    with pytest.raises(InputError, match=r"c\.dxf: (not a DXF that can be read|found no line)"):
        tables_of(tmp_path / "c.dxf")


@pytest.mark.parametrize("kept", ["all but HEADER", "ENTITIES"])
def test_polylines_of_a_file_without_header(tmp_path, kept):
    """Its unit is asked for, and its curves are those of the whole file."""
    lines = write_dxf(tmp_path / "a.dxf").read_text().split("\n")
    pairs = list(zip(lines[::2], lines[1::2], strict=False))
    starts = [at for at, (_, value) in enumerate(pairs) if value == "SECTION"]
    sections = {pairs[at + 1][1]: pairs[at:end] for at, end in zip(starts, [*starts[1:], len(pairs) - 1], strict=True)}
    chosen = [name for name in sections if name == kept or (kept == "all but HEADER" and name != "HEADER")]
    text = "".join(f"{code}\n{value}\n" for name in chosen for code, value in sections[name]) + "  0\nEOF\n"
    (tmp_path / "b.dxf").write_text(text)
    with pytest.raises(InputError, match="the file names no unit"):
        tables_of(tmp_path / "b.dxf")
    sheets = [
        read_dxf(tmp_path / name, unit=1e-3, layers=["CASING"], tolerance=TOLERANCE) for name in ("a.dxf", "b.dxf")
    ]
    assert sheets[1].points == pytest.approx(sheets[0].points, abs=1e-12)


@pytest.mark.parametrize("how", ["frozen layer", "invisible"])
def test_a_block_that_is_not_drawn_is_left_out_and_said(tmp_path, how):
    """Its curves lie on a layer that is drawn; the reference does not."""

    def draw(document, corners):
        polyline(document, corners)
        polyline_of = document.blocks.new("OLD")
        polyline_of.add_lwpolyline([(0, 0), (0, 30), (400, 40), (400, 0)], close=True, dxfattribs={"layer": "CASING"})
        document.layers.add("HIDDEN").freeze()
        attributes = {"layer": "HIDDEN"} if how == "frozen layer" else {"invisible": 1}
        document.modelspace().add_blockref("OLD", (0, 0), dxfattribs=attributes)

    plain, more = tables_of(write_dxf(tmp_path / "a.dxf", polyline)), tables_of(write_dxf(tmp_path / "b.dxf", draw))
    assert more["outer"] == plain["outer"]
    assert "1 reference to a block on a frozen layer, or invisible" in more["notes"]


def test_a_clipped_block_is_taken_whole_and_said(tmp_path):
    def draw(document, corners):
        block = document.blocks.new("SHELL")
        block.add_lwpolyline([tuple(one) for one in corners], format="xyb", close=True)
        reference = document.modelspace().add_blockref("SHELL", (0, 0))
        XClip(reference).set_block_clipping_path([(0, 0), (200, 60)])

    plain, more = tables_of(write_dxf(tmp_path / "a.dxf", polyline)), tables_of(write_dxf(tmp_path / "b.dxf", draw))
    assert more["outer"] == plain["outer"]
    assert "block SHELL is clipped in the drawing, and was taken whole" in more["source"]
