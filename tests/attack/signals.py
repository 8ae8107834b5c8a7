"""Signals at random moments of every stage, on one or two ranks: what is resumed equals what was left alone."""

from __future__ import annotations

import os
import random
import re
import shutil
import signal
import time
from collections import Counter
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fragfield.files.run_directory import STAGES, RunDirectory
from tests.attack.runs import CASE, different, run, start

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["PLAN", "SIGNALS", "Reference", "attack", "signalled"]

SIGNALS = (signal.SIGTERM, signal.SIGINT, signal.SIGKILL)
PLAN = ("burst", "fly", "burst", "break-up", "burst", "fly", "burst", "break-up", "burst", "report")
"""Stages in which signals come, in turn; each has all three."""
_ENDS = {signal.SIGTERM: (130,), signal.SIGINT: (130,), signal.SIGKILL: (-9, 137)}
_LATE, _TRIES = "too late", 4
_CRASHES = ("Traceback", "Segmentation", "signal 11", "signal 6", "Fatal Python error")


class Reference:
    """A run that was left alone.

    Attributes
    ----------
    case, whole : Path
        The case, and the directory of its run.
    durations : dict of str to float
        How long its stages took (s).
    stepping : float
        How long its burst took from its first output on (s).
    pace : dict of str to float
        Share of these times within which a signal is sent; less where signals came too late.
    """

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.case, self.whole = folder / "attacked.toml", folder / "whole"
        self.case.write_text(CASE)
        warm = folder / "warm"  # compiles, which is to be no part of the durations
        for verb, out in (("burst", warm), ("break-up", warm), ("fly", warm), ("run", self.whole)):
            code, words = run(verb, self.case if verb in ("burst", "run") else out, "--out", out, "--quiet")
            assert code in (0, 3), words
        self.bursts = {1: self.whole}
        self.pace = dict.fromkeys(STAGES, 1.1)
        self.stepping = 0.0
        self.stepping = self._burst_on(1, folder / "timed")
        log = (self.whole / "run.log").read_text()
        self.durations = {name: float(took) for name, took in re.findall(r"([\w-]+): done in ([\d.]+) s", log)}

    def burst_on(self, ranks: int) -> Path:
        """A burst on so many ranks: sums over all cells, as in the ledgers, differ in the last bit by their number."""
        if ranks not in self.bursts:
            folder = self.whole.with_name(f"burst_on_{ranks}")
            self._burst_on(ranks, folder)
            self.bursts[ranks] = folder
        return self.bursts[ranks]

    def _burst_on(self, ranks: int, folder: Path) -> float:
        """Compute the burst; gives the time from its first output on."""
        process, began = start("burst", self.case, "--out", folder, "--quiet", ranks=ranks), 0.0
        while process.poll() is None:
            time.sleep(0.02)
            if not began and (folder / "burst").is_dir():
                began = time.monotonic()
        _, words = process.communicate()
        assert process.returncode == 0, words
        return time.monotonic() - began

    def before(self, stage: str, folder: Path) -> Path:
        """A run directory as it is when a stage begins: a copy without what that stage and later ones write."""
        shutil.rmtree(folder, ignore_errors=True)
        later = list(STAGES.values())[list(STAGES).index(stage) :]
        if stage != "burst":
            shutil.copytree(self.whole, folder, ignore=shutil.ignore_patterns("run.log", "figures"))
            RunDirectory(folder).remove(later)
        return folder


def _children(process: int) -> list[int]:
    """Processes that a process has started."""
    try:
        return [int(one) for one in Path(f"/proc/{process}/task/{process}/children").read_text().split()]
    except OSError:
        return []


def _aimed(process: int, ranks: int, kind: signal.Signals, generator: random.Random) -> tuple[str, list[int]]:
    """Who gets the signal: a command; or all ranks, as batch systems do, one of them, or their launcher."""
    if ranks == 1:
        return "the command", [process]
    children = _children(process)
    aim = generator.choice(["all ranks", "one rank", "the launcher"])
    if aim == "the launcher" and kind != signal.SIGKILL:  # a launcher that is killed leaves its ranks behind
        return aim, [process]
    return (aim, [generator.choice(children)]) if aim == "one rank" and children else ("all ranks", children)


