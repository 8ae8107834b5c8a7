"""Threads that wait are asleep: the setting is there before OpenMP's library is, and a user's own setting stays."""

from __future__ import annotations

import ctypes.util
import os
import subprocess
import sys
import textwrap

import pytest

from tests.fragfield.short_run import ROOT

NAMES = ("OMP_WAIT_POLICY", "GOMP_SPINCOUNT", "KMP_BLOCKTIME")


def _printed(code, **variables):
    environment = {name: value for name, value in os.environ.items() if name not in NAMES}
    environment |= {"PYTHONPATH": str(ROOT), **variables}
    return subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code)], capture_output=True, text=True, env=environment, check=True
    )


@pytest.mark.parametrize("package", ["fragfield", "flight", "transition", "burst_fenicsx"])
@pytest.mark.parametrize(
    ("given", "found"),
    [
        ({}, ["passive", None, None]),
        ({"OMP_WAIT_POLICY": "active"}, ["active", None, None]),
        ({"GOMP_SPINCOUNT": "1000"}, [None, "1000", None]),
    ],
)
def test_every_package_sets_it_and_keeps_what_the_user_has_set(package, given, found):
    code = f"""
        import os, {package}
        print([os.environ.get(name) for name in {NAMES!r}])
    """
    assert _printed(code, **given).stdout.strip() == str(found)


@pytest.mark.skipif(ctypes.util.find_library("gomp") is None, reason="there is no libgomp")
@pytest.mark.parametrize(("given", "policy"), [({}, "PASSIVE"), ({"OMP_WAIT_POLICY": "active"}, "ACTIVE")])
def test_the_library_takes_it(given, policy):
    """What libgomp itself says that it has read, in a process that uses a shared loop of ours."""
    code = """
        import fragfield, numba
        @numba.njit(parallel=True)
        def add(values):
            for k in numba.prange(values.size):
                values[k] += 1.0
        import numpy
        add(numpy.zeros(8))
        print(numba.threading_layer())
    """
    done = _printed(code, OMP_DISPLAY_ENV="TRUE", NUMBA_THREADING_LAYER="omp", **given)
    assert done.stdout.strip() == "omp"
    assert f"OMP_WAIT_POLICY = '{policy}'" in done.stderr
