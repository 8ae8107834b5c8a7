"""An input is described once, on the stage's dataclass: key, checks and reference of the case follow from it."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

import pytest
from pydantic import ValidationError

from fragfield.case.faults import choice_faults, explain, outside_hard, outside_soft
from fragfield.case.tables.base import Table
from fragfield_base.bounds import Bounds, OnlyWith, check_inputs
from fragfield_base.errors import InputError
from fragfield_base.inputs import Length


@dataclass(frozen=True)
class Stage:
    """A stage's settings."""

    kind: Literal["plain", "rough"] = "plain"
    """Which."""
    width: Annotated[Length, Bounds(1e-3, 1.0, "a finger to a table", usual=(0.01, 0.5))] = 0.1
    """How wide."""
    grain: Annotated[float, Bounds(0.0, 1.0, "a fraction", above=True), OnlyWith("kind", ("rough",), refused=True)] = (
        0.5
    )
    """How rough, with two
    lines."""
    inner: bool = False
    """Of the program alone."""


class StageTable(Table, Stage):
    """The table."""

    NO_KEYS: ClassVar = ("inner",)
    ORDER: ClassVar = ("name", "kind")
    name: str
    """Its own key."""


def test_keys_are_the_fields_in_order_with_their_meanings_and_defaults():
    fields = StageTable.model_fields
    assert list(fields) == ["name", "kind", "width", "grain"]
    assert [field.description for field in fields.values()] == [
        "Its own key.", "Which.", "How wide.", "How rough, with two\nlines.",
    ]  # fmt: skip
    read = StageTable.model_validate({"name": "a", "width": "20 cm"})
    assert (read.width, read.grain) == (0.2, Stage.grain)
    assert read.made() == Stage(width=0.2)
    written = read.model_dump(mode="json", context={"units": "si"})
    assert written == {"name": "a", "kind": "plain", "width": "0.2 m", "grain": 0.5}


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ({"width": 0.2}, "width: found the bare number 0.2 without a unit; allowed: a length with its unit"),
        ({"kind": "ruogh"}, 'kind: found "ruogh" (did you mean "rough"?); allowed: "plain" or "rough"'),
        ({"widht": "1 m"}, 'widht: unknown key (did you mean "width"?); allowed here: grain, kind, name, width'),
        ({"inner": True}, "inner: unknown key"),
    ],
)
def test_what_is_no_value_is_refused_with_its_key(table, message):
    with pytest.raises(ValidationError) as caught:
        StageTable.model_validate({"name": "a", **table})
    (fault,) = explain(caught.value, StageTable)
    assert str(fault).startswith(message)


def test_bounds_refuse_warn_and_name_their_reason():
    read = StageTable.model_validate({"name": "a", "kind": "rough", "width": "2 m", "grain": 0.0})
    assert [str(fault) for fault in outside_hard(read)] == [
        "width: found 2 m; allowed: 0.001 to 1 m (a finger to a table)",
        "grain: found 0; allowed: above 0 to 1 (a fraction)",
    ]
    unusual = StageTable.model_validate({"name": "a", "width": "0.8 m"})
    assert list(outside_soft(unusual)) == ["width = 0.8 m: unusual; usual: 0.01 to 0.5 m (a finger to a table)"]


def test_a_key_that_another_excludes_is_refused_where_it_is_given():
    given = StageTable.model_validate({"name": "a", "grain": 0.2})
    (fault,) = choice_faults(given)
    assert str(fault) == 'grain: found with kind = "plain"; allowed: only with kind = "rough"'
    left_out = StageTable.model_validate({"name": "a"})
    assert list(choice_faults(left_out)) == []
    read = StageTable.model_validate({"name": "a", "kind": "rough", "grain": 0.2})
    assert list(choice_faults(read)) == []


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"width": 2.0}, r"stage.width: found 2; allowed: 0.001 to 1 m \(a finger"),
        ({"width": "wide"}, "stage.width: found 'wide'; a number is needed"),
        ({"width": True}, "stage.width: found True; a number is needed"),
        ({"kind": "ruogh"}, r"stage.kind: found 'ruogh'; did you mean 'rough'\? \(allowed: plain, rough\)"),
        ({"inner": 1}, r"stage.inner: found 1 \(allowed: True, False\)"),
        ({"grain": 0.0}, "stage.grain: found 0; allowed: above 0 to 1"),
    ],
)
def test_the_stage_refuses_the_same(values, message):
    with pytest.raises(InputError, match=message):
        check_inputs(Stage(**values), "stage", InputError)
    check_inputs(Stage(), "stage", InputError)
