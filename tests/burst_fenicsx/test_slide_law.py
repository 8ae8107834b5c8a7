"""The law of charge on casing and Coulomb's friction by closed forms: one for surfaces, lines and all springs."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from burst_fenicsx.kernels.constants import BENT, ENTRY, MOST_CORRECTION
from burst_fenicsx.kernels.contact.coulomb import coulomb_slip
from burst_fenicsx.kernels.contact.slide_law import SlideLaw, has_left, slide

pytestmark = pytest.mark.dolfinx

TENSION, COHESION, FRICTION, AREA, STIFFNESS, STRENGTH = 5e6, 4e6, 0.3, 2e-5, 1e9, 60e6
LAW = SlideLaw(1e14, 1e-7, TENSION, COHESION, FRICTION)


def slid(gap, *, bonded=True, off=False, burnt=0.0, pressure=0.0, trial=0.0):
    """As `slide` with the values above, from rest: whole, gas, stiffness, kept, stored, heat, depth."""
    return slide(LAW, bonded, off, burnt, pressure, STRENGTH, AREA, gap, STIFFNESS, trial, STIFFNESS, 0.0)


@pytest.mark.parametrize("burnt", [0.0, 0.4])
def test_a_bond_breaks_at_its_tensile_strength_which_fades_as_it_burns(burnt):
    opening = (1.0 - burnt) * TENSION * AREA / STIFFNESS
    for gap, holds in ((0.999 * opening, True), (1.001 * opening, False)):
        whole, gas, stiffness, *_ = slid(gap, burnt=burnt)
        assert (whole, gas, stiffness) == (holds, 0.0, STIFFNESS if holds else 0.0)
    # Broken, it bears no tension, and presses as before.
    assert slid(1e-9, bonded=False)[:3] == (False, 0.0, 0.0)
    whole, _, stiffness, _, stored, _, depth = slid(-1e-9, bonded=False)
    assert (whole, stiffness, depth) == (False, STIFFNESS, 1e-9)
    assert stored == pytest.approx(0.5 * STIFFNESS * 1e-18, rel=1e-12)


@pytest.mark.parametrize(("press", "limit"), [(0.0, COHESION), (50e6, COHESION + FRICTION * 50e6), (1e9, STRENGTH)])
def test_the_explosive_holds_cohesion_and_friction_up_to_its_own_strength(press, limit):
    """Dragged far, the spring keeps the largest tangential force; the bond has given way then."""
    gap = -press * AREA / STIFFNESS

    def held(**changes):
        whole, _, stiffness, kept, *_ = slid(gap, trial=1.0, **changes)
        assert not whole
        return stiffness * kept

    assert held() == pytest.approx(limit * AREA, rel=1e-12)
    assert held(burnt=0.5) == pytest.approx(0.5 * limit * AREA, rel=1e-12)
    broken = min(limit - COHESION, STRENGTH) if press < 1e9 else STRENGTH
    assert held(bonded=False) == pytest.approx(broken * AREA, rel=1e-12, abs=1e-12)
    # Dragged less than that, nothing slips and the bond stays.
    within = 0.999 * limit * AREA / STIFFNESS
    assert slid(gap, trial=within)[:4] == (True, 0.0, STIFFNESS, within)


def test_products_press_with_their_pressure_and_neither_pull_nor_rub():
    pressure = 2e9
    own = pressure * AREA
    for gap in (-1e-6, 0.0, 1e-6, 0.999 * own / STIFFNESS):
        whole, gas, stiffness, kept, *_ = slid(gap, burnt=1.0, pressure=pressure, trial=1e-3)
        assert (whole, kept) == (False, 0.0)
        assert gas == pytest.approx(own, rel=1e-12)
        assert stiffness == STIFFNESS
    # Far behind the wall the correction is a multiple of their own force; before it they are apart.
    _, gas, stiffness, *_ = slid(-2e-2, burnt=1.0, pressure=pressure)
    assert gas == pytest.approx(own, rel=1e-12)
    assert stiffness * 2e-2 == pytest.approx(MOST_CORRECTION * own, rel=1e-12)
    assert slid(1.001 * own / STIFFNESS, burnt=1.0, pressure=pressure)[:3] == (False, 0.0, 0.0)
    # Over an edge they leave, and without pressure they do nothing.
    assert slid(0.0, burnt=1.0, pressure=pressure, off=True)[:3] == (False, 0.0, 0.0)
    assert slid(-1e-4, burnt=1.0)[1:3] == (0.0, 0.0)


def test_a_spring_that_parts_turns_what_it_held_into_heat():
    _, _, stiffness, kept, stored, heat, depth = slide(
        LAW, False, True, 0.0, 0.0, STRENGTH, AREA, -1e-4, STIFFNESS, 2e-6, STIFFNESS, 1e-6
    )
    assert (stiffness, kept, stored, depth) == (0.0, 0.0, 0.0, 0.0)
    assert heat == pytest.approx(0.5 * STIFFNESS * 1e-12, rel=1e-12)


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
