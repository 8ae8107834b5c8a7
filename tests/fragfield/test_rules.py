"""Rules beside ours, against worked examples and printed values of their sources, and on both sides of each range."""

from __future__ import annotations

import math
from dataclasses import replace
from itertools import pairwise

import pytest

from fragfield.case.tables.surroundings import OfficialTable
from fragfield.hazard.contents import (
    COMPARISON,
    DISPOSAL,
    contents_of,
    quantity_words,
    tnt_equivalent,
    tnt_equivalents,
)
from fragfield.hazard.rules import (
    FOOT,
    POUND,
    hazardous_fragment_distance,
    incident_pressure,
    pressure_distance,
    rules_for,
)
from fragfield.results.rules import Contents, Rule
from tests.fragfield.example_results import example
from tests.fragfield.short_run import ROOT

DANGER_AREAS = ("Explosion danger area, public access possible", "Explosion danger area, public access denied")
ROW = "Explosion danger area, items in a row"


def found_rule(contents: Contents, name: str, official: OfficialTable | None = None) -> Rule:
    return next(rule for rule in rules_for(contents, official) if rule.name.startswith(name))


def distance(contents: Contents, name: str) -> float | None:
    return found_rule(contents, name).distance


def of(mass: float, all_up: float | None = None) -> Contents:
    whole = mass if all_up is None else all_up
    return Contents(
        explosive=mass, tnt=mass, all_up=whole, largest_round=whole, rounds=1, clearance=None, charge_diameter=0.1
    )


def in_a_row(clearance: float, **changes: object) -> Contents:
    row = replace(of(14.4, 86.0), largest_round=43.0, rounds=2, in_a_row=True, clearance=clearance)
    return replace(row, **changes)


@pytest.mark.parametrize(("mass", "kilopascals"), [(1000.0, 43.0), (10_000.0, 202.0), (100_000.0, 1150.0)])
def test_blast_agrees_with_the_worked_examples_of_iatg_01_80(mass, kilopascals):
    # IATG 01.80 (2021), Table 5: incident pressure at 50 m, printed to two or three digits
    assert incident_pressure(50.0 / mass ** (1.0 / 3.0)) == pytest.approx(1e3 * kilopascals, rel=0.012)


def test_blast_agrees_with_the_published_program():
    # kingery-bulmash (PyPI), README: 10,000 kg at 500 m
    assert incident_pressure(500.0 / 10_000.0 ** (1.0 / 3.0)) == pytest.approx(5.0549639655028455e3, rel=1e-9)


def test_pressure_falls_with_distance_and_inverts():
    scaled = [0.2 * 1.01**n for n in range(690)]
    pressures = [incident_pressure(z) for z in scaled]
    assert all(b < a * 1.003 for a, b in pairwise(pressures))  # joints of the ranges: 0.3 %
    assert pressure_distance(1000.0, 43e3) == pytest.approx(50.0, rel=0.01)
    for scaled, inside in ((0.1999, False), (0.2001, True), (198.4, True), (198.6, False)):
        assert math.isfinite(incident_pressure(scaled)) == inside
    # the fits do not quite meet: a jump is where the table puts it, and nowhere else
    for joint, jump in ((2.75, False), (2.9, True), (3.05, False), (22.6, False), (23.8, True), (25.0, False)):
        before, behind = (incident_pressure(joint * (1.0 + side * 1e-9)) for side in (-1.0, 1.0))
        assert (abs(behind / before - 1.0) > 1e-6) == jump, joint


def test_k40_is_the_pressure_its_source_gives():
    # Swisdak: 40 W^(1/3) corresponds to 1.18 psi
    reach = distance(of(100.0), "Inhabited building")
    assert reach == pytest.approx(40.0 * (100.0 / POUND) ** (1.0 / 3.0) * FOOT)
    assert incident_pressure(reach / 100.0 ** (1.0 / 3.0)) == pytest.approx(1.18 * 6894.76, rel=0.02)


