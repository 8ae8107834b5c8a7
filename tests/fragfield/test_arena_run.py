"""An arena test's table flown as a run."""

from __future__ import annotations

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from flight.arena import COLUMNS, ArenaTable
from fragfield.case import CaseTable
from fragfield.case.load import case_from_document
from fragfield.pipeline.arena import arena_realisation
from tests.flight.test_arena import burst
from tests.fragfield.short_run import invoke

CASE = """title = "Arena"
[document]
number = "Z-1"
revision = "{revision}"
[hazard]
max_realisations = 30
tolerance = 0.001
[[exposed]]
name = "gate"
position = ["{x} m", "0 m"]
"""


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    folder = tmp_path_factory.mktemp("arena")
    ArenaTable.of([burst(seed) for seed in range(20)]).write(folder / "test.csv")
    for name, revision, x in (("a", "A", 40), ("b", "B", 60)):
        (folder / f"{name}.toml").write_text(CASE.format(revision=revision, x=x), encoding="utf-8")
        done = invoke(
            "fly", folder / f"{name}.toml", "--fragments", folder / "test.csv", "--out", folder / name, "--json"
        )
        assert done.exit_code == 0, done.stderr
    return folder


def test_realisations_are_added_and_all_azimuths_count_alike(runs):
    hazard = json.loads((runs / "a" / "summary.json").read_text())["hazard"]
    assert hazard["realisations"] == 30
    assert hazard["more_realisations"]
    assert hazard["basis"] == "all_azimuths"
    assert hazard["upper"] > hazard["expected"] > 20.0


def test_the_table_of_a_run_is_that_of_the_test(runs):
    ours, theirs = ArenaTable.read(runs / "a" / "arena.csv"), ArenaTable.read(runs / "test.csv")
    assert (ours.number == theirs.number).all()
    assert (ours.speed == theirs.speed).all()


def test_the_table_flown_again_from_the_run_gives_the_same_distance(runs, tmp_path):
    done = invoke("fly", runs / "a.toml", "--fragments", runs / "a" / "arena.csv", "--out", tmp_path / "c", "--json")
    assert done.exit_code == 0, done.stderr
    again = json.loads(done.stdout)["hazard"]
    first = json.loads((runs / "a" / "summary.json").read_text())["hazard"]
    for key in ("recommended", "expected", "upper", "standard_error"):
        assert again[key] == first[key]


def test_places_use_all_azimuths_where_they_are_alike(runs, tmp_path):
    case = "[hazard]\nmax_realisations = 30\ntolerance = 0.001\n"
    for k in range(24):
        x, y = 40.0 * math.cos(0.2618 * k), 40.0 * math.sin(0.2618 * k)
        case += f'[[exposed]]\nname = "{k}"\nposition = ["{x:.3f} m", "{y:.3f} m"]\n'
    case += '[[exposed]]\nname = "own"\nposition = ["40 m", "0 m"]\nenergy = "79.001 J"\n'
    (tmp_path / "ring.toml").write_text(case, encoding="utf-8")
    done = invoke("fly", tmp_path / "ring.toml", "--fragments", runs / "test.csv", "--out", tmp_path / "ring", "--json")
    assert done.exit_code == 0, done.stderr
    *places, alone = json.loads(done.stdout)["exposed"]
    for kind in ("normal", "ground"):
        around = places[0][f"density_{kind}"]
        for place in places[1:]:  # the same distance all around
            assert place[f"density_{kind}"]["expected"] == pytest.approx(around["expected"], rel=1e-3)
        own = alone[f"density_{kind}"]["expected"]  # counted in the ring of places that the site touches
        assert 0.9 < own / places[0][f"density_{kind}"]["expected"] < 1.5


def test_the_report_has_the_zones(runs):
    done = invoke("report", runs / "a")
    assert done.exit_code == 0, done.stderr
    html = (runs / "a" / "report.html").read_text(encoding="utf-8")
    assert 'id="figure-polar_zones"' in html


def test_without_a_round_one_stands_upright_a_metre_over_the_origin():
    table = ArenaTable.of([burst(seed) for seed in range(2)])
    flown = arena_realisation(table, CaseTable.model_validate({"flight": {"origin": ["3 m", "4 m"]}}), 0)
    np.testing.assert_array_equal(flown.position, np.broadcast_to([3.0, 4.0, 1.0], flown.position.shape))


def test_fragments_start_at_the_middle_of_the_charge():
    """Upright and lying M107 (0.7 m long) on the ground: well above its base, and at its radius."""
    table = ArenaTable.of([burst(seed) for seed in range(2)])
    for attitude, low, high in (("upright", 0.2, 0.4), ("lying", 0.07, 0.08)):
        one = {"name": "a", "profile": "m107", "explosive": "tnt", "casing": "steel_m107", "attitude": attitude,
               "base": "ground"}  # fmt: skip
        case = case_from_document(
            {"title": "t", "burst": {"cell_size": "12 mm"}, "round": [one]}, source="case", folder=None
        )
        start = arena_realisation(table, case, 0).position
        assert low < start[0, 2] < high, attitude
        assert (start == start[0]).all()


