"""Whole commands in which one call of the system fails: how they end, the closing of libraries and of Python with it.

A process that has met a fault may have handled all of it and still end by a signal, when a library closes what a kept
object holds. `python -m tests.attack.exits RUN VERB SEED TRIALS` loads all that a command needs once, and then makes a
copy of itself (fork) for every fault: each ends as the command line does.
"""

from __future__ import annotations

import errno
import os
import random
import shutil
import subprocess
import sys
from collections import Counter
from contextlib import suppress
from pathlib import Path

import numba

from tests.faults import failing_call
from tests.fragfield.short_run import environment

__all__ = ["attack"]

_CODES = (errno.ENOSPC, errno.EIO, errno.EACCES, errno.ENOENT, errno.EDQUOT)
_ALLOWED = (0, 2, 3)


def attack(run: Path, folder: Path, seed: int, trials: int, verb: str = "fly") -> list[str]:
    """Let a call fail in `trials` commands on copies of a finished run; those that did not end as they must."""
    folder.mkdir(parents=True, exist_ok=True)
    words = [sys.executable, "-X", "faulthandler", "-m", "tests.attack.exits"]
    done = subprocess.run(
        [*words, str(run), str(folder), verb, str(seed), str(trials)],
        capture_output=True, text=True, env=environment(), check=False,
    )  # fmt: skip
    print(done.stdout.splitlines()[-1] if done.stdout else "no word", flush=True)
    wrong = [line for line in done.stdout.splitlines() if line.startswith("WRONG ")]
    return wrong if done.returncode == 0 else [*wrong, f"exit {done.returncode}: {done.stderr[-2000:]}"]


def _copy(run: Path, to: Path) -> Path:
    shutil.rmtree(to, ignore_errors=True)
    shutil.copytree(run, to, ignore=shutil.ignore_patterns("figures", "run.log"))
    return to


def _command(verb: str, run: Path) -> None:
    from fragfield.cli import main

    sys.argv = ["fragfield", verb, str(run), "--quiet"]
    main()


def _ended(status: int, words: str) -> tuple[str, bool]:
    """How a process ended, and whether it may."""
    if os.WIFSIGNALED(status):
        return f"signal {os.WTERMSIG(status)}", False
    code = os.WEXITSTATUS(status)
    said = [line for line in words.splitlines() if line.startswith("fragfield: ")]
    good = code in _ALLOWED and "Traceback" not in words and "Fatal" not in words and (len(said) == 1 or code != 2)
    return f"exit {code}", good


def _attack(run: Path, folder: Path, verb: str, seed: int, trials: int) -> None:
    """In the parent: faults one after the other. A child returns from here into a command that meets its fault.

    GNU OpenMP, by which numba shares loops, ends a copy of a process that has used it; numba's own threads do not. No
    command of the program is such a copy: its processes are started afresh.
    """
    numba.config.THREADING_LAYER = "workqueue"
    generator, ends, wrong = random.Random(seed), Counter[str](), 0
    work = folder / "faulty"
    with failing_call(-1) as seen, suppress(SystemExit):  # loads all, and counts
        _command(verb, _copy(run, work))
    number = len(seen)
    for _ in range(trials):
        call, code = generator.randrange(number), generator.choice(_CODES)
        _copy(run, work)
        log = folder / "words.txt"
        child = os.fork()
        if child == 0:
            out = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
            os.dup2(out, 1)
            os.dup2(out, 2)
            with failing_call(call, code):
                _command(verb, work)
            return
        _, status = os.waitpid(child, 0)
        words = log.read_text()
        how, good = _ended(status, words)
        ends[how] += 1
        if not good:
            wrong += 1
            text = " ".join(words.split())[-600:]
            print(f"WRONG call {call} ({seen[call]}) of {verb} fails with {errno.errorcode[code]}: {how}: {text}")
    print(f"faults in {verb}, seed {seed}: {trials} of {number} calls, {dict(ends)}; {wrong} wrong", flush=True)


if __name__ == "__main__":
    _attack(Path(sys.argv[1]), Path(sys.argv[2]), sys.argv[3], int(sys.argv[4]), int(sys.argv[5]))
