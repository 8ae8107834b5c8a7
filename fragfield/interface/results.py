"""`fragfield.open`: the content of a run directory, for scripts, report, pictures and application."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.errors import InputError, NotDeterminedError, nearest
from fragfield.files.run_directory import STAGES, RunDirectory
from fragfield.files.stamped import read_stamped_json, stored_case_text
from fragfield.interface.case import Case
from fragfield.results.words import basis_words, headline, ricochet_words, source_words
from fragfield_base.hdf5_files import reading
from fragfield_base.paths import absolute

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence

    from matplotlib.figure import Figure
    from numpy.typing import NDArray

    from flight import Fragments
    from flight.hazard.ensemble import EnsembleHazard
    from fragfield.case import CaseTable
    from fragfield.case.tables.flight import HazardTable
    from fragfield.case.tables.site import DocumentTable
    from fragfield.interface.burst import Burst, RoundTables
    from fragfield.interface.tables import Table
    from fragfield.report.findings import Finding
    from fragfield.results.hazard import DistanceParts, Hazard, WithoutRicochet
    from fragfield.results.rules import DistanceToApply, Official
    from fragfield.results.site import ExposedSite
    from fragfield.results.summary import Summary
    from fragfield.results.uncertainty import UncertaintyResult


_FILES = {"burst": "burst_snapshot.h5", "break-up": "fragments.h5", "flight": "landing.h5"}
"""File that shows that a stage has been run, as the report names stages."""
_LANDED = 1  # of flight's Status
_NO_PROVENANCE = ("format", "format_version", "time", "geometry")


def open(path: str | os.PathLike[str]) -> Run:  # noqa: A001 - as h5py.File has its `open`
    """The run in a directory, whole or in part; what it holds is read when it is asked for.

    Raises
    ------
    InputError
        There is no run directory, or its case is damaged.
    """
    found = Run(path)
    found.case  # noqa: B018 - says what is wrong with the directory
    return found


class Run:
    """A run directory, whose files are read when they are asked for. Numbers are in SI; `print` shows the summary.

    Parameters
    ----------
    path : path
        The directory.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = absolute(path, InputError)
        self._directory = RunDirectory(self.path)

    @cached_property
    def case(self) -> Case:
        """The resolved case."""
        return Case.of_run(self._directory)

    @cached_property
    def summary(self) -> Summary:
        """summary.json by attribute, as `summary.hazard.recommended`; a part is None before its stage has run.

        The page "Output files" of the guide explains them.
        """
        return self._directory.results()

    @property
    def stages(self) -> dict[str, bool]:
        """Whether each stage is done."""
        return {name: self._directory.complete(stage) for name, stage in STAGES.items()}

    @property
    def report(self) -> Path:
        """The report, an HTML page; raises InputError where it is not written."""
        return self._file("report.html", "report")

    @property
    def log(self) -> str:
        """Text of run.log; empty where there is none."""
        path = self._directory.log_file
        return path.read_text(encoding="utf-8", errors="replace") if path.is_file() else ""

    @property
    def burst(self) -> Burst:
        """The burst: casing and charge at its end, and histories; raises InputError where it has not been run."""
        self._file("burst_snapshot.h5", "burst")
        if self.snapshot is None or self.snapshot.part is None:
            raise InputError(f"{self.path}: summary.json has no burst; run `fragfield burst` again")
        return self.snapshot

    @property
    def fragments(self) -> Fragments:
        """Fragments of the first realisation at launch."""
        self._file("fragments.h5", "break-up")
        assert self.launched is not None
        return self.launched

    @property
    def realisations(self) -> Sequence[Fragments]:
        """Fragments of every realisation of the break-up; those after the first are read one by one."""
        from flight.files.ensemble import read_fragment_ensemble
        from fragfield.pipeline.stages import WithFirst

        others = self.path / "ensemble_fragments.h5"
        return WithFirst(self.fragments, read_fragment_ensemble(others) if others.is_file() else ())

    @cached_property
    def landing(self) -> NDArray[Any]:
        """End of every fragment's flight, a structured array of dtype `flight.LANDING`; first realisation."""
        from flight.files.hdf5 import read_table

        return read_table(self._file("landing.h5", "fly"), "landing")[0]

    @property
    def hits(self) -> NDArray[Any]:
        """Crossings of the witness surfaces, a structured array of dtype `flight.HITS`; first realisation."""
        from flight.files.hdf5 import read_table

        return read_table(self._file("hits.h5", "fly"), "hits")[0]

    @property
    def hazard(self) -> HazardDistance:
        """The distances to apply, the recommended one and its parts; raises InputError where nothing was flown."""
        self._file("landing.h5", "fly")
        return HazardDistance(self.summary, self.path)

    @property
    def exposed(self) -> tuple[ExposedSite, ...]:
        """Exposed sites with their densities and verdicts."""
        return self.summary.exposed or ()

    @property
    def official(self) -> Official | None:
        """The case's official distances (m); None where it has none."""
        return self.summary.official

    @property
    def findings(self) -> list[str]:
        """What a reader must know before using the numbers, the gravest first, as the report has it."""
        return [f"{one.label}: {one.text}" for one in self._findings]

    @property
    def warnings(self) -> list[str]:
        """Those of the findings that speak against the numbers."""
        return [f"{one.label}: {one.text}" for one in self._findings if one.weight in ("stop", "warning")]

    @cached_property
    def _findings(self) -> list[Finding]:
        from fragfield.report.findings import findings

        return findings(self)

    @property
    def tables(self) -> dict[str, str]:
        """Names of the tables that are there, and what they hold."""
        from fragfield.interface.tables import TABLES

        return {name: what for name, (file, what, _) in TABLES.items() if (self.path / file).is_file()}

    def write_tables(self, path: str | os.PathLike[str]) -> Path:
        """Write all tables into one workbook (.xlsx), the first sheet of which says what they are.

        Raises
        ------
        InputError
            Another ending, openpyxl is not installed, or the file cannot be written.
        """
        from fragfield.interface.tables import write_workbook

        tables = {name: self.table(name) for name in self.tables}
        return write_workbook(absolute(path, InputError), self.path, self.case.title, self.summary, tables)

    def table(self, name: str) -> Table:
        """A table by its name, with `to_numpy` and `to_pandas`; raises InputError for another name."""
        from fragfield.interface.tables import read_table

        return read_table(self.path, name)

    @property
    def figures(self) -> dict[str, str]:
        """Names of the report's figures, and their titles; a few may have no data in this run."""
        from fragfield.report.figures.registered import FIGURES

        return {name: FIGURES[name].words(self)[0] for name in _drawn_figures()}

    def figure(self, name: str) -> Figure:
        """A figure of the report as one of matplotlib.

        It is not known to pyplot; `figure.savefig("name.png", bbox_inches="tight")` writes it.

        Raises
        ------
        InputError
            Another name, or the run has no data for it.
        """
        from fragfield.report.figures.drawing import drawing_style
        from fragfield.report.figures.registered import FIGURES

        known = _drawn_figures()
        if name not in known:
            raise InputError(f"figure: found {name!r}{nearest(str(name), known)}; allowed: {', '.join(known)}")
        with drawing_style():
            figure = FIGURES[name].draw(self)
        if figure is None or isinstance(figure, str):
            title, _ = FIGURES[name].words(self)
            raise InputError(f"{self.path}: holds no data for the figure {name} ({title})")
        return figure

    def _file(self, name: str, stage: str) -> Path:
        path = self.path / name
        if not path.is_file():
            raise InputError(f"{path}: no such file; run `fragfield {stage}` first")
        return path

    def __repr__(self) -> str:
        done = ", ".join(name for name, is_done in self.stages.items() if is_done)
        return f"<fragfield.Run {str(self.path)!r}: {done or 'nothing'} done>"

    def __str__(self) -> str:
        from fragfield.terminal.show import summary_text

        return summary_text(replace(self.summary, title=self.case.title), str(self.path))

    def require(self) -> None:
        """Raise InputError where there is no such directory, or it holds nothing of a run."""
        if not self.path.is_dir():
            raise InputError(f"{self.path}: no such run directory; give a directory written by `fragfield run`")
        known = ["case.toml", "summary.json", *_FILES.values()]
        if not any((self.path / name).is_file() for name in known):
            raise InputError(f"{self.path}: not a run directory, it contains none of the files ({', '.join(known)})")

    def read_whole(self) -> None:
        """Read all files: one that is damaged is refused before anything is written."""
        self.require()
        _ = self.summary, self.values, self.study, self.snapshot, self.launched, self.landed, self.ensemble

    @cached_property
    def values(self) -> CaseTable | None:
        """The resolved case with every default; None where the directory holds none."""
        return self._directory.stored_case() if self._directory.exists else None

    @property
    def case_text(self) -> str:
        """Text of case.toml."""
        return stored_case_text(self._directory.case_file)

    @cached_property
    def snapshot(self) -> Burst | None:
        """The end of the burst; None where it has not been run."""
        from fragfield.interface.burst import read_burst

        path = self.path / _FILES["burst"]
        return read_burst(path, self.summary.burst) if path.is_file() else None

    @property
    def rounds(self) -> list[RoundTables]:
        """The rounds at the end of the burst; none before."""
        return [] if self.snapshot is None else self.snapshot.rounds

    @cached_property
    def history(self) -> dict[str, NDArray[np.float64]]:
        """Of the burst, over `time` (s); empty before it."""
        return {} if self.snapshot is None else self.snapshot.history

    @cached_property
    def launched(self) -> Fragments | None:
        """As `fragments`; None where there was no break-up."""
        from flight import Fragments

        path = self.path / _FILES["break-up"]
        return Fragments.read(path) if path.is_file() else None

    @cached_property
    def landed(self) -> NDArray[Any]:
        """Rows of the landings that reached the ground; none while the flight has not been run."""
        there = (self.path / _FILES["flight"]).is_file()
        return self.landing[self.landing["status"] == _LANDED] if there else np.empty(0)

    @cached_property
    def _ensembles(self) -> tuple[EnsembleHazard | None, dict[str, NDArray[Any]]]:
        from flight.files.ensemble import read_ensemble

        path = self.path / "ensemble.h5"
        return read_ensemble(path) if path.is_file() else (None, {})

    @cached_property
    def ensemble(self) -> EnsembleHazard | None:
        """Densities and distances by realisation, azimuth and distance; None before the flight."""
        return self._ensembles[0]

    @property
    def witness_ensemble(self) -> dict[str, NDArray[Any]]:
        """Hits by realisation and sector, by the name of the witness surface."""
        return self._ensembles[1]

    @cached_property
    def study(self) -> UncertaintyResult | None:
        """Of a study of uncertainty of this run."""
        from fragfield.results.uncertainty import UncertaintyResult

        if not (path := self.path / "uncertainty.json").is_file():
            return None
        try:
            return UncertaintyResult.of_stage(read_stamped_json(path))
        except InputError as error:
            raise InputError(f"{path}: another version wrote it ({error}); run `fragfield uncertainty` again") from None

    @cached_property
    def provenance(self) -> dict[str, str]:
        """Program, versions, seed and date, as the files of the stages have them."""
        known: dict[str, str] = {}
        for path in (self.path / name for name in _FILES.values()):
            if path.is_file():
                with reading(path, InputError, "run the stage that writes it again") as file:
                    for key, value in file.attrs.items():
                        known.setdefault(key, value.decode() if isinstance(value, bytes) else str(value))
        return {key: value for key, value in known.items() if key not in _NO_PROVENANCE}

    @property
    def expected_stages(self) -> list[str]:
        """Stages that the report is of: the flight alone where the fragments are from a file."""
        return ["flight"] if self.fragments_file is not None else list(_FILES)

    @property
    def missing(self) -> list[str]:
        """Those that have not been run."""
        return [stage for stage in self.expected_stages if not (self.path / _FILES[stage]).is_file()]

    @property
    def title(self) -> str:
        """Title of the case, else the folder's name."""
        own = self.values.title if self.values is not None else ""
        return own or self.summary.title or self.path.name

    @property
    def criteria(self) -> HazardTable:
        """What counts as hazardous; the schema's defaults where the directory holds no case."""
        from fragfield.case.tables.flight import HazardTable

        return self.values.hazard if self.values is not None else HazardTable()

    @property
    def document(self) -> DocumentTable:
        """Number, revision and names; empty texts where the directory holds no case."""
        from fragfield.case.tables.site import DocumentTable

        return self.values.document if self.values is not None else DocumentTable()

    @property
    def fragments_file(self) -> str | None:
        """Name of the file whose fragments were flown instead of those of a burst; None of a run with its own."""
        return (self.summary.flight and self.summary.flight.fragments_file) or None