def test_danger_areas_agree_with_the_calculator_of_un_saferguard():
    # printed for 1,200 kg and 20,000 t, rounded up by a metre: 2,068 and 1,448 m; 10,446 and 7,316 m
    found = of(1200.0)
    assert distance(found, "Explosion danger area, public access possible") == pytest.approx(2068.0, abs=1.6)
    assert distance(found, "Explosion danger area, public access denied") == pytest.approx(1448.0, abs=1.6)
    assert distance(of(2e7), "Explosion danger area, public access possible") == pytest.approx(10_446.0, abs=1.6)


@pytest.mark.parametrize(("pounds", "feet"), [(0.5, 236.0), (97.5, 654.0), (102.5, 667.1), (450.0, 1242.6)])
def test_fragment_distance_meets_the_printed_ends(pounds, feet):
    # 236 ft at 0.5 lb and below; the form changes at 100 lb
    assert hazardous_fragment_distance(pounds * POUND) == pytest.approx(feet * FOOT, abs=0.15)


def test_fragment_distance_by_quantity_ends_at_450_pounds():
    inside, outside = (found_rule(of(pounds * POUND), "Hazardous fragment distance") for pounds in (450.0, 450.01))
    assert inside.distance == pytest.approx(1242.6 * FOOT, abs=0.15)
    assert not inside.reason
    assert outside.distance is None
    assert outside.reason == "net explosive quantity 204.1 kg, above 204.1 kg (450 lb)"
    assert outside.outside == pytest.approx(1242.6 * FOOT, abs=0.15)
    assert outside.missing


@pytest.mark.parametrize(("rounds", "known"), [(1, True), (2, True), (3, False)])
@pytest.mark.parametrize("name", ["Hazardous fragment distance by net", "Fragment distance of a cased item"])
def test_rules_for_unknown_items_end_where_the_official_distance_covers_the_rounds(rounds, known, name):
    official = OfficialTable(hazardous_fragment_distance="112 m", rounds=2, source="S")
    found = found_rule(replace(of(7.2), rounds=rounds), name, official)
    assert (found.distance is None) == known
    assert ("own distance is published" in found.reason) == known
    # a maximum distance alone is none to hazardous fragments
    farthest = OfficialTable(maximum_fragment_distance="700 m", rounds=9, source="S")
    assert found_rule(replace(of(7.2), rounds=rounds), name, farthest).distance is not None


@pytest.mark.parametrize("name", [*DANGER_AREAS, ROW])
def test_danger_areas_end_at_protective_works(name):
    open_ground = in_a_row(0.2)
    assert found_rule(open_ground, name).distance is not None
    behind = found_rule(replace(open_ground, protective_works=("bank",)), name)
    assert behind.distance is None
    assert behind.outside == found_rule(open_ground, name).distance
    assert behind.missing
    assert behind.reason == "protective works enclose the rounds: bank"


@pytest.mark.parametrize(
    ("contents", "reason"),
    [
        (in_a_row(0.1001), ""),
        (in_a_row(0.1), "clear distance 100 mm, not more than one charge diameter, 100 mm"),
        (in_a_row(0.0), "clear distance 0 mm"),
        (in_a_row(0.1001, rounds=1), "a single round"),
        (in_a_row(0.1001, in_a_row=False), "do not stand in a straight row"),
        (in_a_row(0.1001, at_once=False), "not all ignited at the same time"),
        (in_a_row(0.1001, charge_diameter=None), "mesh file"),
    ],
)
def test_the_rule_for_items_in_a_row_holds_for_such_a_row_alone(contents, reason):
    found = found_rule(contents, ROW)
    assert reason in found.reason
    assert (found.distance is None) == bool(reason)
    if not reason:
        assert found.distance == pytest.approx(370.0 * 43.0**0.2)


ROUNDS = """title = "row"
[burst]
cell_size = "14 mm"
"""


