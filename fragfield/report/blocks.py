"""The blocks of a report; the template draws each in one way."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from fragfield.report.quantities import Row

__all__ = ["Beside", "Block", "Card", "Cards", "Finding", "Findings", "Illustration", "Paragraph", "Points", "Rows", "Section", "Signatures", "Table", "Text", "Weight"]  # fmt: skip  # noqa: E501

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
    """A table of several columns; all but the first are numbers."""

    title: str
    head: tuple[str, ...]
    lines: tuple[tuple[str, ...], ...]
    note: str = ""
    columns: int = 1
    """Number of newspaper columns for long tables."""
    kind: str = "table"


@dataclass(frozen=True)
class Text:
    """Text of a file, as it stands."""

    title: str
    text: str
    kind: str = "text"


@dataclass(frozen=True)
class Illustration:
    """A figure with the data URI of its wide and, where it differs, its narrow form."""

    name: str
    title: str
    caption: str
    wide: str = ""
    narrow: str = ""
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


Block = Paragraph | Points | Cards | Findings | Rows | Table | Text | Illustration | Beside | Signatures


@dataclass
class Section:
    """A numbered part of the report."""

    key: str
    title: str
    blocks: list[Block] = field(default_factory=list)
