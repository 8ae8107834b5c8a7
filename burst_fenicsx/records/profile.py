"""Where the time of a burst goes: wall time and calls of its parts, taken around the calls of its objects.

The step is independent of it. Every part's time is its own: what it calls of other parts is taken off.
"""

from __future__ import annotations

import time as clock
from functools import wraps
from typing import TYPE_CHECKING, Any

import numpy as np

from burst_fenicsx.contact.sliding import SlidingInterface

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from burst_fenicsx.simulation import Simulation

__all__ = ["Profile"]

_REST = "all else"


class Profile:
    """Times of a burst that has not begun to step.

    Parameters
    ----------
    run : the burst; methods of its objects are replaced by timed ones.
    """

    def __init__(self, run: Simulation) -> None:
        self._run = run
        self._seconds: dict[str, float] = {}
        self._calls: dict[str, int] = {}
        self._inside = [0.0]  # seconds that the calls under way have spent in parts that they called
        for owner, method, part in _parts(run):
            self._seconds.setdefault(part, 0.0)
            self._calls.setdefault(part, 0)
            setattr(owner, method, self._timed(getattr(owner, method), part))

    def _timed(self, call: Callable[..., Any], part: str) -> Callable[..., Any]:
        @wraps(call)
        def timed(*arguments: Any, **named: Any) -> Any:  # noqa: ANN401 - whatever the method takes and gives
            self._inside.append(0.0)
            began = clock.perf_counter()
            try:
                return call(*arguments, **named)
            finally:
                spent = clock.perf_counter() - began
                self._seconds[part] += spent - self._inside.pop()
                self._inside[-1] += spent
                self._calls[part] += 1

        return timed

    def table(self) -> list[dict[str, Any]]:
        """One record for each part, the longest first: `part`, `seconds`, `share`, `calls`; collective.

        Seconds and calls are means over the ranks. The shares are those of the stepping, which the records add up to.
        """
        comm, names = self._run.comm, list(self._seconds)
        whole = self._run.clocks.stepping
        own = np.array([*self._seconds.values(), whole, *self._calls.values()], dtype=float)
        mean = comm.allreduce(own) / comm.size
        whole = float(mean[len(names)])
        seconds, calls = mean[: len(names)], mean[len(names) + 1 :]
        found = [
            {"part": name, "seconds": float(spent), "share": float(spent) / whole, "calls": round(number)}
            for name, spent, number in zip(names, seconds, calls, strict=True)
            if number > 0.0
        ]
        rest = whole - float(seconds.sum())
        found.append({"part": _REST, "seconds": rest, "share": rest / whole, "calls": self._run.solver.steps})
        return sorted(found, key=lambda record: -float(record["seconds"]))


def _parts(run: Simulation) -> Iterator[tuple[object, str, str]]:
    """Object, method and name of every part; a name may stand for several."""
    solver, contact = run.solver, run.contact
    yield run, "_write_output", "files: states written"
    yield run, "_write_checkpoint", "files: checkpoints"
    yield run, "_record", "ledger: entries and measures"
    yield run, "_report_progress", "progress"
    yield run.interpenetration, "check", "search for metal that has passed through"
    yield run.exposures, "update", "pressures in charges without ignition"
    yield solver, "advance", "macro steps, without the other parts"
    yield solver, "_advance_halves", "element forces and motion"
    yield solver, "choose_levels", "levels: choice and arrangement of blocks"
    yield solver, "erode_metal", "element erosion"
    yield solver.ledger, "add", "ledger: sums"
    yield solver.leakage, "update", "venting"
    yield contact, "add_forces", "contact: rows of forces, mean velocities"
    for method in ("bring", "find_forces", "take_reactions"):
        if isinstance(contact.interface, SlidingInterface):
            yield contact.interface, method, "contact: charge on casing"
        if contact.collisions is not None:
            yield contact.collisions, method, "contact: casings on each other"
    if contact.collisions is not None:
        yield contact.collisions, "search", "contact: search"
    for plane in contact.planes:
        yield plane, "add_forces", "contact: planes"
