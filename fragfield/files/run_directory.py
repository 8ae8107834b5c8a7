"""The run directory: files that each stage reads and writes, and when they may be replaced.

A directory holds one case. It is made when missing; an empty one is used as it is. One that holds results, of the same
case or of another, keeps them: it is refused, unless `resume` continues the same case, `overwrite` removes that
run's files (only those), or a stage's own inputs are unchanged. One that holds anything else is always refused. While
a command writes into it, others are refused by a lock, which the system takes away from a process that ends, however
it ends.

case.toml and summary.json show whether they were changed, by a checksum: the last line of the one, the last key of the
other.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fragfield.case import CaseTable, differences, read_resolved, to_toml
from fragfield.case.load import MOST_CASE
from fragfield.errors import InputError
from fragfield.results.part import to_json
from fragfield.results.summary import Summary, read_summary
from fragfield_base.reading import read_text
from fragfield_base.writing import DRAFT, write_text


@dataclass(frozen=True)
class Stage:
    """A stage of the chain."""

    name: str
    """Word of the command line."""
    needs: str
    """File of the stage before, empty for the first."""
    result: str
    """File by which the stage is known to be complete: the last one it writes."""
    files: tuple[str, ...]
    """Everything it writes, files and folders."""
    parts: tuple[str, ...]
    """Keys of summary.json."""
    keys: tuple[str, ...]
    """Keys of the case that its result depends on, besides those of earlier stages."""


STAGES: dict[str, Stage] = {
    stage.name: stage
    for stage in (
        Stage(
            "burst",
            "",
            "burst_snapshot.h5",
            (
                "checkpoint.h5",
                "burst.xdmf",
                "burst",
                "burst_revolved.xdmf",
                "burst_revolved",
                "burst_snapshot.h5",
            ),
            ("burst",),
            ("burst", "round", "plane"),
        ),
        Stage(
            "break-up",
            "burst_snapshot.h5",
            "fragments.h5",
            ("ensemble_fragments.h5", "arena.csv", "fragments.h5", "fragments.csv"),
            ("break_up",),
            ("break_up", "seed", "flight.shape_factor"),
        ),
        Stage(
            "fly",
            "fragments.h5",
            "landing.h5",
            (
                "hits.h5",
                "landing.h5",
                "obstacle_hits.h5",
                "contacts.h5",
                "witness.csv",
                "landing.csv",
                "obstacle_hits.csv",
                "contacts.csv",
                "trajectories.xdmf",
                "trajectories.h5",
                "ensemble.h5",
                "ensemble.csv",
                "hazard_by_distance.csv",
                "hazard_by_sector.csv",
                "contours.geojson",
                "contours.kml",
                "uncertainty.json",
            ),
            (
                "flight",
                "witness",
                "obstacle",
                "hazard",
                "exposed",
                "rules",
                "official",
                "distance_to_apply",
                "convergence",
            ),
            ("flight", "witness", "hazard", "site", "obstacle", "exposed", "official"),
        ),
        Stage(
            "report",
            "",
            "report.html",
            ("map.html", "report.html"),
            (),
            ("title", "document"),
        ),
    )
}
_MOST_DIFFERENCES = 10
_OWN_FILES = ("case.toml", "summary.json", "run.log", "csv-metadata.json")


@dataclass(frozen=True)
class RunDirectory:
    """A run's directory and its files."""

    path: Path

    @property
    def case_file(self) -> Path:
        """The resolved case."""
        return self.path / "case.toml"

    @property
    def log_file(self) -> Path:
        """What the stages logged."""
        return self.path / "run.log"

    @property
    def summary_file(self) -> Path:
        """The results in numbers."""
        return self.path / "summary.json"

    def file(self, name: str) -> Path:
        """Path of a file of the run."""
        return self.path / name

    @property
    def exists(self) -> bool:
        """Whether a run has been started here."""
        return self.case_file.is_file()

    def stored_case(self) -> CaseTable:
        """The case of the run that is here; raises InputError where there is none."""
        if not self.path.is_dir():
            raise InputError(f"{self.path}: no such run directory")
        if not self.exists:
            raise InputError(f"{self.path}: not a run directory, it contains no case.toml")
        stored_case_text(self.case_file)
        return read_resolved(self.case_file)

    def complete(self, stage: Stage) -> bool:
        """Whether a stage has written its result and its part of the summary."""
        written = self.summary()  # all parts of a stage at once
        return self.file(stage.result).is_file() and all(part in written for part in stage.parts[:1])

    def claim(self, case: CaseTable, *, resume: bool = False, overwrite: bool = False) -> None:
        """Make the directory ready for a run of a case from its first stage.

        `case`: resolved; `resume`: keep what is there; the stored case must be the same; `overwrite`: remove the files
        of the run that is there. Raises InputError: the directory cannot be written, holds something else, or another
        case; the message names the keys.
        """
        self.make()
        if not self.exists:
            self._refuse_foreign()
        elif (resume or not overwrite) and (changed := differences(self.stored_case(), case)):
            hint = "use another --out, or --overwrite to replace that run"
            if resume:
                hint = "--resume continues the same case only: repeat its --set, or use another --out"
            raise InputError(_differ(self.path, changed, hint))
        if not (resume or overwrite) and (results := self._results()):
            others = f" and {len(results) - 1} more results" if len(results) > 1 else ""
            raise InputError(
                f"{self.path}: holds {results[0]}{others}, which this would delete; allowed: --resume to keep what is "
                "done and go on, --overwrite to compute it again, or another --out"
            )
        if not resume:
            self.remove(list(STAGES.values()), clean=overwrite)
        self.write_case(case)

    def enter(self, case: CaseTable, stage: Stage) -> None:
        """Make the directory ready for one stage whose earlier stages have run here.

        Raises InputError: the directory cannot be written, holds something else, or the case differs in a key on which
        earlier stages depend.
        """
        self.make()
        later = list(STAGES.values())[list(STAGES).index(stage.name) :]
        if not self.exists:
            self._refuse_foreign()
            if results := self._results(later):
                raise InputError(
                    f"{self.path}: holds {results[0]}, which this would delete, but no case.toml of the run that made "
                    "it; move it away, or use another --out"
                )
        else:
            self.check_upstream(case, stage)
        self.write_case(case)
        self.remove(later)

    def check_upstream(self, case: CaseTable, stage: Stage) -> None:
        """Raise InputError where the stored case differs in a key on which stages before `stage` depend."""
        earlier = list(STAGES.values())[: list(STAGES).index(stage.name)]
        keys = [key for one in earlier if self.file(one.result).is_file() for key in one.keys]
        if changed := differences(self.stored_case(), case, within=keys):
            hint = (
                f"its {stage.needs or 'summary.json'} does not belong to this case; run the earlier stages again, or "
                "use another --out"
            )
            raise InputError(_differ(self.path, changed, hint))

    def make(self) -> None:
        """Make the directory; raises InputError where it cannot be made or written."""
        try:
            self.path.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"{self.path}: the output folder cannot be made ({error.strerror})") from None
        probe = self.path / f".fragfield-{os.getpid()}"
        try:
            probe.touch()
            probe.unlink()
        except OSError as error:
            raise InputError(f"{self.path}: the output folder cannot be written ({error.strerror})") from None

    def _results(self, stages: Sequence[Stage] = tuple(STAGES.values())) -> list[str]:
        return [name for stage in stages for name in stage.files if self.file(name).exists()]

    def _refuse_foreign(self) -> None:
        names = {name for stage in STAGES.values() for name in stage.files} | {*_OWN_FILES, "figures"}
        found = (entry.name for entry in self.path.iterdir())
        other = sorted(name for name in found if name.removesuffix(DRAFT) not in names)
        if other:
            more = f" and {len(other) - 1} more" if len(other) > 1 else ""
            raise InputError(
                f"{self.path}: holds {other[0]}{more}, which is not a run of this program; "
                "allowed: a new or an empty folder, or a run's"
            )

    def write_case(self, case: CaseTable) -> None:
        """Store the resolved case."""
        write_text(self.case_file, stamped_toml(to_toml(case)), InputError)

    def summary(self) -> dict[str, Any]:
        """summary.json, empty where there is none; raises InputError where it is damaged."""
        return read_stamped_json(self.summary_file) if self.summary_file.is_file() else {}

    def results(self) -> Summary:
        """summary.json by attribute, empty where there is none; raises InputError where it is damaged or too old."""
        return read_summary(self.summary(), self.summary_file)

    def write_results(self, results: Summary) -> None:
        """Store summary.json in one move."""
        self.write_summary(to_json(results))

    def write_summary(self, summary: Mapping[str, Any]) -> None:
        """Store summary.json in one move."""
        write_text(self.summary_file, stamped_json(summary), InputError)

    def remove(self, stages: Sequence[Stage], *, clean: bool = False) -> None:
        """Remove what stages have written: results that no longer belong to the case must not stay beside new ones.

        With `clean` the whole summary goes, damaged or not. Nothing is removed where what stays is damaged.
        """
        summary = {} if clean else self.summary()
        names = [name for stage in stages for name in stage.files]
        name = ""
        try:
            for name in (*names, *((self.summary_file.name,) if clean else ())):
                self.file(name + DRAFT).unlink(missing_ok=True)
                if self.file(name).is_dir() and not self.file(name).is_symlink():
                    shutil.rmtree(self.file(name))
                else:
                    self.file(name).unlink(missing_ok=True)
        except OSError as error:
            raise InputError(f"{self.file(name)}: cannot be removed ({error.strerror})") from None
        parts = [part for stage in stages for part in stage.parts if part in summary]
        if parts:
            self.write_summary({key: value for key, value in summary.items() if key not in parts})


