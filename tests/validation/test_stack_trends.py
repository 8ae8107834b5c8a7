"""Trends of stacks on made-up metal: what passes, what is missed, and the case that the study writes."""

from __future__ import annotations

import tomllib

import h5py
import numpy as np
import pytest

from validation.options import Options
from validation.rows import Row
from validation.runs import ROOT, STOPPED, Runs, StudyError
from validation.stack_trends.check import (
    REFERENCE,
    Focus,
    count_rows,
    delay_rows,
    end_row,
    focus_of,
    gap_rows,
    speed_row,
    varied,
)
from validation.stack_trends.study import _Stacks, study

SINGLE = Focus(share=20 / 180, half_angle=45.0, lean=0.0, place=0.0, fastest=1000.0)
TEXT = (ROOT / REFERENCE["case"]).read_text(encoding="utf-8")


def focus(share=0.25, half_angle=30.0, lean=0.0, place=0.0, fastest=1500.0):
    return Focus(share, half_angle, lean, place, fastest)


def missed(rows):
    return [row.quantity for row in rows if not row.passed]


def snapshot(path, degrees, speed=1000.0, mass=None):
    """Cells of casing that fly at these angles from +y towards +x, each with nodes of its own; and one of charge."""
    angle = np.radians(np.append(degrees, 0.0))
    velocity = np.repeat(np.stack([np.sin(angle), np.cos(angle), 0.0 * angle], axis=1) * speed, 8, axis=0)
    with h5py.File(path, "w") as file:
        file["nodes/velocity"] = velocity
        file["nodes/position"] = 1e-3 * velocity
        file["cells/nodes"] = np.arange(8 * len(angle)).reshape(-1, 8)
        file["cells/part"] = np.append(np.zeros(len(degrees), dtype=int), 1)
        file["cells/mass"] = np.append(np.ones(len(degrees)) if mass is None else mass, 100.0)
    return path


def test_even_metal_is_a_single_round(tmp_path):
    """18,000 cells over all azimuths: 40 of 360 degrees within 10 of +y or -y, half within 45, no lean."""
    found = focus_of(snapshot(tmp_path / "s.h5", np.arange(18000) * 0.02 + 0.01))
    assert found.share == pytest.approx(40 / 360, rel=1e-3)
    assert found.half_angle == pytest.approx(45.0, abs=0.03)
    assert found.lean == pytest.approx(0.0, abs=1e-12)
    assert found.fastest == pytest.approx(1000.0)


def test_the_charge_does_not_count_and_mass_weighs(tmp_path):
    found = focus_of(snapshot(tmp_path / "s.h5", [5.0, 30.0, 80.0], mass=np.array([2.0, 1.0, 1.0])))
    assert found.share == pytest.approx(0.5)
    lean = (2 * np.sin(np.radians(5)) + np.sin(np.radians(30))) / 3
    assert found.lean == pytest.approx(lean)
    assert found.place == pytest.approx(lean)  # a place of a metre along each one's direction
    with pytest.raises(StudyError, match="no snapshot of a burst"):
        focus_of(tmp_path / "none.h5")


def test_the_focus_weakens_and_widens_with_the_gap():
    good = {0.14: focus(0.25, 30.0), 1.0: focus(0.2, 35.0), 3.0: focus(SINGLE.share, 45.0)}
    assert missed(gap_rows(good, SINGLE)) == []
    stronger = {**good, 1.0: focus(0.26, 35.0)}
    assert missed(gap_rows(stronger, SINGLE)) == ["gap 1 against 0.14 calibres: share within 10 deg, ratio"]
    narrower = {**good, 1.0: focus(0.2, 29.0)}
    assert missed(gap_rows(narrower, SINGLE)) == ["gap 1 against 0.14 calibres: angle that holds half, ratio"]
    near = {**good, 3.0: focus(1.02 * SINGLE.share, 45.0)}
    assert missed(gap_rows(near, SINGLE)) == ["gap 3 calibres: share within 10 deg over the single round's"]


