"""Numbers of fragments by mass against the law, of a synthetic casing: the rows of case 3.1 and their figure."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.transition.synthetic import Tube
from transition import BreakUpSettings
from validation.paper_3_1.numbers import draw_numbers, number_rows, segment_numbers


@pytest.fixture(scope="module")
def numbers(tmp_path_factory):
    snapshot = Tube().read(tmp_path_factory.mktemp("burst") / "burst_snapshot.h5")
    return segment_numbers(snapshot, BreakUpSettings(mean_mass=5e-3), seed=3, realisations=20)


def test_rows_hold_both_samplers_against_the_law(numbers):
    rows = {row.quantity: row for row in number_rows(numbers)}
    assert all(row.passed is not False for row in rows.values()), rows
    assert abs(rows["fragments' mass over the casing's - 1, quantile"].ours) < 1e-12
    graded = [row.ours for name, row in rows.items() if name.startswith("part of the mass")]
    assert len(graded) == 3
    assert all(0.0 < part < 1.0 for part in graded), "the paper's grades leave the heaviest out"


def test_a_sampler_that_leaves_the_law_fails(numbers):
    for one in numbers:
        for mass in one.quantile:
            mass[: mass.size // 20] *= 3.0
    rows = {row.quantity: row for row in number_rows(numbers)}
    assert rows["fragments' mass over the casing's - 1, quantile"].passed is False
    assert rows["N(m) - law over N0, largest, all fragments, quantile"].passed is False


def test_numbers_start_at_those_of_the_law_and_fall(numbers, tmp_path: Path):
    mass = np.linspace(0.0, 0.1, 50)
    for one in numbers:
        assert one.expected(mass)[0] == pytest.approx(one.law.n0)
        for values in (one.expected(mass), one.drawn(mass), one.by_grades(mass)):
            assert (np.diff(values) <= 0.0).all()
    assert draw_numbers(numbers, tmp_path / "numbers.png").read_bytes().startswith(b"\x89PNG")
