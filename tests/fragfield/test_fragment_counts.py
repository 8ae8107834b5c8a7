"""Files of counted fragments as `break_up.mean_mass` names them: forms, units, messages, runs and reports."""

from __future__ import annotations

import json
import math
import shutil
from pathlib import Path

import numpy as np
import pytest

from flight.arena import ArenaTable
from fragfield.case import load_case, load_changed_case
from fragfield.case.conversion.mean_mass import read_counts
from fragfield.case.load import case_from_document, read_resolved
from fragfield.case.problem import break_up_settings
from fragfield.case.write import to_toml
from fragfield.checking.check import check_report
from fragfield.errors import InputError
from fragfield.studies.uncertainty.inputs import default_inputs
from fragfield.studies.uncertainty.plan import plan_samples
from fragfield_base.errors import InputError as AnyInputError
from fragfield_base.units import read_measure
from tests.fragfield.short_run import SHORT, invoke
from transition.law.count_fit import SegmentMasses, fit_counts
from transition.law.mott import MottLaw

M107 = Path(__file__).parents[2] / "cases" / "m107_tnt.toml"
CASING = 34.53  # kg, of the M107


def pieces(mean, mass, above=5e-4, seed=1):
    """Masses (kg) of one round of Mott's law, those above the lightest that is counted."""
    generator = np.random.default_rng(seed)
    drawn = MottLaw.from_mean(mean).inverse(1.0 - generator.random(round(mass / mean)))
    return np.sort(drawn[drawn > above])


def write_groups(path, masses, unit="g", rounds=None, weighed=True, edges=None):
    """A file of groups of mass, the last of them open."""
    edges = np.geomspace(5e-4, 0.256, 10) if edges is None else edges
    ends, size = np.append(edges, np.inf), read_measure(f"1 {unit}").value
    group = np.digitize(masses, edges) - 1
    lines = [f"mass_from_{unit},mass_to_{unit},number" + (f",mass_{unit}" if weighed else "")]
    lines[:0] = [f"# rounds = {rounds}"] if rounds else []
    for one in range(len(edges)):
        row = [ends[one] / size, ends[one + 1] / size, (group == one).sum()]
        lines.append(",".join(f"{value:.12g}" for value in [*row, *([masses[group == one].sum() / size] * weighed)]))
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.fixture
def case_with_pit(tmp_path):
    """A copy of a ready case beside a file of counts."""
    write_groups(tmp_path / "pit.csv", pieces(0.014, CASING))
    return Path(shutil.copy(M107, tmp_path / "case.toml"))


@pytest.mark.parametrize("unit", ["kg", "mg", "lb", "oz", "grain"])
def test_every_unit_gives_the_same_counts(tmp_path, unit):
    masses = pieces(0.014, CASING)
    grams = read_counts(write_groups(tmp_path / "g.csv", masses))
    other = read_counts(write_groups(tmp_path / "other.csv", masses, unit))
    assert other.number == grams.number
    assert other.edges == pytest.approx(grams.edges, rel=1e-9)
    assert other.mass == pytest.approx(grams.mass, rel=1e-9)
    assert other.edges[0] == pytest.approx(5e-4)  # kg


def test_numbers_above_masses_are_the_same_groups(tmp_path):
    masses = pieces(0.014, CASING)
    groups = read_counts(write_groups(tmp_path / "groups.csv", masses, weighed=False))
    above = tmp_path / "above.csv"
    rows = [f"{edge * 1e3:.12g};{(masses > edge).sum()}" for edge in groups.edges]
    above.write_text("# heaviest first\nmass_above_g;number\n" + "\n".join(reversed(rows)) + "\n")
    found = read_counts(above)
    assert found.number == groups.number
    assert found.edges == pytest.approx(groups.edges, rel=1e-9)


def test_single_pieces_are_counted_above_the_lightest(tmp_path):
    masses = pieces(0.014, CASING)
    path = tmp_path / "list.csv"
    path.write_text("mass_g\n" + "\n".join(f"{1e3 * mass:.9g}" for mass in masses[::-1]) + "\n")
    counts = read_counts(path)
    assert counts.edges[0] == pytest.approx(masses[0])
    assert counts.pieces == len(masses) - 1
    assert sum(counts.mass) == pytest.approx(masses.sum() - masses[0], rel=1e-9)
    assert np.diff(np.log2(counts.edges)) == pytest.approx(1 / 8)
    one_law = fit_counts(counts)
    exact = fit_counts(read_counts(write_groups(tmp_path / "fine.csv", masses, edges=np.geomspace(5e-4, 0.256, 400))))
    assert abs(math.log(one_law.scale / exact.scale)) < 0.1 * exact.curvature_error
    twice = tmp_path / "twice.csv"
    twice.write_text("mass_g,number\n" + "\n".join(f"{1e3 * mass:.9g},2" for mass in masses) + "\n")
    assert read_counts(twice).pieces == 2 * len(masses) - 1


