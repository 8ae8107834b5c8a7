"""The runs that a study compares, made by the command line of fragfield as a user would, and the files it reads."""

from __future__ import annotations

import json
import subprocess
import sys
import tomllib
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import h5py

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from transition import BreakUpSettings
    from validation.rows import Rows

__all__ = [
    "ROOT",
    "Geometry",
    "Runs",
    "StudyError",
    "break_up_of",
    "changed_case",
    "reference_beside",
    "snapshot_of",
    "summary_of",
]

Geometry = Literal["3d", "axisymmetric"]
"""Of a burst, as `burst.geometry`."""
ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / "runs" / "validation"
LARGEST_ENERGY_ERROR = 0.01
"""Of the energy ledger at the outputs, and of what contact made by the end, over the work of the products."""


class StudyError(Exception):
    """A study cannot go on; `code` is the exit code that says why."""

    def __init__(self, message: str, code: int = 2) -> None:
        super().__init__(message)
        self.code = code


@dataclass(frozen=True)
class Runs:
    """Where runs are made, and how.

    Attributes
    ----------
    folder : Path
        Holds one run directory a run.
    resume : bool
        Keep finished runs and continue unfinished ones, of the same case only. Left out, every run is made again: what
        an earlier version left proves nothing of this one.
    threads : int, optional
        Threads of a run.
    ranks : int
        MPI ranks of a run.
    bursts : list
        Directory's name and part "burst" of the summary of every run made so far; `check` looks at them.
    """

    folder: Path = FOLDER
    resume: bool = False
    threads: int | None = None
    ranks: int = 1
    bursts: list[tuple[str, dict[str, Any]]] = field(default_factory=list)

    def directory(self, name: str, size: str) -> Path:
        """Directory of the run `name` at a cell size such as "8 mm"."""
        return self.folder / f"{name}_{size.replace(' ', '_')}"

    def run(
        self,
        name: str,
        case: str,
        size: str,
        changes: Mapping[str, Any] | None = None,
        *,
        stage: Literal["run", "burst"] = "run",
        geometry: Geometry = "3d",
    ) -> Path:
        """Run a case of this repository at a cell size and return its directory.

        Parameters
        ----------
        name : str
            Of the run directory.
        case : str
            Case file, relative to the repository.
        size : str
            Cell size with its unit.
        changes : mapping, optional
            New values by dotted key; see `changed_case`.
        stage : "run" or "burst"
            The whole chain to the report, or the burst alone.
        geometry : "3d" or "axisymmetric"
            Of the burst: validation says which was validated, and leaves nothing to the case's choice.

        Raises
        ------
        StudyError
            The run did not end with exit code 0, which the error carries.
        """
        out, path = self.directory(name, size), ROOT / case
        if not path.is_file():
            raise StudyError(f"{name}: there is no case {case}")
        self.folder.mkdir(parents=True, exist_ok=True)
        path = out.with_name(f"{out.name}.toml")  # a size may have a point of its own
        path.write_text(changed_case(ROOT / case, {"burst.geometry": geometry, **(changes or {})}), encoding="utf-8")
        if not (self.resume and _finished(out, path, size, stage)):
            self._make(name, path, size, stage, out)
        self.bursts.append((out.name, summary_of(out)["burst"]))
        return out

    def _make(self, name: str, path: Path, size: str, stage: str, out: Path) -> None:
        command = [
            sys.executable,
            "-m",
            "fragfield",
            stage,
            str(path),
            "--set",
            f"burst.cell_size={size}",
            "--out",
            str(out),
        ]
        command += ["--threads", str(self.threads)] if self.threads else []
        if self.ranks > 1:
            command = ["mpirun", "-n", str(self.ranks), *command]
        done = self._call([*command, "--resume"]) if self.resume and out.is_dir() else None
        if done is None or done == 2:  # not begun, or begun of another case
            done = self._call([*command, "--overwrite"])
        if done != 0:
            raise StudyError(f"{name} at {size} ended with exit code {done}", done)

    def burst(
        self, name: str, case: str, size: str, changes: Mapping[str, Any] | None = None,
        geometry: Geometry = "axisymmetric",
    ) -> tuple[Path, dict[str, Any]]:  # fmt: skip
        """As `run`, the burst alone: its directory, and the part "burst" of its summary."""
        return self.run(name, case, size, changes, stage="burst", geometry=geometry), self.bursts[-1][1]

    def hazard(self, name: str, case: str, size: str, changes: Mapping[str, Any] | None = None) -> dict[str, Any]:
        """As `run`, the whole chain of one round in its meridian: the part "hazard" of its summary."""
        found: dict[str, Any] = summary_of(self.run(name, case, size, changes, geometry="axisymmetric"))["hazard"]
        return found

    def check(self, rows: Rows) -> None:
        """Add what all bursts of a study must fulfil: their energy closed and no cell lost; begin again with none.

        One that does not voids what it was compared with: it is named, and the rows may not stand in the record.
        """
        if self.bursts:
            number = len(self.bursts)
            unsound = [name for name, burst in self.bursts if not _sound(burst)]
            quantity = f"bursts with closed energy and no lost cell, of {number}"
            quantity += f" (not: {', '.join(unsound)})" if unsound else ""
            both = "conservation of energy and mass"
            rows.bound(quantity, number - len(unsound), (number, number), both, "", "burst")
            rows.unsound += unsound
        self.bursts.clear()

    @staticmethod
    def _call(command: list[str]) -> int:
        return subprocess.run(command, cwd=ROOT, check=False, stdout=2).returncode


