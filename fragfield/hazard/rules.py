"""Distances by published rules, compared with the computed ones: source, formula, inputs and range of each.

Most know masses and arrangement alone, those of DDESB Technical Paper 12 (the beam distance of a single round, and the
rule for stacks) its break-up. A rule that does not hold for the arrangement has no distance but the reason. Blast
distances come from the net explosive quantity, as its equivalent in TNT, and are marked so. A rule that could not be
read at a public source is left out and listed in `LEFT_OUT`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from flight.errors import InputError as FlightInputError
from flight.shape import FORGED_STEEL_SHELL, HEAVY_PIECES_OF_STACKS
from fragfield.case import CaseTable
from fragfield.case.conversion.surroundings import ground_height
from fragfield.case.problem import flight_arguments, hazard_criteria
from fragfield.case.tables.surroundings import OfficialTable
from fragfield.hazard.contents import COMPARISON, DISPOSAL, SITING, contents_of, quantity_words, with_images
from fragfield.hazard.tp12 import SUPERSONIC_DRAG, Retardation, beam_distance, effective_number, stack_distance
from fragfield.pipeline.single_round import SingleRound
from fragfield.results.rules import Beam, Contents, FragmentField, Rule, Rules, StackRule, Tp12

POUND, FOOT = 0.45359237, 0.3048
# A to E of exp(A + B ln Z + C ln^2 Z + ...) in kPa, Z in m/kg^(1/3), and the range of Z (Swisdak 1994, Table 1).
_KINGERY = (
    (0.2, 2.9, (7.2106, -2.1069, -0.3229, 0.1117, 0.0685)),
    (2.9, 23.8, (7.5938, -3.0523, 0.40977, 0.0261, -0.01267)),
    (23.8, 198.5, (6.0536, -1.4066, 0.0, 0.0, 0.0)),
)
_PRESSURES = (5e3, 21e3)  # among the levels by which IATG 02.20 (2021), Table 8, grades damage
_MOST_BY_QUANTITY = 450.0  # lb, of the hazardous fragment distance by net explosive weight
_MOST_K40 = 1e5  # lb
_WASTE = ((100.0, 204.0), (1000.0, 380.0), (10_000.0, 530.0), (30_000.0, 690.0))  # lb, m
_UNKNOWN = "the masses of the rounds are not known here"
_DANGER = "IATG 01.80 and IMAS TN 10.20/01 (UN SaferGuard), read at second hand; disposal in the open"

LEFT_OUT = (
    (
        "DDESB TP-16, hazardous fragment distance and throw of single items: the tables were not found at a public "
        "source. The table [official] takes such a distance."
    ),
    (
        "DESR 6055.09, distances to public traffic routes and between lines (K 24, K 18): the standard's own text "
        "was not at hand; only K 40 was read, in a paper that quotes it."
    ),
    "DESR 6055.09, distances by item for primary fragments (Joint Hazard Classification System): not public.",
    "IATG 01.80, danger area of bare explosive (130 M^(1/3) m): every round here has a casing.",
)
"""Rules that are not shown, and why."""


def incident_pressure(scaled: float) -> float:
    """Peak incident overpressure (Pa) of a TNT hemisphere on the ground at a scaled distance (m/kg^(1/3)).

    Swisdak, Simplified Kingery Airblast Calculations (1994), Table 1; NaN outside 0.2 to 198.5 m/kg^(1/3).
    """
    for low, high, coefficients in _KINGERY:
        if low <= scaled <= high:
            logarithm = math.log(scaled)
            return 1e3 * math.exp(sum(c * logarithm**n for n, c in enumerate(coefficients)))
    return math.nan


def pressure_distance(tnt: float, pressure: float) -> float | None:
    """Distance (m) at which the peak incident overpressure of a mass of TNT (kg) falls to `pressure` (Pa)."""
    low, high = _KINGERY[0][0], _KINGERY[-1][1]
    if not tnt > 0.0 or not incident_pressure(high) <= pressure <= incident_pressure(low):
        return None
    for _ in range(80):
        middle = math.sqrt(low * high)
        low, high = (middle, high) if incident_pressure(middle) > pressure else (low, middle)
    return math.sqrt(low * high) * tnt ** (1.0 / 3.0)


def hazardous_fragment_distance(explosive: float) -> float | None:
    """Distance (m) for hazardous fragments by net explosive mass (kg), hazard division 1.1 in the open.

    291.3 + 79.2 ln W ft below 100 lb, -1133.9 + 389 ln W above, at least 236 ft; W in lb, prescribed up to 450 lb.
    """
    pounds = explosive / POUND
    if not pounds > 0.0:
        return None
    feet = 291.3 + 79.2 * math.log(pounds) if pounds < 100.0 else -1133.9 + 389.0 * math.log(pounds)
    return FOOT * max(feet, 236.0)


def rules_for(contents: Contents | None, official: OfficialTable | None = None) -> Iterator[Rule]:
    """Every rule, with its distance for these contents or the reason why it does not apply to them.

    Where the round's own published distance (`official`) is there for so many rounds, rules for items whose distance is
    not known do not apply. Without contents a rule that needs masses has no distance.
    """
    yield from _siting_fragments(contents, _known_item(contents, official))
    yield from _disposal(contents)
    yield from _blast(contents)


def _rule(distance: float | None, reason: str, *, missing: bool = False, **what: Any) -> Rule:
    """A rule by the distance of its formula (m) and why it does not apply; `missing` counts where it does not."""
    if not reason:
        return Rule(distance=distance, outside=None, **what)
    return Rule(distance=None, reason=reason, outside=distance, missing=missing, **what)


def _siting_fragments(contents: Contents | None, known: str) -> Iterator[Rule]:
    mass = None if contents is None else contents.explosive
    yield _rule(
        mass and hazardous_fragment_distance(mass), known or _too_much(mass, _MOST_BY_QUANTITY), missing=not known,
        name="Hazardous fragment distance by net explosive weight", hazard="fragments", use=SITING,
        source="DoD 6055.09 (hazard division 1.1, open), as in 14 CFR 420, Table E-1; coefficients read at second hand",
        formula="291.3 + 79.2 ln W ft below 100 lb, −1133.9 + 389 ln W above; at least 236 ft", inputs=_quantity(mass),
        range="up to 450 lb (204 kg); not for an item whose own distance is published",
    )  # fmt: skip
    yield _rule(
        1250.0 * FOOT, known,
        name="Fragment distance of a cased item whose own is not known", hazard="fragments", use=SITING,
        source="US Army subcourse MM0150, p. 6, after TM 9-1300-206 (hazard class 1.1)", formula="1250 ft",
        inputs="none", range="projectiles, bombs and the like whose minimum distance is not known",
    )  # fmt: skip


def _disposal(contents: Contents | None) -> Iterator[Rule]:
    mass = all_up = heaviest = None
    behind, words, single = _UNKNOWN, "all-up mass not known", "all-up mass not known"
    if contents is not None:
        mass, all_up, heaviest = contents.explosive, contents.all_up, contents.largest_round
        works = contents.protective_works
        behind = f"protective works enclose the rounds: {_listed(works)}" if works else ""
        number = f"{contents.rounds} round{'s' if contents.rounds > 1 else ''}"
        words = f"all-up mass {all_up:.3g} kg of {number}, unpackaged"
        single = f"all-up mass {heaviest:.3g} kg of the heaviest round"
    for name, factor in (("public access possible", 634.0), ("public access denied", 444.0)):
        yield _rule(
            all_up and factor * all_up ** (1.0 / 6.0), behind, missing=True,
            name=f"Explosion danger area, {name}", hazard="fragments", use=DISPOSAL, source=_DANGER,
            formula=f"{factor:.0f} M^(1/6) m", inputs=words, range="single and multiple items; no protective works",
        )  # fmt: skip
    yield _rule(
        heaviest and 370.0 * heaviest**0.2, behind or _no_row(contents), missing=bool(behind),
        name="Explosion danger area, items in a row", hazard="fragments", use=DISPOSAL, source=_DANGER,
        formula="370 M^(1/5) m", inputs=single,
        range="two or more items in a straight row, more than one charge diameter apart, detonated at once; no "
        "protective works",
    )  # fmt: skip
    yield _rule(
        next((metres for pounds, metres in _WASTE if mass is not None and mass <= pounds * POUND), None),
        _too_much(mass, _WASTE[-1][0]),
        missing=True,
        name="Open detonation of waste explosives, to the property of others", hazard="fragments", use=DISPOSAL,
        source="40 CFR 265.382",
        formula="204 m to 100 lb, 380 m to 1,000 lb, 530 m to 10,000 lb, 690 m to 30,000 lb", inputs=_quantity(mass),
        range="up to 30,000 lb (13.6 t)",
    )  # fmt: skip


def _blast(contents: Contents | None) -> Iterator[Rule]:
    tnt = None if contents is None else contents.tnt
    words = (contents and quantity_words(contents.explosive, contents.tnt, contents.equivalents)) or _quantity(None)
    yield _rule(
        tnt and 40.0 * FOOT / POUND ** (1.0 / 3.0) * tnt ** (1.0 / 3.0), _too_much(tnt, _MOST_K40, "TNT equivalent"),
        missing=True, name="Inhabited building distance, K 40", hazard="blast", use=SITING,
        source="DoD 6055.9, as quoted by Swisdak, A Consequence Minimization Approach to Explosive Siting",
        formula="40 W^(1/3) ft with W in lb of TNT: 15.87 Q^(1/3) m", inputs=words,
        range="blast alone, 8.1 kPa; to 100,000 lb (45 t)",
    )  # fmt: skip
    for pressure in _PRESSURES:
        reach = tnt and pressure_distance(tnt, pressure)
        outside = "" if reach is not None else "the pressure lies outside the fitted range"
        yield _rule(
            reach, _UNKNOWN if tnt is None else outside,
            name=f"Peak incident overpressure {pressure / 1e3:g} kPa (a level of IATG 02.20, Table 8)", hazard="blast",
            use=COMPARISON, source="Kingery and Bulmash 1984, as fitted by Swisdak 1994 (DTIC ADA526744), Table 1",
            formula="hemisphere of TNT on the ground", inputs=words,
            range="0.2 to 198.5 m/kg^(1/3); casing and height not considered",
        )  # fmt: skip


def _known_item(contents: Contents | None, official: OfficialTable | None) -> str:
    """Why rules for unknown items do not apply: the round's own distance is there for as many; empty where they do."""
    if contents is None or official is None or official.hazardous_fragment_distance is None:
        return ""
    if contents.rounds > official.rounds or not contents.alike:
        return ""
    return "the round's own distance is published, see the official one"


