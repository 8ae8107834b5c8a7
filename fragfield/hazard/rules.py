"""Distances by published rules, compared with the computed ones: source, formula, inputs and range of each.

Those here know masses alone, those of `fragfield.hazard.tp12` the single round's break-up. Blast distances come from
the net explosive mass alone and are marked so. A rule that could not be read at a public source is left out and listed
in `LEFT_OUT`.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any

from fragfield.hazard.rule import Rule
from fragfield.hazard.tp12 import tp12_part, tp12_rules
from fragfield_base.explosive_names import value_for

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from fragfield.case import Case
    from fragfield.pipeline.single_round import SingleRound

__all__ = ["LEFT_OUT", "Contents", "contents_of", "incident_pressure", "pressure_distance", "rules_for", "rules_of", "tnt_equivalent"]  # fmt: skip  # noqa: E501

POUND, FOOT = 0.45359237, 0.3048
# A to E of exp(A + B ln Z + C ln^2 Z + ...) in kPa, Z in m/kg^(1/3), and the range of Z (Swisdak 1994, Table 1).
_KINGERY = (
    (0.2, 2.9, (7.2106, -2.1069, -0.3229, 0.1117, 0.0685)),
    (2.9, 23.8, (7.5938, -3.0523, 0.40977, 0.0261, -0.01267)),
    (23.8, 198.5, (6.0536, -1.4066, 0.0, 0.0, 0.0)),
)
# Equivalent mass of TNT for peak pressure, at second hand: IATG 01.80, clause 7.2, and for Composition A-3, H-6, HBX-1
# and Pentolite ConWep (1992), as printed by others. Where both have an explosive they agree.
_TNT = {
    "TNT": 1.0, "Composition A-3": 1.09, "Composition B": 1.11, "Composition C-3": 1.08, "Composition C-4": 1.37,
    "Cyclotol": 1.14, "H-6": 1.38, "HBX-1": 1.17, "HMX": 1.02, "Octol": 1.06, "Pentolite": 1.42, "PETN": 1.27,
    "RDX": 1.14, "Tetryl": 1.07, "Tritonal": 1.07,
}  # fmt: skip
_LARGEST = max(_TNT, key=lambda name: _TNT[name])
_PRESSURES = (5e3, 21e3)  # among the levels by which IATG 02.20 (2021), Table 8, grades damage

LEFT_OUT = (
    "DDESB TP-16, hazardous fragment distance and throw of the M107: the tables were not found at a public source.",
    (
        "DESR 6055.09, distances to public traffic routes and between lines (K 24, K 18): the standard's own text "
        "was not at hand; only K 40 was read, in a paper that quotes it."
    ),
    "DESR 6055.09, distances by item for primary fragments (Joint Hazard Classification System): not public.",
)
"""Rules that are not shown, and why."""


@dataclass(frozen=True)
class Contents:
    """What stands there: all rounds with their images.

    Attributes
    ----------
    explosive : float
        Net explosive mass (kg).
    tnt : float
        Its equivalent in TNT for peak pressure (kg).
    all_up : float
        Mass of the rounds whole, without packaging (kg).
    largest_round : float
        Mass of the heaviest round (kg).
    rounds : int
        How many.
    equivalents : tuple of str
        Words on the equivalents taken.
    """

    explosive: float
    tnt: float
    all_up: float
    largest_round: float
    rounds: int
    equivalents: tuple[str, ...] = ()


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

    291.3 + 79.2 ln W ft below 100 lb, -1133.9 + 389 ln W above, at least 236 ft; W in lb up to 450 lb.
    """
    pounds = explosive / POUND
    if not 0.0 < pounds <= 450.0:
        return None
    feet = 291.3 + 79.2 * math.log(pounds) if pounds < 100.0 else -1133.9 + 389.0 * math.log(pounds)
    return FOOT * min(max(feet, 236.0), 1250.0)