def test_an_arena_table_is_added_up_over_its_zones(tmp_path):
    source = M107.parents[1] / "examples" / "arena_test.csv"
    table, counts = ArenaTable.read(source), read_counts(source)
    assert counts.pieces == pytest.approx(table.number.sum())
    assert sum(counts.mass) == pytest.approx((table.number * table.mass).sum())
    assert counts.ends[-1] == math.inf
    assert counts.number[-1] == 0.0
    path = tmp_path / "four.csv"
    path.write_text("# rounds = 4\n" + source.read_text())
    four = read_counts(path)
    assert (four.pieces, four.rounds) == (pytest.approx(4.0 * counts.pieces), 4.0)
    casing = SegmentMasses((0.01,), (CASING,))
    one, more = fit_counts(counts, segments=casing), fit_counts(four, segments=casing)
    assert more.recovered == pytest.approx(one.recovered)
    assert more.curvature_error == pytest.approx(0.5 * one.curvature_error, rel=1e-3)


ARENA = "zone_from_deg,zone_to_deg,mass_from_kg,mass_to_kg,number,mean_mass_kg,mean_speed_m_s\n"


def test_groups_that_an_arena_table_leaves_out_hold_nothing(tmp_path):
    path = tmp_path / "arena.csv"
    path.write_text(ARENA + "0,90,0.001,0.002,30,0.0015,900\n90,180,0.004,0.008,10,0.005,900\n")
    counts = read_counts(path)
    assert counts.edges == (0.001, 0.002, 0.004, 0.008)
    assert counts.number == (30.0, 0.0, 10.0, 0.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("mass_g,count\n1,2\n", "unknown column 'count'; needed: mass_from_g"),
        ("mass_st,number\n1,2\n", "unknown column 'mass_st'"),
        ("mass_g,mass_kg,number\n1,2,3\n", "mass_kg stands in two columns, in two units; allowed: one of them"),
        ("mass_from_g,number\n1,2\n", "found columns mass_from_g, number; needed: mass_from_g, mass_to_g, number or "),
        ("number\n1\n", "found columns number; needed:"),
        (
            "mass_from_g,mass_to_g,number\n1,2,30\n3,4,20\n",
            "leave a gap; a group without pieces needs a row with number 0",
        ),
        ("mass_from_g,mass_to_g,number\n1,3,30\n2,4,20\n", "end at 0.003 kg and begin at 0.002 kg overlap"),
        (
            "mass_above_g,number\n1,20\n2,30\n",
            "20 pieces above 0.001 kg and 30 above 0.002 kg; numbers above a mass fall",
        ),
        ("mass_g\n1\n0\n", "pieces need masses above zero"),
        ("mass_g,number\n1,0\n", "no piece in it"),
        ("mass_above_g,number\n1,8\n2,3\n", "8 pieces; at least 20 are needed"),
        ("# rounds = none\nmass_above_g,number\n1,80\n2,30\n", "needed: a number above zero, as # rounds = 4"),
        ("# rounds = 0\nmass_above_g,number\n1,80\n2,30\n", "needed: a number above zero, as # rounds = 4"),
        ("mass_above_g,number\n1,many\n", "line 2, column number: 'many' is not a number"),
        ("mass_from_g,mass_to_g,number,mass_g\n1,2,30,90\n2,4,20,50\n", "30 pieces of 0.001 to 0.002 kg weigh 0.09 kg"),
        (ARENA + "0,90,0.001,0.004,30,0.0015,900\n90,180,0.002,0.008,10,0.005,900\n", "the same groups in every zone"),
        (ARENA + "0,180,0,0,30,0.0015,900\n", "row 1 is 0.0015 kg, outside its own group of mass; allowed: 0 to 0 kg"),
        (ARENA + "0,180,0.0015,0.0015,30,0.0015,900\n", "a row has fragments and no group of mass"),
        (
            ARENA + "0,180,0.001,0.002,30,0.5,900\n0,180,0.002,0.004,9,0.003,9\n",
            "row 1 is 0.5 kg, outside its own group of mass; allowed: 0.001 to 0.002 kg",
        ),
        ("", "no table in it"),
    ],
)
def test_files_at_fault_are_refused_with_their_name(tmp_path, text, message):
    path = tmp_path / "pit.csv"
    path.write_text(text)
    with pytest.raises(AnyInputError) as caught:
        read_counts(path)
    assert message in str(caught.value)
    assert str(path) in str(caught.value)


