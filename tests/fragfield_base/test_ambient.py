"""A process is settled: variables, places of modules, launchers, and the processes that it starts."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from fragfield_base import paths
from fragfield_base.ambient import OURS, check_variables, is_launched
from fragfield_base.errors import InputError

SETTLED = (
    "import json, os, sys; sys.path.insert(0, sys.argv[1])\n"
    "from fragfield_base.ambient import settle, surroundings\n"
    "try:\n"
    "    settle(ValueError)\n"
    "except ValueError as error:\n"
    "    sys.exit(f'refused: {error}')\n"
    "print(json.dumps([dict(os.environ), surroundings(), sys.path]))\n"
)


def settled(folder=None, **variables):
    """Variables, record and places of modules of a process that was settled with these variables, or its refusal."""
    known = {"PATH": os.environ["PATH"], "HOME": "/proc/none", **variables}
    done = subprocess.run(
        [sys.executable, "-c", SETTLED, str(OURS)], env=known, cwd=folder, capture_output=True, text=True, check=False
    )
    return json.loads(done.stdout) if done.returncode == 0 else done.stderr.strip()


def test_variables_of_libraries_are_dropped_and_named():
    hostile = {
        "PETSC_OPTIONS": "-help", "MPLBACKEND": "none", "MATPLOTLIBRC": "/x", "GMSH_X": "1",
        "NUMBA_OPT": "0", "NUMBA_DISABLE_JIT": "1", "HDF5_USE_FILE_LOCKING": "TRUE", "VTK_X": "1", "PYVISTA_X": "1",
        "OPENBLAS_CORETYPE": "Prescott", "PYTHONWARNINGS": "error", "OMPI_MCA_btl": "none", "UCX_TLS": "none",
    }  # fmt: skip
    kept = {"NUMBA_NUM_THREADS": "2", "OMP_NUM_THREADS": "4,2", "LANG": "de_DE"}
    variables, record, _ = settled(**hostile, **kept)
    forced = {"PETSC_OPTIONS": "-no_signal_handler", "MPLBACKEND": "agg", "HDF5_USE_FILE_LOCKING": "FALSE",
              "OMPI_MCA_btl": "self", "UCX_TLS": "self", "MATPLOTLIBRC": os.devnull}  # fmt: skip
    assert {name: variables.get(name) for name in hostile} == dict.fromkeys(hostile) | forced
    assert {name: variables[name] for name in kept} == kept
    assert record["ignored"] == sorted(hostile)
    assert record["kept"] == ["NUMBA_NUM_THREADS=2", "OMP_NUM_THREADS=4,2"]


def test_a_processor_is_named_for_all_libraries_and_kept_for_processes_of_ours():
    variables, record, _ = settled(FRAGFIELD_PROCESSOR="avx2", NUMBA_CPU_NAME="generic")
    assert (variables["NUMBA_CPU_NAME"], variables["NUMBA_CPU_FEATURES"]) == ("haswell", "")
    without = variables["NPY_DISABLE_CPU_FEATURES"].split()
    assert "AVX512F" in without
    assert "AVX2" not in without
    assert record == {"ignored": ["NUMBA_CPU_NAME"], "kept": ["FRAGFIELD_PROCESSOR=avx2"]}
    variables, _, _ = settled(FRAGFIELD_PROCESSOR="sse4")
    assert {"AVX", "AVX2", "FMA3", "AVX512F"} <= set(variables["NPY_DISABLE_CPU_FEATURES"].split())


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("FRAGFIELD_PROCESSOR", "avx512"),
        ("NUMBA_NUM_THREADS", "0"),
        ("NUMBA_NUM_THREADS", "all"),
        ("OMP_NUM_THREADS", "-1"),
        ("OPENBLAS_NUM_THREADS", "0"),
    ],
)
def test_a_variable_that_a_library_would_not_survive_is_refused(monkeypatch, name, value):
    monkeypatch.setenv(name, value)
    with pytest.raises(InputError, match=f"{name}: found '{value}' in the environment; allowed: .*, or to unset it"):
        check_variables(InputError)


def test_an_empty_variable_is_none(monkeypatch):
    monkeypatch.setenv("NUMBA_NUM_THREADS", "")
    check_variables(InputError)
    assert "NUMBA_NUM_THREADS" not in os.environ


LAUNCH = {"OMPI_COMM_WORLD_RANK": "1", "OMPI_COMM_WORLD_SIZE": "2", "OMPI_MCA_pml": "cm"}


def test_variables_of_a_launch_stay_in_its_ranks():
    variables, record, _ = settled(**LAUNCH)
    assert {name: variables[name] for name in LAUNCH} == LAUNCH
    assert not {"OMPI_MCA_btl", "UCX_TLS"} & set(variables)
    assert variables["UCX_DEBUG_SIGNO"] == "0"
    assert record == {}


def test_a_launch_of_one_rank_needs_no_launcher():
    """MPI starts once for a rank: of two commands in a script that it runs the second would be ended."""
    variables, _, _ = settled(OMPI_COMM_WORLD_RANK="0", OMPI_COMM_WORLD_SIZE="1", PMIX_RANK="0", PMIX_NAMESPACE="1")
    assert not {"OMPI_COMM_WORLD_RANK", "PMIX_RANK"} & set(variables)


@pytest.mark.parametrize("name", ["PMIX_RANK", "PMI_RANK", "OMPI_COMM_WORLD_RANK"])
def test_a_rank_without_a_launcher_is_refused(name, monkeypatch):
    for one in ("OMPI_COMM_WORLD_RANK", "OMPI_COMM_WORLD_SIZE", "PMI_RANK", "PMIX_RANK"):
        monkeypatch.delenv(one, raising=False)
    monkeypatch.setenv(name, "1")
    with pytest.raises(InputError, match=f"{name}: found '1' in the environment, but no"):
        is_launched(InputError)
    assert settled(**{name: "1"}).startswith(f"refused: {name}")


def test_no_modules_of_the_working_folder_and_those_of_the_user_last(tmp_path):
    user = tmp_path / "user/lib" / f"python{sys.version_info[0]}.{sys.version_info[1]}" / "site-packages"
    user.mkdir(parents=True)
    named = tmp_path / "named"
    named.mkdir()
    here = {"PYTHONPATH": f".:{named}:", "PYTHONUSERBASE": str(tmp_path / "user")}
    variables, _, places = settled(folder=tmp_path, **here)
    assert variables["PYTHONPATH"].split(os.pathsep) == [str(OURS), str(named)]
    assert variables["PYTHONSAFEPATH"] == "1"
    assert not {"", str(tmp_path)} & set(places)
    assert str(named) in places
    assert str(user) not in places[:-1]  # a virtual environment may have none


def test_a_process_of_its_own_is_settled(monkeypatch):
    from fragfield_base.ambient import run_function

    for name, value in {**LAUNCH, "SLURM_PROCID": "1", "NUMBA_NUM_THREADS": "0", "MPLBACKEND": "none"}.items():
        monkeypatch.setenv(name, value)
    done = run_function("os", "system", "env; pwd")
    lines = done.stdout.decode().splitlines()
    assert done.returncode == 0, done.stderr
    assert not [line for line in lines if line.startswith(("OMPI_COMM", "SLURM", "NUMBA_NUM"))]
    assert {"MPLBACKEND=agg", "OMPI_MCA_pml=ob1", "/"} <= set(lines)


def test_a_folder_of_a_cache_is_absolute(tmp_path):
    variables, _, _ = settled(folder=tmp_path, NUMBA_CACHE_DIR="cache", XDG_CACHE_HOME="other")
    assert variables["NUMBA_CACHE_DIR"] == str(tmp_path / "cache")


# --- Names of files as people give them


def test_a_tilde_is_a_home_and_a_name_is_relative_to_the_beginning(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", "/home/somebody")
    monkeypatch.chdir(tmp_path)
    assert paths.absolute("~/x", InputError) == Path("/home/somebody/x")
    assert paths.absolute("./~x", InputError) == tmp_path / "~x"
    assert paths.absolute(b"a/b.toml", InputError) == tmp_path / "a/b.toml"
    assert paths.absolute("b.csv", InputError, Path("/case")) == Path("/case/b.csv")
    monkeypatch.setattr(paths, "_start", None)
    paths.leave_folder(InputError)
    assert Path.cwd() == Path("/")
    assert paths.absolute("x.toml", InputError) == tmp_path / "x.toml"
    text = {"error": [f"{tmp_path}/runs/a: no such file"], "number": 1}
    assert paths.shown(text) == {"error": ["runs/a: no such file"], "number": 1}


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("", "an empty name"),
        ("~unknown-user/x", "no such home; a name with a tilde: ./~unknown-user/x"),
        (b"a\xff.toml", "not UTF-8; allowed: rename it"),
        ("a\0b", "the character NUL"),
        ("loop/x.toml", "a loop of symbolic links"),
        ("x" * 300, "too long for this file system"),
    ],
)
def test_what_cannot_be_a_name_is_refused_in_one_line(tmp_path, name, words):
    (tmp_path / "loop").symlink_to("other")
    (tmp_path / "other").symlink_to("loop")
    with pytest.raises(InputError, match=words):
        paths.absolute(name, InputError, tmp_path)


def test_a_working_folder_that_is_gone_is_refused(tmp_path, monkeypatch):
    gone = tmp_path / "gone"
    gone.mkdir()
    monkeypatch.chdir(gone)
    gone.rmdir()
    with pytest.raises(InputError, match="the working folder cannot be used"):
        paths.absolute("x", InputError)
    os.chdir(tmp_path)
