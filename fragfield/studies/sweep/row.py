"""A run of a sweep of which the row of the table is all that is kept."""

from __future__ import annotations

import hashlib
import json
from typing import TYPE_CHECKING, Any

from fragfield.case import plain
from fragfield.errors import InputError
from fragfield.hazard.recommended import recommended_of
from fragfield.pipeline.convergence import OF_A_SWEEP
from fragfield.results.part import to_json
from fragfield.studies.numbers import answer_of, burst_of, flown_parts
from fragfield.studies.sweep.results import DONE, KEPT, results_of
from fragfield_base.reading import read_text

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from fragfield.case import CaseTable


_LARGEST = 1 << 28  # bytes of sweep.json


def digest_of(case: CaseTable) -> str:
    """Names what is computed: all of a resolved case but its title."""
    text = json.dumps({key: value for key, value in plain(case).items() if key != "title"}, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def stored_rows(file: Path) -> dict[str, dict[str, Any]]:
    """Rows of an earlier sweep.json that are done, by the names of their runs; raises InputError on a damaged one."""
    if not file.is_file():
        return {}
    try:
        rows = json.loads(read_text(file, InputError, most=_LARGEST))["runs"]
        return {row["name"]: row for row in rows if row["state"] in (DONE, KEPT) and _is_whole(row)}
    except (ValueError, KeyError, TypeError):
        raise InputError(f"{file}: is no table of a sweep; remove it, or use another --out") from None


def _is_whole(row: Mapping[str, Any]) -> bool:
    return bool(row.get("case")) and set(row["results"]) == set(results_of({}))


def perform_row(request: dict[str, Any]) -> tuple[int, str]:
    """Make a run in this process; exit code, and `results` and `message` of its row as JSON, or why there are none.

    `request`: `case`, resolved; `of`: "run" or "burst"; `threads`.
    """
    return answer_of(lambda: _made(request))


def _made(request: Mapping[str, Any]) -> dict[str, Any]:
    case: CaseTable = request["case"]
    burst = burst_of(case)
    if request["of"] == "burst":
        parts: dict[str, Any] = {"burst": burst[0]}
    else:
        # no row lists what surfaces and sites meet, and their crossings take a third of the flight
        parts = flown_parts(case.model_copy(update={"witness": [], "exposed": []}), burst, request["threads"])
        parts["hazard"] = recommended_of(parts["hazard"], {"reason": OF_A_SWEEP})
    results: Any = to_json(results_of(parts))
    return {"results": results, "message": "" if results["determined"] is not False else parts["hazard"]["reason"]}
