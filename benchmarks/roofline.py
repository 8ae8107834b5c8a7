"""The minimum time that the element forces could take here, by memory and by arithmetic, beside what they take."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from benchmarks.goal import at_least
from benchmarks.kernel import kernel_at
from benchmarks.operations import operations_per_cell
from benchmarks.rates import arithmetic, band_width
from benchmarks.state import in_the_middle
from benchmarks.timing import all_threads
from benchmarks.traffic import bytes_per_cell

if TYPE_CHECKING:
    from collections.abc import Mapping

    from benchmarks.options import Options
    from benchmarks.traffic import Kind

__all__ = ["roofline"]

_TARGET = 0.5
_KINDS: tuple[Kind, ...] = ("solid", "charge")


def roofline(options: Options) -> dict[str, Any]:
    """Band width and arithmetic of the machine, bytes and operations of a cell, and how near the kernel comes."""
    run, measured = in_the_middle(options.cell_size), kernel_at(options.cell_size)
    threads = all_threads()
    rates = {
        "bytes_per_second": band_width(1),
        f"bytes_per_second_on_{threads}_threads": band_width(threads),
        "operations_per_second": arithmetic(fused=False),
        "operations_per_second_fused": arithmetic(fused=True),
    }
    moved = {kind: bytes_per_cell(run.fields, kind) for kind in _KINDS}
    done = {kind: operations_per_cell(run, charge=kind == "charge") for kind in _KINDS}
    bounds = {kind: _bound(moved[kind], done[kind], rates, measured[kind]["seconds_per_cell_step"]) for kind in _KINDS}
    tables = {"arrays": _side_by_side("bytes", moved), "arithmetic": _side_by_side("", done)}
    return {"machine": rates} | bounds | tables


def _bound(
    moved: Mapping[str, float], done: Mapping[str, float], rates: Mapping[str, float], seconds: float
) -> dict[str, Any]:
    """Counts of one kind of cell, the bounds that they set on one core, and the share of the higher that is reached."""
    size, operations = sum(moved.values()), sum(done.values())
    by_memory, by_arithmetic = size / rates["bytes_per_second"], operations / rates["operations_per_second_fused"]
    return {
        "bytes": size,
        "operations": operations,
        "operations_per_byte": operations / size,
        "seconds_by_memory": by_memory,
        "seconds_by_arithmetic": by_arithmetic,
        "seconds_per_cell_step": seconds,
        **at_least(max(by_memory, by_arithmetic) / seconds, _TARGET, "higher bound over the time taken"),
    }


def _side_by_side(what: str, counts: Mapping[Kind, Mapping[str, float]]) -> list[dict[str, Any]]:
    """Rows of what both kinds of cell have; zero where one has none."""
    names = dict.fromkeys(name for of_kind in counts.values() for name in of_kind)
    prefix = f"{what}_of_" if what else "of_"
    return [
        {"name": name, **{f"{prefix}{kind}": of_kind.get(name, 0.0) for kind, of_kind in counts.items()}}
        for name in names
    ]