def test_delays_of_either_round_mirror_each_other_and_move_the_focus_to_the_later():
    good = {1e-5: (focus(place=-3e-3), focus(place=3e-3)), 2e-5: (focus(place=-6e-3), focus(place=6e-3))}
    assert missed(delay_rows(good, focus())) == []
    wrong_way = {1e-5: (focus(place=3e-3), focus(place=-3e-3))}
    assert missed(delay_rows(wrong_way, focus())) == ["delay 10 us: place, further to the later round"]
    back = {**good, 2e-5: (focus(place=-2e-3), focus(place=2e-3))}
    assert missed(delay_rows(back, focus())) == ["delay 20 us: place, further to the later round"]
    uneven = {1e-5: (focus(0.26, place=-3e-3), focus(0.25, place=5e-3, lean=-0.06))}
    assert missed(delay_rows(uneven, focus())) == [
        "delay 10 us: share, left delayed over right delayed", "delay 10 us: places, sum of both",
        "delay 10 us: sine of the lean to the later round",
    ]  # fmt: skip


def test_longer_rows_have_more_gaps_to_a_round_and_no_more():
    assert missed(count_rows({2: focus(0.24), 3: focus(0.28), 4: focus(0.30)})) == []
    assert len(missed(count_rows({2: focus(0.24), 3: focus(0.33), 4: focus(0.32)}))) == 2


def test_fast_metal_is_faster_than_a_single_round_by_at_most_two():
    assert speed_row(focus(fastest=1700.0), 1000.0).passed
    assert not speed_row(focus(fastest=2100.0), 1000.0).passed
    assert not speed_row(focus(fastest=990.0), 1000.0).passed


def test_the_case_is_written_with_other_numbers():
    text = varied(TEXT, count=3, gap=0.155, delays=[0.0, 1e-5, 0.0], end=1.3e-4)
    case = tomllib.loads(text)
    assert case["stack"] == {
        "arrangement": "row", "count": 3, "gap": "155 mm", "delays": ["0 us", "10 us", "0 us"],
    }  # fmt: skip
    assert case["burst"]["end_time"] == "130 us"
    with pytest.raises(StudyError, match="must have 'count = 2' once"):
        varied(text, count=2, gap=0.1, delays=[0.0, 0.0], end=1e-4)


def test_a_delay_whose_burst_stops_is_a_row_that_is_missed_and_the_others_count(monkeypatch):
    """Of a pair with one delay one burst stops: that is missed; what cannot be read is a fault and ends the study."""
    stacks = _Stacks(None, "8 mm")
    codes = iter([STOPPED, 2])

    def summary(self, name, **changes):
        raise StudyError("no more", next(codes))

    monkeypatch.setattr(_Stacks, "summary", summary)
    found = [stacks.focus_or_stop("left_40_us", (40e-6, 0.0)), focus()]
    row = end_row(40e-6, found)
    assert found[0] is None
    assert (row.quantity, row.ours, row.passed) == ("delay 40 us: bursts that reach their end, of 2", 1, False)
    assert end_row(10e-6, [focus(), focus()]).passed
    with pytest.raises(StudyError):
        stacks.focus_or_stop("right_40_us", (0.0, 40e-6))


@pytest.mark.parametrize("error", [None, 0.02])
def test_a_fault_leaves_the_rows_before_it_and_a_burst_that_is_not_sound_makes_all_void(monkeypatch, tmp_path, error):
    """The first burst with a delay has a fault; in the second form the pair's energy does not balance."""
    given = snapshot(tmp_path / "burst_snapshot.h5", np.linspace(-60.0, 60.0, 500))

    def run(self, name, *_, **__):
        if "_us" in name:
            raise RuntimeError("no delay")
        return tmp_path / ("open" if error and "gap" in name else "closed")

    def summary(folder):
        found = error if folder.name == "open" else 0.004
        errors = {"energy_error_at_outputs": found, "contact_error_at_end": 0.001}
        return {"burst": {**errors, "lost_cells": 0, "cell_size": 6e-3, "max_initial_speed": 1000.0}}

    monkeypatch.setattr(Runs, "run", run)
    monkeypatch.setattr("validation.stack_trends.study.summary_of", summary)
    monkeypatch.setattr("validation.stack_trends.study.focus_of", lambda _: focus_of(given))
    rows: list[Row] = []
    with pytest.raises(RuntimeError, match="no delay"):
        study(Options(quick=True), Runs(tmp_path), rows)
    names = {row.quantity for row in rows}
    if error:
        assert all(name.startswith("gap_") and name.endswith("energy error at the outputs") for name in names)
    else:
        assert "fastest of the focus over the single round's largest" in names
        assert any(name.startswith("row of ") for name in names)
    assert names
