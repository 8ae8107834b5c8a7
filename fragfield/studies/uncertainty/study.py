"""Sample the uncertain inputs of a case: distribution of the distance, share of each input, one budget.

The inputs are those of the table [uncertainty] and of the default set. Given the directory of a run, that run is the
nominal one, and its report gains a section; else the case is run first.

Exit code 3 where a sample failed or has no distance; they are counted and left out.
"""

from __future__ import annotations

import math
import shutil
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from rich.table import Table as Lines

from flight.files.ensemble import read_ensemble
from fragfield.case.load import case_from_document
from fragfield.errors import EXIT_DONE, EXIT_NUMERICAL, InputError, NotDeterminedError
from fragfield.files.provenance import provenance_of
from fragfield.files.run_directory import STAGES, RunDirectory, stamped_json
from fragfield.hazard.recommended import recommended_of
from fragfield.hazard.site_map import write_contours
from fragfield.hazard.to_apply import distance_to_apply
from fragfield.interface.kinds import CaseOrRun, Samples, Seed, Settings
from fragfield.interface.running import options_of
from fragfield.pipeline.chain import run_chain
from fragfield.pipeline.job import RunOptions
from fragfield.quantities import column_of, shown
from fragfield.report import write_report, write_uncertainty_page
from fragfield.results import uncertainty as parts
from fragfield.results.hazard import Hazard, Recommended
from fragfield.results.part import to_json
from fragfield.results.rules import DistanceToApply
from fragfield.results.site import ExposedSite
from fragfield.results.summary import Summary
from fragfield.results.words import metres, parts_words
from fragfield.studies.study import DONE, FAILED, KEPT, WAITING, Row, Study, digest_of, maker
from fragfield.studies.uncertainty.plan import Plan, plan_samples
from fragfield.studies.uncertainty.statistics import analyse, spread_of, without_statistical_error
from fragfield.studies.workers import Task
from fragfield_base.cores import cores
from fragfield_base.version import __version__
from fragfield_base.writing import write_text

if TYPE_CHECKING:
    from pandas import DataFrame
    from rich.console import Console


_RESULT = "uncertainty.json"
_REPORT_SECONDS = 20.0
_SITE = ("density", "hits", "probability")
_LEVELS = (0.01, *(round(0.02 * step, 2) for step in range(1, 50)), 0.99)
_FEWEST = 8  # samples with a result, below which nothing is said


