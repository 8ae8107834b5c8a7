"""Case files by property-based generation: every one is accepted or refused with one message that names the key."""

from __future__ import annotations

import copy
import re
import tomllib
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from hypothesis import strategies as st
from pydantic import BaseModel

from fragfield.case.keys import marks_of, tables_in
from fragfield.case.schema import CaseTable
from fragfield.case.write import toml_value
from fragfield_base.inputs import Quantity, Vector
from tests.fragfield.short_run import SHORT

if TYPE_CHECKING:
    from collections.abc import Iterator

    from pydantic.fields import FieldInfo

__all__ = ["BASE", "documents", "fault_of", "to_text"]

BASE: dict[str, Any] = tomllib.loads(SHORT)
_UNITS = ("m", "mm", "km", "inch", "s", "us", "kg", "g", "grain", "m/s", "km/s", "kg/m^3", "g/cm^3", "Pa", "GPa", "J",
          "J/m^2", "MJ/kg", "1/m^2", "deg", "rad", "K", "1/s", "m^2", "m^99", "furlong", "", "%", "degC")  # fmt: skip
_NUMBERS = st.one_of(
    st.integers(-3, 10),
    st.integers(),
    st.floats(allow_nan=True, allow_infinity=True),
    st.sampled_from([0.0, -0.0, 1e-300, 1e300, 1e-30, 1e12, -1.0, 0.5, 2.0, 1e-3, 10**30, 2**63]),
)
_QUANTITIES = st.one_of(
    st.builds(lambda number, unit: f"{number} {unit}".strip(), _NUMBERS, st.sampled_from(_UNITS)),
    st.builds(
        lambda a, b, unit: f"{a}e{b} {unit}", st.integers(-99, 99), st.integers(-12, 12), st.sampled_from(_UNITS)
    ),
    st.sampled_from(
        [
            "9**9**9**9 m",
            "1 / (0 m)",
            "(((1 m)))",
            "1 m + 1 m",
            "mm",
            "- m",
            "1e400 m",
            "0x10 m",
            "1_0 m",
            "1 m^-1^-1",
            "1 m**9",
            "5 m·s",
            "1 / 3 m",
            "nan m",
            "inf m",
            "1.5.5 m",
        ]
    ),
)
_TEXTS = st.one_of(
    st.text(st.characters(codec="utf-8"), max_size=30),
    st.sampled_from(
        [
            "",
            "../../etc/passwd",
            "/dev/zero",
            "x" * 5000,
            "=1+1",
            "a,b\n",
            "m107",
            "tnt",
            "none",
            "nose",
            "tube.toml",
            "a.csv",
            "a.msh",
            "a.tif",
            "\u202e",
            "\x00",
        ]
    ),
)
_VALUES = st.recursive(
    st.one_of(_NUMBERS, _QUANTITIES, _TEXTS, st.booleans()),
    lambda inner: st.one_of(
        st.lists(inner, max_size=4),
        st.dictionaries(st.text(st.characters(codec="utf-8"), min_size=1, max_size=8), inner, max_size=3),
    ),
    max_leaves=6,
)


def _paths(
    model: type[BaseModel], above: tuple[str | int, ...] = ()
) -> Iterator[tuple[tuple[str | int, ...], FieldInfo]]:
    """Key paths of the schema with their fields; lists by their first entry."""
    for name, field in model.model_fields.items():
        yield (*above, name), field
        listed = str(field.annotation).startswith(("list", "typing.Annotated[list")) or name in (
            "round", "plane", "obstacle", "witness", "ignition",
        )  # fmt: skip
        for _, table in tables_in(field.annotation):
            yield from _paths(table, (*above, name, 0) if listed else (*above, name))


_FIELDS = dict(_paths(CaseTable))
_ALL = sorted(_FIELDS, key=str)
_SIZES = st.one_of(
    st.floats(-12, 12).map(lambda power: 10.0**power),
    st.floats(0.1, 10.0),
    st.sampled_from([0.0, 1.0, -1.0, 1e-300, 1e300, 1e5, 1e-6]),
)


