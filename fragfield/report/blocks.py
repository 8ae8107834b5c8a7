"""The blocks of a report; the template draws each in one way."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from fragfield.numbers import Row


_LONGEST_NUMBER = 18  # characters of a cell: "1,017.4 ± 4.0", "12,345 – 23,456"

Weight = Literal["stop", "warning", "note", "good"]
"""How grave a finding is."""


@dataclass(frozen=True)
class Paragraph:
    """Running text."""

    text: str
    kind: str = "paragraph"


@dataclass(frozen=True)
class Points:
    """A list of statements."""

    items: tuple[str, ...]
    kind: str = "points"


@dataclass(frozen=True)
class Card:
    """A key number."""

    label: str
    value: str
    unit: str
    note: str = ""


@dataclass(frozen=True)
class Cards:
    """The key numbers side by side."""

    items: tuple[Card, ...]
    kind: str = "cards"


@dataclass(frozen=True)
class Finding:
    """One statement on the run: "stop" (do not use), "warning", "note", or "good" (a check that passed)."""

    weight: Weight
    text: str

    @property
    def label(self) -> str:
        """The weight in a word, so that it does not depend on colour."""
        return {"stop": "Do not use", "warning": "Warning", "note": "Note", "good": "Passed"}[self.weight]


@dataclass(frozen=True)
class Findings:
    """Warnings, notes and passed checks."""

    items: tuple[Finding, ...]
    kind: str = "findings"


@dataclass(frozen=True)
class Rows:
    """A table of quantities: name, practical value, SI."""

    title: str
    rows: tuple[Row, ...]
    kind: str = "rows"

    @property
    def has_si(self) -> bool:
        """Whether the column of SI values is needed."""
        return any(row.si for row in self.rows)


@dataclass(frozen=True)
class Table:
    """A table of several columns; the first one and those with long cells are words, the others numbers."""

    title: str
    head: tuple[str, ...]
    lines: tuple[tuple[str, ...], ...]
    note: str = ""
    columns: int = 1
    """Number of newspaper columns for long tables."""
    kind: str = "table"

    @cached_property
    def worded(self) -> tuple[bool, ...]:
        """By column, whether it holds words, which are broken and begin at the left."""
        return tuple(any(len(line[place]) > _LONGEST_NUMBER for line in self.lines) for place in range(len(self.head)))


@dataclass(frozen=True)
class Text:
    """Text of a file, as it stands."""

    title: str
    text: str
    kind: str = "text"


@dataclass(frozen=True)
class Illustration:
    """A figure with its data URI."""

    name: str
    title: str
    caption: str
    image: str = ""
    missing: str = ""
    """Why the picture could not be drawn, instead of it."""
    kind: str = "illustration"


@dataclass(frozen=True)
class Beside:
    """A file beside the report, and what it is."""

    file: str
    text: str
    kind: str = "beside"


@dataclass(frozen=True)
class Signatures:
    """Lines to sign."""

    roles: tuple[str, ...]
    names: tuple[str, ...] = ("", "", "")
    """Who signs in each role, where that is known."""
    kind: str = "signatures"


@dataclass(frozen=True)
class Columns:
    """Blocks side by side, two in a row; one below the other on a telephone."""

    items: tuple[Block, ...]
    kind: str = "beside_each_other"


@dataclass(frozen=True)
class Group:
    """Blocks one below the other, as one item of columns."""

    items: tuple[Block, ...]
    kind: str = "group"


Block = (
    Columns | Group | Paragraph | Points | Cards | Findings | Rows | Table | Text | Illustration | Beside | Signatures
)


@dataclass
class Section:
    """A part of the report: numbered, or an annex with a letter."""

    key: str
    title: str
    blocks: list[Block] = field(default_factory=list)
    annex: bool = False
    count: str = ""
    """Its number or letter, once the order is known."""
