"""Official distances, rules in range and the distance not to go below."""

from __future__ import annotations

import json

import pytest

import fragfield
from fragfield.case import load_case
from fragfield.hazard.contents import COMPARISON, DISPOSAL, SITING, contents_of
from fragfield.hazard.recommended import minimum_part, official_part
from fragfield.hazard.rules import rules_for
from fragfield.report import read_run
from fragfield.report.tables.rules import minimum_words, prescribed_table
from tests.fragfield.plain_reports import draw_nothing
from tests.fragfield.short_run import RINGS, ROOT, invoke

OFFICIAL = '\n[official]\nhazardous_fragment_distance = "{hazardous}"\nsource = "Authority, table 1, p. 7"\n'


def hazard(distance: float = 100.0, **changes: object) -> dict:
    found = {"determined": True, "recommended": distance, "largest_throw": 500.0}
    return {**found, "ricochet": "none", **changes}


def official(hazardous: float | None = None, maximum: float | None = None, **changes: object) -> dict:
    table = {"hazardous_fragment_distance": hazardous, "maximum_fragment_distance": maximum, "source": "S"}
    return {**table, "rounds": 1, "rounds_here": 1, "covers": True, **changes}


def rule(name: str, distance: float | None, use: str = SITING, against: str = "fragments") -> dict:
    return {"name": name, "distance": distance, "use": use, "hazard": against}


@pytest.mark.parametrize(
    ("theirs", "words"),
    [
        (99.0, "The recommended distance, 100 m, is larger than the official hazardous fragment distance, 99 m"),
        (99.5, "The official hazardous fragment distance, 100 m, equals the recommended distance, 100 m."),
        (101.0, "The official hazardous fragment distance, 101 m, is larger than the recommended distance, 100 m"),
    ],
)
def test_the_larger_of_official_and_computed_governs_and_is_said(theirs, words):
    found = minimum_part(hazard(), official(theirs), ())
    assert words in found["words"][0]
    for use in (SITING, DISPOSAL):
        assert found[use]["distance"] == max(theirs, 100.0)
        assert found[use]["by"].startswith("the official" if theirs > 100.0 else "the recommended")
    if theirs != 99.5:
        assert f": the {'official' if theirs > 100.0 else 'recommended'} one governs" in found["words"][0]


@pytest.mark.parametrize(("theirs", "words"), [(499.0, "larger than the official"), (500.0, "is not exceeded")])
def test_the_largest_throw_stands_against_the_official_maximum(theirs, words):
    found = minimum_part(hazard(), official(None, theirs), ())
    assert words in found["words"][0]
    assert found[SITING]["distance"] == 100.0
    assert found[DISPOSAL] == {"distance": theirs, "by": "the official maximum fragment distance"}


def test_rules_count_for_their_own_use_alone_and_only_in_range():
    rules = [
        rule("siting", 381.0), rule("out", None), rule("disposal", 1200.0, DISPOSAL), rule("other", 9e3, COMPARISON),
        rule("K", 32.0, against="blast"),
    ]  # fmt: skip
    found = minimum_part(hazard(), None, rules)
    assert found[SITING] == {"distance": 381.0, "by": "the rule “siting” (fragments)"}
    assert found[DISPOSAL]["distance"] == 1200.0
    assert found["words"][0] == "No official distance of the round is in the case (table [official])."
    assert "Rules in range against fragments: 381 m (siting), more than the recommended 100 m." in found["words"]
    assert "Rules in range against blast: 32 m (K), less than the recommended 100 m." in found["words"]
    assert "Storage and handling: do not apply less than 381 m, by the rule “siting” (fragments)." in found["words"]


def test_a_distance_that_is_not_determined_leaves_the_prescribed_one_and_says_so():
    found = minimum_part({"determined": False, "reason": "airborne"}, official(80.0, 400.0), [rule("r", 60.0)])
    assert found[SITING] == {"distance": 80.0, "by": "the official hazardous fragment distance"}
    assert "the recommended distance is not determined and may be larger" in found["words"][0]
    assert "the largest throw is not determined" in found["words"][1]
    nothing = minimum_part({"determined": False, "reason": "airborne"}, None, ())
    assert nothing[SITING] == {"distance": None, "by": None}
    assert "No rule was applied: the masses of the rounds are not known here." in nothing["words"]
    assert not any("No rule was applied" in one for one in found["words"])


def test_the_distance_without_ricochet_stands_beside():
    short = {"expected": 85.0, "upper": 88.0, "standard_error": 1.0, "recommended": 90.0}
    found = minimum_part(hazard(ricochet="soft_soil", without_ricochet=short), official(95.0), ())
    assert "The recommended distance, 100 m (without ricochet 90 m), is larger than" in found["words"][0]


@pytest.mark.parametrize(("published", "covers"), [(1, False), (2, True), (3, True)])
def test_official_distances_hold_for_as_many_rounds_as_they_are_published_for(tmp_path, published, covers):
    text = (ROOT / "cases" / "m107_pair_mirrored.toml").read_text(encoding="utf-8")
    path = tmp_path / "pair.toml"
    path.write_text(text + OFFICIAL.format(hazardous="112 m") + f"rounds = {published}\n", encoding="utf-8")
    part = official_part(load_case(path))
    assert (part["rounds_here"], part["covers"]) == (2, covers)  # the image behind the plane counts
    words = minimum_part(hazard(), part, ())["words"]
    assert any("published for one round; 2 stand here, which they do not cover" in one for one in words) == (not covers)


