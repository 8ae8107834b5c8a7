"""The table [official]: distances of the round as its authority publishes them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated

from pydantic import Field

from fragfield.case.tables.base import Table
from fragfield_base.inputs import Quantity

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["OfficialTable", "check_official"]

_FARTHEST = 20e3  # m


class OfficialTable(Table):
    """Published distances, shown beside the computed one; they change nothing that is computed."""

    hazardous_fragment_distance: Annotated[float | None, Quantity("m", "120 m", above=0.0, maximum=_FARTHEST)] = None
    """Distance to hazardous fragments, at one per 55.7 m2 (600 ft2) or as the authority defines it."""
    maximum_fragment_distance: Annotated[float | None, Quantity("m", "650 m", above=0.0, maximum=_FARTHEST)] = None
    """Distance that no fragment is expected to exceed."""
    rounds: int = Field(default=1, ge=1)
    """How many rounds, detonated together, the distances are published for."""
    source: str = Field(min_length=1)
    """Authority, document, edition and page, as the report is to cite them."""


def check_official(official: OfficialTable) -> Iterator[str]:
    """Faults of the table, as lines `key: found ...; allowed: ...`."""
    hazardous, farthest = official.hazardous_fragment_distance, official.maximum_fragment_distance
    if not official.source.strip():
        yield "official.source: found only blanks; allowed: authority, document, edition and page"
    if hazardous is None and farthest is None:
        yield (
            "official.hazardous_fragment_distance: missing, and maximum_fragment_distance too; needed: at least one of "
            'the two, for example hazardous_fragment_distance = "120 m"'
        )
    if hazardous is not None and farthest is not None and farthest < hazardous:
        yield (
            f"official.maximum_fragment_distance: found {farthest:g} m; allowed: at least "
            f"hazardous_fragment_distance, {hazardous:g} m"
        )
