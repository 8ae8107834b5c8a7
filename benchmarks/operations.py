"""Arithmetic operations of the element forces for a cell in a step, counted while they are done.

The kernels' source runs uncompiled, in a process of its own, on numbers that count what is done with them: a few blocks
of a run in the state in which it is timed. A fused product and sum are two operations. What a compiler computes on both
sides of a branch, or saves, is not seen.
"""

from __future__ import annotations

import json
import os
import pickle
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar

import numpy as np
from numpy.lib.mixins import NDArrayOperatorsMixin

from burst_fenicsx.kernels.lanes import LANES
from burst_fenicsx.kernels.state import ChargeState, Grid, Motion, Nodes, Schedule, SolidState, Totals

if TYPE_CHECKING:
    from burst_fenicsx.simulation import Simulation

__all__ = ["Counted", "operations_per_cell"]

_ROOT = Path(__file__).resolve().parent.parent

Group = TypeVar("Group", Nodes, Grid, SolidState, ChargeState)


def operations_per_cell(run: Simulation, *, charge: bool, blocks: int = 24) -> dict[str, float]:
    """Operations a cell by kind: add, multiply, divide, root, power (exponentials); of the charge or of the rest.

    Parameters
    ----------
    run : at the state that counts; it is not changed.
    charge : which cells.
    blocks : how many of them are looked at, spread evenly over the round.
    """
    chosen = _some_blocks(run, blocks, charge=charge)
    with tempfile.TemporaryDirectory(prefix="fragfield-bench-") as folder:
        path = Path(folder) / "blocks.pickle"
        path.write_bytes(pickle.dumps((run.solver.time_step, run.solver.time, *_excerpt(run, chosen, charge=charge))))
        done = subprocess.run(
            [sys.executable, "-m", "benchmarks.operations", str(path)],
            cwd=_ROOT,
            env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
            stdout=subprocess.PIPE,
            text=True,
            check=True,
        )
    cells = int(run.fields.grid.filled[chosen].sum())
    found: dict[str, int] = json.loads(done.stdout)
    return {kind: number / cells for kind, number in found.items()}


def _some_blocks(run: Simulation, number: int, *, charge: bool) -> np.ndarray:
    """Blocks of one kind, evenly spread over the round."""
    schedule = run.fields.blocks.schedule
    first = schedule.first_charge if charge else schedule.first_solid
    every = np.concatenate(
        [np.arange(k, k + n) for k, n in zip(first, schedule.active[:, 0, int(charge)], strict=True)]
    )
    return every[np.linspace(0, len(every) - 1, min(number, len(every))).astype(int)]


def _excerpt(run: Simulation, blocks: np.ndarray, *, charge: bool) -> tuple[Any, ...]:
    """The arguments of the kernels for these blocks alone, cells and nodes numbered again."""
    fields = run.fields
    cells, filled = np.unique(fields.grid.cells[blocks], return_inverse=True)
    nodes, corners = np.unique(fields.grid.dofmap[cells], return_inverse=True)
    slots = (blocks[:, None] * LANES + np.arange(LANES)).ravel()
    kept = {
        len(fields.nodes.position): nodes,
        len(fields.solid.stress): cells,
        len(fields.grid.dofmap): cells,
        len(fields.grid.cells): blocks,
        len(fields.grid.mass): slots,
    }

    def cut(group: Group) -> Group:
        arrays = {name: value for name, value in group._asdict().items() if np.ndim(value) and len(value) in kept}
        return group._replace(**{name: array[kept[len(array)]] for name, array in arrays.items()})

    grid = cut(fields.grid)._replace(
        cells=filled.reshape(-1, LANES).astype(np.int32), dofmap=corners.reshape(-1, 8).astype(np.int32)
    )
    active = np.zeros((1, 1, 2), dtype=np.int32)
    active[0, 0, int(charge)] = len(blocks)
    ends = (np.array(row, dtype=np.int32) for row in ([0, 1], [0], [0], [0]))
    return cut(fields.nodes), grid, Schedule(*ends, active), cut(fields.solid), cut(fields.charge)


_KINDS = {
    "add": "add",
    "subtract": "add",
    "multiply": "multiply",
    "square": "multiply",
    "divide": "divide",
    "true_divide": "divide",
    "reciprocal": "divide",
    "sqrt": "root",
    "cbrt": "power",
    "power": "power",
    "float_power": "power",
    "exp": "power",
    "log": "power",
}
"""numpy's functions that are arithmetic, and what they count as; choosing and turning signs is none."""