def _no_row(contents: Contents | None) -> str:
    if contents is None:
        return _UNKNOWN
    if contents.rounds < 2:
        return "a single round"
    if not contents.in_a_row:
        return "the rounds do not stand in a straight row"
    if contents.charge_diameter is None or contents.clearance is None:
        return "a round is from a mesh file, whose charge diameter is not known"
    if not contents.clearance > contents.charge_diameter:
        return (
            f"clear distance {1e3 * contents.clearance:.4g} mm, not more than one charge diameter, "
            f"{1e3 * contents.charge_diameter:.4g} mm"
        )
    return "" if contents.at_once else "the rounds are not all ignited at the same time"


def _too_much(mass: float | None, pounds: float, what: str = "net explosive quantity") -> str:
    """Why a mass (kg) is above a rule's largest or not known; empty where it is neither."""
    if mass is None:
        return _UNKNOWN
    return "" if mass <= pounds * POUND else f"{what} {mass:.4g} kg, above {pounds * POUND:.4g} kg ({pounds:,.0f} lb)"


def _quantity(mass: float | None) -> str:
    return "net explosive quantity not known" if mass is None else f"net explosive quantity {mass:.3g} kg"


def _listed(names: tuple[str, ...]) -> str:
    return ", ".join(names) if len(names) <= 3 else f"{', '.join(names[:2])} and {len(names) - 2} more"


