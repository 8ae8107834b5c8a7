"""The faults that `setup.sh mutants` seeds: what they change, what they leave alone, which tests they are given to."""

from __future__ import annotations

import ast
import json
import shutil
from pathlib import Path

import pytest

from tests.mutants import __main__ as mutants
from tests.mutants.faults import KINDS, faults_of
from tests.mutants.targets import AREAS, files_of, modules_of, names_imported
from tests.mutants.workshop import Workshop, is_compiled

ROOT = Path(__file__).parents[1]

SOURCE = '''"""A module of 2.0 words."""
from math import pi

__all__ = ["area"]
_SHARE: float = 0.5

def area(r: float, n: int = 3) -> float:
    """The area: 4.0 pi."""
    total = 0.0
    prefetch(n + 3.0)
    for k in range(n):
        total += _SHARE * pi * r ** 2 - r
    if r < 1.0 and n > 2:
        raise ValueError(f"{r + 1.0} is small")
    return min(total, -r) + "é".count("e") * [r, total][0]
'''


def test_every_kind_of_fault_is_found_and_its_text_is_a_module():
    found = faults_of(SOURCE)
    assert {fault.kind for fault in found} == set(KINDS)
    plain = ast.dump(ast.parse(SOURCE))
    for fault in found:
        text = fault.applied(SOURCE)
        assert ast.dump(ast.parse(text)) != plain, fault
        assert len(text.splitlines()) == len(SOURCE.splitlines())
    reported = {str(fault) for fault in found}
    assert "line 5: 0.5 -> 0.4" in reported
    assert "line 11: range(n) -> range(n - 1)" in reported
    assert "line 12: total += _SHARE * pi * r ** 2 - r -> total -= _SHARE * pi * r ** 2 - r" in reported
    assert "line 12: total += _SHARE * pi * r ** 2 - r -> pass" in reported
    assert "line 12: _SHARE * pi * r ** 2 - r -> (_SHARE * pi * r ** 2)" in reported
    assert "line 13: r < 1.0 -> (r >= 1.0)" in reported
    assert "line 13: r < 1.0 and n > 2 -> (r < 1.0 or n > 2)" in reported
    assert "line 15: min(total, -r) -> max(total, -r)" in reported
    assert "line 15: [r, total][0] -> [r, total][1]" in reported
    assert "line 15: -r -> r" in reported


def test_what_computes_nothing_is_left_alone():
    """Docstrings, annotations, imports, names for export and messages, also where letters take several bytes."""
    for fault in faults_of(SOURCE):
        text = fault.applied(SOURCE)
        for kept in ('"""A module of 2.0 words."""', "from math import pi", '["area"]', '"""The area: 4.0 pi."""'):
            assert kept in text
        assert 'raise ValueError(f"{r + 1.0} is small")' in text
        assert "    prefetch(n + 3.0)\n" in text
        assert '"é".count("e")' in text or fault.before.startswith(("min", '"é"'))


@pytest.mark.parametrize("area", AREAS, ids=lambda area: area.name)
def test_every_module_that_gets_faults_has_tests(area):
    modules = modules_of(area, ROOT)
    assert len(modules) > 5
    for module in modules:
        tests = files_of(module)
        assert tests, module
        assert all((ROOT / test).exists() for test in tests), (module, tests)


def test_modules_with_physics_are_in_one_area_each():
    of_area = [modules_of(area, ROOT) for area in AREAS]
    together = [module for modules in of_area for module in modules]
    assert len(set(together)) == len(together)
    for module in (
        "burst_fenicsx/kernels/cells/solid.py",
        "burst_fenicsx/mechanics/solver.py",
        "transition/law/mott.py",
        "flight/hazard/density/expected.py",
    ):
        assert module in together


def test_the_tests_of_a_module_are_those_of_its_area_and_those_that_import_it():
    found = files_of("burst_fenicsx/kernels/geometry/boxes.py")
    assert {"tests/burst_fenicsx/test_search.py", "tests/burst_fenicsx/test_boxes.py"} <= set(found)
    for area in AREAS:
        for module in modules_of(area, ROOT):
            name, tests = module.removesuffix(".py").replace("/", "."), files_of(module)
            folder = ROOT / "tests" / module.partition("/")[0]
            for path in folder.rglob("test_*.py"):
                given = any(path.is_relative_to(ROOT / test) for test in tests)
                assert given or name not in names_imported(path), (module, path)
    assert files_of("burst_fenicsx/kernels/__init__.py") == []


def test_the_same_seed_gives_the_same_faults_from_all_areas_and_kinds():
    first, again = ([next(one) for _ in range(50)] for one in (mutants.chosen_faults(ROOT, 5) for _ in range(2)))
    assert first == again
    assert {area for area, _, _ in first} == {area.name for area in AREAS}
    assert {fault.kind for _, _, fault in first} == set(KINDS)
    other = [item for item, _ in zip(mutants.chosen_faults(ROOT, 6), range(50), strict=False)]
    assert other != first


