"""Base of all tables of a case file: strict types, no unknown keys, immutable."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict, Discriminator

__all__ = ["Table", "by_kind", "name_or_table"]


class Table(BaseModel):
    """A table of the case file. The docstring under a field is its entry in the reference."""

    model_config = ConfigDict(
        extra="forbid", strict=True, frozen=True, use_attribute_docstrings=True, validate_default=False
    )


def name_or_table(value: object) -> str:
    """Tag of a value that is either a name or a table; tags stand in angle brackets and never in a key path."""
    return "<table>" if isinstance(value, (dict, Table)) else "<name>"


def by_kind(usual: str) -> Discriminator:
    """How tables of several kinds in one list are distinguished: by `kind`, which the usual one may leave out."""

    def tag_of(value: object) -> str:
        kind = value.get("kind", usual) if isinstance(value, dict) else getattr(value, "kind", usual)
        return f"<{kind}>"

    return Discriminator(tag_of)