def rules_of(case: CaseTable, single: SingleRound) -> Rules:
    """The part `rules` of the summary. `single` is one of the case's rounds alone."""
    contents, part = contents_of(case), tp12_part(case, single)
    rules = (*tp12_rules(case, part), *rules_for(contents, case.official))
    return Rules(contents=contents, tp12=part, rules=rules, left_out=LEFT_OUT)


BEAM = "TP-12's beam distance of the single round"
STACK = "TP-12's rule for stacks"
_SOURCE = "DDESB Technical Paper 12 (Zaker 1975)"
_BASIS = "single round's break-up"


def tp12_part(case: CaseTable, single: SingleRound) -> Tp12:
    """What the paper's procedure gives for a resolved case: the beam and, of several rounds, the stack."""
    if single.field is None:
        return Tp12(single_round=single.source, realisations=0, beam=None, stack=None)
    air, ground = case.flight.air.air(), ground_height(case, *case.flight.origin)
    density, criteria, gravity = float(air.density(ground)), hazard_criteria(case), case.flight.gravity
    drag = flight_arguments(case)["drag"]
    retardation = Retardation(drag, density, float(air.sound_speed(ground)), FORGED_STEEL_SHELL, gravity)
    beam, stack = beam_distance(single.field, retardation, criteria), None
    if len(positions := with_images(case)) > 1:
        rule, (side, top) = case.hazard.stack_rule, stack_counts(positions)
        side, top = side if rule.side is None else rule.side, top if rule.top is None else rule.top
        known: dict[str, Any] = {"side": side, "top": top, "cover": rule.cover}
        try:
            number = effective_number(side, top, rule.cover)
            found = stack_distance(single.field, number, criteria, density=density, gravity=gravity)
        except FlightInputError as error:
            stack = StackRule(**known, distance=None, reason=str(error))
        else:
            stack = StackRule.read({**known, "effective_number": number, **asdict(found)})
    return Tp12(single_round=single.source, realisations=single.field.realisations, beam=beam, stack=stack)


