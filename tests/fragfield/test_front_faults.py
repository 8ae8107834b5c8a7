"""The way in: settings of one stage, ranks of a launcher, quantities of pint, files by the one writer, exit codes."""

from __future__ import annotations

import errno
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pint
import pytest

import fragfield
from fragfield.case.load import case_from_document
from fragfield.errors import exit_code_of, message_of
from fragfield.interface.running import options_of
from fragfield.pipeline import parallel
from fragfield.report.findings import ledger_findings
from fragfield.results.summary import Summary
from tests.fragfield.example_results import example
from tests.fragfield.short_run import ROOT
from tests.fragfield.synthetic_run import run_of

UNITS = pint.UnitRegistry()


def test_a_mapping_of_settings_and_a_list_mean_the_same_for_one_stage(tmp_path):
    """A flight of given fragments needs no burst, however its settings are written."""
    path = tmp_path / "mine.toml"
    path.write_text('title = "no burst"\n')
    for given in (["hazard.energy=50 J"], {"hazard.energy": "50 J"}):
        request = options_of(path, set=given, out=tmp_path / "run", burst=False)
        assert request.case(burst=False).hazard.energy == 50.0
    asked = options_of(path, set={"hazard.energy": "50 J"}, out=tmp_path / "run")
    with pytest.raises(fragfield.InputError, match="burst: missing"):
        asked.case()


def test_a_burst_without_dolfinx_is_refused_before_anything_is_written(tmp_path, monkeypatch):
    monkeypatch.setattr("fragfield.pipeline.chain.find_spec", lambda name: None if name == "dolfinx" else name)
    with pytest.raises(fragfield.InputError, match=r"found no dolfinx in .*pip install 'fragfield\[dolfinx\]'"):
        fragfield.run(ROOT / "cases" / "tube.toml", out=tmp_path / "run")
    assert not (tmp_path / "run").exists()


LAUNCHERS = [
    ({}, 0, 1),
    ({"OMPI_COMM_WORLD_RANK": "2", "OMPI_COMM_WORLD_SIZE": "4"}, 2, 4),
    ({"PMI_RANK": "1", "PMI_SIZE": "2"}, 1, 2),
    ({"PMIX_RANK": "1", "OMPI_COMM_WORLD_SIZE": "3"}, 1, 3),
    ({"PMIX_RANK": "1", "SLURM_STEP_NUM_TASKS": "8"}, 1, 8),
    ({"SLURM_STEP_NUM_TASKS": "8"}, 0, 1),  # a shell of srun without ranks of MPI
]


@pytest.mark.parametrize(("variables", "rank", "size"), LAUNCHERS)
def test_ranks_and_size_of_a_launcher(variables, rank, size, monkeypatch):
    for name in (*parallel._RANK_VARIABLES, *parallel._SIZE_VARIABLES, parallel._STEP_SIZE):
        monkeypatch.delenv(name, raising=False)
    for name, value in variables.items():
        monkeypatch.setenv(name, value)
    assert (parallel.launched_rank(), parallel.launched_size()) == (rank, size)


def test_mpi_is_asked_where_a_launcher_says_the_rank_alone(monkeypatch):
    for name in (*parallel._RANK_VARIABLES, *parallel._SIZE_VARIABLES, parallel._STEP_SIZE):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("PMIX_RANK", "1")
    monkeypatch.setenv("PMIX_NAMESPACE", "of a launcher")
    world = SimpleNamespace(Get_size=lambda: 2, Get_rank=lambda: 1)
    monkeypatch.setitem(sys.modules, "mpi4py.MPI", SimpleNamespace(COMM_WORLD=world))
    assert parallel.launched_size() == 2
    team = parallel.Team.join()
    assert (team.rank, team.size, team.first) == (1, 2, False)


