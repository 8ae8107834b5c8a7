"""Everyday units read without the units library: the same floats as by it, and all else left to it."""

from __future__ import annotations

import subprocess
import sys

import pytest

from fragfield.case.units import quantities
from fragfield.case.units.everyday import PLAIN_UNITS, plain_value
from fragfield.case.units.quantities import Quantity

NUMBERS = ("1", "6", "25", "-3.5", ".125", "1e-3", "448", "0.1", "123.456789", "7850", "2.5E+02", "1e9")


@pytest.mark.parametrize(
    ("symbol", "unit"), [(symbol, unit) for symbol, units in PLAIN_UNITS.items() for unit in units]
)
def test_every_unit_gives_the_float_of_the_library(symbol, unit, monkeypatch):
    texts = [f"{number} {unit}" for number in NUMBERS] + [f"{number}{unit}" for number in ("6", "0.25")]
    found = [Quantity(symbol, "").parse(text) for text in texts if plain_value(text, symbol) is not None]
    assert len(found) >= len(NUMBERS)
    monkeypatch.setattr(quantities, "plain_value", lambda *_: None)
    assert found == [Quantity(symbol, "").parse(text) for text in texts if plain_value(text, symbol) is not None]


@pytest.mark.parametrize("text", ["1 / (55.7 m^2)", "1/(600 m2)", "1 / (0.3 m^2)"])
def test_a_number_per_area_gives_the_float_of_the_library(text, monkeypatch):
    quantity = Quantity("1/m^2", "")
    found = quantity.parse(text)
    assert plain_value(text, "1/m^2") == found
    monkeypatch.setattr(quantities, "plain_value", lambda *_: None)
    assert quantity.parse(text) == found


@pytest.mark.parametrize(
    ("text", "symbol"),
    [("6", "m"), ("6 mm", "s"), ("6 mm/s", "m/s"), ("6 mm^2", "m"), ("2 * 3 m", "m"), ("1 / (0 m^2)", "1/m^2"),
     ("6 furlong", "m"), ("20 degC", "K"), ("6 m m", "m"), ("mm", "m"), ("1 / (2 m)", "1/m^2"),
     ("61/m^2", "1/m^2")],
)  # fmt: skip
def test_all_else_is_left_to_the_library(text, symbol):
    assert plain_value(text, symbol) is None


def test_a_ready_case_is_read_without_the_library():
    code = (
        "import sys; from pathlib import Path; from fragfield.case import load_case;"
        "load_case(Path('cases/m107_tnt.toml')); sys.exit('pint' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
