"""Ensembles of one burst on the ring, and the study as a whole, on bursts made by hand."""

from __future__ import annotations

import json
from contextlib import redirect_stdout
from dataclasses import replace
from io import StringIO
from pathlib import Path

import h5py
import numpy as np
import pytest

import flight
from fragfield.case import load_case, to_toml
from tests.transition.synthetic import Tube
from transition import BreakUpSettings, Snapshot, break_up
from validation.__main__ import main
from validation.ensembles import ring_ensemble
from validation.paper_3_2.ratios import number_ratio, sector

CASE = Path(__file__).resolve().parents[2] / "cases" / "m107_comp_b.toml"
APART = 0.3  # m, of a tube's axis from the plane between two
LARGE = BreakUpSettings(mean_mass=0.05)  # some hundred fragments
AIR = {"air": 1.069}


def outwards(places):
    """1000 m/s outwards from the z axis, the ends moving apart."""
    radius = np.linalg.norm(places[:, :2], axis=1)
    return np.column_stack([1000.0 * places[:, :2] / radius[:, None], 200.0 * (places[:, 2] / 0.3 - 0.5)])


def towards_the_sides(places):
    """1000 m/s outwards from the axis x = APART, and the more along y the nearer to the plane x = 0."""
    away = places[:, :2] - [APART, 0.0]
    outwards = away / np.maximum(np.linalg.norm(away, axis=1), 1e-12)[:, None]
    inner = np.clip(-outwards[:, 0], 0.0, None)
    along = np.stack([outwards[:, 0] + 1.2 * inner, outwards[:, 1] * (1.0 + inner)], axis=1)
    return np.column_stack([1000.0 * along, 200.0 * (places[:, 2] / 0.3 - 0.5)])


def both_sides(places):
    mirrored = places * [-1.0, 1.0, 1.0]
    left = towards_the_sides(mirrored) * [-1.0, 1.0, 1.0]
    return np.where(places[:, :1] > 0.0, towards_the_sides(places), left)


