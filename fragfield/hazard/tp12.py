"""DDESB Technical Paper 12 beside a run: the beam distance of the single round, and the rule for stacks."""

from __future__ import annotations

from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.hazard.arrangement import with_images
from fragfield.hazard.contents import COMPARISON, Rule

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from numpy.typing import ArrayLike

    from flight.hazard.tp12 import BeamDistance, PolarField, StackDistance
    from fragfield.case import CaseTable
    from fragfield.pipeline.single_round import SingleRound

__all__ = ["BEAM", "STACK", "stack_counts", "tp12_part", "tp12_rules"]

BEAM = "TP-12's beam distance of the single round"
STACK = "TP-12's rule for stacks"
_SOURCE = "DDESB Technical Paper 12 (Zaker 1975)"
_BASIS = "single round's break-up"


def tp12_part(case: CaseTable, single: SingleRound) -> dict[str, Any]:
    """What the paper's procedure gives for a resolved case, as `rules.tp12` of summary.json.

    Returns
    -------
    dict
        `single_round` (where its fragments come from, or why there are none), `realisations`, `beam` and, of several
        rounds, `stack`: numbers, or `reason` where there are none; null without a single round.
    """
    from flight.errors import InputError

    part: dict[str, Any] = {"single_round": single.source, "realisations": 0, "beam": None, "stack": None}
    if single.field is None:
        return part
    beam = _beam(case, single.field)
    part |= {"realisations": single.field.realisations, "beam": asdict(beam)}
    side, top, count = _counts(case)
    if count > 1:
        cover = case.hazard.stack_rule.cover
        try:
            found, number = _stack(case, single.field, side, top)
        except InputError as error:
            part["stack"] = {"side": side, "top": top, "cover": cover, "distance": None, "reason": str(error)}
        else:
            part["stack"] = {"side": side, "top": top, "cover": cover, "effective_number": number, **asdict(found)}
    return part


def tp12_rules(case: CaseTable, part: Mapping[str, Any]) -> Iterator[Rule]:
    """The same as rules beside the others; `part` from `tp12_part`."""
    from flight.hazard.tp12 import SUPERSONIC_DRAG
    from flight.shape import FORGED_STEEL_SHELL, HEAVY_PIECES_OF_STACKS

    beam, stack, source = part["beam"], part["stack"] or {}, part["single_round"]
    criteria = (
        f"{case.hazard.energy:.4g} J against drag or in free fall, 1 per {1.0 / case.hazard.density:.4g} m2 normal to "
        "the path"
    )
    yield Rule(
        name=BEAM,
        hazard="fragments",
        use=COMPARISON,
        distance=beam and beam["distance"],
        source=f"{_SOURCE}, procedure of p. 13-14 with counted fragments",
        formula=f"q = Q / R2 of the worst polar zone of 10 degrees; {criteria}; k = {FORGED_STEEL_SHELL:.0f} kg/m3, "
        "drag and air of the case",
        inputs=f"{_zone_words(beam)}; {source}, {part['realisations']} break-ups" if beam else source,
        range="one round; straight flight, whatever its attitude",
        reason="" if beam else source,
        basis=_BASIS,
    )
    if len(with_images(case)) < 2:
        return
    yield Rule(
        name=STACK,
        hazard="fragments",
        use=COMPARISON,
        distance=stack.get("distance"),
        source=f"{_SOURCE}, p. 11 and 13-14",
        formula="q = N_E Q0 / R2 exp(-(2 m / m0)^(1/2)) perpendicular to the axes; "
        f"{criteria}; k = {HEAVY_PIECES_OF_STACKS:.0f} kg/m3, C_D = {SUPERSONIC_DRAG}",
        inputs=f"{_stack_words(stack)}; {source}" if "single" in stack else stack.get("reason", source),
        range="stacks of equal rounds that detonate at once; colliding casings not considered",
        reason="" if stack.get("distance") is not None else stack.get("reason", source),
        basis=_BASIS,
    )


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


def _counts(case: CaseTable) -> tuple[int, int, int]:
    """Rounds on a side and on top, as the case gives or has them, and all of them."""
    positions, rule = with_images(case), case.hazard.stack_rule
    side, top = stack_counts(positions)
    return rule.side if rule.side is not None else side, rule.top if rule.top is not None else top, len(positions)


def _beam(case: CaseTable, field: PolarField) -> BeamDistance:
    from flight.hazard.retardation import Retardation
    from flight.hazard.tp12 import beam_distance
    from flight.shape import FORGED_STEEL_SHELL
    from fragfield.case.conversion.stages import flight_arguments, hazard_criteria

    density, sound = _air(case)
    drag = flight_arguments(case)["drag"]
    retardation = Retardation(drag, density, sound, FORGED_STEEL_SHELL, case.flight.gravity)
    return beam_distance(field, retardation, hazard_criteria(case))


def _stack(case: CaseTable, field: PolarField, side: int, top: int) -> tuple[StackDistance, float]:
    from flight.hazard.tp12 import effective_number, stack_distance
    from fragfield.case.conversion.stages import hazard_criteria

    number = effective_number(side, top, case.hazard.stack_rule.cover)
    density, _ = _air(case)
    criteria = hazard_criteria(case)
    return stack_distance(field, number, criteria, density=density, gravity=case.flight.gravity), number


def _air(case: CaseTable) -> tuple[float, float]:
    """Density (kg/m3) and speed of sound (m/s) on the ground at the origin."""
    from fragfield.case.conversion.stages import flight_arguments
    from fragfield.case.conversion.surroundings import ground_height

    air, ground = flight_arguments(case)["air"], ground_height(case, *case.flight.origin)
    return float(air.density(ground)), float(air.sound_speed(ground))


def _zone_words(beam: Mapping[str, Any]) -> str:
    return (
        f"{beam['per_steradian']:.3g} hazardous fragments per steradian from {beam['low']:.0f} to {beam['high']:.0f} "
        "degrees from the nose"
    )


def _stack_words(stack: Mapping[str, Any]) -> str:
    mott = stack["single"]
    return (
        f"N_E = {stack['effective_number']:.3g} of {stack['side']} rounds on the fullest side and {stack['top']} on "
        f"top ({stack['cover']}); Q0 = {mott['per_steradian']:.3g} per steradian, "
        f"m0 = {1e3 * mott['mean_mass']:.3g} g, V = {mott['speed']:.4g} m/s "
        f"from {stack['low']:.0f} to {stack['high']:.0f} degrees; "
        f"lightest hazardous fragment {1e3 * stack['lightest']:.3g} g{' by free fall' if stack['free_fall'] else ''}"
    )
