"""Both distributions from their source archives, installed from an index where nothing of the sources can be seen."""

from __future__ import annotations

import functools
import http.server
import json
import shutil
import subprocess
import sys
import tarfile
import threading
import tomllib
import zipfile
from email.parser import BytesParser
from pathlib import Path

import pytest

import fragfield
from tests.matrix import wheel_python

pytestmark = pytest.mark.slow
ROOT = Path(__file__).resolve().parent.parent
PACKAGES = ("burst_fenicsx", "transition", "flight", "fragfield", "fragfield_base")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
NOT_INSTALLED = {"flight/setup.py", "flight/pyproject.toml", "flight/README.md", "flight/LICENSE"}
FLY = """
import sys, flight
fragments = flight.Fragments.read("fragments.csv")
print(flight.fly(fragments).summary["landed"], flight.hazard_distance([fragments]).distance > 0.0, flight.__file__)
for name in ("dolfinx", "mpi4py", "h5py", "fragfield"):
    assert name not in sys.modules
    try:
        __import__(name)
    except ImportError:
        continue
    raise SystemExit(f"{name} is here")
"""


def run(*command: str | Path, cwd: Path, check: bool = True) -> subprocess.CompletedProcess[str]:
    """A command without this environment's variables."""
    clean = {"PATH": "/usr/bin:/bin", "HOME": str(cwd), "OMPI_ALLOW_RUN_AS_ROOT": "1"}
    clean["OMPI_ALLOW_RUN_AS_ROOT_CONFIRM"] = "1"
    done = subprocess.run(list(map(str, command)), cwd=cwd, env=clean, capture_output=True, text=True, check=False)
    if check and done.returncode:
        pytest.fail(f"{command}\n{done.stdout}\n{done.stderr}")
    return done


def pip(*command: str | Path, python: str | Path = sys.executable, cwd: Path) -> str:
    """What pip prints, with its settings of this machine; skips where it reaches no index."""
    whole = [python, "-m", "pip", *command]
    done = subprocess.run(list(map(str, whole)), cwd=cwd, capture_output=True, text=True, check=False)
    if done.returncode:
        unreached = "NewConnectionError" in done.stderr or "NameResolutionError" in done.stderr
        (pytest.skip if unreached else pytest.fail)(f"{command}\n{done.stdout}\n{done.stderr}")
    return done.stdout


def new_environment(folder: Path, *options: str) -> Path:
    """Interpreter of a new environment."""
    run(sys.executable, "-m", "venv", *options, folder, cwd=folder.parent)
    return folder / "bin" / "python"


@pytest.fixture(scope="module")
def archives(tmp_path_factory):
    """The source archives, from a copy of the sources: a build leaves files beside them."""
    folder, copy = tmp_path_factory.mktemp("archives"), tmp_path_factory.mktemp("sources")
    for name in (*PACKAGES, "tests"):
        shutil.copytree(ROOT / name, copy / name, ignore=shutil.ignore_patterns("__pycache__", "*.egg-info"))
    for name in ("pyproject.toml", "README.md", "LICENSE", "MANIFEST.in", "setup.py", "dependencies.txt"):
        shutil.copy(ROOT / name, copy)
    python = new_environment(tmp_path_factory.mktemp("build") / "venv")
    pip("install", "--quiet", *PROJECT["build-system"]["requires"], python=python, cwd=copy)
    build = "import sys; from setuptools.build_meta import build_sdist; build_sdist(sys.argv[1])"
    for source in (copy / "flight", copy):
        run(python, "-c", build, folder, cwd=source)
    return {path.name.rpartition("-")[0].replace("_", "-"): path for path in folder.glob("*.tar.gz")}


@pytest.fixture(scope="module")
def wheels(archives, tmp_path_factory):
    """The wheels, each built from its archive alone."""
    folder = tmp_path_factory.mktemp("wheels")
    pip("wheel", "--quiet", "--no-deps", "--wheel-dir", folder, *archives.values(), cwd=folder)
    return {path.name.partition("-")[0].replace("_", "-"): path for path in folder.glob("*.whl")}


@pytest.fixture(scope="module")
def index(wheels, tmp_path_factory):
    """Address of a package index on this machine that has both."""
    folder = tmp_path_factory.mktemp("index")
    for name, path in wheels.items():
        (folder / name).mkdir()
        shutil.copy(path, folder / name)
    handler = functools.partial(http.server.SimpleHTTPRequestHandler, directory=str(folder))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}/"
        server.shutdown()


def environment(folder: Path, index: str, name: str, *options: str) -> Path:
    """Interpreter of a new environment in which pip has installed a distribution by its name."""
    python = new_environment(folder, *options)
    pins = Path(sys.prefix, "constraints.txt")  # setup.sh's: with Debian's numpy newer packages do not go together
    options = ("--constraint", pins) if options and pins.exists() else ()
    pip("install", "--quiet", "--extra-index-url", index, *options, name, python=python, cwd=folder)
    return python


def metadata(wheel: Path):
    """The metadata of a wheel."""
    with zipfile.ZipFile(wheel) as file:
        name = next(entry for entry in file.namelist() if entry.endswith(".dist-info/METADATA"))
        return BytesParser().parsebytes(file.read(name))


def test_every_file_is_in_one_wheel_and_no_other_file_in_any(wheels):
    """Modules, marks of types, tables and templates; neither tests nor validation."""
    files = {
        name: {entry for entry in zipfile.ZipFile(path).namelist() if ".dist-info/" not in entry}
        for name, path in wheels.items()
    }
    assert set(files) == {"fragfield", "fragfield-flight"}
    assert not files["fragfield"] & files["fragfield-flight"]
    sources = {
        str(path.relative_to(ROOT))
        for package in PACKAGES
        for path in (ROOT / package).rglob("*.*")
        if path.is_file() and path.suffix != ".pyc" and ".egg-info" not in str(path) and ".partial." not in path.name
    }
    assert files["fragfield"] | files["fragfield-flight"] == sources - NOT_INSTALLED
    assert {f"{package}/py.typed" for package in PACKAGES} <= sources