def row_of(folder, *places: tuple[str, str], more: str = "", delay: str = "0 us") -> Contents:
    from fragfield.case import load_case

    text = ROUNDS + "".join(
        f'[[round]]\nname = "r{number}"\nprofile = "tube"\nexplosive = "tnt"\ncasing = "steel_paper"\n'
        f'position = ["{x}", "{y}", "1 m"]\n'
        f'ignition = [{{ station = "nose", delay = "{delay if number else "0 us"}" }}]\n'
        for number, (x, y) in enumerate(places)
    )
    (folder / "row.toml").write_text(text + more, encoding="utf-8")
    return contents_of(load_case(folder / "row.toml"))


def test_rows_are_recognised_from_the_case(tmp_path):
    bore, outside = 0.110, 0.155  # of the ready tube (m)
    alone = row_of(tmp_path, ("0 m", "0 m"))
    assert (alone.in_a_row, alone.clearance) == (False, None)
    assert alone.charge_diameter == pytest.approx(bore, rel=1e-6)
    near, far = (row_of(tmp_path, ("0 m", "0 m"), (f"{outside + bore + more} m", "0 m")) for more in (-1e-5, 1e-5))
    for found, holds in ((near, False), (far, True)):
        assert found.in_a_row
        assert (found_rule(found, ROW).distance is not None) == holds
        assert found.clearance == pytest.approx(bore, abs=2e-5)
    three = [("0 m", "0 m"), ("0.3 m", "0.3 m"), ("0.6 m", "0.6 m")]
    assert row_of(tmp_path, *three).in_a_row
    for aside, holds in (("0.99 mm", True), ("1.01 mm", False)):
        assert row_of(tmp_path, ("0 m", "0 m"), ("0.3 m", aside), ("0.6 m", "0 m")).in_a_row == holds
    for delay, holds in (("0.99 ns", True), ("1.01 ns", False)):
        assert row_of(tmp_path, *three, delay=delay).at_once == holds
    # the image behind a plane of symmetry makes a row of two, and of two rounds side by side a square
    mirror = '[[plane]]\nname = "m"\nkind = "symmetry"\npoint = ["0 m", "0 m", "0 m"]\nnormal = [1, 0, 0]\n'
    imaged = row_of(tmp_path, ("0.2 m", "0 m"), more=mirror)
    assert (imaged.rounds, imaged.in_a_row) == (2, True)
    assert imaged.clearance == pytest.approx(0.4 - outside, abs=1e-6)
    assert not row_of(tmp_path, ("0.2 m", "0 m"), ("0.2 m", "0.4 m"), more=mirror).in_a_row


WALL = '[[plane]]\nname = "{0}"\nkind = "wall"\npoint = ["{1} m", "{2} m", "0 m"]\nnormal = [{3}, {4}, {5}]\n'
WALLS = {
    "west": WALL.format("west", -2, 0, 1, 0, 0), "east": WALL.format("east", 2, 0, -1, 0, 0),
    "south": WALL.format("south", 0, -2, 0, 1, 0), "deck": WALL.format("deck", 0, 0, 0, 0, 1),
}  # fmt: skip
FAR = '[[obstacle]]\nname = "far"\nkind = "wall"\nstart = ["300 m", "0 m"]\nend = ["300 m", "1 m"]\nheight = "1 m"\n'
FAR += 'thickness = "0.2 m"\n'


def ring(away: float, height: float) -> str:
    """Four banks about the rounds, their crests `away` from the centre."""
    ends = {"n": (-1, 1, 1, 1), "s": (-1, -1, 1, -1), "w": (-1, -1, -1, 1), "e": (1, -1, 1, 1)}
    return "".join(
        f'[[obstacle]]\nname = "{name}"\nkind = "barricade"\nheight = "{height} m"\nslope = 0.5\n'
        f'start = ["{away * x1} m", "{away * y1} m"]\nend = ["{away * x2} m", "{away * y2} m"]\n'
        for name, (x1, y1, x2, y2) in ends.items()
    )


BANKS = ring(9, 10)


def works(*names: str) -> str:
    return f"[hazard]\nprotective_works = [{', '.join(f'{chr(34)}{name}{chr(34)}' for name in names)}]\n"


