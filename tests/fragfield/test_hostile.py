"""Whatever surrounds a command, its results are those of a clean environment, or one line says why there are none."""

from __future__ import annotations

import importlib
import os
import re
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from typing import get_args, get_type_hints

import pytest
from typer.main import get_command

from fragfield.cli import app
from fragfield.cli.application import file_path
from fragfield_base.kernel_cache import cache_root
from tests.attack.runs import different
from tests.fragfield.short_run import RINGS, ROOT, invoke
from tests.ranks import mpirun_command, mpirun_environment

SHIM = """
#include <errno.h>
int flock(int file, int act) { errno = ENOLCK; return -1; }
"""
VARIABLES = {
    "PETSC_OPTIONS": "-help -log_view -malloc_dump", "MPLBACKEND": "nonsense", "MATPLOTLIBRC": "HERE",
    "NUMBA_OPT": "0", "NUMBA_DISABLE_JIT": "1", "NUMBA_CPU_NAME": "generic", "NUMBA_THREADING_LAYER": "tbb",
    "NUMBA_BOUNDSCHECK": "1", "NUMBA_DEBUG": "1", "OPENBLAS_CORETYPE": "Prescott", "MKL_CBWR": "COMPATIBLE",
    "NPY_DISABLE_CPU_FEATURES": "AVX2", "HDF5_USE_FILE_LOCKING": "TRUE", "HDF5_PLUGIN_PATH": "HERE",
    "VTK_DEFAULT_OPENGL_WINDOW": "vtkXOpenGLRenderWindow", "PYVISTA_OFF_SCREEN": "false", "DISPLAY": ":987",
    "GMSH_VERBOSITY": "99", "PYTHONPATH": "HERE/mine", "PYTHONUSERBASE": "HERE/user",
    "OMPI_MCA_btl": "nonsense", "OMPI_MCA_pml": "nonsense", "UCX_TLS": "nonsense", "FI_PROVIDER": "nonsense",
    "GIT_DIR": "/proc/none", "PATH": "HERE/bin", "LC_ALL": "C", "TZ": "Asia/Kathmandu",
    "HOME": "HERE/home", "XDG_CONFIG_HOME": "HERE/home/.config",
}  # fmt: skip
"""Of libraries, of a user's settings, of a machine; HERE is the folder in which the command begins."""
FILES = {
    **{f"{name}.py": "raise SystemExit('executed')\n" for name in ("string", "random", "numpy", "csv", "json")},
    "matplotlibrc": "text.usetex: True\nfigure.dpi: 33\naxes.grid: True\nfont.size: 21\n",
    "home/.config/matplotlib/matplotlibrc": "text.usetex: True\nlines.linewidth: 9\n",
    "home/.petscrc": "-help\n", ".petscrc": "-help\n", "petscrc": "-help\n", "home/.gmshrc": "nonsense\n",
    ".numba_config.yaml": "opt: 0\ndisable_jit: 1\n", "ffcx_options.json": '{"scalar_type": "float"}',
    "dolfinx_jit_options.json": '{"cffi_extra_compile_args": ["-nonsense"]}',
}  # fmt: skip


def hostile(folder: Path) -> dict[str, str]:
    """Make a folder to begin in that holds traps, and variables that lead into them."""
    for name, text in FILES.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    user = folder / f"user/lib/python{sys.version_info[0]}.{sys.version_info[1]}/site-packages/numpy"
    for place in (user, folder / "mine", folder / "bin"):
        place.mkdir(parents=True)
    (user / "__init__.py").write_text("raise SystemExit('executed')\n")
    for name in ("gcc", "cc", "as", "ld", "x86_64-linux-gnu-gcc", "git"):  # no ssh
        if found := shutil.which(name):
            (folder / "bin" / name).symlink_to(found)
    found = {name: value.replace("HERE", str(folder)) for name, value in VARIABLES.items()}
    if shutil.which("gcc"):
        (folder / "shim.c").write_text(SHIM)
        subprocess.run(["gcc", "-shared", "-fPIC", "-o", folder / "shim.so", folder / "shim.c"], check=True)
        found["LD_PRELOAD"] = str(folder / "shim.so")
    # The caches of the test's user: what is compiled is no result.
    found |= {"NUMBA_CACHE_DIR": str(cache_root()), "XDG_CACHE_HOME": str(Path.home() / ".cache")}
    return found


