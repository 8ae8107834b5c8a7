"""Disks that are full: one message, everything before readable, and equal results once there is room."""

from __future__ import annotations

import random
import shutil
import subprocess
import time
from collections import Counter
from pathlib import Path

from tests.attack.runs import different, run
from tests.attack.signals import reference

__all__ = ["attack", "filled"]


def filled(
    folder: Path, kilobytes: int, case: Path, whole: Path, verb: str = "run", names: tuple[str, ...] | None = None
) -> tuple[str, list[str]]:
    """A run on a disk of this size, made larger afterwards: where it stopped, and what is wrong."""
    disk = folder / "disk"
    disk.mkdir(exist_ok=True)
    subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={kilobytes}k", "tmpfs", str(disk)], check=True)
    try:
        out, what = disk / "run", f"disk of {kilobytes} kB"
        code, words = run(verb, case, "--out", out, "--quiet")
        said = [line for line in words.splitlines() if line.startswith("fragfield: ")]
        wrong = []
        if code not in (0, 3):
            if code != 2 or len(said) != 1 or "Traceback" in words:
                wrong.append(f"{what}: exit {code}, {words[-300:]}")
            elif "disk is full" not in said[0] and "No space left" not in said[0]:
                wrong.append(f"{what}: {said[0]}")
        subprocess.run(["mount", "-o", "remount,size=512M", str(disk)], check=True)
        if code not in (0, 3):
            kept = (out / "case.toml").is_file()
            again, words = run(verb, case, "--out", out, "--quiet", *(["--resume"] if kept else []))
            if again not in (0, 3):
                return what, [*wrong, f"{what}: resumed with exit {again}: {words[-300:]}"]
        wrong += [f"{what}: {key}" for key in different(out, whole, names)]
        place = said[0].split(": ")[1].rsplit("/", 1)[-1] if said else "enough"
    finally:
        subprocess.run(["umount", "-l", str(disk)], check=True)
    return place, wrong


def attack(folder: Path, seed: int, trials: int, until: float) -> list[str]:
    """Disks of random sizes; needs root, for the disks."""
    chance, places, wrong = random.Random(seed), Counter[str](), []
    case, whole, _ = reference(folder)
    size = sum(entry.stat().st_size for entry in whole.rglob("*") if entry.is_file()) // 1024
    done = 0
    for number in range(trials):
        if time.monotonic() > until:
            break
        kilobytes = max(4, int(size * ((number + chance.random()) / trials) ** 2))
        place, found = filled(folder, kilobytes, case, whole)
        places[place] += 1
        wrong += found
        done += 1
    shutil.rmtree(folder / "disk", ignore_errors=True)
    print(
        f"full disks, seed {seed}: {done} sizes up to {size} kB, stopped at {dict(places)}; {len(wrong)} wrong",
        flush=True,
    )
    return wrong