def _sound(burst: Mapping[str, Any]) -> bool:
    errors = burst["energy_error_at_checks"], burst["contact_error_at_end"]
    return all(error <= LARGEST_ENERGY_ERROR for error in errors) and not burst["lost_cells"]


def _finished(out: Path, case: Path, size: str, stage: str) -> bool:
    """Whether a directory holds this very case, computed to the end."""
    from fragfield.case import differences, load_case
    from fragfield.errors import InputError
    from fragfield.files.run_directory import STAGES, RunDirectory

    directory = RunDirectory(out)
    try:
        if not directory.exists or differences(directory.stored_case(), load_case(case, {"burst.cell_size": size})):
            return False
    except InputError:  # of a version that had other keys
        return False
    wanted = STAGES.values() if stage == "run" else [STAGES["burst"]]
    return all(directory.complete(one) for one in wanted)


def summary_of(folder: Path) -> dict[str, Any]:
    """summary.json of a finished run; raises StudyError where there is none."""
    try:
        found: dict[str, Any] = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise StudyError(f"{folder} is not a finished run: {error}") from None
    return found


def reference_beside(module: str) -> dict[str, Any]:
    """The published values in reference.toml beside a module, given its `__file__`."""
    return tomllib.loads((Path(module).parent / "reference.toml").read_text(encoding="utf-8"))


@contextmanager
def snapshot_of(path: Path) -> Iterator[h5py.File]:
    """A burst's snapshot, open for reading.

    Raises
    ------
    StudyError
        The file is no snapshot, or the block does not find in it what it looks for.
    """
    try:
        with h5py.File(path, "r") as file:
            yield file
    except (OSError, KeyError) as error:
        raise StudyError(f"{path}: no snapshot of a burst: {error}") from None


def break_up_of(folder: Path) -> BreakUpSettings:
    """Settings of the break-up of a run's case."""
    from fragfield.case import read_resolved
    from fragfield.case.problem import break_up_settings

    return break_up_settings(read_resolved(folder / "case.toml"))


def changed_case(path: Path, changes: Mapping[str, Any]) -> str:
    """A case as TOML, resolved, with some of its values replaced.

    Parameters
    ----------
    path : Path
        The case file.
    changes : mapping from dotted key to value
        As `fragfield.case.changed_document` takes them.

    Raises
    ------
    StudyError
        The case has no such key, or may not have such a value.
    """
    from fragfield.case import changed_document, load_case, to_toml
    from fragfield.case.load import case_from_document
    from fragfield.errors import InputError

    document, source = tomllib.loads(to_toml(load_case(path))), f"{path} changed"
    if any(key.endswith(".attitude") for key in changes):  # resolved, it stands as an axis
        for entry in document["round"]:
            entry.pop("axis", None)
    try:
        changed = changed_document(document, changes, source=source, folder=path.parent)
        return to_toml(case_from_document(changed, source=source, folder=path.parent))
    except InputError as error:
        raise StudyError(str(error)) from None