def test_the_archives_hold_no_tests(archives):
    for path in archives.values():
        with tarfile.open(path) as file:
            names = {name.split("/")[1] for name in file.getnames() if "/" in name}
        assert not names & {"tests", "validation", "benchmarks"}


def test_both_have_one_version_a_licence_and_their_extras(wheels):
    for name, path in wheels.items():
        fields = metadata(path)
        source = ROOT / ("flight" if name == "fragfield-flight" else ".") / "pyproject.toml"
        project = tomllib.loads(source.read_text(encoding="utf-8"))["project"]
        assert fields["Version"] == fragfield.__version__
        if name == "fragfield":
            assert f"fragfield-flight=={fragfield.__version__}" in fields.get_all("Requires-Dist")
        assert set(fields.get_all("Provides-Extra")) == set(project["optional-dependencies"])
        with zipfile.ZipFile(path) as file:
            licence = next(entry for entry in file.namelist() if entry.endswith("/LICENSE"))
            assert file.read(licence) == (ROOT / "LICENSE").read_bytes()


def test_neither_needs_an_h5py_of_its_own(wheels):
    """Debian's is unknown to pip, which would install PyPI's beside it: dolfinx and h5py then fail together."""
    for path in wheels.values():
        needs = [line for line in metadata(path).get_all("Requires-Dist") if line.startswith("h5py")]
        assert all("extra ==" in line for line in needs)


@pytest.mark.slow  # compiles its kernels
def test_the_flight_alone_flies_a_table(index, tmp_path):
    """In an empty environment: neither dolfinx, MPI, HDF5 nor fragfield can be imported there."""
    python = environment(tmp_path / "venv", index, "fragfield-flight")
    (tmp_path / "fragments.csv").write_text(
        "mass_kg,vx_m_s,vy_m_s,vz_m_s\n" + "".join(f"0.05,{600 + 10 * i},{i},100\n" for i in range(40))
    )
    landed, hazard, place = run(python, "-c", FLY, cwd=tmp_path).stdout.split()
    assert (landed, hazard) == ("40", "True")
    assert Path(place).is_relative_to(tmp_path)
    assert pip("check", python=python, cwd=tmp_path).strip() == "No broken requirements found."


@pytest.mark.slow  # compiles all kernels
@pytest.mark.dolfinx
def test_the_whole_computes_a_case_beside_the_systems_dolfinx(index, tmp_path):
    """Installed by name with all that it needs; what the system has, dolfinx and h5py, is used from there."""
    system = Path(getattr(sys, "_base_executable", sys.executable))
    if run(system, "-c", "import dolfinx", cwd=tmp_path, check=False).returncode:
        pytest.skip("dolfinx is not the system's: a new environment would not see it")
    python = environment(tmp_path / "venv", index, "fragfield", "--system-site-packages")
    places = run(python, "-c", "import fragfield, h5py, numpy; print(fragfield.__file__, h5py.__file__)", cwd=tmp_path)
    ours, theirs = places.stdout.split()
    assert Path(ours).is_relative_to(tmp_path)
    assert not Path(theirs).is_relative_to(tmp_path)
    broken = run(python, "-m", "pip", "check", cwd=tmp_path, check=False).stdout.splitlines()
    assert not [line for line in broken if line.startswith("fragfield")], broken
    program = tmp_path / "venv" / "bin" / "fragfield"
    options = ("--set", "burst.cell_size=15 mm", "--set", "burst.end_time=60 us", "--out", "run", "--quiet")
    run(program, "run", ROOT / "cases" / "tube.toml", *options, cwd=tmp_path)
    for name in ("burst_snapshot.h5", "summary.json", "report.html"):
        assert (tmp_path / "run" / name).is_file(), name


@pytest.mark.slow  # compiles all kernels
@pytest.mark.dolfinx
@pytest.mark.skipif(wheel_python() is None, reason="no Python here takes PyPI's wheel of dolfinx")
def test_both_and_the_extra_are_all_that_an_empty_environment_needs(index, tmp_path):
    """dolfinx, MPI and h5py from PyPI: a new case is checked and computed, and on two ranks by its launcher."""
    run(wheel_python(), "-m", "venv", tmp_path / "venv", cwd=tmp_path)
    python = tmp_path / "venv" / "bin" / "python"
    pip("install", "--quiet", "--extra-index-url", index, "fragfield[dolfinx]", python=python, cwd=tmp_path)
    assert pip("check", python=python, cwd=tmp_path).strip() == "No broken requirements found."
    program = python.with_name("fragfield")
    run(program, "new", "trial.toml", "--round", "m107", cwd=tmp_path)
    options = ("--set", "burst.cell_size=15 mm", "--set", "burst.end_time=60 us")
    run(program, "check", "trial.toml", *options, cwd=tmp_path)
    run(program, "run", "trial.toml", *options, "--out", "run", "--quiet", cwd=tmp_path)
    assert (tmp_path / "run" / "report.html").is_file()
    launcher = python.with_name("mpiexec")
    run(launcher, "-n", "2", program, "burst", "trial.toml", *options, "--out", "two", "--quiet", cwd=tmp_path)
    code = (
        "import json, sys; print([json.load(open(f'{name}/summary.json'))['burst']['cells'] for name in sys.argv[1:]])"
    )
    one, two = json.loads(run(python, "-c", code, "run", "two", cwd=tmp_path).stdout)
    assert one == two
