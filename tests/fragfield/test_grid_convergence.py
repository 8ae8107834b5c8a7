"""The arithmetic of grid convergence: published examples, manufactured sequences, and sequences that have no order."""

from __future__ import annotations

import numpy as np
import pytest

from fragfield.pipeline.grid_convergence import FACTOR_OBSERVED, FACTOR_RANGE, grid_convergence, observed_order


def test_the_published_example_of_the_pressure_recovery():
    # Roache's method on the NPARC Alliance's example (Slater): total pressure recovery with sizes 1, 2, 4; Roache
    # gives p = 1.786170, 0.971300 for no size and an index of 0.103083 % for the finest.
    found = grid_convergence([1.0, 2.0, 4.0], [0.97050, 0.96854, 0.96178])
    assert found.kind == "monotone"
    assert found.order == pytest.approx(1.786170, abs=1e-6)
    assert found.extrapolated == pytest.approx(0.971300, abs=1e-6)
    assert found.uncertainty / 0.97050 == pytest.approx(0.00103083, abs=1e-8)


def test_the_published_example_with_ratios_that_differ():
    # Celik et al. (2008), Table 1, first column: 18,000, 8,000 and 4,500 cells in two dimensions.
    cells = np.array([18_000.0, 8_000.0, 4_500.0])
    found = grid_convergence(cells**-0.5, [6.063, 5.972, 5.863])
    assert found.order == pytest.approx(1.53, abs=0.005)
    assert found.extrapolated == pytest.approx(6.1685, abs=5e-5)
    assert found.uncertainty / 6.063 == pytest.approx(0.022, abs=5e-4)


@pytest.mark.parametrize("order", [0.6, 1.0, 1.37, 2.0])
@pytest.mark.parametrize("sizes", [(1.0, 2.0, 4.0), (3.0, 3.0 * 2**0.5, 6.0), (1.0, 1.3, 3.1)])
@pytest.mark.parametrize("slope", [-7.0, 0.03])
def test_a_manufactured_sequence_gives_its_order_and_limit(order, sizes, slope):
    h = np.array(sizes)
    values = 1020.0 + slope * h**order
    found = grid_convergence(h, values)
    assert found.kind == "monotone"
    assert found.order == pytest.approx(order, rel=1e-6)
    assert found.extrapolated == pytest.approx(1020.0, rel=1e-9)
    assert found.uncertainty == pytest.approx(FACTOR_OBSERVED * abs(slope) * h[0] ** order, rel=1e-6)
    # The same in any order of the sizes, and in any unit of length.
    turned = grid_convergence(1e-3 * h[::-1], values[::-1])
    assert turned.order == pytest.approx(order, rel=1e-6)
    assert turned.uncertainty == pytest.approx(found.uncertainty, rel=1e-6)
    # Of the value with another size than the finest: its own distance from the limit.
    middle = grid_convergence(h, values, at=h[1])
    assert middle.uncertainty == pytest.approx(FACTOR_OBSERVED * abs(slope) * h[1] ** order, rel=1e-6)


@pytest.mark.parametrize(("order", "used"), [(0.2, 0.5), (3.5, 2.0)])
def test_an_order_out_of_bounds_is_reported_and_not_used(order, used):
    h = np.array([1.0, 2.0, 4.0])
    values = 5.0 + h**order
    found = grid_convergence(h, values)
    assert found.order == pytest.approx(order, rel=1e-6)
    assert found.order_used == used
    assert (found.extrapolated is None) == (order < 0.5)  # so slow that the limit would be a guess
    assert found.uncertainty == pytest.approx(FACTOR_OBSERVED * (values[1] - values[0]) / (2.0**used - 1.0))


@pytest.mark.parametrize(
    ("sizes", "values", "kind"),
    [
        ((1.0, 2.0, 4.0), (1.0, 1.2, 0.9), "oscillating"),
        ((1.0, 2.0, 4.0), (1.0, 1.2, 1.35), "diverging"),  # differences that grow towards small cells
        ((1.0, 2.0, 4.0), (1.0, 1.0, 1.3), "diverging"),
        ((1.0, 2.0, 2.4), (1.0, 1.2, 1.25), "diverging"),  # below 0.2 ln(1.2) / ln(2): no positive order
        ((1.0, 2.0), (1.0, 1.3), "two_sizes"),
    ],
)
def test_without_an_order_the_range_counts_threefold(sizes, values, kind):
    found = grid_convergence(sizes, values)
    assert found.kind == kind
    assert (found.order, found.extrapolated, found.order_used) == (None, None, 1.0)
    assert found.uncertainty == pytest.approx(FACTOR_RANGE * np.ptp(values) / (sizes[-1] - 1.0))