def _differ(path: Path, changed: Sequence[str], hint: str) -> str:
    shown = list(changed[:_MOST_DIFFERENCES])
    if len(changed) > len(shown):
        shown.append(f"and {len(changed) - len(shown)} more keys")
    return "\n  ".join([f"{path}: holds the run of another case; {hint}. The cases differ in", *shown])


_MOST_SUMMARY = 1 << 29
_KEY = "checksum"
_LINE = re.compile(r"\n# checksum of the lines above: ([0-9a-f]{32})\n\Z")


def stamped_toml(text: str) -> str:
    """A case with its checksum as the last line."""
    return f"{text}\n# checksum of the lines above: {_digest(text)}\n"


def stored_case_text(path: Path) -> str:
    """Text of the case that a run directory holds, as the program has written it.

    Raises InputError: the file is empty, cut off or edited.
    """
    text = read_text(path, InputError, most=MOST_CASE)
    found = _LINE.search(text)
    if found is None:
        raise InputError(
            f"{path}: empty, cut off, or not written by this program: its last line, the checksum, is missing; give "
            "the case file again with --overwrite to compute the run again"
        )
    if found[1] != _digest(text[: found.start()]):
        raise InputError(
            f"{path}: was edited or damaged after the run wrote it (its checksum does not fit); allowed: the file as "
            "it was; an edited case is a case file of its own, outside of the run directory, with --out for its results"
        )
    return text


