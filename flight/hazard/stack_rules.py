"""The rule of DDESB Technical Paper 12 for stacks: one round's field times an effective number of rounds.

The rounds of a stack on the side that faces a position and those on top throw fragments there freely; the others are
shielded. The rule counts the fragments of N_E = 0.9 N_S + 0.1 N_T single rounds (open stack; 0.7 N_S + 0.1 N_T under
earth cover), with N_S rounds on that side and N_T in the top layer. It includes no interaction between the rounds:
colliding casings throw fast, dense jets between them, which only the direct computation of the stack shows.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from flight.arguments import require_number
from flight.errors import InputError, nearest
from flight.hazard.density.expected import expected_distance

if TYPE_CHECKING:
    from flight.hazard.density.distance import ExpectedDistance
    from flight.hazard.ensemble import EnsembleHazard

__all__ = ["COVERS", "effective_number", "stack_rule"]

COVERS = {"open": (0.9, 0.1), "earth": (0.7, 0.1)}
"""Weights of the rounds on the side and of those on top, by the stack's cover."""


def effective_number(side: float, top: float, cover: str = "open") -> float:
    """Effective number N_E of rounds of a stack.

    Parameters
    ----------
    side, top : float
        Rounds on the side that faces the place, and in the top layer.
    cover : "open" or "earth"
        Of the stack.

    Raises
    ------
    InputError
        A number below zero or without meaning, none at all, or another cover.
    """
    if cover not in COVERS:
        raise InputError(f"stack rule: cover is {cover!r}{nearest(cover, COVERS)}; allowed: {', '.join(COVERS)}")
    for name, value in (("side", side), ("top", top)):
        require_number("stack rule", name, value, "")
        if not (math.isfinite(value) and value >= 0.0):
            raise InputError(f"stack rule: {name} is {value}, needed: zero or more rounds")
    number = COVERS[cover][0] * side + COVERS[cover][1] * top
    if not number > 0.0:
        raise InputError("stack rule: no round on the side and none on top")
    return number


def stack_rule(single: EnsembleHazard, number: float) -> ExpectedDistance:
    """Hazard distance of a stack by the rule: the single round's expected density times the effective number.

    Over all azimuths: the rule has no directions.

    Raises
    ------
    InputError
        The number is not above zero, or the single round's distance is not determined or was never estimated.
    """
    require_number("stack rule", "effective number", number, "")
    if not (math.isfinite(number) and number > 0.0):
        raise InputError(f"stack rule: effective number is {number}, needed: above zero")
    if single.undetermined or single.all_round is None:
        why = single.undetermined or "it was flown by another version; fly it again"
        raise InputError(f"stack rule: the single round has no hazard distance: {why}")
    return expected_distance(single.all_round, single.criteria.density / number)
