"""A short run of all stages, how it is started, and whether two of its directories hold the same results."""

from __future__ import annotations

import json
import re
import signal
import subprocess
from pathlib import Path
from typing import Any

from fragfield.files.run_directory import STAGES
from tests.datasets import differing
from tests.fragfield.short_run import SHORT, command, environment
from tests.ranks import mpirun_command

__all__ = ["CASE", "FILES", "different", "run", "start"]

CASE = SHORT.replace('"12 us"', '"30 us"\nsymmetry = "off"').replace("realisations = 8", "realisations = 4")
"""Three tenths of the passage of the front in cells of 12 mm, four realisations."""
FILES = {
    "burst": ("burst_snapshot.h5", "burst", "burst.xdmf"),
    "break-up": ("fragments.h5", "fragments.csv", "ensemble_fragments.h5", "arena.csv"),
    "fly": ("landing.h5", "landing.csv", "hits.h5", "witness.csv", "ensemble.h5", "ensemble.csv", "trajectories.h5",
            "trajectories.xdmf", "hazard_by_distance.csv", "hazard_by_sector.csv"),
}  # fmt: skip
"""What the stages write and is compared: every array to the last bit, every text but for its dates."""
_DATED = re.compile(
    r'^# (date|revision|environment) = .*$|<Information Name="(date|revision|environment)"[^>]*>', re.MULTILINE
)
_CLOCKS = ("wall_seconds", "seconds_per_cell_step", "peak_memory_bytes", "checksum", "versions", "phases", "seconds")


_WITHOUT_REPORT = (
    "import fragfield.pipeline.stages as stages; "
    "stages._STAGE_FUNCTIONS['report'] = lambda job, stage: stages.Summary(); "
)
# PETSc, loaded before its variables are settled, takes signals for itself and ends the command at once on its way out.
_SETTLED = "from fragfield_base.ambient import settle; settle(RuntimeError); "
_OFTEN = _SETTLED + "import burst_fenicsx.simulation as one; one._CHECKPOINT_SECONDS = 0.2; "
_COMMAND = "import sys; from fragfield.cli import main; sys.argv[0] = 'fragfield'; main()"


def start(*arguments: object, ranks: int = 1, report: bool = True, **options: Any) -> subprocess.Popen[str]:
    """Start the command in a session of its own; without `report` the chain ends before its last stage, in time.

    A burst writes checkpoints every fifth of a second, so that one that is killed has something to go on from.
    """
    words = command(*arguments)
    code = (_OFTEN if arguments[0] == "burst" else "") + ("" if report else _WITHOUT_REPORT)
    if code:
        words = [words[0], "-X", "faulthandler", "-c", code + _COMMAND, *map(str, arguments)]
    launcher = mpirun_command(ranks) if ranks > 1 else []
    variables = environment()
    if ranks > 1:
        variables |= {"OMPI_ALLOW_RUN_AS_ROOT": "1", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM": "1"}
        variables |= {"OMPI_MCA_odls_base_sigkill_timeout": "5"}
    return subprocess.Popen(
        [*launcher, *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env=variables, start_new_session=True, preexec_fn=_take_interrupts, **options,  # noqa: PLW1509 - one thread
    )  # fmt: skip


def _take_interrupts() -> None:
    """A shell's background jobs ignore SIGINT, and hand that on."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)


def run(*arguments: object, timeout: float = 900.0, ranks: int = 1, **options: Any) -> tuple[int, str]:
    """Exit code and stderr of a command that is left alone."""
    process = start(*arguments, ranks=ranks, **options)
    _, words = process.communicate(timeout=timeout)
    return process.returncode, words


def different(ours: Path, theirs: Path, through: str = "fly") -> list[str]:
    """Files and keys in which two run directories hold other results; empty when they agree to the last bit.

    Of the stages to the one of the name `through`, and of their parts of the summary.
    """
    found = []
    stages = list(FILES)[: list(FILES).index(through) + 1]
    for name in (name for stage in stages for name in FILES[stage]):
        if (ours / name).exists() != (theirs / name).exists():
            found.append(f"{name} is in one of them only")
        elif not (ours / name).exists():
            continue
        elif name.endswith(".h5") or (ours / name).is_dir():
            found += [f"{name}: {key}" for key in differing(ours / name, theirs / name)]
        elif _DATED.sub("", (ours / name).read_text()) != _DATED.sub("", (theirs / name).read_text()):
            found.append(f"{name}: its text")
    one, other = (json.loads((folder / "summary.json").read_text()) for folder in (ours, theirs))
    parts = [part for stage in stages for part in STAGES[stage].parts]
    one, other = ({part: summary.get(part) for part in parts} for summary in (one, other))
    return found + [f"summary.json: {key}" for key in _different_values(one, other)]


def _different_values(one: Any, other: Any, path: str = "") -> list[str]:
    if isinstance(one, dict) and isinstance(other, dict):
        keys = sorted(set(one) | set(other))
        return [
            word
            for key in keys
            if not any(clock in key for clock in _CLOCKS)
            for word in _different_values(one.get(key), other.get(key), f"{path}.{key}")
        ]
    if isinstance(one, list) and isinstance(other, list) and len(one) == len(other):
        return [
            w for i, (a, b) in enumerate(zip(one, other, strict=True)) for w in _different_values(a, b, f"{path}[{i}]")
        ]
    return [] if one == other else [path]
