"""What `sh setup.sh ACT` does once all is set up: `python -m tests.acts ACT ARGUMENT...`."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["ACTS", "pytest_options"]

ROOT = Path(__file__).resolve().parent.parent
_MOST_WORKERS = 4  # each takes up to 2 GB
_DEMONSTRATION = ("cases/grenade_155_tnt.toml", "--set", "burst.cell_size=8 mm", "--out", "runs/demo", "--overwrite")


def _say(text: str) -> None:
    print(f"setup: {text}", flush=True)


def _python(*arguments: str, **variables: str) -> int:
    return subprocess.run([sys.executable, *arguments], cwd=ROOT, env=os.environ | variables, check=False).returncode


def _tool(name: str, *arguments: str) -> int:
    return subprocess.run([Path(sys.executable).with_name(name), *arguments], cwd=ROOT, check=False).returncode


def pytest_options(arguments: list[str], cores: int) -> list[str]:
    """Arguments for pytest: side by side, unless they say how many, or ask for a single test or the debugger."""
    alone = any(one.startswith(("-n", "--pdb")) or "::" in one for one in arguments)
    workers = 1 if alone else min(cores, _MOST_WORKERS)
    return [*(["-n", str(workers), "--dist", "loadgroup"] if workers > 1 else []), *arguments]


def demo(*arguments: str) -> int:
    code = _python("-m", "fragfield", "run", *_DEMONSTRATION, *arguments)
    if code == 0:
        _say("the report is runs/demo/report.html, the pictures are in runs/demo/figures")
    return code


def examples(*arguments: str) -> int:
    for path in sorted((ROOT / "examples").glob("*.py")):
        _say(f"examples/{path.name}")
        if code := _python(str(path)):
            return code
        if arguments[:1] == ("pictures",):
            made = ROOT / "runs" / "examples" / path.stem / f"{path.stem}.png"
            shutil.copy(made, ROOT / "docs" / "pictures" / f"example_{path.stem}.png")
    _say("the pictures are in runs/examples")
    return 0


def test(*arguments: str) -> int:
    options = pytest_options(list(arguments), len(os.sched_getaffinity(0)))
    if "loadgroup" in options and _python("-m", "fragfield", "warm-up"):
        _say("the kernels are left to the tests")
    # The mathematical functions of glibc are chosen when a process begins.
    plain = os.environ.get("FRAGFIELD_PROCESSOR") == "sse4"
    variables = {"GLIBC_TUNABLES": "glibc.cpu.hwcaps=-AVX,-AVX2,-FMA,-FMA4"} if plain else {}
    # A missing dolfinx or mpirun must fail here, not be skipped.
    return _python("-m", "pytest", *options, FRAGFIELD_REQUIRE_ALL="1", **variables)


def processors(*arguments: str) -> int:
    codes = []
    for name in ("avx2", "sse4"):
        _say(f"the tests with code for a processor with {name}")
        codes.append(_python("-m", "tests.acts", "test", *arguments, FRAGFIELD_PROCESSOR=name))
    return max(codes)


def lint() -> int:
    codes = [_tool("ruff", "check"), _tool("ruff", "format", "--check"), _tool("mypy"), _tool("lint-imports")]
    return max(*codes, _python("-m", "tests.vocabulary"))


def validate(*arguments: str) -> int:
    return _python("-m", "pytest", "-m", "slow") or _python("-m", "validation", *arguments)


def docs(*arguments: str) -> int:
    if arguments[:1] == ("pictures",):
        arguments = arguments[1:]
        for name in ("first_page", "application_page"):
            if code := _python(f"docs/hooks/{name}.py"):
                return code
    code = _python("-m", "mkdocs", "build", "--strict", *arguments)
    if code == 0:
        _say("the documentation is build/docs/index.html")
    return code


ACTS: dict[str, Callable[..., int]] = {
    "demo": demo,
    "examples": examples,
    "test": test,
    "matrix": lambda *arguments: _python("-m", "tests.matrix", *arguments),
    "processors": processors,
    "lint": lint,
    "attack": lambda *arguments: _python("-m", "tests.attack", *arguments),
    "validate": validate,
    "bench": lambda *arguments: _python("-m", "benchmarks", *arguments),
    "docs": docs,
}

if __name__ == "__main__":
    sys.exit(ACTS[sys.argv[1]](*sys.argv[2:]))
