"""`fragfield.open`: the content of a run directory, for scripts, report, pictures and application."""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING

from fragfield.errors import InputError, NotDeterminedError, nearest
from fragfield.interface.case import Case
from fragfield.results.run import StoredRun
from fragfield.results.words import basis_words, headline, ricochet_words, source_words
from fragfield_base.paths import absolute

if TYPE_CHECKING:
    import os

    from matplotlib.figure import Figure
    from pandas import DataFrame

    from fragfield.report.findings import Finding
    from fragfield.results.hazard import DistanceParts, Hazard, WithoutRicochet
    from fragfield.results.rules import DistanceToApply
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


class Run(StoredRun):
    """A run directory, whose files are read when they are asked for. Numbers are in SI; `print` shows the summary.

    Parameters
    ----------
    path : path
        The directory.
    """

    @cached_property
    def case(self) -> Case:
        """The resolved case."""
        return Case.of_run(self._directory)

    @property
    def hazard(self) -> HazardDistance:
        """The distances to apply, the recommended one and its parts; raises InputError where nothing was flown."""
        self._file("landing.h5", "fly")
        return HazardDistance(self.summary, self.path)

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

        return {name: what for name, (file, what) in TABLES.items() if (self.path / file).is_file()}

    def write_tables(self, path: str | os.PathLike[str]) -> Path:
        """Write the results in numbers and all tables into one workbook (.xlsx).

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

        return read_table(self, name)

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

    def __repr__(self) -> str:
        done = ", ".join(name for name, is_done in self.stages.items() if is_done)
        return f"<fragfield.Run {str(self.path)!r}: {done or 'nothing'} done>"

    def __str__(self) -> str:
        from fragfield.terminal.show import summary_text

        return summary_text(replace(self.summary, title=self.case.title), str(self.path))


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
    realisations : int
        Events that were flown.
    recommended : float
        The recommended distance (m): the expected one and what is not known of it, added up.
    parts : DistanceParts
        Its parts (m), the expected distance and half-widths; of one that is None `not_included` says why.
    expected, upper, standard_error : float
        Distance (m) at which the expected density of hazardous fragments falls through the acceptable one, its
        one-sided 95 % upper bound and its standard error; the latter two None for a single realisation.
    without_ricochet : WithoutRicochet
        The same distances of the same flights up to the first impact.
    direction, bearing : float
        Worst direction: azimuth (degrees from +x), None over all azimuths, and bearing, None without [site] too.
    """

    recommended: float
    parts: DistanceParts
    not_included: dict[str, str]
    expected: float
    upper: float | None
    standard_error: float | None
    without_ricochet: WithoutRicochet
    direction: float | None
    bearing: float | None

    def __init__(self, summary: Summary, directory: Path) -> None:
        if summary.hazard is None or summary.distance_to_apply is None:
            raise InputError(f"{directory}: contains no distance; run `fragfield fly` first")
        self._directory = directory
        self.to_apply: DistanceToApply = summary.distance_to_apply
        self.summary: Hazard = summary.hazard
        self.determined, self.reason = self.summary.determined, self.summary.reason
        self.realisations = self.summary.realisations

    def __getattr__(self, name: str) -> object:
        if name not in HazardDistance.__annotations__:
            raise AttributeError(f"HazardDistance has no {name}")
        if not self.determined:
            raise NotDeterminedError(f"{self._directory}: the distance is not determined: {self.reason}")
        return getattr(self.summary, f"{name}_deg" if name in ("direction", "bearing") else name)

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
