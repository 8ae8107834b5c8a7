"""summary.json: results of a run in numbers, SI but for degrees where the name says so."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any, Literal, get_args

from fragfield.errors import InputError
from fragfield.results.break_up import BreakUp
from fragfield.results.burst import Burst
from fragfield.results.convergence import Convergence
from fragfield.results.flight import Flight
from fragfield.results.hazard import Hazard
from fragfield.results.part import Part, adapter, out, outputs
from fragfield.results.rules import DistanceToApply, Official, Rules
from fragfield.results.site import ExposedSite, Obstacle, Witness

if TYPE_CHECKING:
    from pathlib import Path


class Warned(Part):
    """A warning of a stage."""

    stage: Literal["burst", "break-up", "fly", "report"] = out("Stage")
    code: str = out(
        "Kind, for programs: `passed_through`, `rounds_alone`, `below_ground`, `certainty`, `drag_table`, "
        "`arena_alone`, `arena_mass`, `contact_energy`, `no_end`, `faster_than_products`, or `other`"
    )
    severity: Literal["warning", "error", "critical"] = out("Severity")
    text: str = out("What was warned of")


class Summary(Part):
    """Results of a run; a part is None until its stage has run, and without all of them there is no case yet."""

    case: dict[str, Any] = out("The case as resolved; its keys are those of the case file, in SI", default={})
    title: str = out("Title of the case", default="")
    program_version: str = out("Version of the program", default="")
    versions: dict[str, str] = out("Versions of the libraries, by name", default={})
    seed: int = out("Seed of the random numbers", default=0)
    findings: tuple[Warned, ...] = out("What the stages warned of; empty where nothing was", default=())
    burst: Burst | None = None
    break_up: BreakUp | None = None
    flight: Flight | None = None
    witness: tuple[Witness, ...] | None = out("Witness surfaces, first realisation", default=None)
    obstacle: tuple[Obstacle, ...] | None = out("Obstacles, first realisation", default=None)
    hazard: Hazard | None = None
    exposed: tuple[ExposedSite, ...] | None = out(
        "Exposed sites, one entry a site, in the order of the case", default=None
    )
    rules: Rules | None = None
    official: Official | None = None
    distance_to_apply: DistanceToApply | None = None
    convergence: Convergence | None = None


STAGE_OF = {"burst": "burst", "break_up": "break-up"}
"""The stage that writes a part; of the others the flight."""


def described(part: str) -> str:
    """What a part of the summary is."""
    _, mark, kind = next(one for one in outputs(Summary) if one[0] == part)
    return mark.label or str(get_args(kind)[0].__doc__)


@cache
def schema() -> dict[str, Any]:
    """The JSON schema of summary.json."""
    found = adapter(Summary).json_schema()
    found["properties"]["checksum"] = {"title": "Of the file itself", "type": "string"}
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **found}


def read_summary(values: dict[str, Any], path: Path) -> Summary:
    """The summary of a file; raises InputError where another version wrote a part without a key of this one."""
    try:
        return Summary.of_stage(values)
    except InputError as error:
        part = str(error).partition(".")[0].partition(":")[0]
        stage = STAGE_OF.get(part, "fly")
        raise InputError(
            f"{path}: another version of the program wrote it ({error}); run `fragfield {stage}` again"
        ) from None