def write_run(folder, places, velocity, planes=False, raised=1.0, **burst):
    """A run directory as the study reads it: tubes of one unstretched mesh, moving by `velocity`."""
    folder.mkdir()
    tube = Tube(around=32, axial=16, stretch=1.0, places=places, velocity=velocity)
    path = tube.write(folder / "burst_snapshot.h5")
    with h5py.File(path, "a") as file:
        file["nodes/position"][:, 2] += raised
        if planes:
            file.create_group("planes/0").attrs.update(name="x = 0", point=(0.0, 0.0, 0.0), normal=(1.0, 0.0, 0.0))
    (folder / "case.toml").write_text(to_toml(load_case(CASE)), encoding="utf-8")
    values = {
        "energy_error_at_outputs": 0.004,
        "contact_error_at_end": 0.001,
        "lost_cells": 0,
        "cell_size": 0.01,
        "products": "landau_cj",
        "end_time": 1.5e-4,
    }
    values |= burst
    (folder / "summary.json").write_text(json.dumps({"burst": values, "versions": {}}), encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs")

    return {
        "single": write_run(folder / "single", ((0.0, 0.0, 0.0),), outwards),
        "pair": write_run(folder / "pair", ((APART, 0.0, 0.0), (-APART, 0.0, 0.0)), both_sides),
        "mirrored": write_run(folder / "mirrored", ((APART, 0.0, 0.0),), towards_the_sides, planes=True),
    }


def test_every_realisation_is_flown_as_by_itself(runs):
    path = runs["pair"] / "burst_snapshot.h5"
    found = ring_ensemble(path, LARGE, AIR, seed=4, realisations=5, threads=1)
    ring = flight.Cylinder(7.62, name="ring")
    for number in (0, 3, 4):
        fragments = break_up(path, LARGE, seed=4, realisation=number).fragments
        alone = flight.fly(fragments, **AIR, ground=None, witnesses=[ring], domain=flight.Domain(7.7, floor=-1e3))
        hits = alone.hits_on("ring")
        assert found.fragments[number] == len(fragments)
        numbers = np.bincount(hits["azimuth"].astype(int), minlength=360)
        assert np.array_equal(found.every_height.hits[number], numbers)
        single = found.hits[found.hits["realisation"] == number]
        assert np.sort(single["mass"]) == pytest.approx(np.sort(hits["mass"]), rel=1e-12)
        inside = (hits["position"][:, 2] >= 0.1) & (hits["position"][:, 2] <= 2.5)
        assert found.band.hits[number].sum() == inside.sum()
        assert found.every_height.largest_initial_speed[number].max() == hits["initial_speed"].max()
        assert found.every_height.initial_speed[number].sum() == pytest.approx(hits["initial_speed"].sum(), rel=1e-12)
        assert found.missed["every_height"][number] == len(fragments) - len(hits)


LEVEL = replace(LARGE, direction_scatter=0.0)


def test_the_ring_catches_what_falls_below_the_ground_and_the_band_does_not(tmp_path):
    run = write_run(tmp_path / "low", ((0.0, 0.0, 0.0),), lambda places: outwards(places) - [0.0, 0.0, 400.0])
    vacuum = {"air": "vacuum"}  # air stops the lightest before the ring
    found = ring_ensemble(run / "burst_snapshot.h5", LEVEL, vacuum, seed=1, realisations=3)
    assert found.missed["every_height"].sum() == 0
    assert (found.every_height.hits.sum(axis=1) == found.fragments).all()
    assert found.band.hits.sum() == 0
    assert np.array_equal(found.missed["band"], found.fragments)
    high = ring_ensemble(run / "burst_snapshot.h5", LEVEL, vacuum, seed=1, realisations=3, band=(-20.0, 2.5))
    assert np.array_equal(high.band.hits, high.every_height.hits)


def test_the_band_needs_no_ground(runs):
    """What the ground would stop has no way back up to the band."""
    path = runs["pair"] / "burst_snapshot.h5"
    found = ring_ensemble(path, LARGE, AIR, seed=2, realisations=2)
    band = flight.Cylinder(7.62, bottom=0.1, top=2.5, name="band")
    for number in range(2):
        fragments = break_up(path, LARGE, seed=2, realisation=number).fragments
        hits = flight.fly(fragments, **AIR, ground=0.0, witnesses=[band]).hits_on("band")
        assert np.array_equal(found.band.hits[number], np.bincount(hits["azimuth"].astype(int), minlength=360))


def test_batches_do_not_change_an_ensemble(runs, monkeypatch):
    path = runs["single"] / "burst_snapshot.h5"
    whole = ring_ensemble(path, LARGE, AIR, seed=3, realisations=6, threads=2)
    monkeypatch.setattr("validation.ensembles.BATCH", 1)
    each = ring_ensemble(path, LARGE, AIR, seed=3, realisations=6, threads=1)
    for surface in ("every_height", "band"):
        for name in ("hits", "initial_speed", "largest_speed"):
            assert np.array_equal(getattr(getattr(whole, surface), name), getattr(getattr(each, surface), name))


def test_a_mirrored_ensemble_is_symmetric(runs):
    snapshot = Snapshot.read(runs["mirrored"] / "burst_snapshot.h5")
    single = ring_ensemble(runs["single"] / "burst_snapshot.h5", LARGE, AIR, seed=2, realisations=60).every_height
    found = ring_ensemble(snapshot, LARGE, AIR, seed=1, realisations=60).every_height
    for centre in (20.0, 45.0, 135.0):
        right = number_ratio(found, single, sector(found, 10.0, (centre,)))
        left = number_ratio(found, single, sector(found, 10.0, ((180.0 - centre) % 360.0,)))
        difference = right.minus(left)
        assert abs(difference.value) < 4.0 * difference.error


def study(runs, *options, realisations=2):
    given = [f"--{name}={folder}" for name, folder in runs.items()]
    return main(["paper_3_2", *given, "--realisations", str(realisations), "--json", *options])


@pytest.fixture(scope="module")
def compared(runs, tmp_path_factory):
    """Exit code, rows by quantity, tables for the README and folder of a study of the three runs."""
    folder, tables, printed = tmp_path_factory.mktemp("compared"), {}, StringIO()
    with pytest.MonkeyPatch.context() as patch, redirect_stdout(printed):
        patch.setattr("validation.paper_3_2.study.insert_tables", tables.update)
        patch.setattr("validation.keeping.insert_tables", lambda *_: None)
        patch.setattr("validation.paper_3_2.study.PICTURES", folder / "pictures")
        code = study(runs, "--readme", "--out", str(folder / "made"), realisations=40)
    rows = {row["quantity"].split(" (")[0]: row for row in json.loads(printed.getvalue())}
    return code, rows, tables, folder


def test_the_study_compares_given_runs(compared):
    code, rows, _, folder = compared
    assert code == (1 if any(row["passed"] is False for row in rows.values()) else 0)
    number = rows["ring: number ratio within 20 deg of 90 and 270"]
    assert number["ours"] > 3.0  # everything thrown inwards goes there
    assert number["ours"] > rows["ring: number ratio within 35 deg of 90 and 270"]["ours"]
    assert rows["ring: integral of the number ratio less 1"]["passed"] is True
    assert rows["band of 2.4 m: integral of the number ratio less 1"]["passed"] is True
    same = [row for name, row in rows.items() if name.startswith("one round with a plane of symmetry")]
    assert len(same) == 6
    assert all(row["passed"] for row in same)
    assert (folder / "made" / "paper_3_2_ring.png").is_file()
    assert "ring" in (folder / "made" / "paper_3_2.txt").read_text(encoding="utf-8")


def test_an_open_ledger_makes_the_comparison_void(runs, capsys, tmp_path):
    open_run = write_run(tmp_path / "open", ((APART, 0.0, 0.0),), towards_the_sides, energy_error_at_outputs=0.011)
    assert study({"single": runs["single"], "pair": open_run}) == 1
    rows = json.loads(capsys.readouterr().out)
    assert [row["quantity"] for row in rows if row["passed"] is False] == ["pair: energy error at the outputs"]
    assert not any("ratio" in row["quantity"] for row in rows)


def test_a_pair_of_one_round_is_refused(runs, capsys):
    assert study({"single": runs["single"], "pair": runs["single"]}) == 2
    assert "a burst of 1 rounds, mirrored ones included; 2 are needed" in capsys.readouterr().err


def test_a_comparison_needs_both_runs(runs, capsys):
    assert study({"pair": runs["pair"]}) == 2
    assert "--single is missing; a comparison needs --single and --pair" in capsys.readouterr().err


def test_one_realisation_has_no_standard_error(capsys):
    with pytest.raises(SystemExit):
        main(["paper_3_2", "--realisations", "1"])
    assert "a standard error needs 2 or more" in capsys.readouterr().err