def test_no_wall_deck_or_building_counts_as_protective_works_unless_the_case_says_so(tmp_path):
    for more in ("".join(WALLS.values()), FAR, BANKS):
        assert row_of(tmp_path, ("0 m", "0 m"), more=more).protective_works == ()


def test_more_rounds_on_a_deck_never_need_less_than_fewer_in_a_row():
    from fragfield.case import load_case

    eight, four = (
        [rule for rule in rules_for(contents_of(load_case(ROOT / "cases" / f"{name}.toml"))) if rule.use == DISPOSAL]
        for name in ("m107_pallet_2x4", "m107_row4")
    )
    ends = [max(rule.distance for rule in rules if rule.distance is not None) for rules in (eight, four)]
    assert ends == pytest.approx([634.0 * (8 * 42.8) ** (1 / 6), 634.0 * (4 * 42.8) ** (1 / 6)], rel=2e-3)


@pytest.mark.parametrize(("names", "more"), [(("west", "east", "south"), "walls"), (("n", "s", "w"), "banks"),
                                             (("n", "s", "w", "e"), "banks")])  # fmt: skip
def test_works_that_enclose_the_rounds_count_when_the_case_names_them(tmp_path, names, more):
    text = works(*names) + ("".join(WALLS.values()) if more == "walls" else BANKS)
    assert row_of(tmp_path, ("0 m", "0 m"), more=text).protective_works == names


@pytest.mark.parametrize(
    ("away", "height", "counts"), [(9, 10, True), (9, 4, False), (300, 10, False), (300, 300, True)]
)
def test_a_complete_ring_of_works_counts_where_it_rises_over_the_rounds(tmp_path, away, height, counts):
    from fragfield.errors import InputError

    text = works("n", "s", "w", "e") + ring(away, height)
    if counts:
        assert row_of(tmp_path, ("0 m", "0 m"), more=text).protective_works
    else:
        with pytest.raises(InputError, match="which close 0 of 360 degrees around the rounds up to 30 degrees"):
            row_of(tmp_path, ("0 m", "0 m"), more=text)


def test_without_masses_rules_that_need_none_apply_and_the_others_are_missing():
    rules = list(rules_for(None))
    assert [rule.distance for rule in rules if rule.distance is not None] == [1250.0 * FOOT]
    for rule in rules:
        assert rule.distance is not None or rule.reason == "the masses of the rounds are not known here"
        assert rule.missing == (rule.distance is None and rule.use != COMPARISON)


def test_k40_ends_at_100_000_pounds_of_tnt():
    inside, outside = (found_rule(of(pounds * POUND), "Inhabited building") for pounds in (1e5, 1.0001e5))
    assert inside.distance == pytest.approx(40.0 * 1e5 ** (1.0 / 3.0) * FOOT)
    assert outside.distance is None
    assert "100,000 lb" in outside.reason


def test_blast_distances_are_those_of_the_equivalent_in_tnt():
    plain, strong = of(10.0), replace(of(10.0), tnt=14.2)
    for name in ("Inhabited building", "Peak incident overpressure 5 kPa", "Peak incident overpressure 21 kPa"):
        ratio = found_rule(strong, name).distance / found_rule(plain, name).distance
        assert ratio == pytest.approx(1.42 ** (1.0 / 3.0), rel=1e-6), name
    for rule in rules_for(strong):
        if rule.hazard == "blast":
            assert "net explosive quantity 10 kg, TNT equivalent for peak pressure 14.2 kg" in rule.inputs


def test_pressure_distances_end_with_the_fit():
    low, high = incident_pressure(198.5), incident_pressure(0.2)
    assert pressure_distance(1.0, low * 1.0001) == pytest.approx(198.5, rel=1e-3)
    assert pressure_distance(1.0, low * 0.9999) is None
    assert pressure_distance(1.0, high * 0.9999) == pytest.approx(0.2, rel=1e-3)
    assert pressure_distance(1.0, high * 1.0001) is None


def test_a_rule_has_either_a_distance_or_a_reason():
    with pytest.raises(ValueError, match="either a distance or a reason"):
        example(Rule, distance=None)
    with pytest.raises(ValueError, match="either a distance or a reason"):
        example(Rule, distance=1.0, reason="why")


