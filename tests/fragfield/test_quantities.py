"""Values with units: what is read, and what is said of values that are none."""

from __future__ import annotations

import math

import pytest

from fragfield_base.inputs import NotAllowedError, NumberOrWord, Quantity, Vector

LENGTH = Quantity("m", "155 mm")
POSITIVE = Quantity("m", "6 mm", above=0.0)


@pytest.mark.parametrize(
    ("symbol", "text", "expected"),
    [
        ("m", "155 mm", 0.155),
        ("m", "25 ft", 7.62),
        ("m", "-3 inch", -0.0762),
        ("m", "6mm", 0.006),
        ("m", "3 feet", 0.9144),
        ("m", "2 metres", 2.0),
        ("m", "0.5 kilometers", 500.0),
        ("s", "3 µs", 3e-6),
        ("Pa", "0.2 kbar", 2e7),
        ("J/kg", "1 kcal / g", 4.184e6),
        ("kg", "2 short_ton", 2 * 2000 * 0.45359237),
        ("s", "120 us", 1.2e-4),
        ("s", "10 ns", 1e-8),
        ("kg", "15 grain", 15 * 64.79891e-6),
        ("kg/m^3", "1.71 g/cm^3", 1710.0),
        ("kg/m^3", "1.71 g/cm3", 1710.0),
        ("kg/m^3", "7850 kg/m**3", 7850.0),
        ("m/s", "2.4 km/s", 2400.0),
        ("Pa", "371.2 GPa", 371.2e9),
        ("J", "58.3 ft * lbf", 58.3 * 0.3048 * 4.4482216152605),
        ("J/kg", "4.52 MJ/kg", 4.52e6),
        ("J/m^2", "14.7e4 J/m^2", 14.7e4),
        ("J/m^3", "7 GJ/m^3", 7e9),
        ("1/m^2", "1 / (55.7 m^2)", 1 / 55.7),
        ("1/m^2", "1 / (600 ft^2)", 1 / (600 * 0.3048**2)),
        ("rad", "90 deg", math.pi / 2),
        ("rad", "1 rad", 1.0),
    ],
)
def test_a_value_with_its_unit_is_read_in_si(symbol, text, expected):
    assert Quantity(symbol, "x").parse(text) == pytest.approx(expected, rel=1e-14)


def test_the_table_of_units_agrees_with_itself():
    """By their own definitions: energies and pressures from force and length, prefixes from the unit alone."""
    pairs = (
        ("J", "1 ft lbf", "1 foot_pound"), ("Pa", "1 lbf / in^2", "1 psi"), ("Pa", "1 N / m^2", "1 Pa"),
        ("J", "1 W s", "1 J"), ("J", "3.6 MJ", "1 kWh"), ("N", "1 kg m / s^2", "1 N"), ("m", "1 yd", "3 ft"),
        ("m", "5280 ft", "1 mile"), ("kg", "7000 grain", "1 lb"), ("kg", "16 oz", "1 pound"), ("m", "1000 mm", "1 m"),
        ("rad", "360 deg", "1 turn"), ("rad", "60 arcmin", "1 degree"), ("m/s", "3.6 kph", "1 m/s"),
        ("m/s", "1 nmi / hour", "1 knot"), ("1/s", "1 Hz", "1 / s"), ("m^3", "1 litre", "1 dm^3"),
    )  # fmt: skip
    for symbol, one, other in pairs:
        quantity = Quantity(symbol, "x")
        assert quantity.parse(one) == pytest.approx(quantity.parse(other), rel=1e-14), one


def test_usual_values_come_out_without_rounding_noise():
    assert LENGTH.parse("25 ft") == 7.62
    assert Quantity("s", "x").parse("120 us") == 1.2e-4
    assert Quantity("kg/m^3", "x").parse("7.85 g/cm^3") == 7850.0


