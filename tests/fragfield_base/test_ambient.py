"""A process is settled: variables of libraries and launchers; names of files as people give them."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from fragfield_base import paths
from fragfield_base.ambient import check_variables
from fragfield_base.errors import InputError
from tests.fragfield.short_run import ROOT

SETTLED = (
    "import json, os, sys; sys.path.insert(0, sys.argv[1])\n"
    "from fragfield_base.ambient import kept_variables, settle\n"
    "settle(ValueError)\n"
    "print(json.dumps([dict(os.environ), kept_variables()]))\n"
)


def settled(**variables):
    """Variables and record of a process that was settled with these variables."""
    known = {"PATH": os.environ["PATH"], "HOME": "/proc/none", **variables}
    done = subprocess.run(
        [sys.executable, "-c", SETTLED, str(ROOT)], env=known, capture_output=True, text=True, check=True
    )
    return json.loads(done.stdout)


def test_pictures_locks_and_mpi_of_one_process_are_set_and_threads_kept():
    given = {"PETSC_OPTIONS": "-help", "MPLBACKEND": "none", "OMPI_MCA_btl": "none", "OMPI_X": "1", "PMI_FD": "3"}
    threads = {"NUMBA_NUM_THREADS": "2", "OMP_NUM_THREADS": "4,2"}
    variables, record = settled(**given, **threads)
    forced = {"PETSC_OPTIONS": "-no_signal_handler", "MPLBACKEND": "agg", "HDF5_USE_FILE_LOCKING": "FALSE",
              "OMPI_MCA_btl": "self", "UCX_TLS": "self", "MATPLOTLIBRC": os.devnull}  # fmt: skip
    assert forced.items() <= variables.items()
    assert not {"OMPI_X", "PMI_FD"} & set(variables)
    assert record == threads


def test_a_processor_is_named_for_all_libraries():
    variables, record = settled(FRAGFIELD_PROCESSOR="avx2", NUMBA_CPU_NAME="generic")
    assert (variables["NUMBA_CPU_NAME"], variables["NUMBA_CPU_FEATURES"]) == ("haswell", "")
    without = variables["NPY_DISABLE_CPU_FEATURES"].split()
    assert "AVX512F" in without
    assert "AVX2" not in without
    assert record == {"FRAGFIELD_PROCESSOR": "avx2"}
    variables, _ = settled(FRAGFIELD_PROCESSOR="sse4")
    assert {"AVX", "AVX2", "FMA3", "AVX512F"} <= set(variables["NPY_DISABLE_CPU_FEATURES"].split())


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("FRAGFIELD_PROCESSOR", "avx512"),
        ("NUMBA_NUM_THREADS", "0"),
        ("OMP_NUM_THREADS", "-1"),
        ("OPENBLAS_NUM_THREADS", "all"),
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


def test_variables_of_a_launch_stay_in_its_ranks():
    launch = {"OMPI_COMM_WORLD_RANK": "1", "OMPI_COMM_WORLD_SIZE": "2", "OMPI_MCA_pml": "cm"}
    variables, _ = settled(**launch)
    assert launch.items() <= variables.items()
    assert not {"OMPI_MCA_btl", "UCX_TLS"} & set(variables)
    assert variables["UCX_DEBUG_SIGNO"] == "0"


def test_a_launch_of_one_rank_needs_no_launcher():
    """MPI starts once for a rank: of two commands in a script that it runs the second would be ended."""
    variables, _ = settled(OMPI_COMM_WORLD_RANK="0", OMPI_COMM_WORLD_SIZE="1", PMIX_RANK="0", PMIX_NAMESPACE="1")
    assert not {"OMPI_COMM_WORLD_RANK", "PMIX_RANK"} & set(variables)


def test_a_tilde_is_a_home_and_a_name_is_relative_to_the_working_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("HOME", "/home/somebody")
    monkeypatch.chdir(tmp_path)
    assert paths.absolute("~/x", InputError) == Path("/home/somebody/x")
    assert paths.absolute("./~x", InputError) == tmp_path / "~x"
    assert paths.absolute(b"a/b.toml", InputError) == tmp_path / "a/b.toml"
    assert paths.absolute("b.csv", InputError, Path("/case")) == Path("/case/b.csv")
    text = {"error": [f"{tmp_path}/runs/a: no such file"], "number": 1}
    assert paths.shown(text) == {"error": ["runs/a: no such file"], "number": 1}


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("", "an empty name"),
        ("~unknown-user/x", "no such home; a name with a tilde: ./~unknown-user/x"),
        (b"a\xff.toml", "not UTF-8; allowed: rename it"),
    ],
)
def test_what_cannot_be_a_name_is_refused_in_one_line(tmp_path, name, words):
    with pytest.raises(InputError, match=words):
        paths.absolute(name, InputError, tmp_path)