def test_waste_distances_are_those_of_40_cfr_265_382():
    name = "Open detonation"
    assert [distance(of(lb * POUND), name) for lb in (50, 100, 101, 1000, 1001, 10_000, 10_001, 30_000, 30_001)] == [
        204.0, 204.0, 380.0, 380.0, 530.0, 530.0, 690.0, 690.0, None,
    ]  # fmt: skip


def test_contents_count_images_and_equivalents():
    from fragfield.case import load_case

    case = load_case(ROOT / "cases" / "m107_pair_mirrored.toml")
    single = load_case(ROOT / "cases" / "m107_tnt.toml")
    pair, one = contents_of(case), contents_of(single)
    assert (pair.rounds, one.rounds) == (2, 1)
    assert pair.explosive == pytest.approx(2.0 * 7.2, rel=0.01)
    assert pair.tnt == pytest.approx(1.11 * pair.explosive)
    assert pair.all_up == pytest.approx(2.0 * pair.largest_round)
    assert one.tnt == pytest.approx(one.explosive)
    assert one.all_up == pytest.approx(42.4, abs=0.1)  # with 7.2 kg of TNT and the fuze


@pytest.mark.parametrize("name", ["comp_b", "Composition B", "COMP-B", "Comp. B", "composition_b"])
def test_an_explosive_has_its_equivalent_however_its_name_is_written(name):
    assert tnt_equivalent(name)[0] == 1.11
    assert name in tnt_equivalent(name)[1]


def test_an_unknown_explosive_is_taken_as_the_strongest_known_with_a_word():
    factor, words = tnt_equivalent("Tetrytol 70/30")
    known = [tnt_equivalent(name)[0] for name in ("TNT", "tritonal", "Composition C-4", "H-6", "PETN", "RDX")]
    assert factor == 1.42
    assert factor > max(known)
    assert "Tetrytol 70/30, whose equivalent is not known" in words
    assert tnt_equivalent("tnt") == (1.0, "")


def test_every_equivalent_names_its_source_which_the_words_repeat():
    for name, (factor, source) in tnt_equivalents().items():
        assert 0.8 < factor <= 1.42
        assert "IATG 01.80" in source or "ConWep" in source
        if factor != 1.0:
            assert source in tnt_equivalent(name)[1]
    words = quantity_words(7.2, 7.99, (tnt_equivalent("comp_b")[1],))
    assert words.startswith("net explosive quantity 7.2 kg, TNT equivalent for peak pressure 7.99 kg; 1.11 for comp_b")


def test_explosives_without_an_equivalent_are_few_and_taken_as_the_strongest():
    from burst_fenicsx.materials.library import explosive_names

    lacking = [name for name in explosive_names() if "not known" in tnt_equivalent(name)[1]]
    assert lacking == ["amatol", "explosive_d", "hns", "lx_14", "nitromethane", "pbx_9407"]
    assert {tnt_equivalent(name)[0] for name in lacking} == {1.42}


def test_blast_distances_do_not_depend_on_how_the_name_is_written(tmp_path):
    from fragfield.case import load_case

    text = (ROOT / "cases" / "m107_comp_b.toml").read_text(encoding="utf-8")
    (tmp_path / "built_in.toml").write_text(text, encoding="utf-8")
    library = (ROOT / "fragfield_base" / "substances" / "explosives" / "comp_b.toml").read_text(encoding="utf-8")
    (tmp_path / "own.toml").write_text(library, encoding="utf-8")  # whose name is "Composition B"
    own = text.replace('explosive = "comp_b"', 'explosive = "own.toml"')
    assert own != text
    (tmp_path / "own_name.toml").write_text(own, encoding="utf-8")
    built_in, named = (contents_of(load_case(tmp_path / f"{name}.toml")) for name in ("built_in", "own_name"))
    assert named.tnt == built_in.tnt == pytest.approx(1.11 * built_in.explosive)
