"""What a reader must know before using the numbers: findings by stage, the gravest first."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from fragfield.checking.case_warnings import doubts
from fragfield.hazard.verdict import exposed_rounds, exposure_words
from fragfield.numbers import number
from fragfield.pipeline.grid_convergence import KINDS
from fragfield.report.evidence import validation_words
from fragfield.results.words import certainty

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fragfield.results.break_up import FragmentTest, MeanMass
    from fragfield.results.burst import Burst
    from fragfield.results.hazard import Hazard
    from fragfield.results.run import StoredRun


Weight = Literal["stop", "warning", "note", "good"]
"""How grave a finding is."""
_LABELS = {"stop": "Do not use", "warning": "Warning", "note": "Note", "good": "Passed"}


class Finding(NamedTuple):
    """One statement on the run: "stop" (do not use), "warning", "note", or "good" (a check that passed)."""

    weight: Weight
    text: str

    @property
    def label(self) -> str:
        """The weight in a word, so that it does not depend on colour."""
        return _LABELS[self.weight]


_MOST_HOURGLASS = 0.1
_MOST_IMBALANCE = 0.05
_MOST_PASSED = 1e-3  # of the casings' mass, through planes or into other rounds
# Overlaps in contact: name in the summary, what overlaps, and the aim in parts of a cell.
_OVERLAPS = (
    ("max_interface_penetration_at_front", "Charge and casing overlap while a front passes", 0.05),
    ("max_interface_penetration", "Charge and casing overlap after the front has passed", 0.01),
    ("max_collision_penetration", "Colliding surfaces overlap", 0.05),
    ("max_plane_penetration", "Casings penetrate a plane", 0.05),
)


def _limit(run: StoredRun) -> tuple[float, str]:
    """Imbalance of energy above which a burst is not to be used, and its words.

    That at which the burst stops, `burst.energy_tolerance`, but never more than 5 %: a tolerance that was raised so
    that a run ends does not make its numbers right.
    """
    tolerance = run.values.burst.energy_tolerance if run.values is not None and run.values.burst is not None else 1.0
    if tolerance < _MOST_IMBALANCE:
        return tolerance, f"above {number(100 * tolerance, 2)} % (`burst.energy_tolerance`)"
    return _MOST_IMBALANCE, f"above {100 * _MOST_IMBALANCE:g} %"


def ledger_findings(run: StoredRun) -> Iterator[Finding]:
    """How well the energy ledger closes, and what the products gave."""
    if (burst := run.summary.burst) is None:
        return
    limit, above = _limit(run)
    error = abs(burst.energy_error)
    text = (
        f"The energy ledger closes within {number(error * 100, 3)} % of the products' work at most, and within "
        f"{number(abs(burst.energy_error_at_end) * 100, 2)} % at the end"
    )
    if not error <= limit:
        yield Finding("stop", f"{text}; {above} the burst is not computed correctly.")
    elif error > 0.01:
        yield Finding("warning", f"{text}; 1 % is the aim.")
    else:
        yield Finding("good", f"{text} (aim: 1 %).")
    yield from _energy_of_contact(burst, limit, above)
    share = burst.products_balance
    text = (
        f"Work done by the products and energy left in them are {number(share * 100, 4)} % of the charges' heat of "
        "detonation"
    )
    if share > 1.01:
        text += (
            ": more than the charges hold, so that speeds are overestimated (known of the product model `landau`; "
            "compare with `landau_cj` or `jwl`)"
        )
    yield Finding("warning" if share > 1.01 else "good", f"{text}.")
    yield from _hourglass(run)
    if abs(burst.momentum_error) > 1e-9:
        yield Finding("warning", f"Total momentum drifts by {burst.momentum_error:.1e} of the momentum summed.")


def _energy_of_contact(burst: Burst, limit: float, above: str) -> Iterator[Finding]:
    largest, at_end = burst.contact_error, burst.contact_error_at_end
    verb, nothing = ("lost", "took") if burst.contact.gain < 0.0 else ("made", "supplied")
    text = (
        f"Contact has {verb} {number(100 * at_end, 2)} % of the products' work at the end, and at most "
        f"{number(100 * largest, 2)} % of the work done until then: energy that nothing {nothing}"
    )
    if not largest <= limit:
        yield Finding("stop", f"{text}; {above} the burst is not computed correctly.")
    elif at_end > 0.01:
        yield Finding("warning", f"{text}; 1 % is the aim: repeat with smaller cells and compare.")
    elif largest > 0.01:
        yield Finding("note", f"{text}. It was above 1 % for a time, and is not at the end.")
    else:
        yield Finding("good", f"{text} (aim: 1 %).")


def _hourglass(run: StoredRun) -> Iterator[Finding]:
    taken, work = (run.history.get(name) for name in ("hourglass", "products_work"))
    if taken is None or work is None or not len(work) or not work[-1] > 0.0:
        return
    share = float(taken[-1] / work[-1])
    if share > _MOST_HOURGLASS:
        yield Finding(
            "warning",
            f"Hourglass control took {number(100 * share, 2)} % of the products' work; above 10 % cells fold where "
            "casings meet, and speeds are underestimated: repeat with smaller cells or quadrature = “full”.",
        )


def burst_findings(run: StoredRun) -> Iterator[Finding]:
    """Lost and folded cells, torn metal, thin walls, contact, and an end of the burst that comes too early."""
    if (burst := run.summary.burst) is None:
        return
    folded, casing = burst.folded_casing_mass, burst.casing_mass
    if lost := burst.lost_cells:
        cells = burst.symmetry.all_cells or burst.cells
        were = "was" if lost == 1 else "were"
        text = f"{number(lost)} of {number(cells)} cells {were} lost ({100 * lost / cells:.2g} %)"
        yield Finding("stop" if lost > 0.01 * cells else "warning", f"{text}: they became too distorted.")
    elif not folded:
        inner = burst.folded_cells
        lie = "cell lies" if inner == 1 else "cells lie"
        beside = f"; {number(inner)} folded {lie} in the products" if inner else ""
        yield Finding("good", f"No cell was lost, and no cell of a casing is folded{beside}.")
    if folded and casing:
        yield Finding(
            "warning",
            f"{number(folded, 3)} kg of the casings ({100 * folded / casing:.2g} %) is folded at the end of the burst "
            "(inverted at a corner), eroded metal apart; results there are not reliable.",
        )
    if (released := burst.released_casing_mass) and casing:
        yield Finding(
            "note",
            f"{number(released, 3)} kg of the casings ({100 * released / casing:.2g} %) is torn metal at the end: "
            "without strength, and folded, flattened or expanded to more than twice its volume. Its stresses were "
            "set to zero; it keeps its mass and momentum; single speeds in it are not reliable.",
        )
    yield from _contact_findings(run, burst)
    yield from _passed_findings(run, burst)
    yield from _unreacted(burst)
    if burst.acceleration_complete is None:
        left = burst.acceleration_left
        how = f": {number(100 * left, 2)} % of its kinetic energy would still come" if left is not None else ""
        yield Finding(
            "warning",
            f"The acceleration of the casings is not complete at the end of the burst{how}. Speeds are those at that "
            "time: underestimated, or those of casings that still collide.",
        )


def _unreacted(burst: Burst) -> Iterator[Finding]:
    for one in burst.rounds:
        if not one.ignition:
            yield Finding(
                "warning",
                f"Round “{one.name}” was never initiated: its charge did not detonate within the computed time, and "
                "its casing is not that of a detonated round.",
            )
        elif one.products_balance < 0.5:
            yield Finding(
                "warning",
                f"Round “{one.name}” gave {number(100 * one.products_balance, 2)} % of its charge's heat of "
                "detonation: it was initiated late, in part, or not at all, and its casing is not that of a detonated "
                "round.",
            )
        if one.ignition and one.ignition[0].by == "shock":
            loading = f" ({exposure_words(one.exposure)})" if one.exposure else ""
            yield Finding(
                "note",
                f"Round “{one.name}” was initiated by shock, at {number(1e6 * one.ignition[0].time, 3)} µs{loading}. "
                "Whether and when a shock initiates a charge depends on `initiation` and on the cell size: repeat with "
                "other values of both.",
            )
    for name, exposure, initiated in exposed_rounds(burst.rounds):
        if not initiated:
            yield Finding(
                "note" if exposure.verdict == "below" and exposure.resolved else "warning",
                f"Round “{name}” was not initiated: {exposure_words(exposure)}. The criterion of critical energy is "
                "one of short plane shocks; it does not cover fragments, friction, fire and delayed reaction: a round "
                "below it is not therefore safe.",
            )


def _contact_findings(run: StoredRun, burst: Burst) -> Iterator[Finding]:
    overlaps = [(words, float(getattr(burst.contact, name)), aim) for name, words, aim in _OVERLAPS]
    size = burst.cell_size
    if run.values is not None and not run.values.plane:
        own = "a plane of symmetry (found by the program)"
        overlaps = [(words.replace("a plane", own), value, aim) for words, value, aim in overlaps]
    deep = [(words, value / size, aim) for words, value, aim in overlaps if value > aim * size]
    for words, share, aim in deep:
        yield Finding("warning", f"{words} by up to {100 * share:.1f} % of a cell; {100 * aim:g} % is the aim.")
    largest = max(value for _, value, _ in overlaps) / size
    if not deep and largest > 0:
        yield Finding("good", f"Surfaces in contact overlap by at most {100 * largest:.2g} % of a cell.")


def _passed_findings(run: StoredRun, burst: Burst) -> Iterator[Finding]:
    if run.values is None or not (run.values.plane or len(run.values.round) > 1):
        return
    passed = burst.passed_through
    planes, rounds = passed.largest_beyond_planes, passed.largest_in_other_rounds
    share = passed.largest_together / burst.casing_mass
    if share > _MOST_PASSED:
        yield Finding(
            "warning",
            f"{100 * share:.2g} % of the casings' mass passed through contact: up to {number(1e3 * planes, 2)} g lay "
            f"behind a plane and {number(1e3 * rounds, 2)} g within another round; at 1 % the burst stops.",
        )
    else:
        words = "No metal" if not planes + rounds else f"No more than {100 * share:.2g} % of the metal"
        yield Finding("good", f"{words} of the casings passed through a plane or into another round.")


_REJECTED = 0.05  # of probability; the break-up widens the standard error there
_COMPLETE = (0.8, 1.05)  # mass of the pieces over that of the law in the same range


def break_up_findings(run: StoredRun) -> Iterator[Finding]:
    """Mass, momentum and energy of the fragments against the burst, and how well the mean mass is known."""
    if (broken := run.summary.break_up) is None:
        return
    if abs(mass := broken.mass_error) > 1e-6:
        yield Finding(
            "warning",
            f"Fragments hold {number(100 * abs(mass), 3)} % {'less' if mass < 0 else 'more'} mass than the casing"
            + (" (the graded sampler drops the heaviest, which fly farthest)." if mass < 0 else "."),
        )
    for value, what in ((broken.momentum_error, "momentum"), (broken.energy_error, "kinetic energy")):
        if abs(value) > 0.05:
            yield Finding("note", f"Fragments carry {what} that differs by {100 * abs(value):.2g} % from the burst.")
    mean = broken.mean_mass
    yield from _by_law(mean) if mean.test is None else _counted(mean, mean.test)


def _by_law(mean: MeanMass) -> Iterator[Finding]:
    law = "is given" if mean.law == "given" else f"follows the law “{mean.law}”"
    own = mean.factor_source == "input"
    if mean.factor is None:
        stated = f"No factor of its uncertainty is stated: {mean.factor_source}. Set `break_up.mean_mass_factor`."
    else:
        source = "as given in the case" if own else mean.factor_source
        known = "Where published data are near, it" if mean.outside_data and not own else "It"
        stated = (
            f"{known} is uncertain by a factor of {number(mean.factor, 3)} either way (one geometric standard "
            f"deviation; {source}): repeat the break-up with it multiplied and divided by this factor, and compare "
            "the distances."
        )
    yield Finding("note", f"The mean fragment mass {law}. {stated}")
    by_round: dict[str, list[str]] = {}
    for one in mean.outside_data:
        by_round.setdefault(one.round, []).append(one.text)
    for name, texts in by_round.items():
        end = "" if own else " No stated factor covers it."
        text = f"No published mean fragment masses are close to round “{name}”: {'; '.join(texts)}.{end}"
        yield Finding("warning", text)


def _counted(mean: MeanMass, test: FragmentTest) -> Iterator[Finding]:
    recovered, in_range, factor = test.recovered_fraction, test.fraction_in_range, number(mean.factor, 3)
    several = "" if test.rounds == 1.0 else f" of {number(test.rounds, 3)} rounds"
    uncertain = (
        f"The case gives a factor of {factor} for its uncertainty."
        if mean.factor_source == "input"
        else f"It is uncertain by a factor of {factor} either way; from round to round it may scatter more."
    )
    hold = "" if recovered is None else (
        f" The pieces hold {number(100.0 * recovered, 3)} % of the casing's mass, where the law has "
        f"{number(100.0 * in_range, 3)} % in their range of masses."
    )  # fmt: skip
    yield Finding(
        "note",
        f"The mean fragment mass is fitted to {test.source}, {test.what}{several}, standard error "
        f"{number(100.0 * test.standard_error, 2)} %: {number(1e3 * test.mean, 3)} g, {number(test.scale, 3)} times "
        f"that of Mott's law (Eq. 21), whose ratios between segments it keeps.{hold} {uncertain}",
    )
    share, margin = None if recovered is None else recovered / in_range, test.mass_margin
    if share is not None and not _COMPLETE[0] / margin <= share <= _COMPLETE[1] * margin:
        why = (
            "pieces were lost, and the fit holds only if light and heavy ones were lost alike"
            if share < 1.0
            else "they may be of the fuze or of another round, or the law has too few heavy ones"
        )
        text = f"The pieces of {test.source} hold {number(100.0 * share, 3)} % of the law's mass in their range: {why}."
        yield Finding("warning", text)
    if test.probability is not None and test.probability < _REJECTED:
        worst = max(counted_groups(test), key=lambda one: (one[1] - one[2]) ** 2 / max(one[2], 5.0))
        widened = test.standard_error / test.curvature_error
        yield Finding(
            "warning",
            f"Mott's law does not describe the pieces of {test.source}: chi-square {number(test.chi_square, 3)} with "
            f"{test.degrees_of_freedom} degrees of freedom (probability {number(100.0 * test.probability, 2)} %). "
            f"Most out of line: {worst[0]} g, {number(worst[1], 4)} counted, {number(worst[2], 4)} expected. The "
            f"standard error is widened {number(widened, 2)} times for it. Compare the numbers of the heavy pieces, "
            "which decide the distance.",
        )


def counted_groups(test: FragmentTest) -> list[tuple[str, float, float]]:
    """Range of mass in g, pieces counted and pieces expected."""
    edges = [1e3 * edge for edge in test.edges if edge is not None]
    names = [f"{number(low, 3)} to {number(high, 3)}" for low, high in pairwise(edges)]
    if len(names) < len(test.number):
        names.append(f"above {number(edges[-1], 3)}")
    return list(zip(names, test.number, test.expected, strict=True))


_SMALLER = "smaller cells reduce it (burst.cell_size)"
_ADVICE = {
    "statistical": "the sizes differ within their statistical error, so that more realisations reduce it (a smaller "
    "hazard.tolerance) and smaller cells do not",
    "oscillating": "the sizes differ to both sides, which is in the recommended distance, and a further size need not "
    "reduce it",
    "diverging": "the sizes do not converge, and what they differ by is in the recommended distance",
}
_MOST_TOLERANCES = 3.0  # of hazard.tolerance, that the cells may add


def flight_findings(run: StoredRun) -> Iterator[Finding]:
    """Certainty of the distance, and fragments outside the drag table or still in the air."""
    if run.summary.hazard:
        yield from _certainty(run.summary.hazard)
    if (flight := run.summary.flight) is None or not flight.fragments:
        return
    flown = number(flight.fragments)
    if flight.above_drag_table:
        yield Finding(
            "warning",
            f"{number(flight.above_drag_table)} of {flown} fragments were faster than the end of the drag table "
            f"“{flight.drag}”; its last coefficient was used there.",
        )
    if held := flight.status.stopped.fragments:
        yield Finding("note", f"{number(held)} of {flown} fragments were stopped by obstacles.")
    if (left := flight.fragments - flight.landed - held) > 0:
        yield Finding("note", f"{number(left)} of {flown} fragments did not land.")


def _certainty(hazard: Hazard) -> Iterator[Finding]:
    words = certainty(hazard)
    if words or hazard.standard_error is None:
        yield Finding("warning" if hazard.determined else "stop", f"{words[0].upper()}{words[1:]}.")
        return
    share = 100 * hazard.standard_error / hazard.expected if hazard.expected else 0.0
    good = {
        "integral": "The expected density is an integral: no random number is in the distance.",
        "weighted_fragments": f"Weighted fragments fix the expected distance to {share:.1f} % (standard error); the "
        "case's seed is not in it.",
        "realisations": f"{number(hazard.realisations)} realisations fix the expected distance to {share:.1f} % "
        f"(standard error; `hazard.tolerance` asks for {100 * hazard.tolerance:g} %).",
    }
    yield Finding("good", good[hazard.method])
    bias = hazard.max_bias or 0.0
    if hazard.expected and bias > 0.5 * hazard.standard_error:
        share = 100 * bias / hazard.expected
        text = f"Taking the worst direction makes the expected distance {share:.1g} % too large, which is taken off it."
        yield Finding("note", text)


def convergence_findings(run: StoredRun) -> Iterator[Finding]:
    """How far the cells, apart from randomness, leave the expected distance open."""
    found, hazard = run.summary.convergence, run.summary.hazard
    if found is None or hazard is None or not hazard.determined:
        return
    entry = (found.quantities or {}).get("expected_distance")
    if entry is None or entry.uncertainty is None or not hazard.expected:
        if found.reason:
            yield Finding("note", f"{found.reason[0].upper()}{found.reason[1:]}.")
        return
    share, tolerance = entry.uncertainty / hazard.expected, hazard.tolerance
    text = f"The cell size leaves the expected distance uncertain by {number(100.0 * share, 2)} %"
    if share > _MOST_TOLERANCES * tolerance:
        text += f" ({KINDS[entry.kind]}), several times `hazard.tolerance` ({100.0 * tolerance:g} %)"
        yield Finding("warning", f"{text}: {_ADVICE.get(entry.kind, _SMALLER)}.")
    else:
        yield Finding("good", f"{text} (grid convergence, in addition to its statistical error).")


def imprint_findings(run: StoredRun) -> Iterator[Finding]:
    """Numbers that differ between neighbouring sectors far more than randomness explains: the mesh may show."""
    for witness in run.summary.witness or ():
        hits = np.array([sector.hits for sector in witness.by_azimuth], dtype=float)
        if len(hits) < 12 or hits.mean() < 5:
            continue
        # A count's variance is its mean; less the mean of two neighbours it is 3/2 of that. Fragments fill the casing
        # without gaps, which alone makes it two to three times as much.
        jump = hits - 0.5 * (np.roll(hits, 1) + np.roll(hits, -1))
        ratio = float(np.mean(jump**2) / (1.5 * hits.mean()))
        if ratio > 6.0:
            yield Finding(
                "warning",
                f"Numbers by azimuth on “{witness.name}” differ between neighbouring sectors "
                f"{math.sqrt(ratio):.1f} times as much as independent counts would: directions may be affected by the "
                "mesh. Judge single sectors only with smaller cells, or use wider sectors.",
            )


_ORDER: dict[Weight, int] = {"stop": 0, "warning": 1, "note": 2, "good": 3}
_JUDGED = {"certainty", "contact_energy", "drag_table", "no_end", "passed_through", "rounds_alone"}
"""Codes of recorded warnings whose matter is judged here from numbers."""


def findings(run: StoredRun) -> list[Finding]:
    """All findings of a run, the gravest first."""
    found = [] if not run.missing else [
        Finding("warning", f"Not yet run: {', '.join(run.missing)}. Results that depend on it are missing below.")
    ]  # fmt: skip
    judges = (
        ledger_findings,
        burst_findings,
        break_up_findings,
        flight_findings,
        imprint_findings,
        convergence_findings,
    )
    found += [one for judge in judges for one in judge(run)]
    said = list(doubts(run.values, burst=run.fragments_file is None)) if run.values is not None else []
    said += [one.text for one in run.summary.findings if one.code not in _JUDGED]
    found += [Finding("warning", _sentence(text)) for text in dict.fromkeys(said)]
    if run.provenance:
        found.append(Finding(*validation_words(run)))
    return sorted(found, key=lambda item: _ORDER[item.weight])


def _sentence(text: str) -> str:
    """A text with a full stop, and with a capital letter unless it begins with a key of the case."""
    first = text[0] if "." in text.partition(" ")[0] else text[0].upper()
    return f"{first}{text[1:]}{'' if text.endswith('.') else '.'}"
