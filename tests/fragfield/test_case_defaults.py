"""Defaults of the case file: each is the very value that a user gets who writes it down."""

from __future__ import annotations

import pytest
from pydantic_core import PydanticUndefined

from fragfield.case import Case, differences
from fragfield.case.load import case_from_document
from fragfield.case.messages import marks_of, tables_in
from fragfield_base.inputs import Quantity, degrees, with_unit
from tests.fragfield.case_documents import CASE, a_round, changed

# Units in which people write; a default is spelled in those of its dimension.
_UNITS = {
    "m": ("mm", "cm", "ft", "inch"),
    "m^2": ("cm^2", "ft^2"),
    "s": ("us", "ms", "ns"),
    "kg": ("g", "lb"),
    "m/s": ("km/s", "ft/s"),
    "m/s^2": ("cm/s^2",),
    "kg/m^3": ("g/cm^3",),
    "Pa": ("MPa", "GPa", "bar"),
    "J": ("kJ",),
    "J/m^2": ("kJ/m^2", "J/cm^2"),
    "1/m^2": ("1/cm^2",),
    "rad": ("deg",),
    "1/s": ("1/ms",),
}
_SHORT = 7  # digits that a person would write


def _tables(model, found=None):
    found = {} if found is None else found
    if model.__name__ not in found:
        found[model.__name__] = model
        for field in model.model_fields.values():
            for _, table in tables_in(field.annotation):
                _tables(table, found)
    return found


def _defaults():
    for name, table in _tables(Case).items():
        for key, field in table.model_fields.items():
            marks = [mark for mark in marks_of(field) if isinstance(mark, Quantity)]
            if marks and field.default is not PydanticUndefined and isinstance(field.default, float):
                yield pytest.param(marks[0], field.default, id=f"{name}.{key}")


DEFAULTS = list(_defaults())


def test_defaults_with_units_are_found():
    assert {"ContactTable.friction_angle", "LeakageTable.parts"} & {one.id for one in DEFAULTS} == {
        "ContactTable.friction_angle"
    }
    assert len(DEFAULTS) > 30


@pytest.mark.parametrize(("mark", "default"), DEFAULTS)
def test_a_default_is_what_is_read_where_it_is_written_down(mark, default):
    """As the resolved case writes it, and in every unit in which it is a short number: "20 deg", not 0.349... rad."""
    assert mark.parse(with_unit(default, mark.symbol)) == default
    for unit in _UNITS[mark.symbol]:
        factor = Quantity(mark.symbol, "x").parse(f"1 {unit}")
        assert isinstance(factor, float)
        spelled = f"{default / factor:.{_SHORT}g}"
        if abs(float(spelled) * factor - default) < 1e-12 * abs(default):
            assert mark.parse(f"{spelled} {unit}") == default, f"{spelled} {unit}"


def test_density_of_hazard_is_the_rule_as_people_write_it():
    assert Quantity("1/m^2", "x").parse("1 / (55.7 m^2)") == Case().hazard.density


def test_angles_in_degrees_are_those_of_the_file():
    for angle in (0.0, 5.0, 20.0, 33.3, 89.0, 360.0):
        assert Quantity("rad", "x").parse(f"{angle} deg") == degrees(angle)


def test_writing_the_default_angles_down_is_no_other_case(tmp_path):
    """What `--resume` compares."""
    plane = {"name": "deck", "kind": "ground"}
    shorter = changed(plane=[plane], flight={"collisions": {}}, round=[a_round(position=["0 m", "0 m", "1 m"])])
    longer = {
        **shorter,
        "burst": {**CASE["burst"], "contact": {"friction_angle": "20 deg", "surface_friction_angle": "20 deg"}},
        "plane": [{**plane, "friction_angle": "20 deg"}],
        "flight": {"collisions": {"friction_angle": "20 deg"}},
    }
    one, other = (case_from_document(item, source="my.toml", folder=tmp_path) for item in (shorter, longer))
    assert differences(one, other) == []
    assert one == other