@dataclass(repr=False)
class Uncertainty(Study):
    """What uncertain inputs do to the distance; samples that fail are counted and raise nothing.

    Parameters
    ----------
    case : Case or path
        A case file, or the directory of a run, which then is the nominal one.
    samples : int, optional
        Number of samples; default uncertainty.samples.
    seed : int, optional
        Of points and samples; default the case's.
    set : sequence of str, or mapping
        Replaces a value of the case, by its dotted key; repeatable.

    Attributes
    ----------
    path : Path
        The folder: uncertainty.html, uncertainty.json, samples.csv and the nominal run.
    found : UncertaintyResult
        What `fragfield uncertainty --json` prints, by attribute: `exit_code` (3 where a sample failed or has no
        distance), `title`, `inputs`, `design`, `states` (numbers of samples by state, and the first messages),
        `distance` (the expected one) and `exposed` (spread, shares, tornado), `hazard`, the recommended distance of
        the nominal run with its parts, and `distance_to_apply` with it, as in summary.json.

    Raises
    ------
    InputError, NumericalStop
        The case or the folder is at fault, or the nominal run stopped; what was computed stays.
    """

    name: ClassVar[str] = "uncertainty"
    rows_file: ClassVar[str] = "samples"
    interim: ClassVar[bool] = False
    case: CaseOrRun

    samples: Samples | None = field(default=None, kw_only=True)
    seed: Seed | None = field(default=None, kw_only=True)
    set: Settings = field(default=(), kw_only=True)

    def plan(self) -> None:
        """Draw the samples."""
        self._request = options_of(self.case_file, set=self.set, progress=self.progress)
        self._plan = plan_samples(self._request.case(), samples=self.samples, seed=self.seed)
        self.sample_rows = [Row(f"sample {number}", None, "", {}) for number in range(self._plan.samples)]
        self.bursts = [self._burst(number) for number in range(self._plan.bursts)]
        self.rows = [*self.sample_rows, *(row for _, row in self.bursts)]

    def _burst(self, number: int) -> tuple[Task, Row]:
        name = f"burst_{number:04d}"
        directory = self.path / "bursts" / name
        case = case_from_document(self._plan.burst_document(number), source=name, folder=Path())
        task = Task(name, case, _nothing, directory=directory, only="burst", threads=self.threads)
        return task, Row(name, str(directory), digest_of(case), {})

    def identity(self) -> dict[str, Any]:
        """Case, inputs, points and seeds."""
        return self._plan.identity()

    def batches(self) -> Iterator[Sequence[Task]]:
        """The bursts that samples share, of which none may fail, then the samples."""
        if self.overwrite and not self.resume:
            for name in ("bursts", "nominal", "figures"):
                shutil.rmtree(self.path / name, ignore_errors=True)
        self.nominal = self._nominal()
        if self.bursts:
            (self.path / "bursts").mkdir(exist_ok=True)
            yield [task for task, _ in self.bursts]
            for number, (_, row) in enumerate(self.bursts, start=1):
                if row.state == FAILED:
                    raise InputError(
                        f"burst {number} of {len(self.bursts)} failed (exit code {row.exit_code}): {row.message}"
                    )
        self._began = self._said = time.monotonic()
        yield [self._sample(number) for number in range(self._plan.samples)]
        self._seconds = time.monotonic() - self._began

    def _sample(self, number: int) -> Task:
        shared = None if self._plan.burst is None else self.bursts[int(self._plan.burst[number])][0].directory
        return Task(
            self.sample_rows[number].name, self._plan.document(number), results_of_summary, burst=shared, sample=True,
            threads=self.threads,
        )  # fmt: skip

    def _nominal(self) -> RunDirectory:
        asked = self._request
        if asked.target.is_dir():
            directory = RunDirectory(asked.target)
            if asked.settings:
                raise InputError(
                    f"{directory.path}: found --set with a run directory, whose run is the nominal one; "
                    "allowed: with a case file"
                )
            if not directory.complete(STAGES["fly"]):
                raise InputError(
                    f"{directory.path}: has no flight; run `fragfield run {directory.path} --resume` first"
                )
            return directory
        directory = RunDirectory(self.path / "nominal")
        quiet = not self.progress
        own = RunOptions(asked.target, directory.path, resume=True, quiet=quiet, settings=asked.settings)
        stages = ("burst", "break-up", "fly")
        for stage in [one for one in stages if not directory.complete(STAGES[one])]:
            self.say(f"nominal run: {stage}")
            run_chain(own if stage == "burst" else RunOptions(directory.path, quiet=quiet), stage)
        return directory

    def announce(self, task: Task, number: int, of: int) -> None:
        """Say which burst begins."""
        if not task.sample:
            self.say(f"burst {number} of {of}")

    def row_ended(self, row: Row) -> None:
        """Say how far the samples are, from time to time."""
        done, now = sum(one.state != WAITING for one in self.sample_rows), time.monotonic()
        if row.directory is not None or (now - self._said < _REPORT_SECONDS and done < self._plan.samples):
            return
        self._said = now
        left = (now - self._began) / self._made * (self._plan.samples - done)
        self.say(f"sample {done} of {self._plan.samples}, about {left / 60.0:.1f} min left")

    @property
    def _made(self) -> int:
        return sum(row.state in (DONE, FAILED) for row in self.sample_rows)

    def make_runs(self) -> None:
        """The runs; then the number in the nominal run, and the pages."""
        super().make_runs()
        nominal = self.nominal
        write_uncertainty_page(self.path, nominal.path, self.found)
        with suppress(InputError):  # a run that may only be read; the study has its own page
            nominal.make()
            write_text(nominal.file(_RESULT), self.text(), InputError)
            self._renew()
            write_report(nominal.path)

    def _renew(self) -> None:
        nominal, summary = self.nominal, self.nominal.results()
        assert summary.hazard is not None  # it was flown
        hazard = recommended_of(summary.hazard, summary.convergence, self.found)
        nominal.write_results(replace(summary, hazard=hazard, distance_to_apply=_to_apply(hazard, summary)))
        if nominal.file("contours.geojson").is_file():
            case, ensemble = nominal.stored_case(), read_ensemble(nominal.file("ensemble.h5"))[0]
            exposed = summary.exposed or ()
            write_contours(case, ensemble, nominal, provenance_of(case), exposed, hazard.recommended)

    def text(self) -> str:
        """The results with a checksum; the folder is where they lie."""
        return stamped_json(to_json(replace(self.found, directory=None)))

    def result(self) -> parts.UncertaintyResult:
        """What the samples say, with the nominal run's summary."""
        cost = parts.StudyCost(
            samples_made_now=self._made, wall_seconds=self._seconds, workers=self.jobs or cores()
        )  # fmt: skip
        assessed = assess(self._plan, self.sample_rows, self.nominal.results())
        return replace(assessed, directory=str(self.path), nominal_run=str(self.nominal.path), cost=cost)

    def csv_rows(self) -> Iterator[list[object]]:
        """One row a sample: its draws, its state and its results."""
        plan = self._plan
        found = [row.results for row in self.sample_rows]
        names = list(dict.fromkeys(site["name"] for one in found for site in one.get("exposed") or []))
        units = {"distance": "m", "standard_error": "m", "density": "1/m^2"}
        units |= {one.name: one.unit for one in shown("uncertainty")}
        results = ["distance", "standard_error", *(one.name for one in shown("uncertainty"))]
        heads = [*(column_of(entry.name, entry.unit) for entry in plan.inputs), "state"]
        heads += [column_of(name, units.get(name, "")) for name in results]
        heads += [f"{site}: {column_of(what, units.get(what, ''))}" for site in names for what in _SITE]
        yield ["sample", *heads]
        words = {WAITING: "missing", FAILED: "failed"}
        for number, row in enumerate(self.sample_rows):
            state = words.get(row.state) or ("done" if row.results["determined"] else "not determined")
            at = {site["name"]: site for site in row.results.get("exposed") or []}
            cells = [row.results.get(name) for name in results]
            cells += [at.get(site, {}).get(what) for site in names for what in _SITE]
            yield [number, *plan.draws[number], state, *cells]

    def show(self, console: Console) -> None:
        """Print the recommended distance, the shares of the inputs and the exposed sites."""
        found, states = self.found, self.found.states
        lost = states.failed + states.not_determined + states.missing
        if lost:
            console.print(f"{lost} of {found.design.samples} samples gave no distance and are left out:")
            for message in states.messages:
                console.print(f"  {message}")
        if not found.distance:
            console.print(f"no result: {states.reason}")
            return
        spread = found.distance.spread
        console.print(
            f"expected distance over the inputs: 5 % {spread.low:.1f}, median {spread.median:.1f}, 95 % "
            f"{spread.high:.1f} m (± {spread.high_standard_error:.1f} m for {spread.samples} samples)"
        )
        table = Lines(box=None, pad_edge=False)
        for head in ("input", "share of the variance %", "distance at its 5 and 95 %, m"):
            table.add_column(head, justify="left" if head == "input" else "right")
        for one, bar in zip(found.distance.shares, found.distance.tornado, strict=True):
            share = f"{100 * one.share:.1f} ± {100 * one.share_standard_error:.1f}"
            table.add_row(one.name, share, f"{bar.low:.1f}  {bar.high:.1f}")
        console.print(table)
        for site in found.exposed:
            if site.hits is not None:
                over = site.hits.spread
                words = f"5 % {over.low:.3g}, median {over.median:.3g}, 95 % {over.high:.3g}"
                console.print(f"{site.name}: expected hits {words}")
        for words in (found.distance_to_apply.line, *found.distance_to_apply.words):
            console.print(words)
        console.print(self._recommended_words())
        if number := found.cost.samples_made_now:
            seconds = found.cost.wall_seconds
            console.print(f"{number} samples in {seconds:.0f} s, {seconds / number:.2f} s each")
        console.print(f"written to {self.path}")

    @property
    def recommended(self) -> float:
        """The recommended distance (m) of the nominal run with this study; NotDeterminedError where there is none."""
        if not self.found.distance:
            raise NotDeterminedError(f"the distance over the inputs is not determined: {self.found.states.reason}")
        return float(self.found.hazard.recommended)

    def _recommended_words(self) -> str:
        hazard = self.found.hazard
        return f"recommended distance {metres(hazard.recommended)}: {parts_words(hazard)}"

    @property
    def spread(self) -> tuple[float, float, float]:
        """Expected distance (m) at 5, 50 and 95 % of the inputs' distribution; NaN where there is none."""
        if not self.found.distance:
            return math.nan, math.nan, math.nan
        spread = self.found.distance.spread
        return spread.low, spread.median, spread.high

    @property
    def effects(self) -> DataFrame:
        """A row an input: its share of the distance's variance, with standard error and 95 % interval.

        Without rows where the samples are too few for shares.
        """
        from pandas import DataFrame

        return DataFrame(to_json(self.found.distance.shares if self.found.distance else ()))

    def __repr__(self) -> str:
        return f"<fragfield.Uncertainty {str(self.path)!r}: {self._plan.samples} samples>"

    def __str__(self) -> str:
        if not self.found.distance:
            return f"no distance over the inputs, see {self.path}"
        low, median, high = (metres(value) for value in self.spread)
        return (
            f"{self.found.distance_to_apply.line}\n  {self._recommended_words()}\n  expected distance over the inputs: "
            f"5 % {low}, median {median}, 95 % {high}, {self._plan.samples} samples"
        )


