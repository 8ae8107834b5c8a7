"""Measures as people write them, in SI: the table of units beside that of pint, the grammar, and what is refused."""

from __future__ import annotations

import math

import pint
import pytest

from fragfield_base.inputs import Quantity
from fragfield_base.units import UNITS, UnitError, read_measure

FOOT = 0.3048


def test_every_unit_is_that_of_pint() -> None:
    """Factor and powers; a radian has a power here. Of two names pint knows one as Planck's constant, one not."""
    registry, compared = pint.UnitRegistry(), 0
    for name, (factor, (metre, kilogram, second, _, kelvin)) in UNITS.items():
        if name in ("hbar", "us_ft"):
            continue
        # Before 0.26 pint's acre is that of the survey foot, 4 parts in a million larger.
        theirs = registry.Quantity(*((43_560.0, "foot ** 2") if name == "acre" else (1.0, name))).to_base_units()
        powers = {"[length]": metre, "[mass]": kilogram, "[time]": second, "[temperature]": kelvin}
        assert factor == pytest.approx(theirs.magnitude, rel=1e-9), name
        assert dict(theirs.dimensionality) == {base: power for base, power in powers.items() if power}, name
        compared += 1
    assert compared > 450
    assert {name for name, (_, powers) in UNITS.items() if powers[3]} >= {"rad", "mrad", "deg", "degree", "°"}


@pytest.mark.parametrize(
    ("text", "value", "symbol"),
    [
        ("155 mm", 0.155, "m"),
        ("-20 deg", -math.radians(20.0), "rad"),
        ("+3 m", 3.0, "m"),
        (" 3m ", 3.0, "m"),
        ("1.71 g/cm^3", 1710.0, "kg/m^3"),
        ("1.71 g cm**-3", 1710.0, "kg/m^3"),
        ("1710 kg/m3", 1710.0, "kg/m^3"),
        ("1 / (55.7 m^2)", 1.0 / 55.7, "1/m^2"),
        ("0.5 1/m^2", 0.5, "1/m^2"),
        ("2 kilobar", 2e8, "Pa"),
        ("2 kbar", 2e8, "Pa"),
        ("3 kg m/s^2/m^2", 3.0, "Pa"),
        ("3 (kg/m)/(s^2)", 3.0, "Pa"),
        ("58 ft*lbf", 58.0 * FOOT * 4.4482216152605, "J"),
        ("5 kilometers", 5000.0, "m"),
        ("120 us", 1.2e-4, "s"),
        (".5e3 m", 500.0, "m"),
    ],
)
def test_a_measure_is_read(text: str, value: float, symbol: str) -> None:
    found = read_measure(text)
    assert found.value == pytest.approx(value, rel=1e-14)
    assert found.is_of(symbol)
    assert not found.is_of("m/s")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("2 kmetre", 'the unknown unit "kmetre"'),
        ("2 kilom", 'the unknown unit "kilom"'),
        ("2 metter", 'did you mean "meter"'),
        ("2 m + 3 m", "which is a sum"),
        ("1 500 kg", "which has two numbers side by side; a number has no space between thousands"),
        ("1 m 20 cm", "which has two numbers side by side"),
        ("2 m)", "parentheses that do not fit"),
        ("2 (m", "parentheses that do not fit"),
        ("2 m^10", "no whole number from -9 to 9"),
        ("2^2 m", "takes a power of a number"),
        ("1 / 0 m", "divides by zero"),
        ("1 " + "m" * 120, "has 122 characters"),
    ],
)
def test_what_is_no_measure_is_refused(text: str, words: str) -> None:
    with pytest.raises(UnitError) as caught:
        read_measure(text)
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("quantity", "value", "text"),
    [
        (Quantity("m", "155 mm"), 0.25, "250 mm"),
        (Quantity("m", "155 mm"), 0.155, "155 mm"),
        (Quantity("rad", "10 deg"), math.radians(30.0), "30 deg"),
        (Quantity("1/m^2", "1 / (55.7 m^2)"), 0.5, "0.5 1/m^2"),
        (Quantity("Pa", "1 MPa"), 4e8, "400 MPa"),
        (Quantity("m", "1 um"), 1e8, "100000000 m"),
    ],
)
def test_a_value_is_shown_in_the_unit_of_its_example(quantity: Quantity, value: float, text: str) -> None:
    assert quantity.in_unit_of_example(value) == text