def test_the_width_of_groups_is_a_part_of_the_number_and_wide_zones_are_refused(runs, tmp_path):
    table = ArenaTable.read(runs / "test.csv")
    parts = json.loads((runs / "a" / "summary.json").read_text())["hazard"]["parts"]
    coarse = replace(table, mass_from=0.0 * table.mass, mass_to=np.full(len(table.mass), np.inf)).merged()
    coarse.write(tmp_path / "coarse.csv")
    done = invoke("fly", runs / "a.toml", "--fragments", tmp_path / "coarse.csv", "--out", tmp_path / "c", "--json")
    assert done.exit_code == 0, done.stderr
    hazard = json.loads(done.stdout)["hazard"]
    assert hazard["parts"]["table"] > 2.0 * parts["table"] > 0.0
    assert hazard["recommended"] > hazard["expected"] + hazard["parts"]["table"]
    one = table.merged().merged().merged().merged()
    one.write(tmp_path / "one.csv")
    done = invoke("fly", runs / "a.toml", "--fragments", tmp_path / "one.csv", "--out", tmp_path / "d")
    assert done.exit_code == 2
    assert "allowed: zones of at most 30 degrees" in " ".join(done.stderr.split())


def test_planes_of_symmetry_are_refused(runs, tmp_path):
    text = CASE.format(revision="A", x=40) + '[[plane]]\nname = "p"\nkind = "symmetry"\nnormal = [1, 0, 0]\n'
    text += 'point = ["0 m", "0 m", "0 m"]\n'
    (tmp_path / "p.toml").write_text(text, encoding="utf-8")
    done = invoke("fly", tmp_path / "p.toml", "--fragments", runs / "test.csv", "--out", tmp_path / "p")
    assert done.exit_code == 2
    assert "give every round its own table [[round]] with its position" in done.stderr


