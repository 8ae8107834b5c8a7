"""The recommended distance: the expected distance, and what is not known of it, added up.

    recommended = expected + sqrt(quadrature^2 + randomness^2 + grid^2 + table^2 + inputs^2)

Every part beside the expected distance is the half-width of its one-sided band of 95 %. Where the expected density is
an integral, or that of weighted fragments, there is no randomness, and the quadrature is the bound of its points, some
tenths of a metre; elsewhere the randomness is the upper bound over the realisations less the expected distance. Of the
grid it is the whole grid convergence index, a band about a limit that lies to one side; of an arena table what other
laws within its groups and zones twice as wide change; of the inputs their 95 % quantile less the expected distance.
Independent contributions at one level are added as squares, as ASME V&V 20 (2009) adds the standard uncertainties of
inputs and numerics. A part that is not known is not in the sum; `not_included` says why.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

if TYPE_CHECKING:
    from collections.abc import Mapping


PARTS = {
    "expected": "expected distance",
    "quadrature": "points of the expected density",
    "randomness": "randomness of the break-up",
    "grid": "grid",
    "table": "groups and zones of the arena table",
    "inputs": "inputs",
}
"""The parts of the recommended distance, in words."""
RULE = (
    "Expected distance plus the root of the sum of squares of the other parts, each the half-width of its one-sided "
    "band of 95 %."
)
_WIDTHS = tuple(PARTS)[1:]
_NO_GRID = "no grid convergence: "


class Part(NamedTuple):
    """A part of the recommended distance: in words, its m (None where it is not known) and why it is not included."""

    words: str
    value: float | None
    reason: str


def recommended_of(
    hazard: Mapping[str, Any], convergence: Mapping[str, Any] | None, study: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """The part `hazard` of summary.json with the recommended distance.

    Parameters
    ----------
    hazard, convergence : mapping
        Parts of summary.json.
    study : mapping, optional
        uncertainty.json of a study of this run.

    Returns
    -------
    dict
        `hazard` with `recommended` (m; None where the distance is not determined), `parts` (m, by the names
        of `PARTS`; `expected` is the expected distance, the others half-widths, None where not known), `not_included`
        (why, by the name of the part), and `recommended` in `without_ricochet`, with the same half-widths but those of
        quadrature and randomness.
    """
    found = dict(hazard)
    short = dict(found.get("without_ricochet") or {})
    if not hazard.get("determined") or hazard.get("expected") is None:
        empty: dict[str, Any] = {"recommended": None, "parts": dict.fromkeys(PARTS), "not_included": {}}
        return found | empty | ({"without_ricochet": short | {"recommended": None}} if short else {})
    expected = float(hazard["expected"])
    spread = ((study or {}).get("distance") or {}).get("spread")
    grid, no_grid = _grid(convergence or {})
    parts: dict[str, float | None] = {
        "expected": expected,
        **_statistical(hazard, hazard),
        "grid": grid,
        "table": hazard.get("table_width"),
        "inputs": None if spread is None else max(float(spread["high"]) - expected, 0.0),
    }
    reasons = {
        "grid": no_grid,
        "inputs": "no study of uncertain inputs" if study is None else "the study of uncertain inputs has no result",
    }
    if hazard.get("method", "realisations") == "realisations":
        reasons["randomness"] = "a single realisation has no bound"
    missing = {name: words for name, words in reasons.items() if parts[name] is None}
    found |= {"recommended": _sum(expected, parts), "parts": parts, "not_included": missing}
    if short:
        beside = parts | _statistical(hazard, short)
        found["without_ricochet"] = short | {"recommended": _sum(float(short["expected"]), beside)}
    return found


def parts_of(hazard: Mapping[str, Any]) -> list[Part]:
    """The parts in their order, with those not included; empty where the distance is not determined."""
    if hazard.get("recommended") is None:
        return []
    missing = hazard["not_included"]
    return [
        Part(PARTS[name], value, missing.get(name, ""))
        for name, value in hazard["parts"].items()
        if value is not None or name in missing
    ]


def parts_words(hazard: Mapping[str, Any]) -> str:
    """The parts in one line, and what is not included; empty where the distance is not determined."""
    rows = parts_of(hazard)
    if not rows:
        return ""
    names = list(PARTS.values())[1:]
    base = f"{rows[0].words} {rows[0].value:.1f} m"
    widths = [f"{row.words} {row.value:.1f} m" for row in rows if row.words in names and row.value is not None]
    together = math.ceil(10.0 * float(hazard["recommended"]) - 1e-9) / 10.0
    added = f"; added as squares: {', '.join(widths)}; together {together:.1f} m" if widths else ""
    missing = not_included_words(hazard)
    return f"{base}{added}{f'; not included: {missing}' if missing else ''}"


def not_included_words(hazard: Mapping[str, Any]) -> str:
    """What the recommended distance does not include and why, or nothing."""
    return ", ".join(f"{row.words} ({row.reason})" for row in parts_of(hazard) if row.reason)


def _statistical(hazard: Mapping[str, Any], of: Mapping[str, Any]) -> dict[str, float | None]:
    """Half-width (m) of a distance `of` the hazard by the points of its density, or by its realisations."""
    upper = of.get("upper")
    width = None if upper is None else max(float(upper) - float(of["expected"]), 0.0)
    integrated = hazard.get("method", "realisations") != "realisations"
    return {"quadrature": width if integrated else None, "randomness": None if integrated else width}


def _grid(convergence: Mapping[str, Any]) -> tuple[float | None, str]:
    """Half-width (m) by the cell size, or why it is not known."""
    entry = (convergence.get("quantities") or {}).get("expected_distance") or {}
    width = entry.get("uncertainty")
    if width is not None:
        return float(width), ""
    reason = str(convergence.get("reason") or "no other cell size gave a distance")
    return None, reason.removeprefix(_NO_GRID)


def _sum(expected: float, parts: Mapping[str, float | None]) -> float:
    return expected + math.sqrt(sum(width**2 for name in _WIDTHS if (width := parts[name]) is not None))
