"""Both distributions as wheels, each installed where nothing of the sources can be seen."""

from __future__ import annotations

import shutil
import subprocess
import sys
import zipfile
from importlib.util import find_spec
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow
ROOT = Path(__file__).resolve().parent.parent
PACKAGES = ("burst_fenicsx", "transition", "flight", "fragfield", "fragfield_base")
FLY = """
import sys, flight
landed = flight.fly(flight.Fragments(0.01, (0.0, 0.0, 1.0), (800.0, 0.0, 100.0))).summary["landed"]
assert not {"dolfinx", "fragfield", "mpi4py"} & set(sys.modules)
print(landed, flight.__file__)
"""


def _run(*command: str | Path, cwd: Path, check: bool = True) -> subprocess.CompletedProcess[str]:
    clean = {"PATH": "/usr/bin:/bin", "HOME": str(cwd)}
    done = subprocess.run(list(map(str, command)), cwd=cwd, env=clean, capture_output=True, text=True, check=False)
    if check and done.returncode:
        pytest.fail(f"{command}\n{done.stdout}\n{done.stderr}")
    return done


@pytest.fixture(scope="module")
def wheels(tmp_path_factory):
    """The two wheels, built from a copy of the sources: a build leaves files beside them."""
    folder, copy = tmp_path_factory.mktemp("wheels"), tmp_path_factory.mktemp("sources")
    for name in PACKAGES:
        shutil.copytree(ROOT / name, copy / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, copy)
    for source in (copy / "flight", copy):
        command = [sys.executable, "-m", "pip", "wheel", "--no-deps", "--wheel-dir", str(folder), str(source)]
        done = subprocess.run(command, capture_output=True, text=True, check=False)
        if done.returncode:
            pytest.skip(f"no wheel without the packages that build it: {done.stderr.strip().splitlines()[-1:]}")
    return {path.name.partition("-")[0]: path for path in folder.glob("*.whl")}


def _environment(folder: Path, *wheels: Path | str, system: bool, needs: bool = True) -> Path:
    """Interpreter of a new environment that holds wheels, and what they need from the index."""
    _run(sys.executable, "-m", "venv", *(["--system-site-packages"] if system else []), folder, cwd=folder.parent)
    python = folder / "bin" / "python"
    command = [python, "-m", "pip", "install", "--quiet", *([] if needs else ["--no-deps"]), *wheels]
    done = subprocess.run(list(map(str, command)), capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.skip(f"the index cannot be reached: {done.stderr.strip().splitlines()[-1:]}")
    return python


def test_no_file_is_in_both_wheels_and_none_is_missing(wheels):
    names = {
        name: {entry for entry in zipfile.ZipFile(path).namelist() if ".dist-info/" not in entry}
        for name, path in wheels.items()
    }
    assert set(names) == {"fragfield", "fragfield_flight"}
    assert not names["fragfield"] & names["fragfield_flight"]
    sources = {str(path.relative_to(ROOT)) for package in PACKAGES for path in (ROOT / package).rglob("*.py")}
    assert sources == {name for name in names["fragfield"] | names["fragfield_flight"] if name.endswith(".py")}


def test_no_wheel_needs_an_h5py_of_its_own(wheels):
    """Debian's is unknown to pip, which would install PyPI's beside it: dolfinx and h5py then fail together."""
    for path in wheels.values():
        with zipfile.ZipFile(path) as file:
            name = next(entry for entry in file.namelist() if entry.endswith(".dist-info/METADATA"))
            needs = [line for line in file.read(name).decode().splitlines() if line.startswith("Requires-Dist: h5py")]
        assert all("extra ==" in line for line in needs)


def test_the_flight_works_in_an_empty_environment(wheels, tmp_path):
    python = _environment(tmp_path / "venv", f"{wheels['fragfield_flight']}[hdf5]", system=False)
    assert _run(python, "-c", "import dolfinx", cwd=tmp_path, check=False).returncode
    landed, place = _run(python, "-c", FLY, cwd=tmp_path).stdout.split()
    assert landed == "1"
    assert Path(place).is_relative_to(tmp_path)


@pytest.mark.dolfinx
def test_the_whole_works_beside_the_systems_dolfinx(wheels, tmp_path):
    """Of the packages that it needs the wheels alone are new: the others are those of this environment."""
    python = _environment(tmp_path / "venv", *wheels.values(), system=True, needs=False)
    here = [str(Path(find_spec(name).origin).parent.parent) for name in ("numba", "pydantic")]
    (next((tmp_path / "venv" / "lib").iterdir()) / "site-packages" / "others.pth").write_text("\n".join(here) + "\n")
    assert _run(python, "-c", "import fragfield, flight; print(fragfield.__file__)", cwd=tmp_path).stdout.startswith(
        str(tmp_path)
    )
    case = tmp_path / "case.toml"
    case.write_text((ROOT / "cases" / "tube.toml").read_text())
    fragfield = tmp_path / "venv" / "bin" / "fragfield"
    assert "mass" in _run(fragfield, "check", case, cwd=tmp_path).stdout
    options = ("--cell-size", "15 mm", "--set", "burst.end_time=10 us", "--out", tmp_path / "out", "--quiet")
    _run(fragfield, "burst", case, *options, cwd=tmp_path)
    assert (tmp_path / "out" / "burst_snapshot.h5").is_file()
