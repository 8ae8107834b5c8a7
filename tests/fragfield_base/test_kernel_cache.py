"""Compiled kernels are read from folders of the user's own only."""

from __future__ import annotations

import logging
import os
import pickle
import subprocess
import sys
from pathlib import Path

import numba
import numpy as np
import pytest
from numba.core.codegen import JITCodeLibrary

from fragfield_base import kernel_cache
from fragfield_base.kernel_cache import cache_root, compiled_with

ROOT = Path(__file__).parents[2]
root_only = pytest.mark.skipif(os.geteuid() != 0, reason="only root can give files to another user")


@pytest.fixture
def places(tmp_path, monkeypatch):
    """Home under a folder of ours, and no setting by the environment."""
    cache_root.cache_clear()
    tmp_path.chmod(0o755)
    for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    yield tmp_path
    cache_root.cache_clear()


def test_the_users_cache_is_made_for_the_user_alone(places):
    found = cache_root()
    assert found == places / "home" / ".cache" / "fragfield"
    assert found.stat().st_mode & 0o777 == 0o700


def test_a_folder_given_by_the_environment_comes_first(places, monkeypatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(places / "mine"))
    assert cache_root() == places / "mine"


@pytest.mark.parametrize("mode", [0o777, 0o757, 0o775])
def test_a_folder_in_which_others_may_write_is_not_used(places, caplog, mode):
    ours = places / "home" / ".cache" / "fragfield"
    ours.mkdir(parents=True)
    ours.chmod(mode)
    with caplog.at_level(logging.WARNING):
        assert cache_root() is None
    assert f"compiled kernels are not kept, which costs minutes in every command: {ours}" in caplog.text


@root_only
def test_a_planted_pickle_does_not_run(places):
    """A cache that another user made, under the names that numba looks for; in one of the user's own it would run."""
    trace, planted = places / "ran", places / "cache"
    (places / "little.py").write_text(
        "import numba\nfrom fragfield_base.kernel_cache import cache_root, compiled_with\n"
        "def twice(x):\n    return 2 * x\ntwice = compiled_with(numba, twice, 'little')\n"
    )
    environment = {"PATH": os.environ["PATH"], "PYTHONPATH": f"{ROOT}:{places}", "NUMBA_CACHE_DIR": str(planted)}

    class Payload:
        def __reduce__(self):
            return os.system, (f"touch {trace}",)

    def start():
        command = [sys.executable, "-c", "import little; print(little.twice(3), little.cache_root())"]
        done = subprocess.run(command, capture_output=True, text=True, check=True, cwd=ROOT, env=environment)
        return done.stdout.strip()

    def plant():
        (index,) = planted.rglob("little.twice-*.nbi")
        index.write_bytes(pickle.dumps(Payload()))

    assert start() == f"6 {planted}"
    plant()
    assert start() == f"6 {planted}"
    assert trace.exists()
    trace.unlink()
    plant()
    for entry in [planted, *planted.rglob("*")]:
        os.chown(entry, 12345, 12345)
    assert start() == "6 None"
    assert not trace.exists()


def test_kernels_work_where_no_folder_is_safe(places, monkeypatch):
    monkeypatch.setattr(kernel_cache, "cache_root", lambda: None)
    import numba

    twice = kernel_cache.compiled_with(numba, lambda x: 2.0 * x, "none")
    assert twice(3.0) == 6.0


def test_every_kernel_that_is_kept_is_kept_by_this_module():
    """Numba's own cache lies beside the sources, where others may be able to write."""
    packages = ("burst_fenicsx", "transition", "flight", "fragfield", "fragfield_base")
    sources = [path for package in packages for path in (ROOT / package).rglob("*.py")]
    found = [str(path.relative_to(ROOT)) for path in sources if "cache=True" in path.read_text(encoding="utf-8")]
    assert found == ["fragfield_base/kernel_cache.py"]


# --- Kernels that other kernels call are compiled into them, without wrappers and once for all constants


@pytest.fixture
def compiled():
    """The decorator of kernels, without a cache."""
    return lambda function, **options: compiled_with(numba, function, **options)


def root_of(x):
    if x < 0.0:
        raise ValueError("no root of a negative number")
    return np.sqrt(x)


def test_constants_have_one_version(compiled):
    """`lane` is typed as a number: numba gives a function that is called with a constant one version for each."""
    load = compiled(lambda rows, row, lane: rows[4 * row + lane])
    seen = []
    listener = type("Listener", (numba.core.event.Listener,), {
        "on_start": lambda self, event: seen.append(event.data["args"]), "on_end": lambda self, event: None
    })()  # fmt: skip
    total = compiled(lambda rows: load(rows, 0, 1) + load(rows, 2, 3) + load(rows, 1, 0))
    rows = np.arange(12.0)
    with numba.core.event.install_listener("numba:compile", listener):
        assert total(rows) == rows[1] + rows[11] + rows[4]
    assert len([arguments for arguments in seen if len(arguments) == 3]) == 1


def test_what_kernels_call_is_called_from_python_too(compiled):
    square = compiled(lambda x: x * x)
    assert compiled(lambda x: 2.0 * square(x))(3.0) == 18.0
    assert square(3.0) == 9.0


def test_options_hold_within_callers(compiled):
    """A division by zero raises with Python's rules and gives infinity with numpy's."""
    inverse = compiled(lambda x: 1.0 / x, error_model="numpy")
    assert compiled(lambda x: inverse(x) + 1.0, error_model="numpy")(0.0) == np.inf


def test_errors_keep_their_text_through_kernels(compiled):
    root = compiled(root_of)
    deep = compiled(lambda x: root(x - 1.0))
    with pytest.raises(ValueError, match="no root of a negative number"):
        compiled(lambda x: deep(x) + root(x))(-2.0)


def test_loops_over_threads_are_part_of_their_callers(compiled):
    def fill(rows):
        for k in numba.prange(rows.size):
            rows[k] = k * k

    inner = compiled(fill, parallel=True)
    total = compiled(lambda rows: (inner(rows), rows.sum())[1])
    rows = np.zeros(1000)
    assert total(rows) == 999 * 1000 * 1999 / 6
    assert np.array_equal(rows, np.arange(1000.0) ** 2)


def test_what_kernels_call_is_optimised_and_translated_in_the_callers_alone(compiled, monkeypatch):
    """Numba by itself makes a library of each function: of these three."""
    translated = []
    translate = JITCodeLibrary._finalize_final_module
    monkeypatch.setattr(
        JITCodeLibrary, "_finalize_final_module", lambda self: (translated.append(self.name), translate(self))
    )
    half = compiled(lambda x: 0.5 * x)
    third = compiled(lambda x: half(x) / 1.5)
    sixth = compiled(lambda x: half(third(x)))
    assert sixth(12.0) == 2.0
    assert len(translated) == 1
    assert third(12.0) == 4.0
    assert len(translated) == 2