def test_a_file_beside_the_case_is_read_into_the_resolved_case(case_with_pit, tmp_path, monkeypatch):
    monkeypatch.chdir("/")
    case = load_changed_case(case_with_pit, {"break_up.mean_mass": "pit.csv"})
    direct = read_counts(case_with_pit.parent / "pit.csv")
    assert case.break_up.mean_mass == "pit.csv"
    assert case.break_up.counts.made() == direct
    (tmp_path / "pit.csv").unlink()  # the resolved case stands alone
    stored = tmp_path / "run" / "case.toml"
    stored.parent.mkdir()
    stored.write_text(to_toml(case))
    assert read_resolved(stored) == case
    assert load_case(stored) == case
    assert break_up_settings(read_resolved(stored)).mean_mass == direct
    with pytest.raises(InputError, match=r"break_up.mean_mass: .*other.csv: no such file"):
        load_changed_case(stored, {"break_up.mean_mass": "other.csv"})  # another file is not the one that was read
    with pytest.raises(InputError, match=r'break_up.counts: found without a file .* only with mean_mass = "pit.csv"'):
        load_changed_case(stored, {"break_up.mean_mass": "14.9 g"})


def test_check_refuses_a_file_that_is_missing_or_of_another_round(case_with_pit):
    folder = case_with_pit.parent
    write_groups(folder / "heavy.csv", pieces(0.014, 2.0 * CASING))
    write_groups(folder / "light.csv", pieces(0.014, 0.3 * CASING))
    for name, message in (
        ("none.csv", "none.csv: no such file"),
        ("heavy.csv", "of the mass of its round (34.53 kg each); allowed: at most 110%"),
        ("light.csv", "allowed: at least 50% of that"),
    ):
        done = invoke("check", case_with_pit, "--set", f"break_up.mean_mass={name}")
        assert done.exit_code == 2
        assert "break_up.mean_mass" in done.stderr
        assert message in done.stderr
    write_groups(folder / "two.csv", pieces(0.014, 2.0 * CASING), rounds=2)
    write_groups(folder / "part.csv", pieces(0.014, 0.3 * CASING), rounds=0.3)
    for name in ("two.csv", "part.csv"):
        case = load_changed_case(case_with_pit, {"break_up.mean_mass": name})
        assert not any("published mean masses" in line for line in check_report(case).warnings)


def test_rounds_that_differ_have_no_common_table(tmp_path):
    case = tmp_path / "case.toml"
    write_groups(tmp_path / "pit.csv", pieces(0.014, CASING))
    text = M107.read_text()
    start = text.index("[[round]]")
    end = text.index("\n[", start + 9)
    second = text[start:end].replace('explosive = "tnt"', 'explosive = "comp_b"')
    case.write_text(text[:end] + "\n" + second.replace('"shell"', '"other"') + "\n" + text[end:])
    changes = {"break_up.mean_mass": "pit.csv", "round.other.position": ["1 m", "0 m", "1 m"]}
    with pytest.raises(InputError, match="fragments of one kind of round, and those of the case differ"):
        load_changed_case(case, changes)


def test_uncertainty_takes_the_standard_error(case_with_pit):
    case = load_changed_case(case_with_pit, {"break_up.mean_mass": "pit.csv"})
    (entry,) = (one for one in default_inputs(case) if one.name == "mean fragment mass")
    fit = fit_counts(case.break_up.counts.made())
    assert entry.keys == ["break_up.counts.scale"]
    assert entry.factor == pytest.approx(fit.factor)
    assert entry.factor < 1.12
    assert fit.label in entry.source
    assert not entry.judgement
    given = load_changed_case(case_with_pit, {"break_up.mean_mass": "pit.csv", "break_up.mean_mass_factor": 1.3})
    (entry,) = (one for one in default_inputs(given) if one.name == "mean fragment mass")
    assert (entry.keys, entry.factor) == (["break_up.counts.scale"], 1.3)


