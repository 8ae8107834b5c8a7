"""The law of charge on casing and Coulomb's friction by closed forms: one for surfaces, lines and all springs."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from burst_fenicsx.kernels.constants import BENT, ENTRY, MOST_CORRECTION
from burst_fenicsx.kernels.contact.coulomb import coulomb_slip
from burst_fenicsx.kernels.contact.slide_law import SlideLaw, attach, has_left

pytestmark = pytest.mark.dolfinx

TENSION, COHESION, FRICTION, AREA, STIFFNESS, STRENGTH = 5e6, 4e6, 0.3, 2e-5, 1e9, 60e6
LAW = SlideLaw(1e14, 1e-7, TENSION, COHESION, FRICTION)


def attached(gap, *, bonded=True, off=False, burnt=0.0, pressure=0.0):
    """As `attach` with the values above: apart, whole, gas, stiffness, limit."""
    return attach(LAW, bonded, off, burnt, pressure, STRENGTH, AREA, gap, STIFFNESS)


@pytest.mark.parametrize("burnt", [0.0, 0.4])
def test_a_bond_breaks_at_its_tensile_strength_which_fades_as_it_burns(burnt):
    opening = (1.0 - burnt) * TENSION * AREA / STIFFNESS
    for gap, holds in ((0.999 * opening, True), (1.001 * opening, False)):
        apart, whole, gas, stiffness, _ = attached(gap, burnt=burnt)
        assert (apart, whole) == (not holds, holds)
        assert (gas, stiffness) == (0.0, STIFFNESS if holds else 0.0)
    # Broken, it bears no tension, and presses as before.
    assert attached(1e-9, bonded=False)[0]
    assert attached(-1e-9, bonded=False)[:2] == (False, False)


@pytest.mark.parametrize(("press", "limit"), [(0.0, COHESION), (50e6, COHESION + FRICTION * 50e6), (1e9, STRENGTH)])
def test_the_explosive_holds_cohesion_and_friction_up_to_its_own_strength(press, limit):
    gap = -press * AREA / STIFFNESS
    assert attached(gap)[4] == pytest.approx(limit * AREA, rel=1e-12)
    half = attached(gap, burnt=0.5)[4]
    assert half == pytest.approx(0.5 * limit * AREA, rel=1e-12)
    broken = min(limit - COHESION, STRENGTH) if press < 1e9 else STRENGTH
    assert attached(gap, bonded=False)[4] == pytest.approx(broken * AREA, rel=1e-12, abs=1e-12)


def test_products_press_with_their_pressure_and_neither_pull_nor_rub():
    pressure = 2e9
    own = pressure * AREA
    for gap in (-1e-6, 0.0, 1e-6, 0.999 * own / STIFFNESS):
        apart, whole, gas, stiffness, limit = attached(gap, burnt=1.0, pressure=pressure)
        assert (apart, whole, limit) == (False, False, 0.0)
        assert gas == pytest.approx(own, rel=1e-12)
        assert stiffness == STIFFNESS
    # Far behind the wall the correction is a multiple of their own force; before it they are apart.
    apart, _, gas, stiffness, _ = attached(-2e-2, burnt=1.0, pressure=pressure)
    assert not apart
    assert gas == pytest.approx(own, rel=1e-12)
    assert stiffness * 2e-2 == pytest.approx(MOST_CORRECTION * own, rel=1e-12)
    assert attached(1.001 * own / STIFFNESS, burnt=1.0, pressure=pressure)[:4] == (True, False, 0.0, 0.0)
    # Over an edge they leave, and without pressure they do nothing.
    assert attached(0.0, burnt=1.0, pressure=pressure, off=True)[:4] == (True, False, 0.0, 0.0)
    assert attached(-1e-4, burnt=1.0)[2:4] == (0.0, 0.0)


def test_a_node_has_left_beyond_the_rim_too_deep_or_deeper_than_it_can_have_come():
    reach, moved = 1e-3, 2e-5
    assert not has_left(0.999 * reach, 0.0, reach, moved, True)
    assert has_left(1.001 * reach, 0.0, reach, moved, True)
    assert not has_left(0.0, -0.999 * reach, reach, moved, True)
    assert has_left(0.0, -1.001 * reach, reach, moved, True)
    entered = ENTRY * moved + BENT * reach
    assert not has_left(0.0, -0.999 * entered, reach, moved, False)
    assert has_left(0.0, -1.001 * entered, reach, moved, False)


def test_friction_takes_the_work_that_the_spring_does_not_store():
    """Work of the mean force on the whole way: spring and heat, to round-off."""
    random = np.random.default_rng(3)
    slipped = 0
    for _ in range(200):
        stiffness, old, trial, limit = random.uniform(0.1, 1.0, 4)
        old = min(old, limit / stiffness)  # the last step kept to its own limit
        kept, heat = coulomb_slip(trial, limit, stiffness, stiffness, old)
        assert stiffness * kept <= limit * (1.0 + 1e-12)
        assert kept <= trial
        assert heat >= 0.0
        if kept < trial:
            slipped += 1
            assert stiffness * kept == pytest.approx(limit, rel=1e-12)
            work = 0.5 * stiffness * (old + kept) * (trial - old)
            assert heat + 0.5 * stiffness * (kept**2 - old**2) == pytest.approx(work, rel=1e-9, abs=1e-12)
        else:
            assert heat == 0.0
    assert 20 < slipped < 180