def test_faults_chosen_by_hand_stand_in_the_sources():
    """Each text once, its fault another one that can be compiled, and its tests in a file that is there."""
    rows = mutants.chosen_by_hand(ROOT)
    assert len(rows) > 50
    for row in rows:
        changed = (ROOT / row["module"]).read_text().replace(row["before"], row["after"])
        compile(changed, row["module"], "exec")
        for test in row["tests"].split():
            path, _, name = test.partition("::")
            assert f"def {name}" in (ROOT / path).read_text(), test


def test_faults_that_change_nothing_are_known_by_text_and_reason():
    known = mutants.equivalents()
    for name in known:
        source = (ROOT / name[0]).read_text()
        assert name in {mutants.name_of(name[0], source, one) for one in faults_of(source)}, name
    lines = (ROOT / "tests/mutants/equivalent.tsv").read_text().splitlines()[1:]
    assert all(len(line.split("\t")[4]) > 10 for line in lines)


class Trial(Workshop):
    """A workshop of one module and one test, without kernels."""

    def _cache_names(self):
        return []


@pytest.fixture
def trial(tmp_path, monkeypatch):
    for module in ("flight/one.py", "tests/test_one.py"):
        (tmp_path / "project" / module).parent.mkdir(parents=True, exist_ok=True)
    (tmp_path / "project/flight/one.py").write_text("def twice(x):\n    return x + x\n")
    (tmp_path / "project/tests/test_one.py").write_text(
        "import sys\nsys.path.insert(0, '.')\nfrom flight.one import twice\n\n\n"
        "def test_twice():\n    assert twice(3) == 6\n"
    )
    (tmp_path / "project/pyproject.toml").write_text('[tool.pytest.ini_options]\nmarkers = ["slow: x", "mpi: x"]\n')
    monkeypatch.delenv("PYTEST_XDIST_WORKER", raising=False)
    for plugin in ("plan.py", "interpreted.py"):
        (tmp_path / "project/tests/mutants").mkdir(exist_ok=True)
        shutil.copy(ROOT / "tests/mutants" / plugin, tmp_path / "project/tests/mutants" / plugin)
    return Trial(tmp_path / "project", tmp_path / "work")


def test_a_fault_is_tried_in_a_copy_and_taken_back(trial):
    module, tests = trial.tree / "flight/one.py", ["tests/test_one.py"]
    before = module.read_text(), module.stat().st_mtime_ns
    assert list(trial.usual(tests)) == ["tests/test_one.py::test_twice"]
    caught = trial.with_fault("flight/one.py", "def twice(x):\n    return x - x\n", tests)
    assert (caught.state, caught.test.split(" - ")[0]) == ("failed", "tests/test_one.py::test_twice")
    missed = trial.with_fault("flight/one.py", "def twice(x):\n    return 2 * x\n", tests)
    assert missed.state == "passed"
    assert (module.read_text(), module.stat().st_mtime_ns) == before
    (known,) = json.loads((trial.tree.parent / "usual.json").read_text()).values()
    assert [key.split()[0] for key in known] == tests
    with pytest.raises(SystemExit, match="another process tries faults"):
        Trial(trial.tree.parent.parent / "project", trial.tree.parent)


KERNEL = "from numba import njit\n\n\n@njit\ndef twice(x):\n    return x + x\n"


def test_a_fault_in_a_kernel_is_tried_in_plain_python_first(trial):
    """Found there where an assertion fails; an error that Python alone may raise decides nothing."""
    module, tests = trial.tree / "flight/one.py", ["tests/test_one.py"]
    module.write_text(KERNEL)
    assert is_compiled(KERNEL)
    found = trial.with_fault("flight/one.py", KERNEL.replace("x + x", "x - x"), tests)
    assert (found.state, found.plain) == ("failed", True)
    found = trial.with_fault("flight/one.py", KERNEL.replace("x + x", "x + x if x else 1 / 0"), tests)
    assert (found.state, found.plain) == ("passed", False)
    found = trial.with_fault("flight/one.py", KERNEL.replace("x + x", "x + x + 0 * (1 // (x - x))"), tests)
    assert (found.state, found.plain) == ("failed", False)
    assert module.read_text() == KERNEL


def test_a_test_that_fails_without_a_fault_decides_nothing(trial):
    (trial.tree / "tests/test_one.py").write_text("def test_wrong():\n    assert False\n")
    with pytest.raises(RuntimeError, match=r"without a fault tests/test_one\.py fails: .*test_wrong"):
        trial.with_fault("flight/one.py", "", ["tests/test_one.py"])


def test_the_interval_is_wilsons():
    """The roots p of (caught / n - p)^2 = z^2 p (1 - p) / n; nothing is known of none."""
    low, high = mutants.interval(280, 300)
    for p in (low, high):
        assert (280 / 300 - p) ** 2 == pytest.approx(1.959964**2 * p * (1.0 - p) / 300, rel=1e-9)
    assert low < 280 / 300 < high
    assert mutants.interval(0, 0) == (0.0, 1.0)
