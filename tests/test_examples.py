"""The scripts of `examples/` and the guide's page on Python: run as they stand, their numbers compared."""

from __future__ import annotations

import contextlib
import io
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
EXAMPLES = ROOT / "examples"
PAGE = ROOT / "docs" / "guide" / "python.md"
PAIR = re.compile(r"^```python\n(.*?)^```\n(?:\n```output\n(.*?)^```\n)?", re.MULTILINE | re.DOTALL)
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
VARIES = ("wall seconds",)  # lines that depend on the machine

# By script: a number that it prints, and what it was when the script was written.
QUICK = {
    "arena_flight.py": (r"upper bound \(95 %\) (\d+) m", 149.0),
    "own_fenicsx.py": (r"hazard distance: (\d+) m", 57.0),
    "terrain_and_barricade.py": (r"'right': (\d+)", 807.0),
}
SLOW = {
    "convergence.py": (r" 3\.0 mm: +\d+ cells, ([\d.]+) m/s", 833.6),
    "pair.py": (r"at 90 and 270 degrees ([\d.]+) times", 4.37),
    "pallet.py": (r"upper bound \(95 %\) +(\d+) m", 183.0),
    "sensitivity.py": (r"nominal: (\d+) m", 106.0),
    "single_round.py": (r"keep people (\d+) m away", 123.0),
    "own_profile.py": (r"upper bound \(95 %\): +(\d+) m", 89.0),
}


def run_example(name, folder):
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, str(EXAMPLES / name), str(folder / "out")],
        cwd=folder, env=environment, capture_output=True, text=True, timeout=900, check=False,
    )  # fmt: skip
    assert done.returncode == 0, f"{done.stdout}\n{done.stderr}"
    picture = Path(re.search(r"^picture: (.*)$", done.stdout, re.MULTILINE)[1])
    assert picture == folder / "out" / f"{Path(name).stem}.png"
    assert picture.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    assert picture.stat().st_size > 20_000
    return done.stdout


def test_every_script_is_tested():
    assert {path.name for path in EXAMPLES.glob("*.py")} == set(QUICK) | set(SLOW)


@pytest.mark.parametrize("name", sorted(QUICK))
def test_a_quick_example(name, tmp_path):
    pattern, value = QUICK[name]
    assert float(re.search(pattern, run_example(name, tmp_path))[1]) == pytest.approx(value, rel=0.02)


@pytest.mark.slow
@pytest.mark.dolfinx
@pytest.mark.parametrize("name", sorted(SLOW))
def test_an_example(name, tmp_path):
    pattern, value = SLOW[name]
    assert float(re.search(pattern, run_example(name, tmp_path))[1]) == pytest.approx(value, rel=0.02)


def printed_and_shown(page, folder):
    """Of every block with an output: what it prints when all are run in order, and what the page shows."""
    found = []
    names: dict[str, object] = {"__name__": "__main__"}
    with contextlib.chdir(folder):
        for code, shown in PAIR.findall(page):
            output = io.StringIO()
            with contextlib.redirect_stdout(output):
                exec(compile(code, str(PAGE), "exec"), names)
            found.append((output.getvalue(), shown))
    return found


def same(printed, shown):
    """Why two outputs differ: in words, or in a number by more than 2 %; None where they do not."""
    ours, theirs = printed.splitlines(), shown.splitlines()
    if len(ours) != len(theirs):
        return f"{len(ours)} lines, shown {len(theirs)}"
    for one, other in zip(ours, theirs, strict=True):
        if any(words in one for words in VARIES):
            continue
        if NUMBER.sub("#", one).split() != NUMBER.sub("#", other).split():
            return f"{one!r}, shown {other!r}"
        for a, b in zip(NUMBER.findall(one), NUMBER.findall(other), strict=True):
            if float(a) != pytest.approx(float(b), rel=0.02, abs=1e-3):
                return f"{one!r}, shown {other!r}"
    return None


@pytest.mark.slow
@pytest.mark.dolfinx
def test_the_page_on_python_prints_what_it_shows(tmp_path):
    pytest.importorskip("pandas")
    pairs = printed_and_shown(PAGE.read_text(encoding="utf-8"), tmp_path)
    assert sum(bool(shown) for _, shown in pairs) >= 6
    assert [why for printed, shown in pairs if (why := same(printed, shown))] == []
    assert (tmp_path / "density.png").stat().st_size > 20_000


def test_a_stale_output_would_be_found():
    assert same("mean 803 m/s\n", "mean 803 m/s\n") is None
    assert same("mean 803 m/s\n", "mean 700 m/s\n")
    assert same("mean 803 m/s\n", "mean 803 km/s\n")
    assert same("a\nb\n", "a\n")
    assert same("burst wall seconds 4 s\n", "burst wall seconds 9 s\n") is None
