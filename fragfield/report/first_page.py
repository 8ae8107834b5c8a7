"""What was computed, as the first page says it: rounds, attitude, site, criterion, cells."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from fragfield.case.conversion.attitude import attitude_of, attitude_words
from fragfield.case.conversion.surroundings import air_words, wind_words
from fragfield.numbers import Row, number
from fragfield_base.substances import substance_title

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fragfield.case import CaseTable
    from fragfield.results.run import StoredRun


def what_was_computed(run: StoredRun) -> Iterator[Row]:
    """The rows of the arrangement and its site: "What was computed"."""
    case = run.values
    if run.fragments_file is not None:
        yield Row("Fragments", f"of {run.fragments_file}; no burst was computed")
    else:
        yield from _rounds(run)
    rules, hazard = run.summary.rules, run.summary.hazard
    if contents := rules.contents if rules else None:
        yield Row(
            "Net explosive quantity",
            f"{number(contents.explosive, 3)} kg (TNT equivalent {number(contents.tnt, 3)} kg)",
        )
    if hazard is not None:
        yield Row("Attitude and height", attitude_words(hazard.attitude))
    elif case is not None:
        yield Row("Attitude and height", attitude_words(attitude_of(case, given=run.fragments_file is not None)))
    if case is None:
        return
    yield from _site(case)
    criteria = run.criteria
    yield Row("Criterion", f"{criteria.energy:.3g} J, 1 per {1.0 / criteria.density:.1f} m²")
    if case.burst is not None and run.fragments_file is None:
        size = f"{number(1e3 * case.burst.cell_size, 3)} mm"
        yield Row("Cell size", f"{size}; grid convergence: {case.burst.convergence}")
    if hazard is not None:
        yield Row("Realisations", number(hazard.realisations))


def _rounds(run: StoredRun) -> Iterator[Row]:
    kinds: dict[tuple[str, str, str], list[str]] = {}
    for item in run.rounds:
        casing, charge = number(item.casing_mass, 3), number(item.charge_mass, 3)
        entry = next((one for one in (run.values.round if run.values else []) if one.name == item.name), None)
        named = getattr(entry, "casing", None)
        material = f" of {getattr(named, 'name', named)}" if named is not None else ""
        fill = f"{substance_title(item.explosive)}, {charge} kg"
        kinds.setdefault((item.profile, fill, f"{casing} kg{material}"), []).append(item.name)
    if not kinds:
        yield Row("Round", "this directory contains no burst")
    for (profile, fill, casing), names in kinds.items():
        listed = ", ".join(names) if len(names) <= 4 else f"{names[0]} … {names[-1]} ({len(names)} rounds)"
        yield Row("Round", f"{listed}{f' ({profile})' if profile else ''}{', each' if len(names) > 1 else ''}")
        yield Row("Fill", fill)
        yield Row("Casing", casing)
    if kinds:
        images = sum(bool(one.mirror_of) for one in run.summary.break_up.rounds) if run.summary.break_up else 0
        behind = f"; {number(images)} more behind planes of symmetry" if images else ""
        yield Row("Number of rounds", f"{number(len(run.rounds))}{behind}")


def _site(case: CaseTable) -> Iterator[Row]:
    ground = case.flight.ground
    ricochet = "no ricochet" if ground.ricochet == "none" else f"ricochet off {ground.ricochet.replace('_', ' ')}"
    yield Row("Ground", f"{'map of heights' if ground.map is not None else 'flat'}, {ricochet}")
    yield Row("Wind", wind_words(case))
    yield Row("Air", air_words(case))
    stops = [f"{one.kind} {one.name}" for one in case.obstacle]
    shown = ", ".join(stops) if len(stops) <= 4 else f"{', '.join(stops[:4])} and {len(stops) - 4} more"
    yield Row("Barricades and buildings", shown or "none")
    if case.site is not None:
        latitude, longitude = (math.degrees(angle) for angle in (case.site.latitude, case.site.longitude))
        yield Row("Site", f"{latitude:.5f}°, {longitude:.5f}°")