def test_samples_of_a_study_vary_the_fitted_mean_mass(case_with_pit):
    case = load_changed_case(case_with_pit, {"break_up.mean_mass": "pit.csv"})
    study = plan_samples(case, samples=40, seed=4)
    scales = []
    for number in range(study.samples):
        sample = case_from_document(study.document(number), source="sample", folder=Path("/nowhere"))
        counts = break_up_settings(sample).mean_mass
        assert counts.number == tuple(case.break_up.counts.number)
        scales.append(counts.scale)
    spread = math.exp(np.std(np.log(scales)))
    assert spread == pytest.approx(fit_counts(case.break_up.counts.made()).factor, rel=0.01)


@pytest.fixture
def short_counted(tmp_path, whole_run):
    """A short case with counts of a round that breaks into 60 g pieces, and its run directory with the burst."""
    casing = json.loads((whole_run[0] / "summary.json").read_text())["burst"]["casing_mass"]
    write_groups(tmp_path / "pit.csv", pieces(0.06, casing, above=5e-3), edges=np.geomspace(5e-3, 0.64, 8))
    case = tmp_path / "case.toml"
    few = SHORT.replace("tolerance = 0.5\nmax_realisations = 8", "max_realisations = 3")
    case.write_text(
        few.replace("realisations = 8", 'mean_mass = "pit.csv"\nvelocity_source = "gurney"\nrealisations = 2')
    )
    folder = Path(shutil.copytree(whole_run[0], tmp_path / "run"))
    return case, folder


@pytest.mark.dolfinx
def test_a_run_breaks_up_by_its_file_and_goes_on_without_it(short_counted, without_figures):
    case, folder = short_counted
    done = invoke("break-up", case, "--out", folder, "--json")
    assert done.exit_code == 0, done.stderr
    part = json.loads(done.stdout)["break_up"]
    assert part["mean_mass"]["law"] == "fitted"
    assert part["mean_mass"]["factor_source"].startswith("fitted to pit.csv, ")
    test = part["mean_mass"]["test"]
    assert test["mean"] == pytest.approx(0.06, rel=3.0 * test["standard_error"])
    assert part["mass"] / part["fragments"] == pytest.approx(test["mean"], rel=0.02)
    (case.parent / "pit.csv").rename(case.parent / "kept.csv")
    done = invoke("fly", folder, "--json")  # makes weighted fragments from the burst
    assert done.exit_code == 0, done.stderr
    assert json.loads(done.stdout)["hazard"]["method"] == "weighted_fragments"
    assert invoke("run", case, "--out", folder, "--resume").exit_code == 2
    (case.parent / "kept.csv").rename(case.parent / "pit.csv")
    done = invoke("run", case, "--out", folder, "--resume", "--json")
    assert done.exit_code == 0, done.stderr
    assert json.loads(done.stdout)["break_up"]["mean_mass"] == part["mean_mass"]


# --- How well the mean fragment mass is known: what the case says of it, `check`, and the report's findings

CASES = Path(__file__).parents[2] / "cases"
CYLINDER = CASES.parent / "validation" / "copper_cylinder" / "case.toml"


def test_the_case_reaches_the_law_of_1947():
    changes = {"break_up.mean_mass": "mott_1947", "break_up.mean_mass_factor": 1.3,
               "break_up.fracture_stress": "700 MPa", "break_up.fracture_gamma": 50.0}  # fmt: skip
    settings = break_up_settings(load_changed_case(CASES / "m107_tnt.toml", changes))
    assert (settings.mean_mass, settings.mean_mass_factor) == ("mott_1947", 1.3)
    assert (settings.fracture_stress, settings.fracture_gamma) == (700e6, 50.0)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"break_up.mean_mass_factor": 0.5}, "break_up.mean_mass_factor: found 0.5"),
        ({"break_up.fracture_stress": "0 MPa"}, "break_up.fracture_stress: found"),
    ],
)
def test_what_contradicts_or_has_no_meaning_is_refused(changes, message):
    with pytest.raises(InputError) as caught:
        load_changed_case(CASES / "m107_tnt.toml", changes)
    assert message in str(caught.value)


def test_check_warns_where_no_data_are_near():
    near = check_report(load_case(CASES / "m107_tnt.toml")).warnings
    assert not any("published mean masses" in line for line in near)
    (warning,) = (line for line in check_report(load_case(CYLINDER)).warnings if "published mean masses" in line)
    assert warning.startswith(
        "round[1] (cylinder): no published mean masses of fragments are close: outer diameter 30.6 mm"
    )
    assert "casing of 8960 kg/m3 (data: steel). No published scatter covers it: measure the mean mass" in warning


def test_check_does_not_warn_where_the_mean_mass_is_given():
    case = load_changed_case(CYLINDER, {"break_up.mean_mass": "3 g"})
    assert not any("published mean masses" in line for line in check_report(case).warnings)
