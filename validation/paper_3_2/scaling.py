"""Time and memory a round, from one round to a pallet of eight."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from validation.paper_3_2.check import NAME, REFERENCE
from validation.rows import Row, markdown_table, within
from validation.runs import summary_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from validation.runs import Runs

__all__ = ["SIZE", "STACKS", "compute", "rows", "table"]

SIZE = "8 mm"
STACKS = ("single", "pair", "row", "pallet")


def compute(runs: Runs, size: str = SIZE) -> dict[str, dict[str, Any]]:
    """Run single round, pair, row of four and pallet of eight to the report; summary.json of each."""
    return {name: summary_of(runs.run(f"{NAME}_scaling_{name}", REFERENCE[name], size)) for name in STACKS}


def _per_round(summary: Mapping[str, Any]) -> dict[str, float]:
    burst = summary["burst"]
    rounds = len(burst["rounds"])
    cores = burst["threads"] * burst["ranks"]
    return {
        "rounds": rounds,
        "cells": burst["cells"] / rounds,
        "steps": burst["steps"],
        "time": burst["wall_seconds"] / rounds,
        "step": 1e6 * burst["wall_seconds"] * cores / burst["steps"] / burst["cells"],
        "memory": burst["peak_memory_bytes"] / rounds,
    }


def rows(summaries: Mapping[str, Mapping[str, Any]]) -> list[Row]:
    """Time a round, cell and step, and memory a round, over the single round's: they must not grow."""
    most = 1.0 + REFERENCE["allowed"]["growth_per_round"]
    base = _per_round(summaries["single"])
    found = []
    for name in STACKS[1:]:
        ours = _per_round(summaries[name])
        for key, words in (
            ("time", "wall time a round"),
            ("step", "core time a cell and step"),
            ("memory", "peak memory a round"),
        ):
            quantity = f"{name} of {ours['rounds']:g}: {words} over the single round's"
            found.append(within(NAME, quantity, ours[key] / base[key], 0.0, most, "own bound: flat within 15 %"))
    return found


def table(summaries: Mapping[str, Mapping[str, Any]]) -> str:
    """What a round costs, alone and in stacks, for the README."""
    base = _per_round(summaries["single"])
    body = []
    for name, summary in summaries.items():
        ours = _per_round(summary)
        body.append(
            (
                name,
                f"{ours['rounds']:g}",
                f"{ours['cells']:.0f}",
                f"{ours['steps']:g}",
                f"{ours['time']:.1f} s ({ours['time'] / base['time']:.2f})",
                f"{ours['step']:.2f} us ({ours['step'] / base['step']:.2f})",
                f"{ours['memory'] / 1e6:.0f} MB ({ours['memory'] / base['memory']:.2f})",
            )
        )
    head = (
        "stack", "rounds", "cells a round", "steps", "wall time a round", "core time a cell and step",
        "peak memory a round",
    )  # fmt: skip
    return markdown_table(head, body)
