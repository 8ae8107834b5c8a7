"""The envelope over attitudes: one attitude of it is the run in that attitude, and the worst is what is reported."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest

import fragfield
from fragfield.case import load_case
from fragfield.case.conversion.turned import Arrangement
from fragfield.files.run_directory import RunDirectory
from fragfield.pipeline import attitudes
from fragfield.pipeline.attitudes import fly_all
from fragfield.pipeline.job import Job, RunOptions
from fragfield.pipeline.parallel import Team
from fragfield.results.part import to_json, value_at
from fragfield.terminal.progress import ProgressReporter
from tests.fragfield.plain_reports import leave_out_figures
from tests.fragfield.short_run import RINGS, invoke

pytestmark = [pytest.mark.dolfinx, pytest.mark.cores]  # one worker makes the fixtures of all

# Few realisations, large steps and a wide tolerance: every part of the search has something to do, in seconds.
STEPS = (60.0, 20.0)
TEXT = (
    RINGS.replace("0.5\nmax_realisations = 8", "0.05\nmax_realisations = 16").replace('"12 us"', '"80 us"')
    + '\n[[exposed]]\nname = "man"\nposition = ["0 m", "40 m"]\n'
)


def _text(attitude, position='["0 m", "0 m", "1 m"]'):
    text = TEXT.replace('attitude = "upright"', f'attitude = "{attitude}"')
    return text.replace('position = ["0 m", "0 m", "1 m"]', f"position = {position}")


def _to_fragments(folder, *chosen):
    """A run's folder with burst and break-up."""
    case = folder / "case.toml"
    case.write_text(_text(*chosen))
    for stage in ("burst", "break-up"):
        done = invoke(stage, *((case, "--out", folder / "run") if stage == "burst" else (folder / "run",)))
        assert done.exit_code == 0, done.stderr
    return folder / "run"


@pytest.fixture(autouse=True, scope="module")
def large_steps():
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(attitudes, "INCLINATION", STEPS)
        yield


@pytest.fixture(scope="module")
def mixed(tmp_path_factory):
    """A run of mixed attitudes, up to its fragments."""
    return _to_fragments(tmp_path_factory.mktemp("mixed"), "any")


def _job(folder, threads=None, *, few=False, **changes):
    """A job for the flight; `few`: with the realisations that there are."""
    directory = RunDirectory(folder)
    case = load_case(directory.case_file)
    if few:
        case = case.model_copy(update={"hazard": case.hazard.model_copy(update={"max_realisations": 8})})
    options = RunOptions(folder, threads=threads, lean=True)
    return Job(case, directory, directory, Team(), ProgressReporter(enabled=False), options, **changes)


def _fragments(folder):
    from flight import Fragments
    from flight.files.ensemble import read_fragment_ensemble

    return [Fragments.read(folder / "fragments.h5"), *read_fragment_ensemble(folder / "ensemble_fragments.h5")]


@pytest.fixture(scope="module")
def envelope(mixed):
    return fly_all(_job(mixed, threads=2), _fragments(mixed))


@pytest.mark.parametrize("inclination", [0.0, 90.0])
def test_one_attitude_of_the_envelope_is_the_run_in_that_attitude(mixed, tmp_path, inclination, monkeypatch):
    """The case with that attitude, its base where the turned one's is: with the same fragments, and with its own."""
    # The envelope is flown from realisations, for its exposed site; so is the run, which would be an integral.
    monkeypatch.setattr("fragfield.pipeline.integral.why_not_integrated", lambda *_, **__: "as the envelope")
    monkeypatch.setattr("fragfield.pipeline.weighted.why_not_weighted", lambda _: "as the envelope")
    job, fragments = _job(mixed, few=True), _fragments(mixed)
    turned = Arrangement(_job(mixed).case).turned(inclination)  # of it the places alone count
    ours = fly_all(replace(job, attitude=turned), fragments).hazard.expected
    place = json.dumps([f"{value!r} m" for value in turned.case.round[0].position])
    folder = _to_fragments(tmp_path, f"{inclination:g} deg", place)
    same, own = (
        fly_all(_job(folder, few=True), given).hazard.expected
        for given in ([turned.fragments(one) for one in fragments], _fragments(folder))
    )
    assert ours.basis == same.basis == ("all_azimuths" if inclination == 0.0 else "worst_direction")
    assert ours.mirrors == same.mirrors == own.mirrors
    for name in ("distance", "upper", "standard_error", "direction"):
        assert getattr(ours, name) == getattr(same, name), name
    assert own.distance > 30.0
    assert ours.realisations == same.realisations == own.realisations == 8
    assert abs(ours.distance - own.distance) < 2.0 * np.hypot(ours.standard_error, own.standard_error)


