"""The plane section from its runs to its rows."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from transition.law.mean_mass import gurney_speed
from validation.plane_section.check import (
    NAME,
    REFERENCE,
    convergence_rows,
    cylinder_speed,
    delay_rows,
    end_of,
    friction_rows,
    gap_rows,
    mirrored_rows,
    single_rows,
)
from validation.runs import ROOT, STOPPED, StudyError, summary_of
from validation.soundness import sound, void_where_unsound
from validation.stack_trends.check import Focus, focus_of, varied

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from validation.options import Options
    from validation.rows import Row
    from validation.runs import Runs

__all__ = ["study"]


@dataclass
class _Sections:
    """Runs in a section, and the rows of those that are not sound."""

    runs: Runs
    unsound: list[Row] = field(default_factory=list)

    def folder(self, name: str, case: str, size: str, **changes: Any) -> Path:
        """Run one; a row is added for what is not sound."""
        folder = self.runs.run(f"{NAME}_{name}", case, size, changes, stage="burst", geometry="plane")
        checks = sound(NAME, summary_of(folder), REFERENCE["sound"], f"{name} {size}")
        self.unsound += [row for row in checks if row.passed is False]
        return folder

    def row_of(
        self, name: str, size: str, *, count: int = 2, gap: float, delays: Sequence[float] = (), **changes: Any
    ) -> Path:
        """Run so many rounds in a row with a gap (m) and delays (s); `changes` by dotted key."""
        times = list(delays) or [0.0] * count
        text = (ROOT / REFERENCE["case"]).read_text(encoding="utf-8")
        self.runs.folder.mkdir(parents=True, exist_ok=True)
        path = self.runs.folder / f"{NAME}_{name}_row.toml"
        text = varied(text, count=count, gap=gap, delays=times, end=end_of(gap, max(times)))
        path.write_text(text, encoding="utf-8")
        return self.folder(name, str(path), size, **changes)

    def ratio(self, name: str, size: str, **changes: Any) -> float | None:
        """Mass ratio within 10 degrees of the pair with changes; None where its burst stopped for its numbers."""
        try:
            return _ratio(self.folder(name, REFERENCE["case"], size, **changes))
        except StudyError as error:
            if error.code != STOPPED:
                raise
            return None

    def focus(self, name: str, size: str, **changes: Any) -> Focus:
        """The focus of one of these."""
        return focus_of(self.row_of(name, size, **changes) / "burst_snapshot.h5")


def _burst(folder: Path) -> dict[str, Any]:
    found: dict[str, Any] = summary_of(folder)["burst"]
    return found


def study(options: Options, runs: Runs, rows: list[Row]) -> None:
    """Burst single sections, the pair over cell sizes, and pairs over gaps, delays and friction."""
    sections = _Sections(runs)
    with void_where_unsound(sections.unsound, rows):
        _compare(sections, options, rows)


def _compare(sections: _Sections, options: Options, rows: list[Row]) -> None:
    """Add the rows of each kind of sections as soon as these have burst."""
    quick = "quick_" if options.quick else ""
    sizes = [options.cell_size] if options.cell_size else REFERENCE[f"{quick}sizes"]
    usual = options.cell_size or REFERENCE[f"{quick}whole"]
    found = [_burst(sections.folder("mirrored", REFERENCE["mirrored"], size)) for size in sizes]
    rows += convergence_rows(sizes, found) if len(sizes) > 1 else []

    single = sections.folder("single", REFERENCE["single"], usual)
    meridian = sections.runs.run(
        f"{NAME}_meridian", REFERENCE["single"], REFERENCE["meridian_size"], stage="burst", geometry="axisymmetric"
    )
    speed = float(_burst(single)["mean_initial_speed"])
    rows += single_rows(speed, cylinder_speed(meridian / "burst_snapshot.h5"), _gurney(single))

    gap, calibre = REFERENCE["gap"], REFERENCE["calibre"]
    off = {"burst.symmetry": "off"}  # both rounds are computed
    whole = sections.row_of("whole", usual, gap=gap, **off)
    together = focus_of(whole / "burst_snapshot.h5")
    if usual in sizes:
        rows += mirrored_rows(_burst(whole), found[sizes.index(usual)])
    gaps = {
        one: together if one == REFERENCE["gaps"][0] else sections.focus(f"gap_{one:g}", usual, gap=one * calibre)
        for one in REFERENCE[f"{quick}gaps"]
    }
    rows += gap_rows(gaps, focus_of(single / "burst_snapshot.h5").share)
    delays = {
        delay: (
            sections.focus(f"left_{1e6 * delay:g}_us", usual, gap=gap, delays=(delay, 0.0)),
            sections.focus(f"right_{1e6 * delay:g}_us", usual, gap=gap, delays=(0.0, delay)),
        )
        for delay in REFERENCE[f"{quick}delays"]
    }
    rows += delay_rows(delays, together)
    key = "burst.contact.surface_friction_angle"
    frictions = {
        angle: sections.ratio(f"friction_{angle:g}", usual, **{key: f"{angle:g} deg"}, **off)
        for angle in REFERENCE[f"{quick}frictions"]
    }
    rows += friction_rows(frictions, _ratio(whole))


def _ratio(folder: Path) -> float:
    return float(_burst(folder)["section"]["focus"]["mass_ratio"]["10"])


def _gurney(folder: Path) -> float:
    """Gurney's speed (m/s) of a section, by Eqs. 23 and 24, with the section's own masses."""
    from fragfield.case import load_case
    from fragfield.case.conversion.stages import burst_rounds

    explosive = burst_rounds(load_case(folder / "case.toml"))[0].explosive
    burst = _burst(folder)
    return gurney_speed(explosive.detonation_velocity, burst["charge_mass"] / burst["casing_mass"])