def test_differences_within_their_statistical_errors_are_no_trend():
    h, values = [1.0, 2.0, 4.0], [100.0, 101.0, 103.0]
    assert grid_convergence(h, values).kind == "monotone"
    assert grid_convergence(h, values, [0.1, 0.1, 0.1]).kind == "monotone"
    found = grid_convergence(h, values, [2.0, 2.0, 2.0])
    assert (found.kind, found.order, found.extrapolated) == ("statistical", None, None)
    # On a line of slope 1, whose error is 2 over the root of 14 / 3, the sum of squares about the mean size.
    assert found.uncertainty == pytest.approx(FACTOR_OBSERVED * 1.0 + 1.96 * 2.0 / (14.0 / 3.0) ** 0.5)
    assert grid_convergence(h, values, [2.0, 2.0, 2.0], at=2.0).uncertainty == pytest.approx(2.0 * found.uncertainty)


@pytest.mark.parametrize("slope", [0.0, 0.5, -1.0, 2.0])
@pytest.mark.parametrize("sizes", [(1.0, 2.0), (1.0, 2**0.5, 2.0), (2**-0.5, 1.0, 2**0.5, 2.0)])
def test_the_uncertainty_within_statistical_errors_covers_the_error_of_the_cells(slope, sizes):
    h, sigma = np.array(sizes), 1.5
    draws = np.random.default_rng(7).normal(130.0 + slope * h, sigma, (2000, len(h)))
    found = [grid_convergence(h, values, np.full(len(h), sigma), at=1.0) for values in draws]
    covered = [one.uncertainty >= abs(slope) for one in found if one.kind == "statistical"]
    assert len(covered) > 1000
    assert np.mean(covered) > 0.95
    if slope == 0.0 and len(h) > 2:  # and narrower than by the range of what is noise
        ranges = FACTOR_RANGE * np.ptp(draws, axis=1) / (h.max() / h.min() - 1.0) / h.min()
        assert np.median([one.uncertainty for one in found]) < np.median(ranges)


def test_values_off_the_line_by_more_than_their_errors_widen_the_band():
    # About the line, which is level, lie -10/3, 20/3, -10/3 with errors of 1: chi squared is 200/3 with one degree of
    # freedom. The slope's own error is the root of 1/2.
    found = grid_convergence([1.0, 2.0, 3.0], [100.0, 110.0, 100.0], [1.0, 1.0, 1.0])
    assert found.kind == "oscillating"
    assert found.uncertainty == pytest.approx(1.96 * (200.0 / 3.0 / 2.0) ** 0.5)
    assert found.uncertainty < grid_convergence([1.0, 2.0, 3.0], [100.0, 110.0, 100.0]).uncertainty
    # Within the errors nothing is widened, and the band does not jump where differences become significant.
    below, above = (grid_convergence([1.0, 2.0, 3.0], [100.0, 100.0 + rise, 100.0], [1.0] * 3) for rise in (2.82, 2.83))
    assert (below.kind, above.kind) == ("statistical", "oscillating")
    assert above.uncertainty == pytest.approx(below.uncertainty, rel=0.01)


def test_values_that_agree_and_a_single_size():
    same = grid_convergence([1.0, 2.0, 4.0], [7.0, 7.0, 7.0])
    assert (same.kind, same.extrapolated, same.uncertainty) == ("constant", 7.0, 0.0)
    assert grid_convergence([1.0], [7.0]).kind == "one_size"


def test_of_many_sizes_the_three_finest_count():
    h = np.array([1.0, 2.0, 4.0, 8.0])
    values = 3.0 + h**1.5
    values[-1] = -50.0
    assert grid_convergence(h, values).order == pytest.approx(1.5, rel=1e-9)


@pytest.mark.parametrize(
    ("sizes", "values"),
    [([1.0, 1.0], [2.0, 3.0]), ([0.0, 1.0], [2.0, 3.0]), ([1.0, 2.0], [2.0, np.nan]), ([1.0], [2.0, 3.0]), ([], [])],
)
def test_what_has_no_meaning_is_refused(sizes, values):
    with pytest.raises(ValueError, match=r"sizes|length"):
        grid_convergence(sizes, values)


def test_no_order_where_a_difference_vanishes():
    assert observed_order([1.0, 2.0, 4.0], [1.0, 1.0, 2.0]) is None


@pytest.mark.parametrize(
    ("round_", "values"),
    [
        ("M107, TNT", {13.43: 139.05, 10.66: 140.06, 8.06: 140.77, 6.12: 141.17, 4.31: 141.62, 3.0: 141.95}),
        ("M107, Composition B", {10.66: 151.40, 8.06: 151.99, 6.12: 152.38, 4.31: 152.88, 3.0: 153.23}),
        ("155 mm shell of the paper, TNT", {10.42: 147.07, 8.3: 147.89, 6.01: 148.34, 4.24: 148.80}),
    ],
)
def test_distances_of_rounds_lie_within_the_band_of_their_limit(round_, values):
    """Distances (m) by representative size (mm), by the integral; the limit is that of the two finest, at order 1."""
    h = sorted(values)
    limit = values[h[0]] + h[0] * (values[h[0]] - values[h[1]]) / (h[1] - h[0])
    for three in zip(h, h[1:], h[2:], strict=False):
        found = grid_convergence(three, [values[one] for one in three], [1e-6] * 3)
        assert limit - values[three[0]] < found.uncertainty, (round_, three)
        assert found.uncertainty < 2.0 * (limit - values[three[0]]), (round_, three)