class Counted(NDArrayOperatorsMixin):
    """A number that counts, in `done`, the operations that it takes part in; operators become numpy's functions."""

    __slots__ = ("value",)
    done: ClassVar[dict[str, int]] = dict.fromkeys(("add", "multiply", "divide", "root", "power"), 0)

    def __init__(self, value: float) -> None:
        self.value = float(value)

    def __array_ufunc__(self, ufunc: np.ufunc, method: str, *inputs: Any, **kwargs: Any) -> object:
        """Count, and compute with plain numbers; what was to be changed in place becomes a new number."""
        if any(np.ndim(value) for value in inputs if isinstance(value, np.ndarray)):
            return NotImplemented  # numpy then goes through the array's numbers one by one
        kind = _KINDS.get(ufunc.__name__)
        if ufunc is np.power and inputs[1] == 2:
            kind = "multiply"
        if kind is not None:
            Counted.done[kind] += 1
        kwargs.pop("out", None)
        found = getattr(ufunc, method)(*(float(value) for value in inputs), **kwargs)
        return Counted(found) if isinstance(found, float) else found

    def __float__(self) -> float:
        return self.value

    def __int__(self) -> int:
        return int(self.value)

    def __bool__(self) -> bool:
        return bool(self.value)

    def sqrt(self) -> object:
        """What numpy calls for a number in an array."""
        return np.sqrt(self)

    def exp(self) -> object:
        """What numpy calls for a number in an array."""
        return np.exp(self)


def _counting(group: Group) -> Group:
    """The group with its floating-point arrays made of numbers that count."""
    make = np.vectorize(Counted, otypes=[object])
    arrays = {name: value for name, value in group._asdict().items() if np.ndim(value) and value.dtype == float}
    return group._replace(**{name: make(array) for name, array in arrays.items()})


class _Address:
    """A number in an array, in the place of its address."""

    def __init__(self, array: np.ndarray, byte: int = 0) -> None:
        self.array, self.byte = array.reshape(-1), byte

    def __add__(self, by: int) -> _Address:
        return _Address(self.array, self.byte + int(by))

    def three(self) -> np.ndarray:
        """Three numbers from here on, to be read or changed."""
        first = self.byte // 8
        return self.array[first : first + 3]


def _lane(rows: np.ndarray, start: int, k: int) -> np.ndarray:
    """The numbers of vector k in three rows."""
    return rows[start + k : start + k + 3 * LANES : LANES]


def _load_triples(places: tuple[_Address, ...], rows: np.ndarray, start: int) -> None:
    for k, place in enumerate(places):
        _lane(rows, start, k)[:] = place.three()


def _store_triples(rows: np.ndarray, start: int, places: tuple[_Address, ...]) -> None:
    for k, place in enumerate(places):
        place.three()[:] = _lane(rows, start, k)


def _add_triples(rows: np.ndarray, start: int, places: tuple[_Address, ...]) -> None:
    for k, place in enumerate(places):
        place.three()[:] = [old + new for old, new in zip(place.three(), _lane(rows, start, k), strict=True)]


def _replace_intrinsics() -> None:
    """Put what Python can do in the place of what only a compiler can: hints, fused products, addresses, shuffles."""
    plain = {
        "widest_vectors": lambda: None,
        "fma": lambda a, b, c: a * b + c,
        "address": _Address,
        "load_triples": _load_triples,
        "store_triples": _store_triples,
        "add_triples": _add_triples,
        "prefetch": lambda _: None,
    }
    for name, module in list(sys.modules.items()):
        if name.startswith("burst_fenicsx."):
            for intrinsic in plain.keys() & vars(module).keys():
                setattr(module, intrinsic, plain[intrinsic])


def _main(path: Path) -> None:
    from burst_fenicsx.kernels.step.assembly import ONE_POINT, add_element_forces, make_scratch

    step, time, nodes, grid, schedule, solid, charge = pickle.loads(path.read_bytes())
    rounds = len(np.unique(grid.material)) + int(grid.material.max())  # no fewer than there are
    totals = Totals(np.zeros((1, 5)), np.zeros((1, rounds, 2)), *(np.zeros(1) for _ in range(3)))
    scratch = make_scratch(1).astype(object)
    states = [_counting(part) for part in (nodes, grid)], [_counting(part) for part in (solid, charge)]
    _replace_intrinsics()
    nodes, grid = states[0]
    count = len(nodes.position)
    levels = np.zeros(count, dtype=np.int8)
    motion = Motion(np.arange(count, dtype=np.int32), levels, levels, np.ones(count))
    with np.errstate(all="ignore"):
        states_and_sums = *states[1], None, totals, scratch
        add_element_forces(1, step, time, 0, ONE_POINT, nodes, motion, count, grid, schedule, *states_and_sums)
    print(json.dumps(Counted.done))


if __name__ == "__main__":
    _main(Path(sys.argv[1]))
