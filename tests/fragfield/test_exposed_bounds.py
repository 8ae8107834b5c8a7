"""Exposed sites: bounds against exact ones, their coverage, and every value of a site by hand."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import gamma

from flight.hazard.density.distance import ExpectedDistance
from flight.hazard.exposed import COUNTS
from fragfield.case.conversion.exposed_sites import exposed_sites_of
from fragfield.case.load import case_from_document
from fragfield.hazard.exposed import ExposedSums, share_bound, sum_bound
from fragfield.hazard.verdict import verdict_of


@pytest.mark.parametrize(("count", "exact"), [(0, 2.9957), (1, 4.7439), (5, 10.5130), (20, 29.0620)])
def test_equal_weights_give_the_poisson_bound(count, exact):
    # upper 95 % limits of a Poisson mean (chi-square quantiles over two)
    assert sum_bound(count, count, 1.0) == pytest.approx(exact, rel=1e-4)
    assert sum_bound(3.0 * count, 9.0 * count, 3.0) == pytest.approx(3.0 * exact, rel=1e-4)


def test_share_bound_is_that_of_clopper_and_pearson():
    assert share_bound(0, 100) == pytest.approx(1.0 - 0.05**0.01, rel=1e-9)
    assert share_bound(100, 100) == 1.0
    bound = share_bound(5, 50)  # by definition: so many or fewer with this probability in 5 % of trials
    below = sum(math.comb(50, k) * bound**k * (1.0 - bound) ** (50 - k) for k in range(6))
    assert below == pytest.approx(0.05, rel=1e-9)


@pytest.mark.parametrize("mean", [0.5, 4.0, 40.0])
def test_coverage_of_unequal_weights(mean):
    generator, trials, held = np.random.default_rng(7), 3000, 0
    for _ in range(trials):
        weights = generator.uniform(0.0, 2.0, generator.poisson(mean))
        held += sum_bound(weights.sum(), (weights**2).sum(), 2.0) >= mean
    assert held / trials >= 0.95 - 1.64 * np.sqrt(0.05 * 0.95 / trials)


POISSON_SIX = 11.8424  # upper 95 % limit of the mean where six were counted
FOUR_OF_SIX = (2, 1, 1, 2)  # counts of four realisations, less scattered than Poisson's
ALL_AT_ONCE = (6, 0, 0, 0)
BY_VARIANCE = gamma.ppf(0.95, 49.0 / 37.0, scale=37.0 / 7.0)  # of the mean 6 + 1 and the variance 4 x 9 + 1
SHELL = {"name": "shell", "profile": "m107", "explosive": "tnt", "casing": "steel_m107", "attitude": "upright",
         "position": ["0 m", "0 m", "1 m"]}  # fmt: skip
PERSON = {"name": "person", "position": ["80 m", "0 m"], "extent": "5 m"}
ROAD = {"name": "road", "kind": "road", "points": [["-20 m", "60 m"], ["20 m", "60 m"]], "width": "6 m",
        "target_area": "10 m^2", "number": 2}  # fmt: skip
OFFICE = {"name": "office", "kind": "building", "position": ["0 m", "-60 m"], "length": "9 m", "width": "9 m",
          "height": "3 m", "wall": {"material": "steel", "thickness": "9 mm"}}  # fmt: skip


def assessed(entry, counts, *, expected=None):
    """Entry of summary.json and prisms of one site, by counts {name: of the first prism in every realisation}."""
    case = case_from_document(
        {"title": "t", "burst": {"cell_size": "12 mm"}, "round": [SHELL], "exposed": [entry]}, source="case",
        folder=None,
    )  # fmt: skip
    (site,) = exposed_sites_of(case)
    sums = ExposedSums([site])
    for number in range(4):
        row = np.zeros(len(site.prisms), dtype=COUNTS)
        for name, values in counts.items():
            row[name][: len(np.atleast_1d(values[number]))] = values[number]
        sums.add(row)
    found = SimpleNamespace(expected=expected, undetermined="" if expected else "no flight", without_ricochet=None)
    return sums.assess(case, found)[0], site.prisms


@pytest.mark.parametrize(("counts", "bound"), [(FOUR_OF_SIX, POISSON_SIX), (ALL_AT_ONCE, BY_VARIANCE)])
def test_densities_of_a_site_by_hand(counts, bound):
    """Landings over area, lengths over volume: mean, standard error of the mean, and the bound of the sum."""
    longest = math.hypot(5.0 * math.sqrt(2.0), 1.8)
    lengths = longest * np.array(counts)
    entry, (prism,) = assessed(PERSON, {"landings": counts, "track": lengths, "track_squares": longest * lengths})
    error = np.std(counts, ddof=1) / 2.0
    for name, unit in (("density_ground", 25.0), ("density_normal", 25.0 * 1.8 / longest)):
        found = [entry[name][key] * unit for key in ("expected", "upper", "standard_error")]
        assert found == pytest.approx([1.5, bound / 4.0, error], rel=1e-5), name
    assert prism.longest == pytest.approx(longest)


def test_every_target_on_a_road_counts_and_of_its_pieces_the_largest_bound():
    landings = [*zip(FOUR_OF_SIX, (5, 0, 0, 0), strict=True)]
    entry, prisms = assessed(ROAD, {"track": FOUR_OF_SIX, "track_squares": FOUR_OF_SIX, "landings": landings})
    hits = 2 * 10.0 * 1.5 / prisms[0].volume
    assert entry["expected_hits"]["expected"] == pytest.approx(hits)
    assert entry["probability"]["expected"] == pytest.approx(1.0 - math.exp(-hits))
    assert entry["density_ground"]["expected"] == pytest.approx(1.5 / prisms[0].area)
    second = gamma.ppf(0.95, 36.0 / 26.0, scale=26.0 / 6.0)  # five at once have a larger bound than six
    assert second > POISSON_SIX
    assert entry["density_ground"]["upper"] == pytest.approx(second / 4.0 / prisms[0].area)


def test_hits_on_a_building_by_hand():
    """Three realisations of four hit, two through the wall; bounds 0.95^(1/4) of three in four, 0.9024 of two."""
    shadow = 9.0 * 3.0
    weights = np.array((2, 2, 2, 0)) / shadow
    counts = {"hits": (2, 2, 2, 0), "through": (1, 0, 1, 0), "fluence": weights, "fluence_squares": weights / shadow}
    entry, _ = assessed(OFFICE, counts)
    assert entry["expected_hits"]["upper"] == pytest.approx(POISSON_SIX / 4.0, rel=1e-5)
    assert entry["density_normal"]["upper"] == pytest.approx(POISSON_SIX / 4.0 / shadow, rel=1e-5)
    assert entry["probability"] == {"expected": 0.75, "upper": pytest.approx(0.95**0.25)}
    assert entry["not_stopped"]["probability"] == {"expected": 0.5, "upper": pytest.approx(0.9024, abs=1e-4)}


def test_where_all_azimuths_are_alike_the_curve_is_taken_at_the_nearest_edge():
    """Its bootstrap's deviation is 0.1 of ten groups: 1.8331 by Student and (10 / 9)^(1/2) of it are the bound."""
    radius = np.geomspace(10.0, 500.0, 400)
    curve = np.stack([radius**-3.0, 2.0 * radius**-3.0])
    one = np.array([110.0])
    expected = ExpectedDistance(
        100.0, 110.0, 2.0, 90.0, 100.0, "all_azimuths", None, 10, 10, None, (), 0.0, np.zeros(1), one, one, radius,
        curve, curve * math.exp(-0.16448536), curve * math.exp(0.16448536),
    )  # fmt: skip
    entry, _ = assessed(PERSON, {}, expected=expected)
    factor = 1.8331 * math.sqrt(10.0 / 9.0)
    for name, density in (("density_ground", 77.5**-3.0), ("density_normal", 2.0 * 77.5**-3.0)):
        found = [entry[name][key] / density for key in ("expected", "upper", "standard_error")]
        assert found == pytest.approx([1.0, math.exp(0.1 * factor), 0.1], rel=1e-4)
        assert entry["counted"][name.partition("_")[2]]["expected"] == 0.0
    assert entry["margin"] == pytest.approx(77.5 - 110.0, abs=0.01)
    assert assessed(PERSON | {"energy": "100 J"}, {}, expected=expected)[0]["counted"] is None


@pytest.mark.parametrize(
    ("expected", "upper", "verdict"), [(0.9, 0.999, "met"), (0.9, 1.001, "not shown"), (1.001, 1.2, "not met")]
)
def test_the_bound_meets_a_criterion_and_the_estimate_fails_it(expected, upper, verdict):
    value = {"expected": 2.0 * expected, "upper": 2.0 * upper}
    less = {"expected": 0.0, "upper": 0.0}
    for kinds in ((value, less), (less, value)):
        entry = dict(zip(("density_normal", "density_ground"), kinds, strict=True))
        assert verdict_of(entry | {"criterion": {"quantity": "density", "limit": 2.0}}) == verdict
