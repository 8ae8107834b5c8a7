"""Findings on break-up, flight and distance: mean mass, certainty, convergence, imprint of the mesh."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.hazard.certainty import certainty
from fragfield.numbers import number
from fragfield.pipeline.grid_convergence import KINDS
from fragfield.report.blocks import Finding
from fragfield.report.tables.counted import counted_findings
from fragfield.results.hazard import Hazard

if TYPE_CHECKING:
    from collections.abc import Mapping

    from fragfield.report.reading.run_files import RunFiles


_SMALLER = "smaller cells reduce it (burst.cell_size)"
_ADVICE = {
    "statistical": "the sizes differ within their statistical error, so that more realisations reduce it (a smaller "
    "hazard.tolerance) and smaller cells do not",
    "oscillating": "the sizes differ to both sides, which is in the recommended distance, and a further size need not "
    "reduce it",
    "diverging": "the sizes do not converge, and what they differ by is in the recommended distance",
}
_MOST_TOLERANCES = 3.0  # of hazard.tolerance, that the cells may add


def break_up_findings(run: RunFiles) -> list[Finding]:
    """Mass, momentum and energy of the fragments against the burst, and how well the mean mass is known."""
    part = run.part("break_up")
    found: list[Finding] = []
    mass = value_of(part, "mass_error")
    if mass is not None and abs(mass) > 1e-6:
        found.append(
            Finding(
                "warning",
                f"Fragments hold {number(100 * abs(mass), 3)} % {'less' if mass < 0 else 'more'} mass than the casing"
                + (" (the graded sampler drops the heaviest, which fly farthest)." if mass < 0 else "."),
            )
        )
    for name, what in (("momentum_error", "momentum"), ("energy_error", "kinetic energy")):
        value = value_of(part, name)
        if value is not None and abs(value) > 0.05:
            found.append(
                Finding("note", f"Fragments carry {what} that differs by {100 * abs(value):.2g} % from the burst.")
            )
    return [*found, *_mean_mass(part.get("mean_mass"))]


def _mean_mass(part: dict[str, Any] | None) -> list[Finding]:
    """How well the mean fragment mass is known, and where no data are near; nothing before the break-up."""
    if part is None:
        return []
    if "test" in part:
        return list(counted_findings(part["test"], part["factor"], own_factor=part["factor_source"] == "input"))
    law = "is given" if part["law"] == "given" else f"follows the law “{part['law']}”"
    own = part["factor_source"] == "input"
    if part["factor"] is None:
        stated = f"No factor of its uncertainty is stated: {part['factor_source']}. Set `break_up.mean_mass_factor`."
    else:
        source = "as given in the case" if own else part["factor_source"]
        known = "Where published data are near, it" if part["outside_data"] and not own else "It"
        stated = (
            f"{known} is uncertain by a factor of {number(float(part['factor']), 3)} either way (one geometric "
            f"standard deviation; {source}): repeat the break-up with it multiplied and divided by this factor, and "
            "compare the distances."
        )
    found = [Finding("note", f"The mean fragment mass {law}. {stated}")]
    by_round: dict[str, list[str]] = {}
    for one in part["outside_data"]:
        by_round.setdefault(str(one["round"]), []).append(str(one["text"]))
    found += [
        Finding(
            "warning",
            f"No published mean fragment masses are close to round “{name}”: {'; '.join(texts)}."
            + ("" if own else " No stated factor covers it."),
        )
        for name, texts in by_round.items()
    ]
    return found


def flight_findings(run: RunFiles) -> list[Finding]:
    """Certainty of the distance, and fragments outside the drag table or still in the air."""
    part = run.part("flight")
    found: list[Finding] = []
    if hazard := run.part("hazard"):
        found += _certainty(hazard)
    beyond, flown = value_of(part, "above_drag_table"), value_of(part, "fragments")
    if beyond and flown:
        found.append(
            Finding(
                "warning",
                f"{number(int(beyond))} of {number(int(flown))} fragments were faster than the end of the drag table "
                f"“{part.get('drag', '')}”; its last coefficient was used there.",
            )
        )
    flown, landed = value_of(part, "fragments"), value_of(part, "landed")
    if flown and landed is not None:
        held = int(((part.get("status") or {}).get("stopped") or {}).get("fragments", 0))
        if held:
            found.append(
                Finding("note", f"{number(held)} of {number(int(flown))} fragments were stopped by obstacles.")
            )
        if flown - landed - held > 0:
            text = f"{number(int(flown - landed) - held)} of {number(int(flown))} fragments did not land."
            found.append(Finding("note", text))
    return found


def _certainty(hazard: Mapping[str, Any]) -> list[Finding]:
    """Whether the distance is determined, and whether there are enough realisations."""
    words = certainty(Hazard.read(hazard))
    if not hazard["determined"]:
        return [Finding("stop", f"{words[0].upper()}{words[1:]}.")]
    if words:
        return [Finding("warning", f"{words[0].upper()}{words[1:]}.")]
    share = hazard["standard_error"] / hazard["expected"] if hazard["expected"] else 0.0
    text = f"{number(int(hazard['realisations']))} realisations fix the expected distance to {100 * share:.1f} %"
    found = [Finding("good", f"{text} (standard error; `hazard.tolerance` asks for {100 * hazard['tolerance']:g} %).")]
    if hazard.get("method") == "integral":
        found = [Finding("good", "The expected density is an integral: no random number is in the distance.")]
    if hazard.get("method") == "weighted_fragments":
        text = f"Weighted fragments fix the expected distance to {100 * share:.1f} % (standard error)"
        found = [Finding("good", f"{text}; the case's seed is not in it.")]
    if hazard["expected"] and hazard["max_bias"] > 0.5 * hazard["standard_error"]:
        share = 100 * hazard["max_bias"] / hazard["expected"]
        text = f"Taking the worst direction makes the expected distance {share:.1g} % too large, which is taken off it."
        found.append(Finding("note", text))
    return found


def convergence_findings(run: RunFiles) -> list[Finding]:
    """How far the cells, apart from randomness, leave the expected distance open."""
    part, hazard = run.part("convergence"), run.part("hazard")
    entry = (part.get("quantities") or {}).get("expected_distance")
    if not part or not hazard or not hazard.get("determined"):
        return []
    if entry is None or entry["uncertainty"] is None or not hazard.get("expected"):
        return [Finding("note", f"{part['reason'][0].upper()}{part['reason'][1:]}.")] if part.get("reason") else []
    share, tolerance = entry["uncertainty"] / hazard["expected"], hazard["tolerance"]
    text = f"The cell size leaves the expected distance uncertain by {number(100.0 * share, 2)} %"
    if share > _MOST_TOLERANCES * tolerance:
        text += f" ({KINDS[entry['kind']]}), several times `hazard.tolerance` ({100.0 * tolerance:g} %)"
        return [Finding("warning", f"{text}: {_ADVICE.get(entry['kind'], _SMALLER)}.")]
    return [Finding("good", f"{text} (grid convergence, in addition to its statistical error).")]


def imprint_findings(run: RunFiles) -> list[Finding]:
    """Numbers that differ between neighbouring sectors far more than randomness explains: the mesh may show."""
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
                    f"Numbers by azimuth on “{witness.get('name', '')}” differ between neighbouring sectors "
                    f"{math.sqrt(ratio):.1f} times as much as independent counts would: directions may be "
                    "affected by the "
                    "mesh. Judge single sectors only with smaller cells, or use wider sectors.",
                )
            )
    return found


def counted(count: int, noun: str) -> str:
    """A count with its noun, in the plural where it is one."""
    return f"{number(count)} {noun}{'' if count == 1 else 's'}"


def value_of(part: Mapping[str, Any], name: str) -> float | None:
    """A number of a table of summary.json; None where there is none."""
    found = part.get(name)
    return float(found) if isinstance(found, (int, float)) and not isinstance(found, bool) else None
