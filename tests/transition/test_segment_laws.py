"""The laws of the break-up, one for each segment: numbers and means by hand, radius and wall at rupture, stations."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from tests.transition.synthetic import STEEL, Tube, radial
from transition import BreakUp, BreakUpSettings, InputError, break_up
from transition.law.mean_mass import gurney_sarmousakis, mott_linfoot
from transition.law.segments import _extent, _outline


def test_laws_by_hand(snapshot):
    """Wall: Eq. 21 with Eq. 22; nose: with radius and wall before the burst; base: a plate stretched both ways."""
    laws = BreakUp(snapshot, BreakUpSettings(critical_strain=0.5)).laws
    segments = snapshot.rounds[0].segments
    wall = mott_linfoot(4.0, STEEL, 1.5 * 0.0775, 14.7e4, 0.018 / 1.5, segments[1].speed)
    assert laws[1].law.mean == pytest.approx(wall, rel=1e-12)
    assert laws[1].n0 == pytest.approx(segments[1].casing_mass / wall, rel=1e-12)
    # 1000 m/s outwards at all radii: as near as can be to v = rate r over the ring, at its outer radius
    inner, outer = 0.0595, 0.0775
    expansion = 1000.0 * outer * (outer**3 - inner**3) / 3.0 / ((outer**4 - inner**4) / 4.0)
    assert laws[0].v0 == pytest.approx(expansion, rel=3e-3)
    end = mott_linfoot(4.0, STEEL, 0.0775, 14.7e4, 0.018, laws[0].v0)
    assert laws[0].law.mean == pytest.approx(end, rel=1e-12)
    plate = mott_linfoot(4.0, STEEL, 1.5 * 0.0775, 14.7e4, 0.018 / 1.5**2, laws[3].v0)
    assert laws[3].law.mean == pytest.approx(plate, rel=1e-12)


def test_speed_from_gurney(snapshot):
    law = BreakUp(snapshot, BreakUpSettings(velocity_source="gurney")).laws[1]
    data = snapshot.rounds[0].segments[1]
    ratio = data.charge_mass / data.casing_mass
    assert law.v0 == pytest.approx(2463.2 * np.sqrt(ratio / (1.0 + 0.5 * ratio)), rel=1e-9)


def test_other_laws_of_the_mean(snapshot, tmp_path):
    assert BreakUp(snapshot, BreakUpSettings(mean_mass=0.01)).laws[1].law.mean == pytest.approx(0.01)
    law = BreakUp(snapshot, BreakUpSettings(mean_mass="gurney_sarmousakis")).laws[1]
    assert law.law.mean == pytest.approx(gurney_sarmousakis(3.81, 0.018, 0.119), rel=1e-9)
    other = Tube(around=8, axial=10, explosive="ANFO").read(tmp_path / "s.h5")
    with pytest.raises(
        InputError, match=r"no constant is known for the explosive 'ANFO'.*give break_up.explosive_constant"
    ):
        BreakUp(other, BreakUpSettings(mean_mass="gurney_sarmousakis"))


def test_end_that_only_flies_along_the_axis_stays_in_one_piece(tmp_path):
    tube = Tube(around=16, axial=20, velocity=lambda x: np.where(x[:, 2:] < 0.04, [[0.0, 0.0, -570.0]], radial(x)))
    result = break_up(tube.read(tmp_path / "s.h5"))
    base, law = result.summary["rounds"][0]["segments"][3], result.segments[3].law
    assert (base["fragments"], base["n0"]) == (1, 1.0)
    assert law.v0 < 1e-9
    assert base["speed"] == pytest.approx(570.0)
    assert result.fragments.velocity[-1] == pytest.approx([0.0, 0.0, -570.0], abs=1e-9)
    assert base["mass"] == pytest.approx(law.mass, rel=1e-12)


def test_segments_by_stations_are_measured_on_the_cells(snapshot):
    cut = BreakUp(snapshot, BreakUpSettings(segments=(0.06, 0.21)))
    assert [s.data.kind for s in cut.segments] == ["wall", "wall", "wall"]
    for segment, (start, end) in zip(cut.segments, ((0.0, 0.06), (0.06, 0.21), (0.21, 0.3)), strict=True):
        assert (segment.data.start, segment.data.end) == pytest.approx((start, end))
        share = (end - start) / 0.3
        assert segment.data.casing_mass == pytest.approx(share * snapshot.mass[snapshot.casing].sum(), rel=1e-9)
        assert segment.data.outer_radius == pytest.approx(0.0775, rel=1e-9)
        # a ring of 48 straight sides: a smaller volume by (2 pi/48)^2/6
        assert segment.data.wall_thickness == pytest.approx(0.018, rel=0.01)
        assert segment.data.charge_radius == pytest.approx(np.sqrt(0.0595**2 - 0.01**2), rel=0.01)
    speeds = [s.data.speed for s in cut.segments]
    assert all(900.0 < speed < 1010.0 for speed in speeds)


def test_stations_on_a_cone_give_its_mean_radius_and_wall(tmp_path):
    def cone(nodes):
        return nodes * np.column_stack([1.0 - nodes[:, 2], 1.0 - nodes[:, 2], np.ones(len(nodes))])

    snapshot = Tube(around=64, axial=60, reshape=cone).read(tmp_path / "s.h5")
    for segment in BreakUp(snapshot, BreakUpSettings(segments=(0.1, 0.2))).segments:
        middle = 0.3 - 0.5 * (segment.data.start + segment.data.end)
        assert segment.data.outer_radius == pytest.approx(0.0775 * (1.0 - middle), rel=0.01)
        assert segment.data.wall_thickness == pytest.approx(0.018 * (1.0 - middle), rel=0.02)


@pytest.mark.parametrize(
    ("segments", "message"),
    [
        ((0.1, 0.5), r"round 'round 0': station 0.5 m lies beyond the round's length of 0.3 m"),
        ({"round 9": (0.1,)}, r"no round 'round 9'; did you mean 'round 0'"),
        ((0.1, 0.101), r"no casing cell has its centre between 0.1 and 0.101 m"),
    ],
)
def test_stations_refused(snapshot, segments, message):
    with pytest.raises(InputError, match=message):
        break_up(snapshot, BreakUpSettings(segments=segments))


def test_graded_reports_what_is_missing(snapshot):
    """Of the wall; its ends are drawn by "quantile" and close on their masses."""
    result = break_up(snapshot, BreakUpSettings(sampler="graded", graded_dm=1e-3))
    lacking = np.array([s.law.mass - s.mass.sum() for s in result.segments])
    assert np.abs(lacking[[0, 3]]).max() < 1e-12
    assert lacking[1:3].min() > 0.0
    missing = lacking.sum()
    assert result.summary["mass_error"] == pytest.approx(-missing / snapshot.mass[snapshot.casing].sum(), rel=1e-9)
    with pytest.raises(InputError, match="round 'round 0', segment 'wall 1': sampler 'graded': the first grade"):
        break_up(snapshot, BreakUpSettings(sampler="graded", graded_dm=1e-7))


@pytest.mark.parametrize("speed", [float("nan"), float("inf"), -3.0])
def test_speed_that_is_no_speed_is_refused(snapshot, speed):
    data = snapshot.rounds[0]
    broken = tuple(replace(segment, speed=speed) for segment in data.segments)
    with pytest.raises(InputError, match=f"round 'round 0', segment 'wall 1': the burst stage gives the speed {speed}"):
        BreakUp(replace(snapshot, rounds=(replace(data, segments=broken),)))


@pytest.mark.parametrize("axis", [(0.0, 0.0, 2.0), (1.0, 0.0, 0.0)])
def test_the_outline_of_steps_is_their_mean_by_mass(axis):
    """Two tubes one behind the other, of 1 kg and 3 kg, 60 and 80 mm in radius; the position is that of the axis."""
    corners = np.array([[0, 0], [1, 0], [1, 1], [0, 1]])
    profile = np.concatenate([[0.05, 0.0] + 0.01 * corners, [0.07, 0.01] + 0.01 * corners])
    unit = np.array(axis) / np.linalg.norm(axis)
    across = np.roll(unit, 1)
    position = np.array([0.3, -0.2, 0.1])
    snapshot = SimpleNamespace(
        reference=position + profile[:, :1] * across + profile[:, 1:] * unit, cells=np.arange(8).reshape(2, 4),
        mass=np.array([1.0, 3.0]),
    )  # fmt: skip
    data = SimpleNamespace(along=unit, position=position, length=0.5)
    assert _outline(snapshot, data, np.array([0, 1])) == pytest.approx((0.06 + 3.0 * 0.08) / 4.0, rel=1e-12)
    assert _outline(snapshot, data, np.array([1])) == pytest.approx(0.08, rel=1e-12)
    assert _extent(snapshot, data, np.array([0, 1])) == pytest.approx((0.48, 0.5))
    assert _extent(snapshot, data, np.array([0])) == pytest.approx((0.49, 0.5))
