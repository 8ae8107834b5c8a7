"""What a run is asked for, and what each of its stages works on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fragfield.case import CaseTable, plain
from fragfield.case.changes import Settings, load_case
from fragfield.case.conversion.turned import Turned
from fragfield.files.provenance import versions
from fragfield.files.run_directory import RunDirectory, Stage
from fragfield.pipeline.parallel import Team
from fragfield.results.summary import Summary, Warned
from fragfield_base.cores import cores
from fragfield_base.version import __version__

if TYPE_CHECKING:
    from fragfield.terminal.progress import Progress, ProgressReporter


@dataclass(frozen=True)
class RunOptions:
    """What the command line or a Python program asks for, from there to the stages as it is."""

    target: Path
    """A case file or a run directory."""
    out: Path | None = None
    """Run directory to write; left out: the run directory given, or runs/NAME for NAME.toml."""
    threads: int | None = None
    """Threads of a rank."""
    resume: bool = False
    overwrite: bool = False
    """See `RunDirectory.claim`."""
    quiet: bool = False
    """No progress."""
    fragments: Path | None = None
    """Fragments from another source, for the stage `fly`."""
    settings: Settings = ()
    """KEY=VALUE, or values by dotted key, that replace values of the case."""
    lean: bool = False
    """Numbers alone, for a sweep: no report, no files for visualisation, no other cell sizes."""
    made: CaseTable | None = None
    """The resolved case, instead of a file's; `target` is then its run directory, and a stage's case is this one."""
    follow: Callable[[Progress], object] | None = None
    """Called with the progress, on rank 0."""

    def case(self, *, burst: bool = True) -> CaseTable:
        """The resolved case of the file, or of the run directory; raises InputError."""
        if self.made is not None:
            return self.made
        if self.target.is_dir():
            stored = RunDirectory(self.target)
            stored.stored_case()  # says what is missing, in the words of a run directory
            return self._loaded(stored.case_file, burst=burst)
        return self._loaded(self.target, burst=burst)

    def _loaded(self, path: Path, *, burst: bool) -> CaseTable:
        return load_case(path, self.settings, burst=burst)

    @property
    def directory(self) -> RunDirectory:
        """Where the run is written."""
        if self.out is not None:
            return RunDirectory(self.out)
        if self.target.is_dir():
            return RunDirectory(self.target)
        return RunDirectory(Path.cwd() / "runs" / self.target.stem)

    @property
    def source(self) -> RunDirectory:
        """Where a stage finds the files of earlier stages."""
        return RunDirectory(self.target) if self.target.is_dir() else self.directory


@dataclass(frozen=True)
class Job:
    """What a stage works on."""

    case: CaseTable
    """Resolved."""
    source: RunDirectory
    target: RunDirectory
    """Where the stage reads and writes; the same but for `--out`."""
    team: Team
    """The ranks of the launch."""
    reporter: ProgressReporter
    """Follows the stages on the terminal."""
    options: RunOptions
    """What was asked for."""
    attitude: Turned | None = None
    """The one attitude in which an arrangement of mixed attitudes is flown; left out: all."""
    sample: bool = False
    """Whether an integral is that of a sample, as of `Integrand`."""

    @property
    def cores(self) -> int:
        """Threads of a rank."""
        return self.options.threads or cores()

    def needed(self, stage: Stage) -> Path:
        """The stage's input file."""
        return self.source.file(stage.needs)

    def note(self, stage: Stage, made: Summary, warned: Sequence[Warned]) -> None:
        """Put the parts that a stage has made into summary.json, and its warnings in place of its earlier ones."""
        before = self.source.results()
        others = (one for one in before.findings if one.stage != stage.name)
        parts: dict[str, Any] = {part: getattr(made, part) for part in stage.parts}
        now = replace(
            before, case=plain(self.case), title=self.case.title, program_version=__version__, versions=versions(),
            seed=self.case.seed, findings=(*others, *warned), **parts,
        )  # fmt: skip
        if stage.parts or now.findings != before.findings:  # a report adds its page alone
            self.target.write_results(now)
