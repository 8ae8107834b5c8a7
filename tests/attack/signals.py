"""Signals at random moments of a run on one or two ranks: what is resumed equals what was left alone."""

from __future__ import annotations

import os
import random
import re
import signal
import time
from collections import Counter
from contextlib import suppress
from pathlib import Path

from tests.attack.runs import CASE, different, run, start

__all__ = ["SIGNALS", "reference", "signalled"]

SIGNALS = (signal.SIGTERM, signal.SIGINT, signal.SIGKILL)
_ENDS = {signal.SIGTERM: (130,), signal.SIGINT: (130,), signal.SIGKILL: (-9, 137)}


def reference(folder: Path) -> tuple[Path, Path, dict[str, float]]:
    """Case, the directory of a run that was left alone, and how long (s) its stages took."""
    folder.mkdir(parents=True, exist_ok=True)
    case = folder / "attacked.toml"
    case.write_text(CASE)
    whole = folder / "whole"
    code, words = run("run", case, "--out", whole, "--quiet")  # compiles
    assert code in (0, 3), words
    code, words = run("run", case, "--out", whole, "--quiet", "--overwrite")
    assert code in (0, 3), words
    log = (whole / "run.log").read_text()
    return case, whole, {name: float(time) for name, time in re.findall(r"([\w-]+): done in ([\d.]+) s", log)}


def _children(process: int) -> list[int]:
    """Processes that a process has started."""
    try:
        return [int(one) for one in Path(f"/proc/{process}/task/{process}/children").read_text().split()]
    except OSError:
        return []


def signalled(
    folder: Path, number: int, chance: random.Random, made: tuple[Path, Path, dict[str, float]], ranks: int = 1
) -> tuple[str, list[str]]:
    """One run with one signal: the stage in which it came, and what is wrong afterwards."""
    case, whole, durations = made
    out, kind = folder / f"signalled_{ranks}_{number}", SIGNALS[number % 3]
    stage = chance.choice(["burst", "burst", "burst", *durations])
    verb = "burst" if stage == "burst" else "run"
    process = start(verb, case, "--out", out, "--quiet", ranks=ranks)
    while process.poll() is None and f"{stage}: begins" not in _text(out / "run.log"):
        time.sleep(0.02)
    delay = durations[stage] * chance.random()
    time.sleep(delay)
    # A launcher is one signal away from its ranks: sent to these, as batch systems do.
    children = _children(process.pid) if ranks > 1 else []
    for one in children or [process.pid]:
        with suppress(ProcessLookupError):
            os.kill(one, kind)
    _, words = process.communicate(timeout=600)
    what = f"{signal.Signals(kind).name} {delay:.2f} s into {stage}"
    ended = process.returncode in (0, 3, *_ENDS[kind]) or ranks > 1
    wrong = [] if ended else [f"{what}: exit {process.returncode}, {words[-300:]}"]
    wrong += [f"{what}: {words[-300:]}"] if "Traceback" in words else []
    finished = process.returncode in (0, 3)
    code, words = (0, "") if finished else run(verb, case, "--out", out, "--quiet", "--resume")
    if code not in (0, 3):
        return stage, [*wrong, f"{what}: resumed with exit {code}: {words[-300:]}"]
    found = different(out, whole, None if verb == "run" else ("burst.h5", "burst_snapshot.h5"))
    return f"{stage}, too late" if finished else stage, wrong + [f"{what}: {key}" for key in found]


def _text(path: Path) -> str:
    return path.read_text() if path.is_file() else ""


def attack(folder: Path, seed: int, trials: int, until: float, ranks: int = 1) -> list[str]:
    """Signals until the trials are done or the time (of the monotonic clock) is over; what went wrong."""
    chance, stages, wrong, done = random.Random(seed), Counter[str](), [], 0
    made = reference(folder)
    for number in range(trials):
        if time.monotonic() > until:
            break
        stage, found = signalled(folder, number, chance, made, ranks)
        stages[stage] += 1
        wrong += found
        done += 1
    print(f"signals on {ranks} rank(s), seed {seed}: {done} runs, in {dict(stages)}; {len(wrong)} wrong", flush=True)
    return wrong