def command(folder: Path, variables: dict[str, str], *arguments: object) -> subprocess.CompletedProcess[str]:
    """The command as an installed program starts it, with the source tree as its installation."""
    start = f"import sys; sys.path.insert(0, {str(ROOT)!r}); from fragfield.cli import main; main()"
    return subprocess.run(
        [sys.executable, "-P", "-c", start, *map(str, arguments)], cwd=folder, env=variables, capture_output=True,
        text=True, errors="replace", check=False,
    )  # fmt: skip


def drawn(run: Path) -> dict[str, object]:
    """Pictures of a report, and those beside it."""
    page = (run / "report.html").read_text(encoding="utf-8")
    found: dict[str, object] = {"pictures": re.findall(r"data:image/[^\"]*", page)}
    return found | {path.name: path.read_bytes() for path in sorted(run.glob("figures/*"))}


@pytest.mark.slow
@pytest.mark.dolfinx
def test_a_hostile_environment_changes_no_byte(tmp_path):
    case = tmp_path / "case.toml"
    case.write_text(RINGS)
    clean, here = tmp_path / "clean", tmp_path / "hostile"
    clean.mkdir()
    known = {name: os.environ[name] for name in ("PATH", "HOME") if name in os.environ}
    runs = {}
    for folder, variables in ((clean, known), (here, hostile(here))):
        done = command(folder, variables, "run", case, "--out", "run", "--threads", "1", "--quiet")
        assert done.returncode in (0, 3), done.stderr
        assert "executed" not in done.stdout + done.stderr
        runs[folder] = folder / "run"
        assert [path.name for path in folder.iterdir() if path.name in ("runs", "~")] == []
    assert different(runs[clean], runs[here]) == []
    first, second = (drawn(run) for run in runs.values())
    assert first["pictures"]
    assert {"picture_of_burst.svg", "density_curve.svg"} <= set(first)
    assert [name for name in first if first[name] != second.get(name)] == []
    log = (here / "run" / "run.log").read_text()
    if shutil.which("gcc"):
        assert "this file system has no locks" in log


@pytest.mark.parametrize(
    ("variables", "arguments", "words"),
    [
        ({"NUMBA_NUM_THREADS": "0"}, ("check", "case.toml"), "NUMBA_NUM_THREADS: found '0' in the environment"),
        ({"OMP_NUM_THREADS": "all"}, ("check", "case.toml"), "OMP_NUM_THREADS: found 'all' in the environment"),
        ({"PMIX_RANK": "1"}, ("run", "case.toml"), "PMIX_RANK: found '1' in the environment, but no PMIX_NAMESPACE"),
        (
            {"OMPI_COMM_WORLD_RANK": "0", "OMPI_COMM_WORLD_SIZE": "2", "OMPI_NUM_APP_CTX": "2"},
            ("check", "case.toml"),
            "check: found 2 different commands in one MPI launch",
        ),
        ({}, ("run", "case.toml", "--out=~unknown-user/x"), "there is no such home"),
        ({}, ("check", b"a\xff.toml"), "a name that is not UTF-8"),
        ({}, ("check", "loop/case.toml"), "a loop of symbolic links"),
        ({}, ("check", "case.toml", "--set", "flight.ground.map=loop/map.tif"), "flight.ground.map"),
    ],
)  # fmt: skip
def test_surroundings_that_no_run_survives_are_one_line_and_exit_2(tmp_path, variables, arguments, words):
    (tmp_path / "case.toml").write_text(RINGS)
    (tmp_path / "loop").symlink_to("other")
    (tmp_path / "other").symlink_to("loop")
    known = {name: os.environ[name] for name in ("PATH", "HOME") if name in os.environ}
    done = command(tmp_path, known | variables, *(os.fsdecode(one) for one in arguments))
    assert (done.returncode, words in done.stderr) == (2, True), done.stderr
    assert done.stderr.startswith("fragfield: ")
    assert len(done.stderr.strip().splitlines()) == 1
    assert not (tmp_path / "runs").exists()