def test_official_distances_do_not_cover_rounds_of_different_kinds(tmp_path):
    tube = (
        '[[round]]\nname = "{0}"\nprofile = "tube"\nexplosive = "{0}"\ncasing = "steel_paper"\n'
        'position = ["{1}", "0 m", "1 m"]\n'
    )
    second = tube.replace('name = "{0}"', 'name = "second"', 1)
    for explosive, covers in (("comp_b", True), ("tnt", False)):
        path = tmp_path / f"{explosive}.toml"
        rounds = tube.format("comp_b", "0 m") + second.format(explosive, "0.3 m")
        table = OFFICIAL.format(hazardous="112 m") + "rounds = 2\n"
        path.write_text(f'[burst]\ncell_size = "14 mm"\n{rounds}{table}', encoding="utf-8")
        case = load_case(path)
        part = official_part(case)
        assert (part["alike"], part["covers"]) == (covers, covers)
        words = minimum_part(hazard(), part, ())["words"]
        assert any("rounds of different kinds stand here" in one for one in words) == (not covers)
        unknown = next(one for one in rules_for(contents_of(case, {}), case.official) if "not known" in one.name)
        assert (unknown.distance is None) == covers


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ('source = "S"', "official.hazardous_fragment_distance: missing, and maximum_fragment_distance too"),
        ('hazardous_fragment_distance = "112 m"', "official.source: missing"),
        ('hazardous_fragment_distance = "112 m"\nsource = ""', "official.source: found ''"),
        ('hazardous_fragment_distance = "112 m"\nsource = "  "', "official.source: found only blanks"),
        ('hazardous_fragment_distance = "0 m"\nsource = "S"', "official.hazardous_fragment_distance: found"),
        ('hazardous_fragment_distance = "112 km"\nsource = "S"', "official.hazardous_fragment_distance: found"),
        (
            'hazardous_fragment_distance = 112\nsource = "S"',
            "official.hazardous_fragment_distance: found the bare number 112 without a unit",
        ),
        ('hazardous_distance = "112 m"\nsource = "S"', "hazardous_fragment_distance"),
        ('hazardous_fragment_distance = "112 m"\nrounds = 0\nsource = "S"', "official.rounds: found 0"),
        (
            'hazardous_fragment_distance = "112 m"\nmaximum_fragment_distance = "111 m"\nsource = "S"',
            "official.maximum_fragment_distance: found 111 m; allowed: at least hazardous_fragment_distance, 112 m",
        ),
    ],
)
def test_faults_of_the_table_are_refused_at_check(tmp_path, table, message):
    path = tmp_path / "case.toml"
    path.write_text(f"{RINGS}\n[official]\n{table}\n", encoding="utf-8")
    done = invoke("check", path)
    assert done.exit_code == 2
    assert message in done.stderr.replace('"', "'").replace("\n", " ")


def test_equal_official_distances_are_accepted(tmp_path):
    path = tmp_path / "case.toml"
    text = RINGS + OFFICIAL.format(hazardous="112 m") + 'maximum_fragment_distance = "112 m"\n'
    path.write_text(text, encoding="utf-8")
    assert load_case(path).official.maximum_fragment_distance == 112.0


def test_check_shows_official_distances_quantity_and_rules(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(RINGS + OFFICIAL.format(hazardous="112 m"), encoding="utf-8")
    done = invoke("check", path)
    assert done.exit_code == 0, done.stderr
    assert "official, hazardous fragments: 112 m, Authority, table 1, p. 7" in done.stdout
    assert "net explosive quantity" in done.stdout
    siting = next(line for line in done.stdout.splitlines() if line.startswith("rules in range, storage"))
    assert "K 40: " in siting
    assert "1250" not in siting
    assert "own is not known" not in siting  # its own distance is given
    found = fragfield.check(path).found
    assert found["official"]["covers"] is True
    path.write_text(RINGS, encoding="utf-8")
    assert "own is not known: 381 m" in invoke("check", path).stdout
    assert fragfield.check(path).found["official"] is None


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("official")
    (folder / "case.toml").write_text(RINGS + OFFICIAL.format(hazardous="9 km"), encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        draw_nothing(patch)
        done = invoke("run", folder / "case.toml", "--out", folder / "run")
    assert done.exit_code in (0, 3), done.stderr
    return folder / "run", done.stdout


def test_a_run_shows_the_official_distance_everywhere(run):
    folder, stdout = run
    assert "official, hazardous fragments" in stdout
    assert (
        "Storage and handling: do not apply less than 9,000 m, by the official hazardous fragment distance." in stdout
    )
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    assert summary["official"]["hazardous_fragment_distance"] == 9000.0
    assert summary["minimum"]["siting"] == {"distance": 9000.0, "by": "the official hazardous fragment distance"}
    opened = fragfield.open(folder)
    assert opened.official == summary["official"]
    assert opened.minimum == summary["minimum"]
    (table,) = prescribed_table(read_run(folder))
    lines = {line[0]: line[1:] for line in table.lines}
    assert lines["Official hazardous fragment distance"] == ("9,000", "Authority, table 1, p. 7")
    words = list(minimum_words(read_run(folder)))
    by = "by the official hazardous fragment distance"
    assert words[0] == f"Storage and handling: do not apply less than 9,000 m, {by}."
    text = (folder / "report.html").read_text(encoding="utf-8")
    assert "do not apply less than 9,000" in text
    assert "net explosive quantity" in text.casefold()


def test_rules_of_a_run_have_a_distance_or_a_reason(run):
    rules = json.loads((run[0] / "summary.json").read_text(encoding="utf-8"))["rules"]["rules"]
    assert len(rules) > 8
    for one in rules:
        assert (one["distance"] is None) == bool(one["reason"]), one
    row = next(one for one in rules if one["name"].endswith("items in a row"))
    assert row["reason"] == "a single round"