def test_a_quantity_of_pint_stands_for_its_text():
    tables = {
        "burst": {"cell_size": 12 * UNITS.mm, "end_time": 20 * UNITS.us, "geometry": "3d"},
        "round": [
            {"name": "t", "profile": "tube", "explosive": "tnt", "casing": "steel_paper",
             "position": np.array([0.0, 0.0, 100.0]) * UNITS.cm}
        ],
        "hazard": {"density": 1 / (55.7 * UNITS.m**2), "energy": UNITS.Quantity(58.0, "ft * lbf")},
        "break_up": {"fracture_energy": 14.7e4 * UNITS.J / UNITS.m**2, "prefactor": UNITS.Quantity(4.0)},
    }  # fmt: skip
    values = fragfield.Case(tables).values
    assert values.burst.cell_size == pytest.approx(0.012)
    assert values.round[0].position == pytest.approx((0.0, 0.0, 1.0))
    assert values.hazard.density == pytest.approx(1 / 55.7)
    assert values.hazard.energy == pytest.approx(78.64, abs=0.01)
    assert (values.break_up.fracture_energy, values.break_up.prefactor) == pytest.approx((14.7e4, 4.0))


def test_a_quantity_of_another_dimension_is_refused_with_its_key():
    tables = {"burst": {"cell_size": 12 * UNITS.s}}
    with pytest.raises(fragfield.InputError, match=r"burst\.cell_size: found \"12 second\", which is a time"):
        fragfield.Case(tables)


@pytest.mark.parametrize(
    "error",
    [
        OSError(errno.ENOSPC, "No space left on device", "/x/y"),
        OSError(errno.EMFILE, "Too many open files"),
        PermissionError(errno.EACCES, "Permission denied", "/x/y"),
        FileNotFoundError(errno.ENOENT, "No such file or directory", "/x/y"),
        ConnectionRefusedError(errno.ECONNREFUSED, "Connection refused"),
        FileNotFoundError(errno.ENOENT, "No such file or directory"),
        FileNotFoundError(errno.ENOENT, "No such file", str(Path(fragfield.__file__).parent / "data" / "x.toml")),
        OSError(errno.EBADF, "Bad file descriptor"),
        OSError(errno.EINVAL, "Invalid argument"),
        OSError("without errno"),
    ],
)
def test_errors_of_the_operating_system_are_the_machines_or_a_files(error):
    assert exit_code_of(error) == 2
    assert "fault of the program" not in message_of(error)


def _run(part: str, tolerance: float = 0.05, **values):
    document = {"burst": {"cell_size": "6 mm", "energy_tolerance": tolerance}}
    case = fragfield.case.CaseTable.model_validate(document)
    return run_of(values=case, summary=example(Summary, **{part: values}))


@pytest.mark.parametrize(
    ("tolerance", "error", "weight", "words"),
    [
        (0.05, 0.049, "warning", "1 % is the aim"),
        (0.05, 0.051, "stop", "above 5 % the burst is not computed correctly"),
        (0.02, 0.019, "warning", "1 % is the aim"),
        (0.02, 0.021, "stop", "above 2 % (`burst.energy_tolerance`) the burst is not computed correctly"),
        (1.0, 0.051, "stop", "above 5 % the burst is not computed correctly"),  # a raised tolerance mends nothing
    ],
)
def test_a_ledger_is_stopped_at_its_tolerance_and_never_above_5_percent(tolerance, error, weight, words):
    of_contact = {"contact_error": error, "contact_error_at_end": error, "contact": {"gain": 1.0}}
    for burst in ({"energy_error": error}, of_contact):
        found = ledger_findings(_run("burst", tolerance, **burst))
        assert [one.weight for one in found if words in one.text] == [weight]


@pytest.mark.parametrize(("ratio", "warned"), [(1.58, True), (1.59, False), (2.1, False), (2.11, True)])
def test_the_range_of_venting_is_one(ratio, warned):
    from fragfield.case.faults import outside_soft
    from fragfield.case.keys import bounds_of
    from fragfield.studies.uncertainty.inputs import default_inputs

    case = case_from_document(
        {
            "burst": {"cell_size": "8 mm", "leakage": {"radius_ratio": ratio}},
            "round": [{"name": "t", "profile": "tube", "explosive": "tnt", "casing": "steel_paper"}],
        },
        source="case.toml", folder=ROOT,
    )  # fmt: skip
    assert bool(list(outside_soft(case))) == warned
    sampled = next(one for one in default_inputs(case) if "burst.leakage.radius_ratio" in one.keys)
    assert bounds_of(type(case.burst.leakage).model_fields["radius_ratio"]).usual == (sampled.low, sampled.high)