def rules_for(contents: Contents) -> Iterator[Rule]:
    """Every rule that can be applied to these contents."""
    mass, all_up = contents.explosive, contents.all_up
    explosive = f"net explosive mass {mass:.3g} kg"
    yield Rule(
        "Hazardous fragment distance by net explosive weight", "fragments", hazardous_fragment_distance(mass),
        "DoD 6055.09 (hazard division 1.1, open), as in 14 CFR 420, Table E-1; coefficients read at second hand",
        "291.3 + 79.2 ln W ft below 100 lb, −1133.9 + 389 ln W above; at least 236 ft", explosive,
        "up to 450 lb (204 kg); not for primary fragments of a known item",
    )  # fmt: skip
    yield Rule(
        "Fragment distance of a cased item whose own is not known", "fragments", 1250.0 * FOOT,
        "US Army subcourse MM0150, after TM 9-1300-206 (hazard class 1.1)", "1250 ft", "none",
        "projectiles, bombs and the like whose minimum distance is not known",
    )  # fmt: skip
    danger = "IATG 01.80 and IMAS TN 10.20/01 (UN SaferGuard), read at second hand; disposal in the open"
    words = f"all-up mass {all_up:.3g} kg of {contents.rounds} round{'s' if contents.rounds > 1 else ''}, unpackaged"
    for name, factor in (("public access possible", 634.0), ("public access denied", 444.0)):
        yield Rule(
            f"Explosion danger area, {name}", "fragments", factor * all_up ** (1.0 / 6.0), danger,
            f"{factor:.0f} M^(1/6) m", words, "single and multiple items; no protective works",
        )  # fmt: skip
    yield Rule(
        "Explosion danger area, items in a row", "fragments", 370.0 * contents.largest_round**0.2, danger,
        "370 M^(1/5) m", f"all-up mass {contents.largest_round:.3g} kg of the heaviest round",
        "a linear array, more than one charge diameter apart, detonated at once",
    )  # fmt: skip
    yield Rule(
        "Open detonation of waste explosives, to the property of others", "fragments", _waste(mass),
        "40 CFR 265.382", "204 m to 100 lb, 380 m to 1,000 lb, 530 m to 10,000 lb, 690 m to 30,000 lb", explosive,
        "up to 30,000 lb (13.6 t)",
    )  # fmt: skip
    yield Rule(
        "Inhabited building distance, K 40", "blast",
        40.0 * FOOT / POUND ** (1.0 / 3.0) * mass ** (1.0 / 3.0) if mass < 1e5 * POUND else None,
        "DoD 6055.9, as quoted by Swisdak, A Consequence Minimization Approach to Explosive Siting",
        "40 W^(1/3) ft with W in lb: 15.87 Q^(1/3) m", explosive, "blast alone, 8.1 kPa; to 100,000 lb (45 t)",
    )  # fmt: skip
    tnt = "; ".join((f"TNT equivalent {contents.tnt:.3g} kg", *contents.equivalents))
    for pressure in _PRESSURES:
        yield Rule(
            f"Peak incident overpressure {pressure / 1e3:g} kPa (a level of IATG 02.20, Table 8)", "blast",
            pressure_distance(contents.tnt, pressure),
            "Kingery and Bulmash 1984, as fitted by Swisdak 1994 (DTIC ADA526744), Table 1",
            "hemisphere of TNT on the ground", tnt, "0.2 to 198.5 m/kg^(1/3); casing and height not considered",
        )  # fmt: skip
    yield Rule(
        "Danger area of bare explosive", "blast", 130.0 * mass ** (1.0 / 3.0), danger, "130 M^(1/3) m", explosive,
        "bare explosive",
    )  # fmt: skip


def _waste(mass: float) -> float | None:
    for pounds, metres in ((100.0, 204.0), (1000.0, 380.0), (10_000.0, 530.0), (30_000.0, 690.0)):
        if mass <= pounds * POUND:
            return metres
    return None


def tnt_equivalent(explosive: str) -> tuple[float, str]:
    """Equivalent of an explosive in TNT for peak pressure, and words on it (empty for TNT itself).

    An explosive that is not in the table has the largest equivalent that is: its blast distances are then rather too
    long.
    """
    factor = value_for(explosive, _TNT)
    if factor is None:
        return _TNT[_LARGEST], (
            f"{_TNT[_LARGEST]:g} for {explosive}, whose equivalent is not known: the largest known one, of {_LARGEST}"
        )
    return factor, f"{factor:g} for {explosive}" if factor != 1.0 else ""


def contents_of(case: Case, summary: Mapping[str, Any]) -> Contents | None:
    """What a resolved case's rounds hold, images behind planes of symmetry too; None for fragments from another source.

    Rounds from mesh files take their masses from the burst's part of summary.json.
    """
    from fragfield.case.conversion.stages import burst_round
    from fragfield.hazard.arrangement import with_images

    if not case.round:
        return None
    images = len(with_images(case)) // len(case.round)
    burst = {str(one.get("name")): one for one in (summary.get("burst") or {}).get("rounds") or []}
    explosive = tnt = all_up = heaviest = 0.0
    words = []
    for number, entry in enumerate(case.round, start=1):
        one = burst_round(entry, f"round[{number}]")
        if one.profile is not None:
            charge = one.profile.charge_volume * one.explosive.density
            whole = charge + one.profile.casing_volume * one.casing.density + one.profile.fuze_mass
        elif entry.name in burst:
            charge = float(burst[entry.name]["charge_mass"])
            whole = charge + float(burst[entry.name]["casing_mass"])
        else:
            return None
        factor, said = tnt_equivalent(one.explosive.name)
        if said:
            words.append(said)
        explosive, all_up = explosive + images * charge, all_up + images * whole
        tnt, heaviest = tnt + images * charge * factor, max(heaviest, whole)
    return Contents(explosive, tnt, all_up, heaviest, images * len(case.round), tuple(dict.fromkeys(words)))


def rules_of(case: Case, summary: Mapping[str, Any], single: SingleRound) -> dict[str, Any] | None:
    """The part `rules` of summary.json; None where the case has no rounds. `single` is one of its rounds alone."""
    contents = contents_of(case, summary)
    if contents is None:
        return None
    part = tp12_part(case, single)
    rules = [*tp12_rules(case, part), *rules_for(contents)]
    return {
        "contents": asdict(contents),
        "tp12": part,
        "rules": [asdict(rule) for rule in rules],
        "left_out": list(LEFT_OUT),
    }