run_uncertainty = maker(Uncertainty)


def _nothing(summary: Summary) -> dict[str, Any]:
    del summary
    return {}


def results_of_summary(summary: Summary) -> dict[str, Any]:
    """The numbers of a sample that are kept (SI).

    `distance`, the expected one, with its `standard_error`, None where it is not `determined`; `mean_initial_speed`,
    `speed_99`, `fragments`, and for each exposed site its expected `density` (the larger of that normal to the path and
    that on the ground), `hits` and `probability` with their standard errors.
    """
    hazard = summary.hazard
    assert hazard is not None  # it was flown
    determined = hazard.determined
    return {
        "distance": hazard.expected if determined else None,
        "standard_error": hazard.standard_error if determined else None,
        "determined": determined,
        "reason": "" if determined else hazard.reason,
        **{one.name: one.of(summary) for one in shown("uncertainty")},
        "exposed": [_site(entry) for entry in summary.exposed or ()],
    }


def _site(entry: ExposedSite) -> dict[str, Any]:
    densities = [one for one in (entry.density_normal, entry.density_ground) if one]
    worst = max(densities, key=lambda one: one.expected or 0.0, default=None)
    found: dict[str, Any] = {"name": entry.name}
    for name, value in (("density", worst), ("hits", entry.expected_hits)):
        found[name] = value and value.expected
        found[f"{name}_standard_error"] = value and value.standard_error
    found["probability"] = entry.probability and entry.probability.expected
    return found


