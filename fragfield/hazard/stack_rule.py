"""TP-12's rule for stacks, compared with the direct result of a case."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.errors import InputError
from fragfield.hazard.arrangement import with_images

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from fragfield.case import Case

__all__ = ["stack_counts", "stack_rule_of"]


def stack_rule_of(case: Case) -> dict[str, Any]:
    """Distances by the rule, from the run of the single round that the case names.

    Returns
    -------
    dict
        `single`, `cover`, `side`, `top`, `effective_number`, `realisations` (of the single round) and `hazard`: the
        distance of the expected density over all azimuths with its upper bound and standard error.

    Raises
    ------
    InputError
        The single round's run cannot be read, or counted other fragments as hazardous.
    """
    from flight.files.ensemble import read_ensemble
    from flight.hazard.stack_rules import effective_number, stack_rule
    from fragfield.case.conversion.stages import hazard_criteria

    rule = case.hazard.stack_rule
    assert rule is not None  # the caller's choice
    file = Path(rule.single) / "ensemble.h5"
    single, _ = read_ensemble(file)
    criteria = hazard_criteria(case)
    if single.criteria != criteria:
        raise InputError(
            f"{file}: assessed with {single.criteria}, this case has {criteria}; hazard.stack_rule needs the same "
            "in both"
        )
    side, top = rule.side, rule.top
    if side is None or top is None:
        if not case.round:
            raise InputError("hazard.stack_rule: side and top are needed where the case has no rounds to count")
        counted = stack_counts(with_images(case))
        side, top = (own if own is not None else count for own, count in zip((side, top), counted, strict=True))
    number = effective_number(side, top, rule.cover)
    found = stack_rule(single, number)
    return {
        "single": rule.single,
        "cover": rule.cover,
        "side": side,
        "top": top,
        "effective_number": number,
        "realisations": found.realisations,
        "hazard": {
            "distance": found.distance,
            "upper": found.upper,
            "standard_error": found.standard_error,
            "basis": found.basis,
        },
    }


def stack_counts(positions: ArrayLike) -> tuple[int, int]:
    """Rounds on the fullest of the sides that face along x and along y, and rounds in the top layer.

    Parameters
    ----------
    positions : (n, 3)
        Positions of the rounds (m), with images behind planes of symmetry; they are rounded to half of the
        smallest distance between two, so that rounds behind each other count once.
    """
    at = np.asarray(positions, dtype=np.float64).reshape(-1, 3)
    if len(at) == 1:
        return 1, 1
    apart = np.linalg.norm(at[:, None] - at[None], axis=-1)
    step = 0.5 * float(apart[apart > 1e-9].min(initial=np.inf))
    top = int((at[:, 2] > at[:, 2].max() - step).sum())
    sides = []
    for across in (0, 1):  # seen along y, and along x
        cells = np.floor((at[:, [across, 2]] - at[:, [across, 2]].min(axis=0)) / step + 0.5)
        sides.append(len(np.unique(cells, axis=0)))
    return max(sides), top
