"""Cases made in Python: what they hold, their faults, how they are checked, and what an import of fragfield costs."""

from __future__ import annotations

import json

import numpy as np
import pytest

import flight
import fragfield
from fragfield.errors import exit_code_of
from fragfield.interface import running
from fragfield.results.part import to_json
from tests.fragfield.short_run import RINGS, ROOT, invoke, python
from tests.fragfield.small_tube import BURST, TUBE, tube_case

HEAVY = ("dolfinx", "mpi4py", "petsc4py", "vtkmodules", "pyvista", "matplotlib", "pandas", "gmsh", "numpy", "numba",
         "pydantic", "pint", "h5py", "scipy", "rich", "typer", "burst_fenicsx", "transition", "flight")  # fmt: skip


@pytest.fixture(scope="module")
def tube():
    return tube_case()


def test_the_import_is_cheap_and_every_name_is_there():
    probe = python(
        "import sys, json, fragfield\n"
        f"print(json.dumps([name for name in {HEAVY!r} if name in sys.modules]))\n"
        "print(json.dumps([name for name in fragfield.__all__ if not hasattr(fragfield, name)]))\n"
        "print('dolfinx' in sys.modules, 'matplotlib' in sys.modules, 'pandas' in sys.modules)"
    )
    assert probe.returncode == 0, probe.stderr
    loaded, missing, afterwards = probe.stdout.splitlines()
    assert json.loads(loaded) == []
    assert json.loads(missing) == []
    assert afterwards == "False False False"
    assert set(fragfield.__all__) <= set(dir(fragfield))
    with pytest.raises(AttributeError, match="no attribute 'rum'"):
        _ = fragfield.rum


def test_a_case_of_a_dict_is_the_case_of_the_file(tmp_path):
    (tmp_path / "tube.toml").write_text(RINGS)
    read = fragfield.Case.from_toml(tmp_path / "tube.toml")
    assert fragfield.Case(read.tables()) == read
    assert fragfield.Case.from_toml(read.write(tmp_path / "written.toml")) == read
    assert read.path == tmp_path / "tube.toml"


def test_tables_may_hold_arrays_tuples_and_paths(tmp_path):
    outer = np.array([[0.0, 40.0], [300.0, 40.0]])
    shape = {
        "unit": "mm",
        "source": "test",
        "outer": {"points": outer},
        "cavity": {"points": ((20, 30), (280, 30))},
        "charge": {"front": 20},
    }
    (tmp_path / "drag.csv").write_text("mach;cd\n0;1\n2;1.2\n")
    case = fragfield.Case(
        {"burst": BURST},
        folder=tmp_path,
        round=({**TUBE, "profile": shape},),
        flight={"drag": (tmp_path / "drag.csv").relative_to(tmp_path)},
    )
    assert case.values.round[0].profile["outer"]["points"] == outer.tolist()
    assert case.values.flight.drag == str(tmp_path / "drag.csv")


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        (
            {"burst": {"cell_size": 6}, "round": [TUBE]},
            "burst.cell_size: found the bare number 6 without a unit; allowed: a length with its unit",
        ),
        ({"flight": {"drag": "nothing.csv"}}, "nothing.csv: no such file"),
    ],
)
def test_a_fault_in_a_case_is_reported_as_of_a_file(tables, message, tmp_path):
    with pytest.raises(fragfield.InputError, match=message) as found:
        fragfield.Case(tables)
    assert str(found.value).startswith("case: ")
    assert exit_code_of(found.value) == 2
    from fragfield.case.write import tables_to_toml

    (tmp_path / "same.toml").write_text(tables_to_toml(tables))
    burst = "burst" in tables or "round" in tables
    with pytest.raises(fragfield.InputError) as of_file:
        fragfield.Case.from_toml(tmp_path / "same.toml", burst=burst)
    tail = str(found.value).removeprefix("case: ").replace(str(tmp_path), "").replace(str(ROOT), "")
    assert str(of_file.value).removeprefix(f"{tmp_path / 'same.toml'}: ")[:60].split("/")[0] == tail[:60].split("/")[0]


def test_arguments_of_a_case_are_checked(tube):
    with pytest.raises(fragfield.InputError, match="burst is given twice, in the tables and as a keyword"):
        fragfield.Case({"burst": BURST}, burst=BURST)
    with pytest.raises(fragfield.InputError, match="found a list; needed: a mapping of tables"):
        fragfield.Case([TUBE])
    with pytest.raises(fragfield.InputError, match='set: found the text "seed=3"; needed: a list of KEY=VALUE'):
        fragfield.Case.from_toml(ROOT / "cases" / "tube.toml", set="seed=3")
    with pytest.raises(fragfield.InputError, match=r"burst.cell_siz: unknown key"):
        tube.changed({"burst.cell_siz": "8 mm"})


def test_set_takes_texts_and_mappings():
    path = ROOT / "cases" / "tube.toml"
    texts = fragfield.Case.from_toml(path, set=["burst.cell_size=8 mm", "seed=7"])
    mapping = fragfield.Case.from_toml(path, set={"burst.cell_size": "8 mm", "seed": 7})
    assert texts == mapping == fragfield.Case.from_toml(path).changed(["burst.cell_size=8 mm", "seed=7"])
    assert texts.values.burst.cell_size == 0.008
    assert texts.title == mapping.title == fragfield.Case.from_toml(path).title


def test_check_is_that_of_the_command_line(tmp_path, tube):
    found = fragfield.check(tube)
    printed = invoke("check", tube.write(tmp_path / "tube.toml"), "--json")
    assert json.loads(printed.stdout) == json.loads(json.dumps(to_json(found.found)))
    assert found.warnings == [*found.found.warnings] != []
    assert found.found.mesh.cells > 100
    finer = fragfield.check(tube, set={"burst.cell_size": "7 mm", "seed": 3})
    assert finer.found.mesh.cells > 2 * found.found.mesh.cells


def test_where_a_run_goes(tmp_path, monkeypatch, tube):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.toml").write_text(RINGS)
    runs = tmp_path / "runs"
    assert running.options_of("mine.toml").directory.path == runs / "mine"
    assert running.options_of(fragfield.Case.from_toml("mine.toml")).directory.path.name == "mine"
    assert running.options_of("mine.toml", set={"seed": 2}).directory.path.name == "mine"
    assert running.options_of("mine.toml", set={"seed": 2}).case().seed == 2
    assert running.options_of("mine.toml", set=["seed=2"]).case().seed == 2
    assert running.options_of(tube, out="there", set=["seed=2"]).case().seed == 2
    (tmp_path / "old").mkdir()
    (tmp_path / "old" / "case.toml").write_text("")
    assert running.options_of("old", progress=False).directory.path.name == "old"
    assert running.options_of("old", progress=False).quiet


def test_the_errors_of_all_stages_are_one():
    from burst_fenicsx.errors import InputError as OfBurst
    from fragfield.errors import InputError as OfCommandLine
    from transition.errors import InputError as OfBreakUp

    for kind in (OfBurst, OfBreakUp, OfCommandLine, flight.InputError):
        assert issubclass(kind, fragfield.InputError)
        assert kind is not fragfield.InputError
        assert exit_code_of(kind("x")) == 2