def _to_apply(hazard: Hazard, summary: Summary) -> DistanceToApply:
    return distance_to_apply(hazard, summary.official, () if summary.rules is None else summary.rules.rules)


def assess(plan: Plan, rows: Sequence[Row], summary: Summary) -> parts.UncertaintyResult:
    """What the samples say, with the nominal run's summary; see `Uncertainty.found`."""
    values = [row.results for row in rows]
    distance = _column(values, "distance")
    known = int(np.isfinite(distance).sum())
    few = f"{known} samples gave a distance; at least {_FEWEST} are needed" if known < _FEWEST else None
    nominal = results_of_summary(summary)
    found = parts.UncertaintyResult(
        exit_code=EXIT_DONE if known == plan.samples else EXIT_NUMERICAL,
        program_version=__version__,
        title=plan.case.title,
        inputs=tuple(entry.described() for entry in plan.inputs),
        design=parts.Design(
            samples=plan.samples, seed=plan.seed, bursts=plan.bursts, realisations=plan.realisations,
            geometry=plan.geometry,
        ),
        states=_states(rows, known, few),
        nominal=nominal,
        distance=None if few else parts.SampledQuantity(**_quantity(plan, distance, _column(values, "standard_error"))),
        exposed=(),
        hazard=None,
    )  # fmt: skip
    if few:
        return found
    assert summary.hazard is not None  # it was flown
    hazard = recommended_of(summary.hazard, summary.convergence, found)
    return replace(
        found,
        hazard=Recommended(recommended=hazard.recommended, parts=hazard.parts, not_included=hazard.not_included),
        distance_to_apply=_to_apply(hazard, summary),
        exposed=tuple(
            parts.SampledSite(
                name=site["name"], **{name: _of_site(plan, values, number, name, site[name]) for name in _SITE}
            )
            for number, site in enumerate(nominal["exposed"])
        ),
    )


