"""The expected distance of a single M107 over cell sizes and over its attitude: both must leave it well-posed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from validation.attitudes.figure import draw
from validation.figures import keep_picture
from validation.runs import reference_beside

if TYPE_CHECKING:
    from validation.rows import Rows
    from validation.runs import Runs

__all__ = ["REFERENCE", "study"]

REFERENCE = reference_beside(__file__)
_SOURCE = "own finest cells"


def study(runs: Runs, rows: Rows) -> None:
    """Run both fills over cell sizes, leans and the whole envelope; whole chains, in the meridian."""
    quick = "quick_" if rows.quick else ""
    curves: dict[str, Any] = {}
    for fill, case in REFERENCE["cases"].items():
        subjects = ("profile:m107", f"explosive:{fill.lower().replace(' ', '_')}")
        sizes = REFERENCE[f"{quick}sizes"]
        hazards = {size: _hazard(runs, case, fill, size, "upright") for size in sizes}
        finest = hazards[sizes[-1]]["expected"]
        for size, hazard in hazards.items():
            base = finest if size != sizes[-1] else None
            rows.trend(f"{fill}, {size}: distance upright", hazard["expected"], base, _SOURCE, "m", *subjects,
                       standard_error=hazard["standard_error"])  # fmt: skip
        size = REFERENCE[f"{quick}size"]
        leans = {lean: _hazard(runs, case, fill, size, f"{lean} deg") for lean in REFERENCE[f"{quick}leans"]}
        upright = hazards[size]["expected"]
        for lean, hazard in leans.items():
            rows.trend(f"{fill}: distance leaning {lean:g} degrees", hazard["expected"], upright, "upright", "m",
                       *subjects, standard_error=hazard["standard_error"])  # fmt: skip
        curves[fill] = _hazard(runs, case, fill, size, "any")["attitude"]
        _envelope(rows, fill, curves[fill], subjects)
    path = draw(curves, runs.folder / "attitudes.png")
    if not rows.quick:
        keep_picture(path)


def _hazard(runs: Runs, case: str, fill: str, size: str, attitude: str) -> dict[str, Any]:
    name = f"attitudes_{fill.lower()}_{attitude}".replace(" ", "_")
    return runs.hazard(name, case, size, {"round.*.attitude": attitude})


def _envelope(rows: Rows, fill: str, attitude: dict[str, Any], subjects: tuple[str, ...]) -> None:
    """Upright, lying and nose down beside the worst attitude."""
    curve = {row["inclination_deg"]: row for row in attitude["curve"]}
    worst = attitude["worst_inclination_deg"]
    for degrees, words in ((0.0, "upright"), (90.0, "lying"), (180.0, "nose down")):
        row = curve[degrees]
        rows.trend(f"{fill}: distance {words}, beside the worst attitude ({worst:g} degrees from upright)",
                   row["expected"], curve[worst]["expected"], "envelope of all attitudes", "m", *subjects,
                   standard_error=row["standard_error"])  # fmt: skip
