"""Exact sums: rounding to multiples of a power of two, in Python, in compiled loops and at the nodes."""

from __future__ import annotations

import math
from fractions import Fraction

import numpy as np
import pytest

pytest.importorskip("numba")
pytest.importorskip("mpi4py")

from burst_fenicsx.contact.nodes import CONTACT_FORCES
from burst_fenicsx.kernels.lanes import kernel
from burst_fenicsx.kernels.vectors.exact import quantise, quantum, rounding_constant


@kernel
def _sum(terms: np.ndarray, rounding: float) -> float:
    """Sum as the kernels do it: rounding and adding in one compiled loop, the product free to be fused."""
    total = 0.0
    for k in range(terms.size):
        total += quantise(1.0625 * terms[k], rounding)
    return total


@pytest.fixture(scope="module")
def terms():
    random = np.random.default_rng(8)
    return random.normal(size=3000) * 10.0 ** random.uniform(-12.0, 0.0, 3000)


@pytest.mark.parametrize("largest", [1e-30, 0.7, 1.0, 1.5, 3e5, 2.0**40, 1e30])
def test_the_constant_rounds_terms_up_to_the_largest(largest):
    rounding = rounding_constant(largest)
    q = quantum(rounding)
    assert math.frexp(q)[0] == 0.5  # a power of two
    assert math.ulp(rounding) == q
    assert largest <= 2.0**51 * q <= 2.0 * largest
    for sign in (1.0, -1.0):
        for value in (sign * largest, sign * 0.3 * largest, sign * 123.456 * q, sign * 0.49 * q):
            rounded = quantise(value, rounding)
            assert rounded / q == round(rounded / q)
            assert abs(rounded - value) <= 0.5 * q <= largest / 2.0**51


@pytest.mark.parametrize("largest", [0.0, -1.0, math.inf, math.nan])
def test_a_largest_term_that_is_none_is_refused(largest):
    with pytest.raises(ValueError, match="it must be positive and finite"):
        rounding_constant(largest)


def test_compiled_sums_are_exact_in_any_order(terms):
    """Against rational arithmetic; without rounding the same orders give different sums, so the test can fail."""
    rounding = rounding_constant(8.0)
    random = np.random.default_rng(9)
    orders = [random.permutation(len(terms)) for _ in range(20)]
    plain = {_sum(terms[order], 0.0) for order in orders}
    exact = {_sum(terms[order], rounding) for order in orders}
    assert len(plain) > 1
    assert len(exact) == 1
    whole = sum(Fraction(_sum(terms[k : k + 1], rounding)) for k in range(len(terms)))
    assert Fraction(exact.pop()) == whole
    assert abs(float(whole) - math.fsum(1.0625 * terms)) < len(terms) * quantum(rounding)


def test_contacts_of_one_node_are_summed_exactly_beyond_what_cells_can_give():
    """Terms of up to ten times a cell's largest force, as where walls collide: with the cells' quantum order shows."""
    cells = rounding_constant(5.8e6)  # N, of steel cells of 8 mm
    random = np.random.default_rng(7)
    pushes = random.uniform(0.0, 5.8e7, 40)
    orders = [random.permutation(len(pushes)) for _ in range(50)]
    assert len({_sum(pushes[order], cells) for order in orders}) > 1
    assert len({_sum(pushes[order], CONTACT_FORCES * cells) for order in orders}) == 1
    # A multiple of the cells' own quantum that is a power of two: sums with their forces are exact as well.
    assert np.frexp(CONTACT_FORCES)[0] == 0.5
