"""What a reader must know before using the numbers: the run's own warnings, in order of weight."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.case.checks.bounds import outside_soft
from fragfield.hazard.certainty import certainty
from fragfield.hazard.shock_exposure import exposed_rounds, exposure_words
from fragfield.report.blocks import Finding
from fragfield.report.findings.validation_status import read_record, validation_words
from fragfield.report.quantities import number
from fragfield.report.reading.mesh_quality import scaled_jacobian
from fragfield.report.tables.ignition import initiated_by_shock, never_initiated

if TYPE_CHECKING:
    from fragfield.report.blocks import Weight
    from fragfield.report.reading.run_files import RunFiles

__all__ = ["findings"]

_ORDER: dict[Weight, int] = {"stop": 0, "warning": 1, "note": 2, "good": 3}
_MOST_PASSED = 1e-3  # of the casings' mass, through planes or into other rounds
_MOST_HOURGLASS = 0.1
_MOST_TOLERANCES = 3.0  # of hazard.tolerance, that the cells may add
_JUDGED = {"certainty", "drag_table", "passed_through", "rounds_alone"}
"""Codes of recorded warnings whose matter is judged here from numbers."""


def findings(run: RunFiles) -> list[Finding]:
    """All findings of a run, the gravest first."""
    found = [*_stages(run), *_ledger(run), *_burst(run), *_break_up(run), *_flight(run), *_imprint(run)]
    found += [*_grid_convergence(run), *_recorded(run)]
    if run.provenance:
        version = (run.provenance.get(key, "") for key in ("program_version", "revision"))
        found.append(Finding(*validation_words(read_record(), *version)))
    return sorted(found, key=lambda item: _ORDER[item.weight])


def _counted(count: int, noun: str) -> str:
    """A count with its noun, in the plural where it is one."""
    return f"{number(count)} {noun}{'' if count == 1 else 's'}"


def _value(part: dict[str, Any], name: str) -> float | None:
    found = part.get(name)
    return float(found) if isinstance(found, (int, float)) and not isinstance(found, bool) else None


def _stages(run: RunFiles) -> list[Finding]:
    if not run.missing:
        return []
    names = ", ".join(run.missing)
    return [Finding("warning", f"Not yet run: {names}. What rests on it is missing below.")]


def _ledger(run: RunFiles) -> list[Finding]:
    part = run.part("burst")
    found: list[Finding] = []
    error = _value(part, "energy_error")
    if error is not None:
        text = f"The energy ledger closes within {number(abs(error) * 100, 3)} % of the products' work"
        at_end = _value(part, "energy_error_at_end")
        if at_end is not None:
            text += f" at its worst, within {number(abs(at_end) * 100, 2)} % at the end"
        if not abs(error) <= 0.05:
            found.append(Finding("stop", f"{text}; above 5 % the burst is not computed correctly."))
        elif abs(error) > 0.01:
            found.append(Finding("warning", f"{text}; 1 % is the aim."))
        else:
            found.append(Finding("good", f"{text} (aim: 1 %)."))
    share = _value(part, "products_balance")
    if share is not None:
        text = f"Work done by the products and energy left in them are {number(share * 100, 4)} % of the charges' heat"
        if share > 1.01:
            found.append(
                Finding(
                    "warning",
                    f"{text} of detonation: more than the charges hold, so that speeds are on the high side "
                    "(known of the product model `landau`; compare with `landau_cj` or `jwl`).",
                )
            )
        else:
            found.append(Finding("good", f"{text} of detonation."))
    found += _hourglass(run)
    momentum = _value(part, "momentum_error")
    if momentum is not None and abs(momentum) > 1e-9:
        found.append(Finding("warning", f"Total momentum drifts by {momentum:.1e} of the momentum summed."))
    return found


def _hourglass(run: RunFiles) -> list[Finding]:
    """Whether the control of hourglass modes, no physics, took a share of the work that shows in the speeds."""
    taken, work = (run.history.get(name) for name in ("hourglass", "products_work"))
    if taken is None or work is None or not len(work) or not work[-1] > 0.0:
        return []
    share = float(taken[-1] / work[-1])
    if not share > _MOST_HOURGLASS:
        return []
    return [
        Finding(
            "warning",
            f"Hourglass control took {number(100 * share, 2)} % of the products' work; above 10 % cells fold where "
            "casings meet, and speeds are on the low side: repeat with smaller cells or quadrature = “full”.",
        )
    ]


def _burst(run: RunFiles) -> list[Finding]:
    part = run.part("burst")
    found: list[Finding] = []
    folded = _folded_casing_cells(run)
    lost, cells = _value(part, "lost_cells"), _value(part.get("symmetry") or part, "all_cells") or _value(part, "cells")
    if lost is not None and cells:
        if lost:
            were = "was" if lost == 1 else "were"
            text = f"{number(int(lost))} of {number(int(cells))} cells {were} lost ({100 * lost / cells:.2g} %)"
            found.append(Finding("stop" if lost > 0.01 * cells else "warning", f"{text}: too distorted to compute."))
        elif not folded:
            found.append(Finding("good", "No cell was lost, and none of the casings is folded."))
    if folded:
        found.append(
            Finding(
                "warning",
                f"{_counted(folded, 'cell')} of the casings {'is' if folded == 1 else 'are'} folded at the end of the "
                "burst (a corner turned inside out); what is there is not reliable.",
            )
        )
    released, casing = _value(part, "released_casing_mass"), _value(part, "casing_mass")
    if released and casing:
        found.append(
            Finding(
                "note",
                f"{number(released, 3)} kg of the casings ({100 * released / casing:.2g} %) is torn metal at the end: "
                "without strength, and folded or blown up to more than twice its volume. It gave up its stresses and "
                "flew on with its mass and momentum; single speeds in it are not reliable.",
            )
        )
    size = run.cell_size or math.nan
    walls = [float(np.min(item.segments["wall_thickness"])) for item in run.rounds if len(item.segments)]
    if walls and size > 0:
        across = min(walls) / size
        if across < 3:
            found.append(
                Finding(
                    "warning",
                    f"The thinnest wall ({number(min(walls) * 1e3, 3)} mm) is {across:.1f} cells across; below 3 the "
                    "casing is coarse: repeat with smaller cells and compare.",
                )
            )
    found += [*_contact(run, size), *_passed_through(run), *_unreacted(run)]
    if "acceleration_complete" in part and part["acceleration_complete"] is None:
        growth = _value(part, "kinetic_energy_growth")
        how = (
            f" (kinetic energy grew by {number(100 * growth, 2)} % over the last window)" if growth is not None else ""
        )
        found.append(Finding("warning", f"The casing still accelerates at the end of the burst{how}: speeds are low."))
    return found


# Overlaps in contact: key of the summary, what overlaps, and the aim in parts of a cell.
_OVERLAPS = (
    ("max_interface_penetration_at_front", "Charge and casing overlap while a front passes", 0.05),
    ("max_interface_penetration", "Charge and casing overlap after the front has passed", 0.01),
    ("max_collision_penetration", "Colliding surfaces overlap", 0.05),
    ("max_plane_penetration", "Casings reach through a plane", 0.05),
)


def _contact(run: RunFiles, size: float) -> list[Finding]:
    """How far surfaces in contact overlap, and whether rounds are in contact at all."""
    part = run.part("burst")
    found: list[Finding] = []
    case = run.case
    if case is not None and case.burst is not None and len(case.round) > 1 and not case.burst.contact.surfaces:
        found.append(
            Finding(
                "warning",
                "Contact of surfaces is switched off: every round is computed as if it stood alone, casings pass "
                "through each other, and the distances are not those of a stack.",
            )
        )
    contact = part.get("contact")
    overlaps = [
        (words, value, aim)
        for key, words, aim in _OVERLAPS
        if isinstance(contact, dict) and (value := _value(contact, key)) is not None
    ]
    if not overlaps:
        deepest = part.get("max_penetration")
        keyed = deepest if isinstance(deepest, dict) else None
        values = [_value(keyed, key) for key in keyed] if keyed is not None else [_value(part, "max_penetration")]
        overlaps = [("Surfaces in contact overlap", value, 0.05) for value in values if value is not None]
    if not overlaps or not size > 0:
        return found
    deep = [(words, value / size, aim) for words, value, aim in overlaps if value > aim * size]
    found += [
        Finding("warning", f"{words} by up to {100 * share:.1f} % of a cell; {100 * aim:g} % is the aim.")
        for words, share, aim in deep
    ]
    largest = max(value for _, value, _ in overlaps) / size
    if not deep and largest > 0:
        found.append(Finding("good", f"Surfaces in contact overlap by at most {100 * largest:.2g} % of a cell."))
    return found


def _passed_through(run: RunFiles) -> list[Finding]:
    """Whether metal of the casings has passed through planes or into other rounds."""
    part = run.part("burst")
    passed, casing = part.get("passed_through"), _value(part, "casing_mass")
    if (
        not isinstance(passed, dict)
        or not casing
        or run.case is None
        or not (run.case.plane or len(run.case.round) > 1)
    ):
        return []
    planes, rounds = (_value(passed, key) or 0.0 for key in ("largest_beyond_planes", "largest_in_other_rounds"))
    share = (_value(passed, "largest_together") or 0.0) / casing
    if share > _MOST_PASSED:
        text = (
            f"{100 * share:.2g} % of the casings' mass passed through contact: up to {number(1e3 * planes, 2)} g lay "
            f"behind a plane and {number(1e3 * rounds, 2)} g within another round; at 1 % the burst stops."
        )
        return [Finding("warning", text)]
    words = "No metal" if not planes + rounds else f"No more than {100 * share:.2g} % of the metal"
    return [Finding("good", f"{words} of the casings passed through a plane or into another round.")]


def _unreacted(run: RunFiles) -> list[Finding]:
    """Rounds that were never initiated, that a shock initiated, or whose products gave less than half its heat."""
    unreacted = never_initiated(run)
    found = [
        Finding(
            "warning",
            f"Round “{name}” was never initiated: its charge did not detonate in the time computed, and its casing is "
            "not that of a detonated round.",
        )
        for name in unreacted
    ]
    found += [
        Finding(
            "note" if exposure["verdict"] == "below" and exposure["resolved"] else "warning",
            f"Round “{name}” was not initiated: {exposure_words(exposure)}. The criterion of critical energy is one of "
            "plane, short shocks; it knows nothing of fragments, friction, fire and later reaction: a round below it "
            "is not thereby safe.",
        )
        for name, exposure, initiated in exposed_rounds(run.part("burst"))
        if not initiated
    ]
    shares = [(str(one.get("name")), _value(one, "products_balance")) for one in run.part("burst").get("rounds") or []]
    found += [
        Finding(
            "warning",
            f"Round “{name}” gave {number(100 * share, 2)} % of its charge's heat of detonation: it was initiated "
            "late, in part, or not at all, and its casing is not that of a detonated round.",
        )
        for name, share in shares
        if share is not None and share < 0.5 and name not in unreacted
    ]
    found += [
        Finding(
            "note",
            f"Round “{name}” was initiated by shock, at {number(1e6 * time, 3)} µs. Whether and when a "
            "shock initiates a charge rests on `initiation` and on the cell size: repeat with other values of both.",
        )
        for name, time in initiated_by_shock(run)
    ]
    return found


def _folded_casing_cells(run: RunFiles) -> int:
    if not run.nodes:
        return 0
    return int((scaled_jacobian(run.nodes["position"], run.cells["nodes"][run.cells["part"] == 0]) <= 0.0).sum())


def _break_up(run: RunFiles) -> list[Finding]:
    part = run.part("break_up")
    found: list[Finding] = []
    mass = _value(part, "mass_error")
    if mass is not None and abs(mass) > 1e-6:
        found.append(
            Finding(
                "warning",
                f"Fragments hold {number(100 * abs(mass), 3)} % {'less' if mass < 0 else 'other'} mass than the casing "
                "(the graded sampler drops the heaviest, which fly farthest).",
            )
        )
    for name, what in (("momentum_error", "momentum"), ("energy_error", "kinetic energy")):
        value = _value(part, name)
        if value is not None and abs(value) > 0.05:
            found.append(
                Finding("note", f"Fragments carry {what} that differs by {100 * abs(value):.2g} % from the burst.")
            )
    return [*found, *_mean_mass(part.get("mean_mass"))]


def _mean_mass(part: dict[str, Any] | None) -> list[Finding]:
    """How well the mean fragment mass is known, and where no data are near; nothing for runs of earlier versions."""
    if part is None:
        return []
    law = "is given" if part["law"] == "given" else f"follows the law “{part['law']}”"
    if part["factor"] is None:
        stated = f"No factor of its uncertainty is stated: {part['factor_source']}. Set `break_up.mean_mass_factor`."
    else:
        source = "as given in the case" if part["factor_source"] == "input" else part["factor_source"]
        stated = (
            f"It is uncertain by a factor of {number(float(part['factor']), 3)} either way (one geometric standard "
            f"deviation; {source}): repeat the break-up with it multiplied and divided by this factor, and compare the "
            "distances."
        )
    found = [Finding("note", f"The mean fragment mass {law}. {stated}")]
    by_round: dict[str, list[str]] = {}
    for one in part["outside_data"]:
        by_round.setdefault(str(one["round"]), []).append(str(one["text"]))
    found += [
        Finding(
            "warning",
            f"No published mean masses of fragments are near round “{name}”: {'; '.join(texts)}. No stated factor "
            "covers it.",
        )
        for name, texts in by_round.items()
    ]
    return found


def _flight(run: RunFiles) -> list[Finding]:
    part = run.part("flight")
    found: list[Finding] = []
    if part or run.part("hazard"):
        found += _certainty(run.part("hazard"))
    beyond, flown = _value(part, "above_drag_table"), _value(part, "fragments")
    if beyond and flown:
        found.append(
            Finding(
                "warning",
                f"{number(int(beyond))} of {number(int(flown))} fragments flew faster than the drag table "
                f"“{part.get('drag', '')}” reaches; its last coefficient was used there.",
            )
        )
    flown, landed = _value(part, "fragments"), _value(part, "landed")
    if flown and landed is not None and landed < flown:
        found.append(Finding("note", f"{number(int(flown - landed))} of {number(int(flown))} fragments did not land."))
    return found


def _certainty(hazard: dict[str, Any]) -> list[Finding]:
    """Whether the hazard distance is determined, and whether there are enough realisations."""
    if not hazard:
        text = (
            "This flight was computed by an earlier version, which had no estimate of the hazard distance: fly again."
        )
        return [Finding("stop", text)]
    words = certainty(hazard)
    if not hazard["determined"]:
        return [Finding("stop", f"{words[0].upper()}{words[1:]}.")]
    if words:
        return [Finding("warning", f"{words[0].upper()}{words[1:]}.")]
    text = f"{number(int(hazard['realisations']))} realisations fix the hazard distance to"
    found = [Finding("good", f"{text} {100 * hazard['tolerance']:g} % (standard error).")]
    if hazard["distance"] and hazard["max_bias"] > 0.5 * hazard["standard_error"]:
        share = 100 * hazard["max_bias"] / hazard["distance"]
        text = f"Taking the worst direction may bias the hazard distance by up to {share:.1g} % either way."
        found.append(Finding("note", text))
    return found


def _grid_convergence(run: RunFiles) -> list[Finding]:
    """How far the cells, apart from randomness, leave the hazard distance open."""
    part, hazard = run.part("convergence"), run.part("hazard")
    entry = (part.get("quantities") or {}).get("hazard_distance")
    if not part or not hazard or not hazard.get("determined"):
        return []
    if entry is None or entry["uncertainty"] is None or not hazard.get("distance"):
        return [Finding("note", f"{part['reason'][0].upper()}{part['reason'][1:]}.")] if part.get("reason") else []
    share, tolerance = entry["uncertainty"] / hazard["distance"], hazard["tolerance"]
    text = f"By its cells the hazard distance is uncertain by {number(100.0 * share, 2)} %"
    if share > _MOST_TOLERANCES * tolerance:
        text += (
            f" (grid convergence, values {_trend(entry['kind'])}), several times `hazard.tolerance` "
            f"({100.0 * tolerance:g} %): repeat with smaller cells."
        )
        return [Finding("warning", text)]
    return [Finding("good", f"{text} (grid convergence, beside its statistical error).")]


def _trend(kind: str) -> str:
    """Kind of a grid convergence as part of a sentence."""
    return {
        "monotone": "with an observed order",
        "oscillating": "that oscillate",
        "diverging": "that do not converge",
        "two_sizes": "of two sizes",
        "statistical": "within their statistical errors",
        "constant": "that agree",
    }.get(kind, kind)


def _imprint(run: RunFiles) -> list[Finding]:
    """Numbers that jump between neighbouring sectors far more than randomness explains: the mesh may show."""
    found = []
    for witness in run.witnesses:
        hits = np.array([line.get("hits") or 0 for line in witness.get("by_azimuth") or []], dtype=float)
        if len(hits) < 12 or hits.mean() < 5:
            continue
        # A count's variance is its mean; less the mean of two neighbours it is 3/2 of that. Fragments fill the casing
        # without gaps, which alone makes it two to three times as much.
        jump = hits - 0.5 * (np.roll(hits, 1) + np.roll(hits, -1))
        ratio = float(np.mean(jump**2) / (1.5 * hits.mean()))
        if ratio > 6.0:
            found.append(
                Finding(
                    "warning",
                    f"Numbers by azimuth on “{witness.get('name', '')}” jump between neighbouring sectors "
                    f"{math.sqrt(ratio):.1f} times as much as independent counts would: directions may follow the "
                    "cells. Judge sectors only after smaller cells, or from wider sectors.",
                )
            )
    return found


def _recorded(run: RunFiles) -> list[Finding]:
    """What the case is unusual in, and what the stages warned of, each once."""
    found = list(outside_soft(run.case)) if run.case is not None else []
    records = run.summary.get("findings") or []
    found += [str(one["text"]) for one in records if one["code"] not in _JUDGED]
    return [Finding("warning", _sentence(text)) for text in dict.fromkeys(found)]


def _sentence(text: str) -> str:
    """A text with a capital letter and a full stop."""
    return f"{text[0].upper()}{text[1:]}{'' if text.endswith('.') else '.'}"
