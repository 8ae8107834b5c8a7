"""Signals at random moments of a run on one or two ranks: what is resumed equals what was left alone."""

from __future__ import annotations

import os
import random
import signal
import time
from collections import Counter
from contextlib import suppress
from pathlib import Path

from tests.attack.runs import CASE, different, run, start

__all__ = ["SIGNALS", "reference", "signalled"]

SIGNALS = (signal.SIGTERM, signal.SIGINT, signal.SIGKILL)
_ENDS = {signal.SIGTERM: (130,), signal.SIGINT: (130,), signal.SIGKILL: (-9, 137)}


def reference(folder: Path) -> tuple[Path, Path, float]:
    """Case, the directory of a run that was left alone, and its duration (s)."""
    folder.mkdir(parents=True, exist_ok=True)
    case = folder / "attacked.toml"
    case.write_text(CASE)
    whole = folder / "whole"
    code, words = run("run", case, "--out", whole, "--quiet")
    assert code in (0, 3), words
    began = time.monotonic()
    code, words = run("run", case, "--out", whole, "--quiet", "--overwrite")
    assert code in (0, 3), words
    return case, whole, time.monotonic() - began


def _children(process: int) -> list[int]:
    """Processes that a process has started."""
    try:
        return [int(one) for one in Path(f"/proc/{process}/task/{process}/children").read_text().split()]
    except OSError:
        return []


def signalled(
    folder: Path, number: int, chance: random.Random, made: tuple[Path, Path, float], ranks: int = 1
) -> tuple[str, list[str]]:
    """One run with one signal: the stage in which it came, and what is wrong afterwards."""
    case, whole, duration = made
    out, kind = folder / f"signalled_{ranks}_{number}", SIGNALS[number % 3]
    moment = duration * ranks**0.5 * (0.15 + 0.8 * chance.random())
    process = start("run", case, "--out", out, "--quiet", ranks=ranks)
    time.sleep(moment)
    # To every process of the session, as batch systems send it, or to the first alone.
    children = _children(process.pid) if ranks > 1 and kind == signal.SIGKILL else []
    for one in [process.pid, *children] if process.poll() is None else []:
        with suppress(ProcessLookupError):
            os.kill(one, kind)
    _, words = process.communicate(timeout=600)
    log = (out / "run.log").read_text() if (out / "run.log").is_file() else ""
    stage = log.rsplit(": begins", 1)[0].rsplit(" ", 1)[-1] if ": begins" in log else "before"
    what = f"{signal.Signals(kind).name} in {stage} at {moment:.1f} s"
    wrong = [] if process.returncode in (0, 3, *_ENDS[kind]) or ranks > 1 else [f"{what}: exit {process.returncode}"]
    wrong += [f"{what}: {words[-300:]}"] if "Traceback" in words else []
    for _ in range(3):
        code, words = run("run", case, "--out", out, "--quiet", "--resume")
        if code in (0, 3):
            break
    else:
        return stage, [*wrong, f"{what}: resumed with exit {code}: {words[-300:]}"]
    return stage, wrong + [f"{what}: {key}" for key in different(out, whole)]


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
