"""The two runs of a comparison: their data, and whether they can be compared."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from fragfield.case.load import read_document
from fragfield.case.write import document_differences
from fragfield.errors import InputError
from fragfield.files.run_directory import RunDirectory
from fragfield.files.stamped import stored_case_text
from fragfield.hazard.recommended import not_included_words
from fragfield_base.errors import show

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from flight.hazard.ensemble import EnsembleHazard


_ROUND_OFF = 1e-12  # an angle written as a default and one read in degrees differ in their last digit


@dataclass(frozen=True, eq=False)
class ComparedRun:
    """What a comparison takes of a run."""

    folder: Path
    """Its directory."""
    case: dict[str, Any]
    """Tables of its case, as resolved."""
    summary: dict[str, Any]
    """summary.json."""
    hazard: EnsembleHazard | None
    """Over its realisations; None where it has not been flown."""
    hits: dict[str, NDArray[Any]]
    """dict from a surface's name to (n, s) arrays of flight.hazard.density.sectors.SECTOR_HITS: hits by realisation and
    sector."""

    @property
    def flown(self) -> bool:
        """Whether its fragments have been flown."""
        return isinstance(self.summary.get("flight"), dict)

    @property
    def surfaces(self) -> dict[str, dict[str, Any]]:
        """Witness surfaces of the case by their names."""
        return {str(entry["name"]): entry for entry in self.case.get("witness", [])}

    def part(self, name: str) -> dict[str, Any]:
        """One part of the summary, empty where it is missing."""
        found = self.summary.get(name)
        return found if isinstance(found, dict) else {}

    @property
    def realisations(self) -> int:
        """How many were flown; 0 without a flight."""
        return (self.part("flight").get("realisations") or 1) if self.flown else 0

    def described(self) -> dict[str, Any]:
        """Names, seed and size of the run."""
        document = self.case.get("document") or {}
        return {
            "directory": str(self.folder),
            "title": str(self.case.get("title", "")),
            "document": " ".join(str(document[key]) for key in ("number", "revision") if document.get(key)),
            "seed": self.summary.get("seed"),
            "realisations": self.realisations or None,
            "program_version": self.summary.get("program_version"),
        }


def read_compared_run(folder: Path) -> ComparedRun:
    """Read a run directory; raises InputError where there is none, or a file of it is damaged."""
    directory = RunDirectory(folder)
    if not folder.is_dir():
        raise InputError(f"{folder}: no such run directory")
    if not directory.exists:
        raise InputError(f"{folder}: not a run directory, it contains no case.toml")
    summary = directory.summary()
    if not any(isinstance(summary.get(part), dict) for part in ("burst", "flight")):
        raise InputError(f"{folder}: nothing to compare, its summary.json has no results; run `fragfield run` first")
    stored_case_text(directory.case_file)
    hazard: EnsembleHazard | None = None
    hits: dict[str, NDArray[Any]] = {}
    if directory.file("ensemble.h5").is_file():
        from flight.files.ensemble import read_ensemble

        hazard, hits = read_ensemble(directory.file("ensemble.h5"))
    return ComparedRun(folder, read_document(directory.case_file), summary, hazard, hits)


def check_alike(run: ComparedRun, reference: ComparedRun) -> None:
    """Raise InputError where witness surfaces or their sectors differ; the message names each surface."""
    ours, theirs = run.surfaces, reference.surfaces
    faults = []
    for name in dict.fromkeys([*ours, *theirs]):
        if name not in ours or name not in theirs:
            faults.append(f'"{name}": only in {run.folder if name in ours else reference.folder}')
            continue
        keys = dict.fromkeys([*ours[name], *theirs[name]])
        changed = [key for key in keys if ours[name].get(key) != theirs[name].get(key)]
        for key in changed:
            values = [f"{_shown(one.surfaces[name], key)} in {one.folder}" for one in (run, reference)]
            faults.append(f'"{name}": {key} {", ".join(values)}')
    if faults:
        head = f"{run.folder}, {reference.folder}: the witness surfaces differ; needed: the same in both cases"
        raise InputError("\n  ".join([head, *faults]))
    for name in run.hits.keys() & reference.hits.keys():
        mine, other = run.hits[name].shape[1], reference.hits[name].shape[1]
        if mine != other:
            raise InputError(
                f"{run.folder}, {reference.folder}: the sectors differ, {mine} and {other}; needed: one hazard.sectors"
            )


def _shown(table: dict[str, Any], key: str) -> str:
    return show(table[key]) if key in table else "nothing"


def differences_of(run: ComparedRun, reference: ComparedRun) -> list[str]:
    """One line a key in which the cases differ; of rounds and planes that only one has, their numbers."""
    ours, theirs, lines = dict(run.case), dict(reference.case), []
    for name in ("round", "plane"):
        tables = [case.get(name, []) for case in (ours, theirs)]
        mine, other = (len(table) for table in tables)
        if mine != other:
            lines.append(f"{name}: reference {other}, run {mine}")
            ours[name], theirs[name] = (table[: min(mine, other)] for table in tables)
    return lines + document_differences(theirs, ours, words=("reference", "run"), tolerance=_ROUND_OFF)


def _not_included(run: ComparedRun, reference: ComparedRun) -> list[str]:
    """What the recommended distances do not include, once where it is the same for both."""
    missing = [(one, not_included_words(one.part("hazard"))) for one in (run, reference)]
    if len({words for _, words in missing}) == 1:
        return [f"the recommended distances do not include {missing[0][1]}"] if missing[0][1] else []
    return [f"{one.folder}: the recommended distance does not include {words}"
            for one, words in missing if words]  # fmt: skip


def notes_on(run: ComparedRun, reference: ComparedRun) -> list[str]:
    """What a reader must know of the two runs beside their ratios."""
    notes = []
    seeds = [one.summary.get("seed") for one in (run, reference)]
    same = not differences_of(run, reference)
    if same and seeds[0] == seeds[1]:
        notes.append("both runs are of the same case and seed: their differences do not come from the case")
    elif seeds[0] != seeds[1]:
        notes.append(f"the seeds differ, {seeds[0]} and {seeds[1]}")
    else:
        notes.append(f"both have the seed {seeds[0]}; standard errors of ratios assume independent realisations")
    for one in (run, reference):
        if not one.flown:
            notes.append(f"{one.folder} has no flight: only the casings are compared")
        elif not one.part("hazard").get("determined", True):
            notes.append(f"{one.folder}: the distance is not determined: {one.part('hazard')['reason']}")
        elif one.realisations < 2:
            notes.append(f"{one.folder} has one realisation of the break-up: no standard errors")
    if run.hazard is not None and reference.hazard is not None and run.hazard.criteria != reference.hazard.criteria:
        notes.append(
            f"the hazard criteria differ, {run.hazard.criteria} and {reference.hazard.criteria}: "
            "ratios of hazardous numbers and distances include this difference"
        )
    notes += _not_included(run, reference)
    bases = [one.part("hazard").get("basis") for one in (run, reference)]
    if None not in bases and bases[0] != bases[1]:
        words = {"all_azimuths": "over all azimuths", "worst_direction": "in the worst direction"}
        notes.append("distances hold " + " and ".join(words[str(basis)] for basis in bases))
    versions = [one.summary.get("program_version") for one in (run, reference)]
    if versions[0] != versions[1]:
        notes.append(f"computed by different versions of the program, {versions[0]} and {versions[1]}")
    return notes
