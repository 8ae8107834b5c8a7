"""Rows of the plane section on made-up numbers: what passes and what is missed."""

from __future__ import annotations

import pytest

from validation.plane_section.check import (
    REFERENCE,
    convergence_rows,
    delay_rows,
    end_of,
    friction_rows,
    gap_rows,
    mirrored_rows,
    single_rows,
)
from validation.stack_trends.check import Focus


def focus(share=0.25, place=0.0):
    return Focus(share, 30.0, 0.0, place, 1500.0)


def burst(scale=1.0, speed=4000.0):
    ratio = {"5": 8.0 * scale, "10": 6.0 * scale, "20": 4.5 * scale, "35": 3.5 * scale}
    return {"section": {"focus": {"mass_ratio": ratio, "speed_99_percent": speed, "max_speed": 5000.0}}}


def missed(rows):
    return [row.quantity for row in rows if row.passed is False]


def test_the_two_finest_of_three_sizes_are_bounded():
    sizes = ["2 mm", "1 mm", "0.5 mm"]
    assert not missed(convergence_rows(sizes, [burst(0.8), burst(1.0), burst(1.04, 4100.0)]))
    found = missed(convergence_rows(sizes, [burst(), burst(), burst(1.06, 4400.0)]))
    assert found == [f"two finest: mass within {width} deg" for width in (10, 20, 35)] + ["two finest: speed of 99 %"]
    assert all(row.passed is None for row in convergence_rows(sizes[:2], [burst(0.5), burst()]))


def test_single_rounds_and_mirrored_ones():
    assert not missed(single_rows(1322.0, 1379.0, 1434.0))
    assert len(missed(single_rows(1200.0, 1379.0, 1434.0))) == 2
    assert not missed(mirrored_rows(burst(1.05), burst()))
    assert len(missed(mirrored_rows(burst(1.1), burst()))) == 3


def test_a_wider_gap_must_weaken_the_focus_down_to_the_single_round():
    single = 20.0 / 180.0
    assert not missed(gap_rows({0.14: focus(0.3), 1.0: focus(0.2), 3.0: focus(single)}, single))
    assert missed(gap_rows({0.14: focus(0.3), 1.0: focus(0.31)}, single))
    assert missed(gap_rows({0.14: focus(0.3), 3.0: focus(0.2)}, single))


def test_delays_are_mirrored_and_move_the_metal_to_the_later_round():
    together = focus(0.3)
    assert not missed(delay_rows({5e-6: (focus(0.25, -1e-3), focus(0.25, 1e-3))}, together))
    assert len(missed(delay_rows({5e-6: (focus(0.2), focus(0.35, -1e-3))}, together))) == 3


def test_friction_hardly_counts_and_wider_gaps_take_longer():
    assert not missed(friction_rows({0.0: 6.3, 40.0: 6.4}, 6.48))
    assert missed(friction_rows({0.0: 5.0}, 6.48))
    assert missed(friction_rows({0.0: None}, 6.48))
    assert end_of(REFERENCE["gap"]) == pytest.approx(REFERENCE["end"])
    assert end_of(0.2617, 1e-5) == pytest.approx(REFERENCE["end"] + 0.12 / REFERENCE["closing_speed"] + 1e-5)
