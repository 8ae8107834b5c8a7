"""`fragfield.open`: the content of a run directory, read on demand."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fragfield.errors import InputError, nearest
from fragfield.files.run_directory import STAGES, RunDirectory
from fragfield.interface.case import Case
from fragfield_base.paths import absolute

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence

    import numpy as np
    from matplotlib.figure import Figure
    from numpy.typing import NDArray
    from pandas import DataFrame

    from flight import Fragments
    from fragfield.interface.hazard import HazardDistance
    from fragfield.report.findings.finding import Finding
    from fragfield.report.reading.run_files import RoundTables, RunFiles
    from fragfield.results.rules import Official
    from fragfield.results.site import ExposedSite
    from fragfield.results.summary import Summary


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
    """A run directory. Numbers are in SI; `print` shows the summary.

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

    @property
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

    @cached_property
    def burst(self) -> Burst:
        """The burst: casing and charge at its end, and histories; raises InputError where it has not been run."""
        self._file("burst_snapshot.h5", "burst")
        return Burst(self.files)

    @cached_property
    def fragments(self) -> Fragments:
        """Fragments of the first realisation at launch."""
        from flight import Fragments

        return Fragments.read(self._file("fragments.h5", "break-up"))

    @property
    def realisations(self) -> Sequence[Fragments]:
        """Fragments of every realisation of the break-up; those after the first are read one by one."""
        from flight.files.ensemble import read_fragment_ensemble
        from fragfield.pipeline.stages import WithFirst

        others = self.path / "ensemble_fragments.h5"
        return WithFirst(self.fragments, read_fragment_ensemble(others) if others.is_file() else ())

    @property
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
        from fragfield.interface.hazard import HazardDistance

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
        from fragfield.report.findings.findings import findings

        return findings(self.files)

    @cached_property
    def files(self) -> RunFiles:
        """All that the report and the figures show, as they read it; whole arrays of the burst among it."""
        from fragfield.report import read_run

        return read_run(self.path)

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

    def table(self, name: str) -> DataFrame:
        """A table by its name; raises InputError for another name."""
        from fragfield.interface.tables import read_table

        return read_table(self.path, name)

    @property
    def figures(self) -> dict[str, str]:
        """Names of the report's figures, and their titles; a few may have no data in this run."""
        from fragfield.report.figures.registered import FIGURES

        return {name: FIGURES[name].words(self.files)[0] for name in _drawn_figures()}

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
            figure = FIGURES[name].draw(self.files)
        if figure is None or isinstance(figure, str):
            title, _ = FIGURES[name].words(self.files)
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


class Burst:
    """The end of a burst, from burst_snapshot.h5, and what led to it.

    Parameters
    ----------
    files : RunFiles
        The run's files.

    Attributes
    ----------
    summary : Burst of fragfield.results.burst
        The part of the summary: cells, steps, masses, speeds, energy and momentum errors.
    """

    def __init__(self, files: RunFiles) -> None:
        self._files = files
        if files.summary.burst is None:
            raise InputError(f"{files.folder}: summary.json has no burst; run `fragfield burst` again")
        self.summary = files.summary.burst

    @property
    def time(self) -> float:
        """Time at its end (s)."""
        return float(self._files.burst_time or 0.0)

    @property
    def nodes(self) -> dict[str, NDArray[np.float64]]:
        """`reference` and `position` (m), `velocity` (m/s) of the casings' nodes, (n, 3), or (n, 2) of a meridian."""
        return self._files.nodes

    @property
    def cells(self) -> dict[str, NDArray[Any]]:
        """Of the casings' cells (c,): `nodes` (c, 8), or (c, 4) of a meridian, and their state."""
        return self._files.cells

    @property
    def history(self) -> dict[str, NDArray[np.float64]]:
        """Over `time` (s): `mean_casing_speed` (m/s), `outer_diameter` (m), energies (J) and `energy_error`."""
        return self._files.history

    @property
    def rounds(self) -> list[RoundTables]:
        """By round: `name`, `attributes`, and `segments` and `along` as structured arrays."""
        return self._files.rounds

    @property
    def is_axisymmetric(self) -> bool:
        """Whether the cells are those of a meridian."""
        return self._files.is_axisymmetric

    def __repr__(self) -> str:
        return f"<fragfield.Burst to {self.time * 1e6:.4g} us: {self.summary.cells} cells>"

    def __str__(self) -> str:
        found = self.summary
        names = ", ".join(one.name for one in self.rounds)
        return (
            f"burst of {names} to {self.time * 1e6:.4g} us: {found.cells} cells, {found.steps} steps\n"
            f"  mean initial speed of the casing {found.mean_initial_speed:.0f} m/s, energy error "
            f"{100.0 * found.energy_error:.2g} %"
        )


def _drawn_figures() -> list[str]:
    """Names of the report's figures that matplotlib draws; those of the rounds are SVG, see `CheckResult.draw`."""
    from fragfield.report.figures.registered import FIGURES
    from fragfield.report.figures.rounds import DRAWINGS

    return [name for name in FIGURES if name not in DRAWINGS]
