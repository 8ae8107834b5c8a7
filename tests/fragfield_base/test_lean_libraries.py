"""Machine code is made of what Python calls; kernels that only kernels call are part of it."""

from __future__ import annotations

import numba
import numpy as np
import pytest
from numba.core import codegen

from fragfield_base import kernel_cache, lean_libraries


@pytest.fixture
def compiled(monkeypatch):
    """The decorator of kernels, without a cache."""
    monkeypatch.setattr(kernel_cache, "cache_root", lambda: None)
    return lambda function, **options: kernel_cache.compiled_with(numba, function, "none", **options)


def root_of(x):
    if x < 0.0:
        raise ValueError("no root of", x)
    return np.sqrt(x)


def test_machine_code_is_made_of_the_caller_alone(compiled):
    root = compiled(root_of)
    total = compiled(lambda x: root(x) + 1.0)
    assert total(4.0) == 3.0
    [inner], [outer] = root.fragfield_bare.overloads.values(), total.overloads.values()
    assert outer.library.get_pointer_to_function(outer.fndesc.llvm_func_name)
    assert not inner.library.get_pointer_to_function(inner.fndesc.llvm_func_name)
    assert root(9.0) == 3.0, "called from Python after all"


def test_errors_of_inner_kernels_keep_their_values(compiled):
    root = compiled(root_of)
    deep = compiled(lambda x: root(x - 1.0))
    with pytest.raises(ValueError, match=r"no root of.*-3\.0"):
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


def test_a_numba_of_other_classes_compiles_as_usual(monkeypatch):
    """Where numba's methods have other names, its classes are left as they are."""
    other = type("JITCodeLibrary", (), {})
    monkeypatch.setattr(codegen, "JITCodeLibrary", other)
    lean_libraries.teach()
    assert not hasattr(other, "fragfield_lean")


@pytest.mark.parametrize(
    ("version", "taught"), [("0.60.0", False), ("0.61.0", True), ("0.68.1", True), ("0.69.0", False)]
)
def test_versions_of_numba_that_have_not_been_tried_compile_as_usual(monkeypatch, version, taught):
    known = {name: (lambda *_: None) for name in dir(codegen.JITCodeLibrary) if name.startswith("_")}
    other = type("JITCodeLibrary", (), {name: known[name] for name in known if not name.startswith("__")})
    monkeypatch.setattr(codegen, "JITCodeLibrary", other)
    monkeypatch.setattr(codegen.JITCPUCodegen, "set_env", codegen.JITCPUCodegen.set_env)
    monkeypatch.setattr(numba, "__version__", version)
    lean_libraries.teach()
    assert hasattr(other, "fragfield_lean") is taught
