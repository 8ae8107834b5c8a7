"""The element forces alone, on one core: all cells, and each kind of cell in each state."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

from benchmarks.parts import count, forces_of_part
from benchmarks.state import begun, forces_alone, in_the_middle, in_the_middle_full, shares
from benchmarks.timing import best_of, on_threads

if TYPE_CHECKING:
    from benchmarks.options import Options

__all__ = ["kernel", "kernel_at"]

_CALLS, _REPEATS = 5, 6


def kernel(options: Options) -> dict[str, Any]:
    """Seconds per cell and step of the element forces, of the cells of each kind alone and of all together."""
    return kernel_at(options.cell_size)


@cache
def kernel_at(cell_size: float) -> dict[str, Any]:
    """The same with cells of a size (m), measured once."""
    early, middle, full = (make(cell_size) for make in (begun, in_the_middle, in_the_middle_full))
    cells, solid, charge = len(middle.mesh.cells), count(middle, charge=False), count(middle, charge=True)
    with on_threads(1), forces_alone(middle) as forces, forces_alone(early), forces_alone(full):
        times = best_of(
            _REPEATS,
            {
                "all": (_CALLS, forces),
                "flowing": (_CALLS, forces_of_part(middle, charge=False)),
                "elastic": (_CALLS, forces_of_part(early, charge=False)),
                "full": (2, forces_of_part(full, charge=False)),
                "burnt": (_CALLS, forces_of_part(middle, charge=True)),
                "unreacted": (_CALLS, forces_of_part(early, charge=True)),
            },
        )
    return {
        "cells": cells,
        "share": shares(middle),
        "seconds_per_cell_step": times["all"] / cells,
        "solid": {
            "seconds_per_cell_step": times["flowing"] / solid,
            "seconds_per_cell_step_elastic": times["elastic"] / solid,
            "seconds_per_cell_step_full_quadrature": times["full"] / solid,
        },
        "charge": {
            "seconds_per_cell_step": times["burnt"] / charge,
            "seconds_per_cell_step_unreacted": times["unreacted"] / charge,
        },
    }
