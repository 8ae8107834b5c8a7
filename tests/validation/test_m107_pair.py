"""The pair of M107 on made-up hits: sectors of known laws, rows that pass and are missed, bursts that stop."""

from __future__ import annotations

import numpy as np
import pytest

from tests.validation.rings import LOBE, ring
from validation.m107_pair.check import convergence_rows, index_of, reading_rows, symmetry_rows
from validation.m107_pair.sectors import fast_speed, focus, mean_speed, per_degree, profile, reading, scatter
from validation.paper_3_2.ratios import Estimate, integral_above_one
from validation.runs import StudyError

SHARE = 2.5  # of the hits in the lobes of 20 degrees, over that of even hits
FRAGMENTS = 4000
INSIDE = SHARE * FRAGMENTS / 360.0  # hits a degree
OUTSIDE = (FRAGMENTS - 4.0 * LOBE * INSIDE) / (360.0 - 4.0 * LOBE)


@pytest.fixture(scope="module")
def pair():
    return ring(seed=2, fragments=FRAGMENTS, share=SHARE)


def missed(rows):
    return [row.quantity.split(" (")[0] for row in rows if row.passed is False]


def near(found, expected):
    return abs(found.value - expected) < 4.0 * found.error < 0.1 * expected


def test_numbers_and_masses_a_degree_are_those_of_the_law(pair):
    found = profile(pair)
    expected = {
        "within 5 deg": INSIDE, "within 10 deg": INSIDE, "within 20 deg": INSIDE,
        "within 35 deg": (20.0 * INSIDE + 15.0 * OUTSIDE) / 35.0, "beyond 60 deg": OUTSIDE,
        "10 to 20 deg": INSIDE, "20 to 30 deg": OUTSIDE, "80 to 90 deg": OUTSIDE,
    }  # fmt: skip
    for place, value in expected.items():
        assert near(found["number", place], value), place
        assert near(found["mass", place], 0.01 * value), place
    ratio = focus(pair)
    assert near(ratio["number", "within 10 deg"], INSIDE / OUTSIDE)
    assert near(ratio["mass", "within 35 deg"], expected["within 35 deg"] / OUTSIDE)


def test_every_hit_lies_in_one_sector(pair):
    both = sum(4.0 * width * per_degree(pair, angles, "number") for width, angles in ((60, (0, 60)), (30, (60, 90))))
    assert both == pytest.approx(np.full(60, FRAGMENTS))


def test_speeds_are_those_of_even_numbers(pair):
    """Speeds even on 900 to 1100 m/s; of n fragments the largest is 900 + 200 n/(n + 1)."""
    angles = (0.0, 20.0)
    assert mean_speed(pair, angles).mean() == pytest.approx(1000.0, abs=1.0)
    assert fast_speed(pair, angles, 0.99).mean() == pytest.approx(1098.0, abs=0.3)
    number = 4.0 * LOBE * INSIDE
    assert fast_speed(pair, angles, 1.0).mean() == pytest.approx(900.0 + 200.0 * number / (number + 1.0), abs=0.15)


def test_the_speed_of_a_share_is_of_that_rank_and_empty_realisations_say_nothing(pair):
    hits = pair.hits[:5].copy()
    hits["realisation"], hits["azimuth"] = [0, 0, 0, 2, 2], [90.0, 91.0, 270.0, 89.0, 180.0]
    hits["initial_speed"] = [3.0, 1.0, 2.0, 7.0, 99.0]
    few = type(pair)(pair.fragments[:3], pair.every_height, pair.band, pair.missed, hits)
    assert fast_speed(few, (0.0, 5.0), 1.0).tolist() == [3.0, 7.0]
    assert fast_speed(few, (0.0, 5.0), 0.5).tolist() == [2.0, 7.0]
    assert fast_speed(few, (0.0, 5.0), 1.0 / 3.0).tolist() == [1.0, 7.0]
    assert mean_speed(few, (0.0, 5.0)).tolist() == [2.0, 7.0]
    assert per_degree(few, (85.0, 90.0), "number").tolist() == [0.0, 0.0, 0.05]


def test_a_ratio_of_parts_of_one_realisation_has_the_scatter_of_repeated_ensembles():
    few = [focus(ring(seed=50 + k, fragments=FRAGMENTS, share=SHARE, realisations=10)) for k in range(40)]
    key = "number", "within 35 deg"
    stated = np.mean([one[key].error / one[key].value for one in few])
    assert 0.7 < scatter(few, key) / stated < 1.4
    assert np.isnan(scatter(few[:1], key))