def stamped_json(summary: Mapping[str, Any]) -> str:
    """A summary with its checksum as the last key; raises ValueError for numbers that JSON does not have."""
    text = json.dumps(summary, indent=1, default=_plain_number, allow_nan=False)
    whole = json.loads(text)
    whole.pop(_KEY, None)
    whole[_KEY] = _digest(_canonical(whole))
    return json.dumps(whole, indent=1) + "\n"


def read_stamped_json(path: Path) -> dict[str, Any]:
    """Read summary.json, without its checksum; raises InputError where it is damaged."""
    advice = "run the stages again"
    text = read_text(path, InputError, most=_MOST_SUMMARY, advice=advice)
    try:
        found = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: damaged ({error}); {advice}") from None
    if not isinstance(found, dict):
        raise InputError(f"{path}: damaged (not a table); {advice}")
    stamp = found.pop(_KEY, None)
    if stamp is not None and stamp != _digest(_canonical(found)):
        raise InputError(f"{path}: damaged or edited (its checksum does not fit); {advice}")
    return found


def _canonical(found: Mapping[str, Any]) -> str:
    return json.dumps(found, sort_keys=True, separators=(",", ":"))


def _digest(text: str) -> str:
    return hashlib.blake2b(text.encode("utf-8", errors="surrogatepass"), digest_size=16).hexdigest()


def _plain_number(value: object) -> object:
    if hasattr(value, "tolist"):
        return value.tolist()
    message = f"{type(value).__name__} has no place in a summary"
    raise TypeError(message)