def tp12_rules(case: CaseTable, part: Tp12) -> Iterator[Rule]:
    """The same as rules beside the others; `part` from `tp12_part`."""
    beam, stack, source = part.beam, part.stack, part.single_round
    no_stack = "" if stack is not None and stack.distance is not None else (stack and stack.reason) or source
    criteria = (
        f"{case.hazard.energy:.4g} J against drag or in free fall, 1 per {1.0 / case.hazard.density:.4g} m2 normal to "
        "the path"
    )
    yield Rule(
        name=BEAM,
        hazard="fragments",
        use=COMPARISON,
        distance=None if beam is None else beam.distance,
        outside=None,
        source=f"{_SOURCE}, procedure of p. 13-14 with counted fragments",
        formula=f"q = Q / R2 of the worst polar zone of 10 degrees; {criteria}; k = {FORGED_STEEL_SHELL:.0f} kg/m3, "
        "drag and air of the case",
        inputs=f"{_zone_words(beam)}; {source}, {part.realisations} break-ups" if beam else source,
        range="one round; straight flight, whatever its attitude",
        reason="" if beam else source,
        basis=_BASIS,
    )
    if not case.round or len(with_images(case)) < 2:
        return
    yield Rule(
        name=STACK,
        hazard="fragments",
        use=COMPARISON,
        distance=None if stack is None else stack.distance,
        outside=None,
        source=f"{_SOURCE}, p. 11 and 13-14",
        formula="q = N_E Q0 / R2 exp(-(2 m / m0)^(1/2)) perpendicular to the axes; "
        f"{criteria}; k = {HEAVY_PIECES_OF_STACKS:.0f} kg/m3, C_D = {SUPERSONIC_DRAG}",
        inputs=f"{_stack_words(stack, stack.single)}; {source}" if stack and stack.single else no_stack,
        range="stacks of equal rounds that detonate at once; colliding casings not considered",
        reason=no_stack,
        basis=_BASIS,
    )


def stack_counts(positions: ArrayLike) -> tuple[int, int]:
    """Rounds on the fullest of the sides that face along x and along y, and rounds in the top layer.

    `positions` (n, 3): positions of the rounds (m), with images behind planes of symmetry; they are rounded to half of
    the smallest distance between two, so that rounds behind each other count once.
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


def _zone_words(beam: Beam) -> str:
    return (
        f"{beam.per_steradian:.3g} hazardous fragments per steradian from {beam.low:.0f} to {beam.high:.0f} "
        "degrees from the nose"
    )


def _stack_words(stack: StackRule, mott: FragmentField) -> str:
    return (
        f"N_E = {stack.effective_number:.3g} of {stack.side} rounds on the fullest side and {stack.top} on top "
        f"({stack.cover}); Q0 = {mott.per_steradian:.3g} per steradian, m0 = {1e3 * mott.mean_mass:.3g} g, V = "
        f"{mott.speed:.4g} m/s from {stack.low:.0f} to {stack.high:.0f} degrees; lightest hazardous fragment "
        f"{1e3 * (stack.lightest or 0.0):.3g} g{' by free fall' if stack.free_fall else ''}"
    )