@pytest.mark.parametrize(
    ("quantity", "value", "parts"),
    [
        (LENGTH, 6, ["the bare number 6 without a unit", "a length", '"155 mm"']),
        (LENGTH, 6.5, ["the bare number 6.5"]),
        (LENGTH, "6", ['"6" without a unit']),
        (LENGTH, "-6.e3", ["without a unit"]),
        (LENGTH, True, ["found True"]),
        (LENGTH, ["6 mm"], ["found ['6 mm']"]),
        (LENGTH, "3 kg", ['"3 kg"', "a mass", "a length"]),
        (LENGTH, "3 m^2", ["an area"]),
        (LENGTH, "3 m/s", ["a speed"]),
        (LENGTH, "3 deg", ["an angle", "a length"]),
        (LENGTH, "3 A", ['unknown unit "A"']),
        (LENGTH, "3 kg/m", ["a quantity in m^-1 kg^1"]),
        (LENGTH, "1 / (0 m)", ["divides by zero"]),
        (LENGTH, "2 m + 1 m", ["is a sum"]),
        (LENGTH, "3 millimetr", ['unknown unit "millimetr"']),
        (LENGTH, "3 meterr", ['did you mean "meter"']),
        (LENGTH, "", ['found ""']),
        (LENGTH, "mm +", ["not a number with a unit"]),
        (LENGTH, "{} mm", ['found "{} mm"']),
        (LENGTH, "{m}", ['found "{m}"']),
        (LENGTH, "6 {m}", ['found "6 {m}"']),
        (LENGTH, "mm", ['found "mm"', "not a number"]),
        (LENGTH, "1e400 m", ["allowed: a length"]),
        (POSITIVE, "0 mm", ["greater than 0 m"]),
        (POSITIVE, "-1 mm", ['found "-1 mm"', "greater than 0 m"]),
        (Quantity("s", "0 us", minimum=0.0), "-1 us", ["at least 0 s"]),
        (Quantity("rad", "5 deg"), "1 m/m", ["a number without a unit", "an angle"]),
        (Quantity("m", "30 mm", words=("nose",)), "nsoe", ['did you mean "nose"', '"nose" or a length']),
    ],
)
def test_a_value_that_is_none_says_what_was_found_and_what_is_allowed(quantity, value, parts):
    with pytest.raises(NotAllowedError) as caught:
        quantity.parse(value)
    message = str(caught.value)
    for part in [*parts, "allowed:"]:
        assert part in message


@pytest.mark.parametrize("text", ["1 m;", "((", "1 m m", "m ** m", "1e", "0x", "'", "\u00b5", "9" * 400 + " m"])
def test_no_text_ends_in_anything_but_a_message(text):
    with pytest.raises(NotAllowedError, match="allowed: a length"):
        LENGTH.parse(text)


def test_a_word_may_stand_for_a_value():
    assert Quantity("m", "30 mm", words=("nose",)).parse("nose") == "nose"
    assert NumberOrWord(("none",), 0.5).parse("none") == "none"
    assert NumberOrWord(("none",), 0.5).parse(2) == 2.0
    for bad in (-1, 0, "non", True, math.inf, "0.5"):
        with pytest.raises(NotAllowedError, match='allowed: "none" or a number greater than 0'):
            NumberOrWord(("none",), 0.5).parse(bad)


def test_a_vector_names_the_component_at_fault():
    place = Vector(3, LENGTH, '["0 mm", "0 mm", "1 m"]')
    assert place.parse(["1 mm", "2 cm", "3 m"]) == (0.001, 0.02, 3.0)
    with pytest.raises(NotAllowedError, match="component 2: found the bare number 2"):
        place.parse(["1 mm", 2, "3 m"])
    with pytest.raises(NotAllowedError, match="a list of 3 components"):
        place.parse(["1 mm", "2 mm"])
    with pytest.raises(NotAllowedError, match="allowed: a list of 3 components, without unit"):
        Vector(3, None, "[0, 0, 1]").parse([0, 0, "1"])