def test_the_worst_attitude_is_reported_with_the_curve(envelope):
    rows = {(row.inclination_deg, row.roll_deg): row for row in envelope.curve}
    assert {(60.0 * step, 0.0) for step in range(4)} < set(rows)
    assert list(rows) == sorted(rows)
    worst = max(rows.values(), key=lambda row: row.upper)
    expected = envelope.hazard.expected
    assert envelope.attitude.inclination == worst.inclination_deg
    assert expected.upper == worst.upper
    assert expected.distance == worst.expected
    for beside in (worst.inclination_deg - 20.0, worst.inclination_deg + 20.0):
        assert (beside, 0.0) in rows or not 0.0 <= beside <= 180.0
    assert envelope.flights == sum(row.realisations for row in rows.values())
    assert all(row.realisations >= 8 for row in rows.values())
    # Its distance holds in every direction.
    assert set(expected.by_direction) == {expected.distance}
    assert set(expected.upper_by_direction) == {expected.upper}


def test_an_exposed_site_meets_its_worst_attitude(mixed, envelope):
    """No less than the mean of one attitude at any azimuth; the attitude is one of those flown."""
    (man,) = envelope.exposed
    rows = {(row.inclination_deg, row.roll_deg) for row in envelope.curve}
    assert (man.worst_inclination_deg, man.worst_roll_deg) in rows
    leaning = replace(_job(mixed, few=True), attitude=Arrangement(_job(mixed).case).turned(60.0))
    (there,) = fly_all(leaning, _fragments(mixed)).exposed
    for name in ("density_normal", "density_ground"):
        assert value_at(man, f"{name}.expected") <= value_at(man, f"{name}.upper")
    assert max(value_at(man, f"{name}.upper") for name in ("density_normal", "density_ground")) >= max(
        value_at(there, f"{name}.expected") for name in ("density_normal", "density_ground")
    )


@pytest.mark.mpi
def test_the_envelope_does_not_depend_on_ranks_and_threads(on_ranks, mixed, envelope, tmp_path):
    script = tmp_path / "fly.py"
    script.write_text(
        "import sys, json, fragfield\n"
        "from fragfield.results.part import to_json, value_at\n"
        "from fragfield.pipeline import attitudes\n"
        f"attitudes.INCLINATION = {STEPS}\n"
        f"run = fragfield.run({str(mixed)!r}, only='fly', progress=False, out={str(tmp_path / 'out')!r})\n"
        "from mpi4py import MPI\n"
        "if MPI.COMM_WORLD.rank == 0:\n"
        "    sys.stdout.write(json.dumps(to_json(run.summary.hazard)))\n"
    )
    hazard = json.loads(on_ranks(2, script))
    assert hazard["attitude"]["curve"] == to_json(envelope.curve)
    assert hazard["upper"] == envelope.hazard.expected.upper


def test_fragments_of_a_file_are_not_turned(mixed, tmp_path):
    case = tmp_path / "case.toml"
    case.write_text(_text("any"))
    done = invoke("fly", case, "--fragments", mixed / "fragments.h5", "--out", tmp_path / "out")
    assert done.exit_code == 2
    assert 'round[1].attitude: found "any" with the fragments of fragments.h5; allowed: an arena table' in done.stderr


def test_summary_and_report_state_the_attitude(mixed, tmp_path, monkeypatch):
    leave_out_figures(monkeypatch)
    run = fragfield.run(mixed, only="fly", progress=False, out=tmp_path / "out")
    part = run.summary.hazard.attitude
    assert part.kind == "any"
    assert part.worst_inclination_deg in [row.inclination_deg for row in part.curve]
    done = invoke("report", tmp_path / "out")
    assert done.exit_code == 0, done.stderr
    page = (tmp_path / "out" / "report.html").read_text()
    first = page.index("mixed attitudes, the distance is that of the worst: inclined by")
    assert first < page.index("Limits of validity")
    assert run.figure("attitude_curve").axes
    assert "in every direction: worst attitude" in page