@pytest.mark.filterwarnings("ignore:fragments. the lightest")
def test_pieces_that_land_beyond_the_first_guess_of_the_reach(tmp_path):
    """Pieces of 20 kg land up to 2.2 km away, the densities begin with cells to 2 km."""
    header = ";".join(COLUMNS)
    lines = (header, "0;60;0;0;0;0;0;0", "60;90;18;22;60;20;900;900", "90;180;0;0;0;0;0;0")
    (tmp_path / "far.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    (tmp_path / "far.toml").write_text("seed = 1\n[hazard]\nmax_realisations = 8\n[break_up]\nrealisations = 8\n")
    done = invoke(
        "fly", tmp_path / "far.toml", "--fragments", tmp_path / "far.csv", "--out", tmp_path / "run", "--json"
    )
    assert done.exit_code == 0, done.stderr
    hazard = json.loads(done.stdout)["hazard"]
    assert hazard["largest_throw"] > 2000.0
    assert hazard["determined"]
    assert 10.0 < hazard["expected"] < hazard["upper"] < 100.0


ROUND = """title = "Arena with a round"
[[round]]
name = "tube"
profile = "tube"
explosive = "tnt"
casing = "steel_paper"
position = ["0 m", "0 m", "1 m"]
[break_up]
realisations = 8
[hazard]
max_realisations = 8
"""
CASING = 21.916  # kg


def _table_of(folder, fraction):
    """An arena table that holds a fraction of the casing of the ready tube."""
    table = ArenaTable.of([burst(seed) for seed in range(4)])
    path = folder / f"arena_{fraction}.csv"
    table.scaled(fraction * CASING / table.total_mass).write(path)
    return path


def _checked(folder, fraction, *options, text=ROUND):
    (folder / "case.toml").write_text(text, encoding="utf-8")
    return invoke("check", folder / "case.toml", "--fragments", _table_of(folder, fraction), *options)


@pytest.mark.parametrize(
    ("fraction", "code", "warned"),
    [(0.12, 2, True), (0.49, 2, True), (0.51, 0, True), (0.89, 0, True), (0.91, 0, False), (1.09, 0, False),
     (1.11, 2, True)],
)  # fmt: skip
def test_a_table_of_another_mass_than_the_casing_is_warned_of_and_refused(fraction, code, warned, tmp_path):
    done = _checked(tmp_path, fraction, "--json")
    assert done.exit_code == code, done.stderr
    held = f"{100 * fraction:.3g} % of the 21.92 kg of the casing"
    if code:
        assert f"arena_{fraction}.csv: the arena table holds" in done.stderr
        assert held in done.stderr
        assert 'allowed with flight.arena_mass = "checked": 50 to 110 %' in done.stderr
        return
    found = json.loads(done.stdout)
    recovered = found["fragments"]["recovered"]
    assert recovered["fraction"] == pytest.approx(fraction, rel=1e-3)
    assert recovered["casing_mass"] == pytest.approx(CASING, rel=1e-3)
    assert bool(found["warnings"]) == warned
    assert all(held in line for line in found["warnings"])


def test_numbers_are_scaled_to_the_casing_or_flown_as_given(tmp_path):
    scaled = json.loads(_checked(tmp_path, 0.12, "--set", "flight.arena_mass=scaled", "--json").stdout)["fragments"]
    assert scaled["mass"] == pytest.approx(CASING, rel=1e-3)
    assert scaled["recovered"]["factor"] == pytest.approx(1.0 / 0.12, rel=1e-3)
    assert scaled["recovered"]["mass"] == pytest.approx(0.12 * CASING, rel=1e-3)
    given = json.loads(_checked(tmp_path, 0.12, "--set", "flight.arena_mass=as_given", "--json").stdout)
    assert given["fragments"]["mass"] == pytest.approx(0.12 * CASING, rel=1e-3)
    assert "are not flown, so that densities and distances are too small" in given["warnings"][0]
    assert scaled["number"] == pytest.approx(given["fragments"]["number"] / 0.12, rel=1e-3)


def test_what_cannot_be_compared_or_scaled(tmp_path):
    plain = "seed = 1\n"
    done = _checked(tmp_path, 0.12, text=plain)
    assert done.exit_code == 0, done.stderr
    assert "without a table [[round]] the mass of the casing is not known" in done.stdout
    done = _checked(tmp_path, 0.12, "--set", "flight.arena_mass=scaled", text=plain)
    assert done.exit_code == 2
    assert 'flight.arena_mass: found "scaled" without a table [[round]]' in done.stderr
    other = ROUND.replace("[break_up]", ROUND.partition("\n")[2].partition("[break_up]")[0] + "[break_up]")
    other = other.replace('name = "tube"', 'name = "b"', 1).replace('casing = "steel_paper"', 'casing = "copper"', 1)
    other = other.replace('["0 m", "0 m", "1 m"]', '["1 m", "0 m", "1 m"]', 1)
    done = _checked(tmp_path, 0.95, text=other)
    assert done.exit_code == 2
    assert "holds the fragments of one kind of round, and those of the case differ" in done.stderr
    done = _checked(tmp_path, 0.95, "--set", "flight.arena_mass=scale")
    assert 'found "scale" (did you mean "scaled"?); allowed: "checked", "scaled" or "as_given"' in done.stderr


def test_a_run_states_what_was_recovered_and_refuses_before_it_begins(tmp_path, without_figures):
    (tmp_path / "case.toml").write_text(ROUND, encoding="utf-8")
    run = ("fly", tmp_path / "case.toml", "--fragments", _table_of(tmp_path, 0.12), "--out", tmp_path / "run")
    done = invoke(*run)
    assert done.exit_code == 2
    assert not (tmp_path / "run").exists()
    text = ROUND.replace("[break_up]", '[flight]\narena_mass = "scaled"\n[break_up]')
    (tmp_path / "case.toml").write_text(text, encoding="utf-8")
    done = invoke(*run)
    assert done.exit_code == 0, done.stderr
    assert "12 % of the 21.92 kg of the casing; its numbers are flown times 8.333" in done.stdout
    summary = json.loads((tmp_path / "run" / "summary.json").read_text())
    assert summary["flight"]["recovered"]["factor"] == pytest.approx(1.0 / 0.12, rel=1e-3)
    assert [one["code"] for one in summary["findings"] if one["code"] == "arena_mass"] == ["arena_mass"]
    flown = ArenaTable.read(tmp_path / "run" / "arena.csv")
    assert flown.total_mass == pytest.approx(CASING, rel=1e-3)
    done = invoke("report", tmp_path / "run")
    assert done.exit_code == 0, done.stderr
    page = " ".join((tmp_path / "run" / "report.html").read_text(encoding="utf-8").split())
    assert "12 % of the 21.92 kg of the casing; its numbers are flown times 8.333" in page


def test_an_arena_run_keeps_the_rules_that_need_no_mass(runs):
    found = json.loads((runs / "a" / "summary.json").read_text())
    assert found["rules"]["contents"] is None
    assert (found["hazard"]["recommended"] or 0.0) < 381.0
    siting = found["distance_to_apply"]["siting"]
    assert siting["distance"] == 381.0
    assert {one["reason"] for one in siting["left_out"]} == {"the masses of the rounds are not known here"}
    assert found["distance_to_apply"]["line"].startswith(
        "Distance to apply: at least 381 m (storage and handling, incomplete), at least "
    )


def test_an_arena_run_takes_the_masses_of_the_rounds_of_its_case(tmp_path):
    (tmp_path / "case.toml").write_text(ROUND, encoding="utf-8")
    done = invoke(
        "fly", tmp_path / "case.toml", "--fragments", _table_of(tmp_path, 1.0), "--out", tmp_path / "run", "--json"
    )
    assert done.exit_code == 0, done.stderr
    found = json.loads(done.stdout)
    contents = found["rules"]["contents"]
    assert contents["all_up"] > CASING > contents["explosive"] > 0.0
    assert found["distance_to_apply"]["siting"]["distance"] == 381.0
    assert found["distance_to_apply"]["disposal"]["distance"] == pytest.approx(
        634.0 * contents["all_up"] ** (1.0 / 6.0)
    )
    assert "incomplete" not in found["distance_to_apply"]["line"]