def test_every_file_that_is_typed_is_made_absolute():
    """The command line leaves the folder in which it began: a relative name would mean another file."""
    loose, found = [], 0
    for command, one in get_command(app).commands.items():
        hints = get_type_hints(one.callback, localns={"Path": Path}, include_extras=True)
        for name, hint in hints.items():
            kinds = (hint.__origin__, *get_args(hint.__origin__)) if hasattr(hint, "__metadata__") else ()
            if Path in kinds:
                found += 1
                loose += [f"{command} {name}"] if hint.__metadata__[0].parser is not file_path else []
    assert found > 20
    assert loose == []


def test_fifty_thousand_unknown_keys_take_a_second(tmp_path):
    import time

    (tmp_path / "many.toml").write_text("".join(f"key{number} = 1\n" for number in range(50_000)) + RINGS)
    began = time.process_time()
    done = invoke("check", tmp_path / "many.toml")
    assert time.process_time() - began < 5.0
    assert done.exit_code == 2
    assert "50000 faults" in done.stderr
    assert "and 49988 more" in done.stderr


@pytest.mark.dolfinx
@pytest.mark.parametrize(
    ("damaged", "command_"), [("burst_snapshot.h5", "break-up"), ("fragments.h5", "fly"), ("summary.json", "break-up")]
)
def test_a_damaged_input_is_refused_before_anything_is_removed(whole_run, tmp_path, damaged, command_):
    run = tmp_path / "run"
    shutil.copytree(whole_run[0], run)
    whole = bytearray((run / damaged).read_bytes())
    whole[len(whole) // 2] ^= 1
    (run / damaged).write_bytes(whole)
    before = {path: path.stat().st_mtime_ns for path in run.rglob("*") if path.is_file() and path.name != "run.log"}
    done = invoke(command_, run)
    assert done.exit_code == 2, done.output
    assert damaged in done.stderr
    after = {path: path.stat().st_mtime_ns for path in run.rglob("*") if path.is_file() and path.name != "run.log"}
    assert {path.name for path in before} == {path.name for path in after}


@pytest.mark.mpi
def test_ranks_of_two_commands_and_of_another_launcher_are_refused(tmp_path):
    for name in ("one", "two"):
        (tmp_path / f"{name}.toml").write_text(RINGS)
    known = {name: os.environ[name] for name in ("PATH", "HOME") if name in os.environ}
    ours = importlib.import_module("mpi4py.MPI").get_vendor()[0]
    foreign = {"OMPI_COMM_WORLD_RANK": "0", "OMPI_COMM_WORLD_SIZE": "2"}
    if ours == "Open MPI":
        foreign = {"PMI_RANK": "0", "PMI_SIZE": "2", "PMI_FD": "9"}
    done = command(tmp_path, known | foreign, "run", "one.toml")
    assert done.returncode == 2, done.stderr
    assert "found 2 ranks by the launcher's variables, and 1 by MPI" in done.stderr
    start = f"import sys; sys.path.insert(0, {str(ROOT)!r}); from fragfield.cli import main; main()"
    two_commands = [*mpirun_command(1), "true", ":", "-n", "1", "true"]
    if subprocess.run(two_commands, capture_output=True, check=False).returncode == -signal.SIGSEGV:
        pytest.skip("Open MPI 5 of Debian's packages ends two commands by a segmentation fault (open-mpi/ompi #13303)")
    one, two = ([sys.executable, "-P", "-c", start, "run", f"{name}.toml"] for name in ("one", "two"))
    launched = subprocess.run(
        [*mpirun_command(1), *one, ":", "-n", "1", *two], cwd=tmp_path, env=mpirun_environment(), capture_output=True,
        text=True, check=False,
    )  # fmt: skip
    assert launched.returncode == 2, launched.stderr
    assert "found 2 commands in one MPI launch; allowed: one command for all ranks" in launched.stderr
    assert not (tmp_path / "runs").exists()
