"""Experiments on the base: what it is that brings its pieces into the test's rear cone."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from transition import BreakUp
from transition.law.mott import MottLaw

if TYPE_CHECKING:
    from collections.abc import Iterator

    from transition import BreakUpSettings
    from transition.snapshot import Snapshot

__all__ = ["experiments"]


def experiments(snapshot: Snapshot, settings: BreakUpSettings) -> Iterator[tuple[str, BreakUp]]:
    """Break-ups of the same burst with one thing about the base changed, each with its words."""
    for pieces, outward in ((1.0, 0.0), (2.0, 1.0), (2.0, 0.0)):
        words = [] if pieces == 1.0 else [f"{pieces:g} times the pieces"]
        words += [] if outward == 1.0 else ["no outward speed"]
        yield " and ".join(words), _changed(snapshot, settings, pieces, outward)


def _changed(snapshot: Snapshot, settings: BreakUpSettings, pieces: float, outward: float) -> BreakUp:
    """The base with so many times the pieces and this fraction of its outward speed; its law is the usual one."""
    usual = BreakUp(snapshot, settings)
    last = len(snapshot.rounds[0].segments) - 1
    segment = snapshot.segment[snapshot.casing]
    cells = snapshot.cells[snapshot.casing]
    own = np.setdiff1d(np.unique(cells[segment == last]), np.unique(cells[segment != last]))
    axis = np.asarray(snapshot.rounds[0].axis)
    velocity = snapshot.velocity.copy()
    along = np.outer(velocity[own] @ axis, axis)
    velocity[own] = along + outward * (velocity[own] - along)
    changed = BreakUp(replace(snapshot, velocity=velocity), settings)
    changed.laws = tuple(
        law
        if part.index != last
        else replace(law, law=MottLaw.from_mean(law.law.mean / pieces, settings.dimension), n0=pieces * law.n0)
        for part, law in zip(usual.segments, usual.laws, strict=True)
    )
    return changed
