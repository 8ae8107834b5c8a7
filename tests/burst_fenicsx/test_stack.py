"""Stacks of coarse tubes: order of the rounds, mirror images, blocked venting, planes."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from mpi4py import MPI

from burst_fenicsx.errors import InputError
from burst_fenicsx.problem import ContactSettings, Leakage, Mirror
from burst_fenicsx.simulation import Simulation
from fragfield.case import load_case
from fragfield.case.conversion.rounds import burst_rounds
from fragfield.case.problem import burst_settings
from tests.burst_fenicsx.tubes import SETTINGS, tube

pytestmark = pytest.mark.dolfinx

CASES = Path(__file__).parents[2] / "cases"
APART = 0.5 * (0.155 + 0.010)  # half the distance of two tubes with a gap of 10 mm
SHORT = replace(SETTINGS, end_time=60e-6, output_interval=60e-6, leakage=Leakage(radius_ratio=1.25, parts=4))
MIRROR = Mirror("middle", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))


def left(**changes):
    return tube(name="left", position=(-APART, 0.0, 0.0), **changes)


def right(**changes):
    return tube(name="right", position=(APART, 0.0, 0.0), **changes)


def burst(out_dir, rounds, settings=SHORT):
    """A finished simulation, its summary's rounds by name, and the summary."""
    going = Simulation(rounds, settings, out_dir, MPI.COMM_SELF, {})
    going.run()
    summary = going.finish().summary
    return going, {item["name"]: item for item in summary["rounds"]}, summary


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    return burst(tmp_path_factory.mktemp("pair"), [left(), right()])


def test_the_order_of_the_rounds_does_not_matter(pair, tmp_path):
    """Which round comes first in the case changes nothing beyond round-off."""
    _, first, _ = pair
    _, swapped, _ = burst(tmp_path, [right(), left()])
    for name in ("left", "right"):
        for key in ("mean_initial_speed", "max_initial_speed", "outer_diameter", "products_balance"):
            assert swapped[name][key] == pytest.approx(first[name][key], rel=1e-9)


def test_both_rounds_of_a_pair_fare_alike_and_momentum_stays(pair):
    going, rounds, summary = pair
    assert going.contact.penetrations.collision > 0.0
    assert rounds["left"]["mean_initial_speed"] == pytest.approx(rounds["right"]["mean_initial_speed"], rel=0.01)
    assert summary["momentum_error"] < 1e-12
    assert summary["energy_error_at_checks"] < 0.02


def test_one_round_and_its_mirror_are_the_pair(pair, tmp_path):
    """A plane of symmetry without friction in place of the neighbour; its impulse is counted."""
    _, rounds, _ = pair
    going, mirrored, summary = burst(tmp_path, [right()], replace(SHORT, planes=(MIRROR,)))
    assert mirrored["right"]["mean_initial_speed"] == pytest.approx(rounds["right"]["mean_initial_speed"], rel=0.01)
    assert mirrored["right"]["outer_diameter"] == pytest.approx(rounds["right"]["outer_diameter"], rel=0.01)
    assert going.contact.impulse[0] > 0.05 * going.ledger.entries[-1].mean_casing_speed
    assert np.abs(going.contact.impulse[1:]).max() < 1e-9 * going.contact.impulse[0]
    assert summary["momentum_error"] < 2e-3  # the impulse is a sum over steps of trapezoids


def test_a_neighbour_that_is_in_the_way_lessens_the_venting(pair, tmp_path):
    """Every charge has parts of its own; held back on one side, they vent less than when alone."""
    stacked, _, _ = pair
    alone, _, _ = burst(tmp_path, [right()])
    parts = SHORT.leakage.parts
    assert len(stacked.leakage.factor) == 2 * parts + 1
    lone = alone.leakage.radii(alone.fields.nodes.position)
    for index in range(2):
        own = slice(index * parts, (index + 1) * parts)
        radii = stacked.leakage.radii(stacked.fields.nodes.position)[own]
        assert (radii < lone).all()
        assert radii.sum() < 0.99 * lone.sum()
        assert stacked.leakage.factor[:-1][own].sum() > alone.leakage.factor[:-1].sum() + 0.01


def test_without_contact_of_surfaces_rounds_do_not_feel_each_other(pair, tmp_path, caplog):
    _, rounds, _ = pair
    apart = replace(SHORT, contact=ContactSettings(surfaces=False))
    _, free, _ = burst(tmp_path, [left(), right()], apart)
    assert "as if each stood alone" in caplog.text
    assert free["left"]["mean_initial_speed"] > 1.01 * rounds["left"]["mean_initial_speed"]


def test_a_round_behind_a_plane_is_refused(tmp_path):
    with pytest.raises(InputError, match=r"round 'left' lies \d+ mm behind the plane 'middle'"):
        Simulation([left(), right()], replace(SHORT, planes=(MIRROR,)), tmp_path, MPI.COMM_SELF, {})
    flat = replace(SHORT, planes=(replace(MIRROR, normal=(0.0, 0.0, 0.0)),))
    with pytest.raises(InputError, match="plane 'middle' has the normal"):
        Simulation([right()], flat, tmp_path, MPI.COMM_SELF, {})


def pallet(folder, side, **changes):
    """A burst, before its first step, of the ready pallet with `side` x `side` M107 and 12 mm cells."""
    case = load_case(CASES / "m107_pallet_2x4.toml", {"stack.counts": [side, side, 1], "burst.cell_size": "12 mm"})
    going = Simulation(burst_rounds(case), replace(burst_settings(case), **changes), folder, MPI.COMM_SELF, {})
    going.writes_series = False
    return going


@pytest.mark.slow
def test_two_by_two_burst_alike_with_symmetry_and_without(tmp_path):
    """To their own end: time, speeds and what finds no room of a quarter and of the whole, whose rounds fare alike."""
    summaries = {}
    for name in ("auto", "off"):
        (tmp_path / name).mkdir()
        going = pallet(tmp_path / name, 2, symmetry=name)
        going.run()
        summaries[name] = going.finish().summary
    quarter, whole = summaries["auto"], summaries["off"]
    assert 4 * quarter["cells"] == whole["cells"]
    assert quarter["acceleration_complete"] == pytest.approx(whole["acceleration_complete"], rel=0.03)
    assert quarter["mean_initial_speed"] == pytest.approx(whole["mean_initial_speed"], rel=5e-3)
    speeds = [item["mean_initial_speed"] for item in whole["rounds"]]
    assert speeds == pytest.approx([np.mean(speeds)] * 4, rel=1e-3)
    for summary in (quarter, whole):
        assert summary["passed_through"]["largest_together"] < 5e-3 * summary["casing_mass"]


@pytest.mark.slow
def test_three_by_three_end_with_the_speeds_of_a_later_end(tmp_path):
    """The inner round is squeezed and has no end of its own; two fifths later the rounds tend to the same speeds."""
    later = pallet(tmp_path, 3, end_time=390e-6)
    later.run()
    record = later.acceleration
    end = int(np.argmax(np.array(record.excess) <= 1.0))
    assert 250e-6 < record.rows[end][0] < 310e-6
    ended, tended = np.sqrt(record.asymptotes[end]), np.sqrt(record.asymptotes[-1])
    assert (record.touched @ record.touched).all()
    assert np.sqrt((tended**2).sum() / (ended**2).sum()) == pytest.approx(1.0, abs=0.03)
    np.testing.assert_allclose(tended[:3] / ended[:3], 1.0, atol=0.04)
    assert tended[3] / ended[3] == pytest.approx(1.0, abs=0.1)
