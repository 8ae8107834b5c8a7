"""Figures over time and of two revisions: what has become slower is seen."""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchmarks.table import rows_of

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

__all__ = ["HISTORY", "changes", "compare", "comparisons", "flat", "machine_name", "remember"]

_ROOT = Path(__file__).resolve().parent.parent
HISTORY = Path(__file__).resolve().parent / "history"
"""One file of JSON lines for each kind of machine."""

_MOVED = 0.1  # a change of a ratio that is worth a line
_ROUNDS = 2  # times that each of two revisions is measured, in turns


def flat(figures: Mapping[str, Any], path: str = "") -> Iterator[tuple[str, float]]:
    """Every number among nested figures by its dotted name, lists left out."""
    for key, value in figures.items():
        if isinstance(value, dict):
            yield from flat(value, f"{path}{key}.")
        elif isinstance(value, (int, float)) and not isinstance(value, bool):
            yield f"{path}{key}", float(value)


def remember(found: Mapping[str, Any], folder: Path = HISTORY) -> list[str]:
    """Add a line with the figures to the machine's file; the words of what has changed since the line before."""
    machine = found["machine"]
    path = folder / f"{_file_name(machine)}.jsonl"
    line = {
        "date": machine["date"],
        "revision": _revision(),
        "machine": machine_name(machine),
        "comparisons": comparisons(found),
        "figures": dict(flat({name: value for name, value in found.items() if name != "machine"})),
    }
    earlier = path.read_text(encoding="utf-8").splitlines() if path.is_file() else []
    folder.mkdir(parents=True, exist_ok=True)
    with path.open("a", encoding="utf-8") as file:
        file.write(json.dumps(line) + "\n")
    return changes([json.loads(text) for text in earlier], line)


def comparisons(found: Mapping[str, Any]) -> dict[str, dict[str, str]]:
    """Figure, target and whether it is met, as text, of every comparison with a target, by benchmark and its words."""
    return {
        f"{name}: {row.what}": {"figure": row.figure, "target": row.target, "met": row.met}
        for name, figures in found.items()
        if name != "machine"
        for row in rows_of(figures)
        if row.target
    }


def machine_name(machine: Mapping[str, Any]) -> str:
    """A kind of machine in a few words."""
    return f"{machine['processor']}, {machine['cores']} cores".replace("(R)", "")


def changes(earlier: Sequence[Mapping[str, Any]], line: Mapping[str, Any]) -> list[str]:
    """In words, every ratio that has moved by more than a tenth since it was last measured."""
    words = []
    for name, now in line["figures"].items():
        last = next((one for one in reversed(earlier) if name in one["figures"]), None)
        if last is None or not name.endswith("ratio"):
            continue
        before = last["figures"][name]
        if abs(now - before) > _MOVED * abs(before):
            words.append(f"{name}: {before:.3g} on {last['date']} ({last['revision']}), now {now:.3g}")
    return words


def compare(revision: str, names: Sequence[str], arguments: Sequence[str] = ()) -> dict[str, Any]:
    """Measure a revision and the working tree in turns, each in processes of its own.

    Returns a table `figures` with the best of each, `before`, `now` and `now_over_before`, of all that both have;
    raises ValueError for a revision that git does not know.
    """
    with tempfile.TemporaryDirectory(prefix="fragfield-bench-") as folder:
        _unpack(revision, Path(folder))
        measured: dict[str, list[dict[str, float]]] = {"before": [], "now": []}
        for _ in range(_ROUNDS):
            for which, root in (("before", Path(folder)), ("now", _ROOT)):
                measured[which].append(_figures_in(root, [*names, *arguments]))
    best = {which: _best(runs) for which, runs in measured.items()}
    return {
        "revision": revision,
        "figures": [
            {"figure": name, "before": before, "now": best["now"][name], "now_over_before": best["now"][name] / before}
            for name, before in best["before"].items()
            if name in best["now"] and before != 0.0 and _is_measured(name)
        ],
    }


def _is_measured(name: str) -> bool:
    """Whether a figure is a time, a ratio or a size in memory, and no target or count."""
    key = name.rpartition(".")[2]
    return key == "ratio" or (("seconds" in key or "bytes" in key) and "target" not in key and "paper" not in key)


def _best(runs: Sequence[Mapping[str, float]]) -> dict[str, float]:
    return {name: min(run[name] for run in runs) for name in runs[0] if all(name in run for run in runs)}


def _figures_in(root: Path, arguments: Sequence[str]) -> dict[str, float]:
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks", *arguments, "--json"],
        cwd=root, env={**os.environ, "PYTHONPATH": str(root)}, stdout=subprocess.PIPE, text=True, check=True,
    )  # fmt: skip
    found = json.loads(done.stdout)
    return dict(flat({name: value for name, value in found.items() if name != "machine"}))


def _unpack(revision: str, folder: Path) -> None:
    """The files of a revision."""
    if shutil.which("git") is None:
        raise ValueError("git is not installed, which holds the revisions")
    packed = subprocess.run(["git", "archive", revision, "--"], cwd=_ROOT, capture_output=True, check=False)
    if packed.returncode != 0:
        raise ValueError(f"git has no revision '{revision}': {packed.stderr.decode('utf-8', 'replace').strip()}")
    subprocess.run(["tar", "-x", "-C", str(folder)], input=packed.stdout, check=True)


def _revision() -> str:
    """Short name of the commit, with a mark where files differ from it; "unknown" without git."""
    if shutil.which("git") is None:
        return "unknown"
    done = subprocess.run(
        ["git", "describe", "--always", "--dirty"], cwd=_ROOT, capture_output=True, text=True, check=False
    )
    return done.stdout.strip() or "unknown"


def _file_name(machine: Mapping[str, Any]) -> str:
    """A kind of machine as the name of a file."""
    text = f"{machine['processor']} {machine['cores']} cores".lower().replace("(r)", "")
    return re.sub(r"[^a-z0-9]+", "_", text).strip("_")
