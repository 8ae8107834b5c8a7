"""Time and memory a round, from one round to a pallet of eight.

The program itself takes a few hundred megabytes before the first round, which stacks share; what a further round
takes is therefore shown beside the total over the rounds.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from validation.paper_3_2.check import NAME, REFERENCE
from validation.rows import Row, markdown_table, within
from validation.runs import STOPPED, StudyError, summary_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from validation.runs import Runs

__all__ = ["SIZE", "STACKS", "compute", "rows", "table"]

SIZE = "8 mm"
WARM_UP_SIZE = "14 mm"
STACKS = ("single", "pair", "row", "pallet")

FULL = {"burst.symmetry": "off"}
"""Every round is computed: what is measured is how cost grows with their number."""


def compute(runs: Runs, size: str = SIZE) -> dict[str, dict[str, Any]]:
    """Run single round, pair, row of four and pallet of eight to the report; summary.json of each.

    A coarse pair goes before, so that no measured run compiles kernels.
    """
    try:
        runs.run(f"{NAME}_scaling_warm_up", REFERENCE["pair"], WARM_UP_SIZE, FULL, stage="burst")
    except StudyError as error:
        if error.code != STOPPED:  # so coarse, its ledger may open
            raise
    return {name: summary_of(runs.run(f"{NAME}_scaling_{name}", REFERENCE[name], size, FULL)) for name in STACKS}


def _per_round(summary: Mapping[str, Any]) -> dict[str, float]:
    burst = summary["burst"]
    rounds = len(burst["rounds"])
    cores = burst["threads"] * burst["ranks"]
    return {
        "rounds": rounds,
        "cells": burst["cells"] / rounds,
        "steps": burst["cell_steps"] / burst["cells"],
        "time": burst["wall_seconds"] / rounds,
        "step": 1e6 * burst["wall_seconds"] * cores / burst["cell_steps"],
        "memory": burst["peak_memory_bytes"] / rounds,
    }


def _further_memory(summaries: Mapping[str, Mapping[str, Any]], name: str) -> float | None:
    """Peak memory that each round takes beyond those of the next smaller stack (bytes)."""
    place = STACKS.index(name)
    if place == 0:
        return None
    larger, smaller = (summaries[stack]["burst"] for stack in (name, STACKS[place - 1]))
    return (larger["peak_memory_bytes"] - smaller["peak_memory_bytes"]) / (
        len(larger["rounds"]) - len(smaller["rounds"])
    )


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
    further = {name: _further_memory(summaries, name) for name in STACKS[1:]}
    for name in STACKS[2:]:
        quantity = f"{name}: memory of a further round over that of the pair's second"
        ratio = (further[name] or 0.0) / (further["pair"] or 1.0)
        found.append(within(NAME, quantity, ratio, 0.0, most, "own bound: flat within 15 %"))
    return found


def table(summaries: Mapping[str, Mapping[str, Any]]) -> str:
    """What a round costs, alone and in stacks, for the README."""
    base = _per_round(summaries["single"])
    body = []
    for name, summary in summaries.items():
        ours, further = _per_round(summary), _further_memory(summaries, name)
        body.append(
            (
                name,
                f"{ours['rounds']:g}",
                f"{ours['cells']:.0f}",
                f"{ours['steps']:.0f}",
                f"{ours['time']:.1f} s ({ours['time'] / base['time']:.2f})",
                f"{ours['step']:.2f} us ({ours['step'] / base['step']:.2f})",
                f"{ours['memory'] / 1e6:.0f} MB ({ours['memory'] / base['memory']:.2f})",
                "-" if further is None else f"{further / 1e6:.1f} MB",
            )
        )
    head = (
        "stack", "rounds", "cells a round", "steps of a cell", "wall time a round", "core time a cell and step",
        "peak memory a round", "memory a further round",
    )  # fmt: skip
    return markdown_table(head, body)