def signalled(
    folder: Path, number: int, generator: random.Random, made: Reference, ranks: int = 1, stage: str = "burst"
) -> tuple[str, list[str]]:
    """One run with one signal within a stage: how that went in a word, and what is wrong afterwards."""
    kind, out = SIGNALS[number % 3], made.before(stage, folder / f"signalled_{ranks}_{number}")
    verb, options = ("burst", {}) if stage == "burst" else ("run", {"report": stage == "report"})
    process = start(
        verb, made.case, "--out", out, "--quiet", *(["--resume"] if stage != "burst" else []), ranks=ranks, **options
    )
    within = stage == "burst" and generator.random() < 0.7
    while process.poll() is None and (
        f"{stage}: begins" not in _text(out / "run.log") or (within and not (out / "burst").is_dir())
    ):
        time.sleep(0.02)
    delay = made.pace[stage] * (made.stepping if within else made.durations[stage]) * generator.random()
    time.sleep(delay)
    aim, aims = _aimed(process.pid, ranks, kind, generator)
    for one in aims:
        with suppress(ProcessLookupError):
            os.kill(one, kind)
    _, words = process.communicate(timeout=900)
    what = f"{kind.name} to {aim} of {ranks}, {delay:.2f} s into {'the steps of ' * within}{stage}"
    finished = process.returncode in (0, 3)
    went_on = stage == "burst" and (out / "checkpoint.h5").is_file()
    wrong = []
    if not finished and ranks == 1 and process.returncode not in _ENDS[kind]:
        wrong.append(f"{what}: exit {process.returncode}, {words[-300:]}")
    if any(crash in words for crash in _CRASHES):
        wrong.append(f"{what}: {words[-600:]}")
    code, words = (0, "") if finished else _resumed(verb, made.case, out, ranks, options)
    if code not in (0, 3):
        return "wrong", [*wrong, f"{what}: resumed with exit {code}: {words[-300:]}"]
    alone, through = (made.burst_on(ranks), "burst") if stage == "burst" else (made.whole, "fly")
    wrong += [f"{what}: {key}" for key in different(out, alone, through)]
    wrong += [f"{what}: no report" for _ in [0] if stage == "report" and not (out / "report.html").is_file()]
    if wrong:
        return "wrong", wrong
    shutil.rmtree(out)
    return _LATE if finished else "resumed from its checkpoint" if went_on else "resumed", wrong


def _resumed(verb: str, case: Path, out: Path, ranks: int, options: dict[str, Any]) -> tuple[int, str]:
    """Exit code and words of the command that goes on; ranks that lost their launcher may still be ending."""
    until = time.monotonic() + 30.0
    while True:
        code, words = run(verb, case, "--out", out, "--quiet", "--resume", ranks=ranks, **options)
        if code == 0 or "is writing into it" not in words or time.monotonic() > until:
            return code, words
        time.sleep(1.0)


def _text(path: Path) -> str:
    return path.read_text() if path.is_file() else ""


def attack(
    folder: Path, seed: int, trials: int, until: float, made: Reference, ranks: int = 1, plan: Sequence[str] = PLAN
) -> list[str]:
    """Signals until the trials are done or the time (of the monotonic clock) is over; what went wrong.

    One that came too late, which shows little, is sent once more, earlier; at most so often.
    """
    generator, ends, wrong, done = random.Random(seed), Counter[Any](), [], 0
    folder.mkdir(parents=True, exist_ok=True)
    for number in range(trials):
        if time.monotonic() > until:
            break
        stage = plan[number // len(SIGNALS) % len(plan)]
        for _ in range(_TRIES):
            how, found = signalled(folder, number, generator, made, ranks, stage)
            made.pace[stage] = 0.8 * made.pace[stage] if how == _LATE else min(1.1, 1.1 * made.pace[stage])
            if how != _LATE:
                break
        ends[f"{SIGNALS[number % 3].name} in {stage}: {how}"] += 1
        wrong += found
        done += 1
    print(f"signals on {ranks} rank(s), seed {seed}: {done} runs, {dict(ends)}; {len(wrong)} wrong", flush=True)
    return wrong