def _fitting(field: FieldInfo) -> st.SearchStrategy[Any]:
    """Values of the type that a key has, of any size: what gets past the schema."""
    options: list[st.SearchStrategy[Any]] = []
    for mark in marks_of(field):
        if isinstance(mark, Quantity):
            options.append(st.builds(lambda number, unit=mark.symbol: f"{number!r} {unit}", _SIZES))
        if isinstance(mark, Vector):
            unit = "" if mark.component is None else f" {mark.component.symbol}"
            one = _SIZES if not unit else st.builds(lambda number, unit=unit: f"{number!r}{unit}", _SIZES)
            options.append(st.lists(one, min_size=mark.size, max_size=mark.size))
    words = re.findall(r"'([^']*)'", str(field.annotation)) if "Literal" in str(field.annotation) else []
    options += [st.sampled_from(words)] if words else []
    text = str(field.annotation)
    options += [_SIZES] if "float" in text and not options else []
    options += [st.integers(0, 12)] if "int" in text else []
    options += [st.booleans()] if "bool" in text else []
    listed = [st.lists(one, max_size=4) for one in options] if text.startswith("list") else []
    return st.one_of(*(listed or options)) if options else _VALUES


@st.composite
def documents(draw: st.DrawFn) -> dict[str, Any]:
    """The short case with one to four of its keys set to anything, removed, or added."""
    document = copy.deepcopy(BASE)
    for _ in range(draw(st.integers(1, 4))):
        path = draw(st.sampled_from(_ALL))
        if draw(st.integers(0, 19)) == 0:
            path = (*path[:-1], draw(st.text(st.characters(codec="utf-8"), min_size=1, max_size=8)))
            _put(document, path, draw(_VALUES), remove=False)
            continue
        value = draw(_VALUES if draw(st.integers(0, 5)) == 0 else _fitting(_FIELDS[path]))
        _put(document, path, value, remove=draw(st.integers(0, 15)) == 0)
    return document


def _put(node: Any, path: tuple[str | int, ...], value: object, *, remove: bool) -> None:
    for step, after in pairwise(path):
        if isinstance(step, int):
            if not isinstance(node, list):
                return
            if not node:
                node.append({})
            node = node[0]
        else:
            if not isinstance(node, dict):
                return
            if not isinstance(node.get(step), (dict, list)):
                node[step] = [] if isinstance(after, int) else {}
            node = node[step]
    if isinstance(node, dict):
        if remove:
            node.pop(path[-1], None)
        else:
            node[path[-1]] = value


def to_text(document: dict[str, Any]) -> str:
    """A document as TOML, all tables in one line each."""
    return "".join(
        f"{key if re.fullmatch('[A-Za-z0-9_-]+', key) else toml_value(key)} = {toml_value(value)}\n"
        for key, value in document.items()
    )


_ODD = re.compile("unknown key|control character")  # what keys that the schema does not know are refused by
_FOUND = re.compile("found|missing|unknown key")
_ALLOWED = re.compile("allowed|need|missing|must|at most|at least|expected|cannot|did you mean|use|instead")


def fault_of(code: int, out: str, words: str, file: str) -> str | None:
    """What is wrong with how the program took a case; None if nothing is."""
    if code == 0:
        return None
    if code != 2:
        return f"exit {code}: {words[-300:]}"
    if "Traceback" in words or "Traceback" in out:
        return f"traceback: {words[-300:]}"
    said = [line for line in words.splitlines() if line.startswith("fragfield: ")]
    if len(said) != 1:
        return f"{len(said)} messages: {words[-300:]}"
    whole = words[words.index("fragfield: ") :].removeprefix("fragfield: ")
    if not whole.startswith(f"{file}: "):
        return f"no file: {said[0][:300]}"
    rest = whole.removeprefix(f"{file}: ")
    if rest.startswith("not valid TOML"):
        return None if "at line" in rest or "nested" in rest or "limit" in rest else f"no line: {rest[:300]}"
    faults = [line[2:] for line in rest.splitlines()[1:]] if re.match(r"\d+ faults\n", rest) else [rest]
    for fault in faults:
        if re.fullmatch(r"and \d+ more", fault):
            continue
        if re.split(r"[.\[:]", fault)[0] not in CaseTable.model_fields and not _ODD.search(fault):
            return f"the key is not said: {fault[:400]}"
        if not _FOUND.search(fault):
            return f"what was found is not said: {fault[:400]}"
        if not _ALLOWED.search(fault):
            return f"what is allowed is not said: {fault[:400]}"
    return None
