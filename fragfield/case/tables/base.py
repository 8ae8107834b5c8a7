"""Base of all tables of a case file: strict types, no unknown keys, immutable.

A table whose keys are those of a stage's dataclass inherits from it: defaults, units, bounds and meanings of the keys
stand there, once.
"""

from __future__ import annotations

import ast
import inspect
import math
import sys
from dataclasses import is_dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any, ClassVar

from pydantic import BaseModel, ConfigDict, Discriminator

from fragfield.case.keys import mark_of, unit_of
from fragfield_base.inputs import Parsed


class Table(BaseModel):
    """A table of the case file. The docstring under a field is its entry in the reference."""

    model_config = ConfigDict(
        extra="forbid",
        strict=True,
        frozen=True,
        validate_default=False,
        defer_build=True,
    )
    ORDER: ClassVar[tuple[str, ...]] = ()
    """The first keys in the order of the file, where it is not that of the stage's dataclass."""
    NO_KEYS: ClassVar[tuple[str, ...]] = ()
    """Fields of the stage's dataclass that are no keys."""
    stage: ClassVar[Any] = None
    """The stage's dataclass that the table is."""

    @classmethod
    def __pydantic_init_subclass__(cls, **_: Any) -> None:
        """Take the meanings of the keys from the texts below them, of inherited ones below those of the stage."""
        # pydantic's own use_attribute_docstrings reads the source once for every class: half a second of every start
        stages = [base for base in cls.__mro__ if is_dataclass(base) and not issubclass(base, BaseModel)]
        fields = cls.__pydantic_fields__
        for home in (cls, *stages):
            for name, meaning in _meanings(home).items():
                if name in fields and fields[name].description is None:
                    fields[name].description = meaning
        if not stages:
            return
        cls.stage = stages[0]
        ordered = dict.fromkeys([*cls.ORDER, *fields])
        cls.__pydantic_fields__ = {name: fields[name] for name in ordered if name not in cls.NO_KEYS}

    def made(self, **more: Any) -> Any:  # noqa: ANN401 - each table has a stage of its own
        """The stage's own object with the values of the keys, and `more`.

        What is left out is as the stage has it, "none" is None there, and an angle that the stage takes in degrees is
        in degrees; tables within are made as well.
        """
        fields = type(self).__pydantic_fields__
        values = {}
        for name in self.stage.__dataclass_fields__:
            key = name if name in fields else name.removesuffix("_deg")
            if name in more or key not in fields or (value := _made(getattr(self, key))) is None:
                continue
            restated = key != name or key in type(self).__annotations__
            if restated and isinstance(value, float) and unit_of(fields[key]) == "rad":
                value = degrees_of(value)
            values[name] = None if value == "none" and mark_of(fields[key], Parsed) is not None else value
        return self.stage(**values, **more)


def degrees_of(angle: float) -> float:
    """An angle in degrees, free of what the way over radians adds in the last digits."""
    return round(math.degrees(angle), 10)


def _made(value: object) -> object:
    if isinstance(value, Table):
        return value.made()
    return tuple(_made(entry) for entry in value) if isinstance(value, (list, tuple)) else value


def _meanings(home: type) -> dict[str, str]:
    body = _classes(home.__module__).get(home.__name__, [])
    return {
        field.target.id: inspect.cleandoc(text.value.value)
        for field, text in pairwise(body)
        if isinstance(field, ast.AnnAssign)
        and isinstance(field.target, ast.Name)
        and isinstance(text, ast.Expr)
        and isinstance(text.value, ast.Constant)
        and isinstance(text.value.value, str)
    }


@cache
def _classes(module: str) -> dict[str, list[ast.stmt]]:
    """The bodies of a module's classes by name."""
    file = getattr(sys.modules[module], "__file__", None)
    body = ast.parse(Path(file).read_text(encoding="utf-8")).body if file else []
    return {one.name: one.body for one in body if isinstance(one, ast.ClassDef)}


def name_or_table(value: object) -> str:
    """Tag of a value that is either a name or a table; tags stand in angle brackets and never in a key path."""
    return "<table>" if isinstance(value, (dict, Table)) else "<name>"


def by_kind(usual: str) -> Discriminator:
    """How tables of several kinds in one list are distinguished: by `kind`, which the usual one may leave out."""

    def tag_of(value: object) -> str:
        kind = value.get("kind", usual) if isinstance(value, dict) else getattr(value, "kind", usual)
        return f"<{kind}>"

    return Discriminator(tag_of)