def scaled(found, factor, kinds):
    return {
        key: Estimate(factor * one.value, one.error) if key[0] in kinds else one for key, one in found.items()
    }  # fmt: skip


def test_forms_must_be_alike(pair):
    base = profile(pair)
    assert not missed(symmetry_rows("6 mm", {"quarter": base, "full": base}, {"quarter": [base]}))
    off = scaled(base, 1.011, ("mass",))
    found = missed(symmetry_rows("6 mm", {"quarter": base, "full": off}, {"quarter": [base]}))
    assert len(found) == 6  # five sectors, and the farthest of the bins
    assert all("mass" in quantity for quantity in found)
    assert len(missed(symmetry_rows("6 mm", {"quarter": base, "full": scaled(base, 0.994, ("mean speed",))}, {}))) == 5
    fan = [base, scaled(base, 1.02, ("mass",))]
    row = symmetry_rows("6 mm", {"quarter": base, "mirrored": base, "full": base}, {"quarter": fan, "full": [base] * 2})
    noise = [one.quantity.split("(")[1] for one in row if "mass within 5 deg" in one.quantity]
    assert [text.split(", ")[1:] for text in noise] == [
        ["scatter of quarter 1.40%)"], ["scatter of quarter 1.40%", "scatter of full 0.00%)"]
    ]  # fmt: skip
    one_bin = {**base, ("number", "30 to 40 deg"): Estimate(2.0, 0.01)}
    found = missed(symmetry_rows("6 mm", {"quarter": base, "full": one_bin}, {}))
    assert found == ["6 mm, full: number 30 to 40 deg, the bin farthest off"]


def test_the_two_finest_are_bounded_and_have_an_index(pair):
    base = focus(pair)
    good = {"4 mm": scaled(base, 0.9, base), "3 mm": base, "2 mm": scaled(base, 1.04, ("number", "mass"))}
    assert not missed(convergence_rows(good))
    bad = {**good, "2 mm": scaled(scaled(base, 1.06, ("number", "99 % of speeds")), 1.09, ("largest speed",))}
    assert missed(convergence_rows(bad)) == [
        "2 mm against 3 mm: number within 10 deg", "2 mm against 3 mm: 99 % of speeds within 5 deg",
        "2 mm against 3 mm: largest speed within 5 deg",
    ]  # fmt: skip
    two = dict(list(bad.items())[1:])
    assert all(row.passed is None for row in convergence_rows(two)), "two sizes show no convergence"
    assert index_of({f"{h} mm": 5.0 + 0.1 * h**2 for h in (6, 4, 3, 2)}).limit == pytest.approx(5.0)
    with pytest.raises(StudyError, match="millimetres are expected"):
        index_of({"6 mm": 1.0, "4 mm": 2.0, "0.3 cm": 3.0})


def test_the_reading_is_extrapolated_beside_the_paper(pair):
    """Peaks that go with the square of the cells: 4 + 0.1 h^2."""
    single = ring(seed=1, fragments=FRAGMENTS // 2)
    found = reading(pair, single, [5.0, 10.0])
    lobe = found["integral of the number ratio less 1, within 60 deg"]
    beyond = 120.0 * (2.0 * OUTSIDE / (FRAGMENTS / 360.0) - 1.0)
    assert lobe.value == pytest.approx(integral_above_one(pair.every_height, single.every_height) - beyond, rel=0.05)
    name = "peak of the number, bins of 5 deg"
    assert found[name].value == pytest.approx(2.0 * SHARE, rel=0.05)
    sizes = {f"{h} mm": {name: Estimate(4.0 + 0.1 * h**2, 0.02)} for h in (4, 3, 2)}
    row = reading_rows(sizes)[-1]
    assert row.quantity.startswith("extrapolated: peak of the number, bins of 5 deg (±")
    assert (row.ours, row.reference, row.passed) == (pytest.approx(4.0), 3.63, None)
    turning = {**sizes, "2 mm": {name: Estimate(5.5, 0.02)}}
    row = reading_rows(turning)[-1]
    assert row.quantity.startswith("finest: peak")
    assert (row.ours, "oscillatory" in row.quantity) == (5.5, True)
