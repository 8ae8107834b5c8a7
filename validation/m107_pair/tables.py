"""The pair in the README: forms side by side, the focus over cell sizes, the paper's reading."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from validation.m107_pair.check import index_of, paper_of
from validation.m107_pair.sectors import UNITS
from validation.rows import markdown_table

if TYPE_CHECKING:
    from collections.abc import Mapping

    from validation.m107_pair.sectors import Key
    from validation.paper_3_2.ratios import Estimate

__all__ = ["convergence_table", "reading_table", "symmetry_table"]

_SHOWN: tuple[Key, ...] = (
    ("number", "within 10 deg"), ("number", "beyond 60 deg"), ("mass", "within 10 deg"),
    ("mean speed", "within 10 deg"), ("99 % of speeds", "within 5 deg"),
)  # fmt: skip


def symmetry_table(
    profiles: Mapping[str, Mapping[str, Mapping[Key, Estimate]]], bursts: Mapping[str, Mapping[str, Mapping[str, Any]]]
) -> str:
    """Forms by cell size: what they cost, and some of what they give (numbers and masses a degree, speeds in m/s)."""
    head = ("cells of", "computed", "cells", "burst, wall", *(" ".join(key) for key in _SHOWN))
    body = []
    for size, forms in profiles.items():
        for form, found in forms.items():
            burst = bursts[size][form]
            cost = (f"{burst['cells']:,}", f"{burst['wall_seconds']:.0f} s")
            body.append((size, form, *cost, *(_shown(found[key], key[0]) for key in _SHOWN)))
    return markdown_table(head, body)


def convergence_table(found: Mapping[str, Mapping[Key, Estimate]], bursts: Mapping[str, Mapping[str, Any]]) -> str:
    """The focus by cell size, with observed order and limit of the three finest."""
    keys = list(next(iter(found.values()), {}))
    body = [
        (size, *(_shown(focus[key], "ratio" if key[0] in UNITS else key[0]) for key in keys),
         f"{bursts[size]['wall_seconds']:.0f} s")
        for size, focus in found.items()
    ]  # fmt: skip
    if len(found) >= 3:
        limits = [_limit({size: focus[key].value for size, focus in found.items()}) for key in keys]
        body.append(("limit", *limits, ""))
    return markdown_table(("cells of", *(" ".join(key) for key in keys), "burst, wall"), body)


def reading_table(found: Mapping[str, Mapping[str, Estimate]]) -> str:
    """Peaks and the lobe's integral by cell size, extrapolated, beside the paper's."""
    names = list(next(iter(found.values()), {}))
    body = [(size, *(_shown(values[name], "ratio") for name in names)) for size, values in found.items()]
    if len(found) >= 3:
        body.append(
            ("limit", *(_limit({size: values[name].value for size, values in found.items()}) for name in names))
        )
    body.append(("the paper", *("-" if paper_of(name) is None else f"{paper_of(name):g}" for name in names)))
    return markdown_table(("cells of", *names), body)


def _shown(value: Estimate, kind: str) -> str:
    digits = {"ratio": 2, "number": 2, "mass": 4}.get(kind, 0)
    return f"{value.value:.{digits}f} ± {value.error:.{digits}f}"


def _limit(values: Mapping[str, float]) -> str:
    index = index_of(values)
    uncertain = f"± {100.0 * index.index:.0f} %"
    if index.limit is None:
        return f"{index.kind}, {uncertain}"
    return f"{index.limit:.4g} (order {index.order:.1f}, {uncertain})"
