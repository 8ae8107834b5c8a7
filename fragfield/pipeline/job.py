"""Input of a stage: the case, the run directory, and settings of the process."""

from __future__ import annotations

import math
import os
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from fragfield.case import plain
from fragfield.files.provenance import versions
from fragfield.version import __version__

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from fragfield.case import Case
    from fragfield.case.conversion.turned import Turned
    from fragfield.files.run_directory import RunDirectory, Stage
    from fragfield.pipeline.parallel import Team
    from fragfield.terminal.progress import ProgressReporter

__all__ = ["Job"]


@dataclass(frozen=True)
class Job:
    """What a stage works on.

    Attributes
    ----------
    case : Case
        Resolved.
    source, target : RunDirectory
        Where the stage reads and writes; the same but for `--out`.
    team : Team
        The ranks of the launch.
    reporter : ProgressReporter
        Follows the stages on the terminal.
    threads : int, optional
        Threads of a rank; left out: all that the rank may use.
    fragments : Path, optional
        Fragments from another source, to fly instead of the run's own.
    resume : bool
        Go on from a burst's checkpoint where there is one.
    lean : bool
        Numbers alone: no files for visualisation, no other cell sizes.
    profile : bool
        Time the parts of the burst.
    attitude : Turned, optional
        The one attitude in which an arrangement of mixed attitudes is flown; left out: all.
    noted : dict
        What has been put into summary.json.
    """

    case: Case
    source: RunDirectory
    target: RunDirectory
    team: Team
    reporter: ProgressReporter
    threads: int | None = None
    fragments: Path | None = None
    resume: bool = False
    lean: bool = False
    profile: bool = False
    attitude: Turned | None = None
    noted: dict[str, Any] = field(default_factory=dict)

    @property
    def cores(self) -> int:
        """Threads of a rank."""
        return self.threads or len(os.sched_getaffinity(0))

    def needed(self, stage: Stage) -> Path:
        """The stage's input file."""
        return self.source.file(stage.needs)

    def note(self, parts: Mapping[str, Any]) -> None:
        """Put parts into summary.json, beside those of earlier stages."""
        summary = {
            "case": plain(self.case),
            "title": self.case.title,
            "program_version": __version__,
            "versions": versions(),
            "seed": self.case.seed,
        }
        earlier = {key: value for key, value in self.source.summary().items() if key not in summary}
        self.noted.update(parts)  # the source has them where it is the target, too
        everything = {**summary, **earlier, **self.noted}
        self.target.write_summary({key: _finite(value) for key, value in everything.items()})


def _finite(value: object) -> object:
    """JSON has no NaN and no infinity: what was never reached is null."""
    if hasattr(value, "tolist"):
        value = value.tolist()
    if isinstance(value, dict):
        return {str(key): _finite(entry) for key, entry in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(entry) for entry in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
