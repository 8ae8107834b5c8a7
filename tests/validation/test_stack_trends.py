"""Trends of stacks on made-up metal: what passes, what is missed, and the case that the study writes."""

from __future__ import annotations

import tomllib

import h5py
import numpy as np
import pytest

from validation.runs import ROOT, StudyError
from validation.stack_trends.check import (
    REFERENCE,
    Focus,
    count_rows,
    delay_rows,
    focus_of,
    gap_rows,
    speed_row,
    varied,
)

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
