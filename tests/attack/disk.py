"""Disks that are full in every stage: one message, everything before readable, and equal results once there is room."""

from __future__ import annotations

import random
import shutil
import subprocess
import time
from collections import Counter
from typing import TYPE_CHECKING, Any

from fragfield.errors import InputError
from fragfield.files.run_directory import STAGES
from fragfield_base.hdf5_files import check_sound
from tests.attack.runs import different, run

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from tests.attack.signals import Reference

__all__ = ["attack", "filled"]

_PLAN = ("burst", "burst", "break-up", "fly", "fly", "burst", "break-up", "fly", "burst", "report")


def _mount(disk: Path, options: str) -> None:
    subprocess.run(["mount", "-t", "tmpfs", "-o", options, "tmpfs", str(disk)], check=True)


def filled(folder: Path, stage: str, share: float, made: Reference) -> tuple[str, list[str]]:
    """A stage on a disk with room for a share of its files, made larger afterwards: how it ended, and what is wrong."""
    disk = folder / "disk"
    disk.mkdir(parents=True, exist_ok=True)
    _mount(disk, "size=512M")
    try:
        out = made.before(stage, disk / "run")
        held = shutil.disk_usage(disk).used // 1024
        files = [made.whole / name for name in STAGES[stage].files]
        files += [file for folder in files if folder.is_dir() for file in folder.iterdir()]
        room = int(share * sum(file.stat().st_size for file in files if file.is_file())) // 1024
        _mount(disk, f"remount,size={held + room + 4}k")
        what = f"room for {room} kB in {stage}"
        verb, more = ("burst", []) if stage == "burst" else ("run", ["--resume"])
        code, words = run(verb, made.case, "--out", out, "--quiet", *more, report=stage == "report")
        said = [line for line in words.splitlines() if line.startswith("fragfield: ")]
        wrong = []
        if code not in (0, 3):
            if code != 2 or len(said) != 1 or "Traceback" in words:
                wrong.append(f"{what}: exit {code}, {words[-300:]}")
            elif "disk is full" not in said[0] and "No space left" not in said[0]:
                wrong.append(f"{what}: {said[0]}")
        for file in sorted(out.rglob("*.h5")):
            try:
                check_sound(file, InputError)
            except InputError as error:
                wrong.append(f"{what}: {error}")
        _mount(disk, "remount,size=512M")
        if code not in (0, 3):
            kept = (out / "case.toml").is_file()
            again, words = run(
                verb, made.case, "--out", out, "--quiet", *(["--resume"] if kept else []), report=stage == "report"
            )
            if again not in (0, 3):
                return "wrong", [*wrong, f"{what}: resumed with exit {again}: {words[-300:]}"]
        through = "burst" if stage == "burst" else "fly"
        wrong += [f"{what}: {key}" for key in different(out, made.whole, through)]
        wrong += [f"{what}: no report" for _ in [0] if stage == "report" and not (out / "report.html").is_file()]
        place = said[0].split(": ")[1].rsplit("/", 1)[-1] if said else "enough"
    finally:
        subprocess.run(["umount", "-l", str(disk)], check=True)
    return f"{stage} at {place}", wrong


def attack(
    folder: Path, seed: int, trials: int, until: float, made: Reference, plan: Sequence[str] = _PLAN
) -> list[str]:
    """Disks with room for random shares of a stage's files; needs root, for the disks."""
    generator, places, wrong, done = random.Random(seed), Counter[Any](), [], 0
    for number in range(trials):
        if time.monotonic() > until:
            break
        place, found = filled(folder, plan[number % len(plan)], generator.random(), made)
        places[place] += 1
        wrong += found
        done += 1
    shutil.rmtree(folder / "disk", ignore_errors=True)
    print(f"full disks, seed {seed}: {done} sizes, stopped in {dict(places)}; {len(wrong)} wrong", flush=True)
    return wrong