def _states(rows: Sequence[Row], known: int, reason: str | None) -> parts.States:
    failed = [row for row in rows if row.state == FAILED]
    undetermined = [row for row in rows if row.state in (DONE, KEPT) and not row.results["determined"]]
    messages = [f"{row.name}: exit code {row.exit_code}: {row.message}" for row in failed]
    messages += [f"{row.name}: not determined: {row.message}" for row in undetermined]
    return parts.States(
        done=known, failed=len(failed), not_determined=len(undetermined),
        missing=sum(row.state == WAITING for row in rows), messages=tuple(messages[:10]), reason=reason,
    )  # fmt: skip


def _column(values: Sequence[Mapping[str, Any]], name: str) -> NDArray[np.float64]:
    return np.array([math.nan if one.get(name) is None else one[name] for one in values], dtype=np.float64)


def _quantity(plan: Plan, values: NDArray[np.float64], errors: NDArray[np.float64]) -> dict[str, Any]:
    known = np.isfinite(values)
    used = errors[known] if np.isfinite(errors[known]).all() else None
    rng = np.random.default_rng(np.random.SeedSequence([plan.seed, 3]))
    spread = spread_of(values[known], used, rng, None if plan.burst is None else plan.burst[known])
    inputs = [(entry.name, entry.distribution) for entry in plan.inputs]
    analysis = analyse(inputs, plan.points, values, seed=plan.seed, burst=plan.burst)
    own, _ = without_statistical_error(values[known], spread.statistical_error**2)
    curve = parts.Curve(level=_LEVELS, value=tuple(np.quantile(own, _LEVELS).tolist()))
    return {"spread": spread, "curve": curve, **analysis._asdict()}


def _of_site(
    plan: Plan, values: Sequence[Mapping[str, Any]], number: int, name: str, nominal: float | None
) -> parts.SampledSiteQuantity | None:
    sites = [one["exposed"][number] if one.get("exposed") else {} for one in values]
    found = _column(sites, name)
    if np.isfinite(found).sum() < _FEWEST:
        return None
    return parts.SampledSiteQuantity(
        nominal=nominal, **_quantity(plan, found, _column(sites, f"{name}_standard_error"))
    )