class HazardDistance:
    """The distances of a flown run; a number that is not determined raises NotDeterminedError.

    Attributes
    ----------
    to_apply : DistanceToApply
        For storage and handling (`siting`) and disposal in the open, determined or not: `line` is what every view shows
        first, `words` say what each is by and what was left out.
    summary : Hazard
        The part of the summary, with all of it.
    determined, reason : bool, str
        Whether there is a distance, and why not.
    """

    def __init__(self, summary: Summary, directory: Path) -> None:
        if summary.hazard is None or summary.distance_to_apply is None:
            raise InputError(f"{directory}: contains no distance; run `fragfield fly` first")
        self._directory = directory
        self.to_apply: DistanceToApply = summary.distance_to_apply
        self.summary: Hazard = summary.hazard
        self.determined, self.reason = self.summary.determined, self.summary.reason

    @property
    def recommended(self) -> float:
        """The recommended distance (m): the expected one and what is not known of it, added up."""
        return self._known.recommended or 0.0

    @property
    def parts(self) -> DistanceParts:
        """Its parts (m), the expected distance and half-widths; of one that is None `not_included` says why."""
        return self._known.parts

    @property
    def not_included(self) -> dict[str, str]:
        """Parts that the recommended distance does not include, and why."""
        return self._known.not_included

    @property
    def expected(self) -> float:
        """Distance (m) at which the expected density of hazardous fragments falls through the acceptable one."""
        return self._known.expected or 0.0

    @property
    def upper(self) -> float | None:
        """Its one-sided 95 % upper bound (m), by points or over realisations; None for a single realisation."""
        return self._known.upper

    @property
    def standard_error(self) -> float | None:
        """Standard error of the expected distance (m); None for a single realisation."""
        return self._known.standard_error

    @property
    def without_ricochet(self) -> WithoutRicochet:
        """The same distances of the same flights up to the first impact."""
        return self._known.without_ricochet

    @property
    def direction(self) -> float | None:
        """Azimuth of the worst direction (degrees from +x); None where the distance is of all azimuths."""
        return self._known.direction_deg

    @property
    def bearing(self) -> float | None:
        """Bearing of the worst direction (degrees from north, clockwise); None without [site] too."""
        return self._known.bearing_deg

    @property
    def realisations(self) -> int:
        """Events that were flown."""
        return self.summary.realisations

    @cached_property
    def ensemble(self) -> EnsembleHazard:
        """Densities and distances by realisation, azimuth and distance, from ensemble.h5."""
        from flight.files.ensemble import read_ensemble

        path = self._directory / "ensemble.h5"
        if not path.is_file():
            raise InputError(f"{path}: no such file; run `fragfield fly` first")
        return read_ensemble(path)[0]

    @property
    def _known(self) -> Hazard:
        if not self.determined:
            raise NotDeterminedError(f"{self._directory}: the distance is not determined: {self.reason}")
        return self.summary

    def __repr__(self) -> str:
        if not self.determined:
            return "<fragfield.HazardDistance: not determined>"
        return f"<fragfield.HazardDistance: {headline(self.summary).value} m>"

    def __str__(self) -> str:
        found, shown = self.summary, headline(self.summary)
        text = f"{self.to_apply.line}\n{shown.lines}"
        more = f"\n  {source_words(found)}; {basis_words(found)}; {ricochet_words(found)}"
        return text + more if self.determined else text


def _drawn_figures() -> list[str]:
    """Names of the report's figures that matplotlib draws; those of the rounds are SVG, see `CheckResult.draw`."""
    from fragfield.report.figures.registered import FIGURES
    from fragfield.report.figures.rounds import DRAWINGS

    return [name for name in FIGURES if name not in DRAWINGS]
