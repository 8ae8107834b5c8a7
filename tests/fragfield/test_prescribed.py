"""Official distances, rules in range and the distance not to go below."""

from __future__ import annotations

import json

import pytest

import fragfield
from fragfield.case import load_case
from fragfield.hazard.contents import COMPARISON, DISPOSAL, SITING, contents_of
from fragfield.hazard.rules import rules_for
from fragfield.hazard.to_apply import distance_to_apply, official_part
from fragfield.results.hazard import Hazard
from fragfield.results.part import to_json
from fragfield.results.rules import DistanceToApply, Official, Rule
from tests.fragfield.example_results import example
from tests.fragfield.plain_reports import Report, leave_out_figures
from tests.fragfield.short_run import RINGS, ROOT, invoke

OFFICIAL = '\n[official]\nhazardous_fragment_distance = "{hazardous}"\nsource = "Authority, table 1, p. 7"\n'


def hazard(distance: float = 100.0, **changes: object) -> Hazard:
    found = {"determined": True, "recommended": distance, "largest_throw": 500.0}
    return example(Hazard, **{**found, "ricochet": "none", **changes})


AIRBORNE = example(Hazard, determined=False, reason="airborne", recommended=None)


def official(hazardous: float | None = None, maximum: float | None = None, **changes: object) -> Official:
    table = {"hazardous_fragment_distance": hazardous, "maximum_fragment_distance": maximum, "source": "S"}
    return example(Official, **{**table, "rounds": 1, "rounds_here": 1, "covers": True, **changes})


def rule(name: str, distance: float | None, use: str = SITING, against: str = "fragments", **left_out: object) -> Rule:
    known = {"outside": None, "missing": False, "reason": "" if distance else "out of range", **left_out}
    return example(Rule, name=name, distance=distance, use=use, hazard=against, **known)


@pytest.mark.parametrize(
    ("theirs", "words"),
    [
        (99.0, "The recommended distance, 100 m, is larger than the official hazardous fragment distance, 99 m"),
        (99.5, "The official hazardous fragment distance, 100 m, equals the recommended distance, 100 m."),
        (101.0, "The official hazardous fragment distance, 101 m, is larger than the recommended distance, 100 m"),
    ],
)
def test_the_larger_of_official_and_computed_governs_and_is_said(theirs, words):
    found = distance_to_apply(hazard(), official(theirs), ())
    assert words in found.official[0]
    for use in (found.siting, found.disposal):
        assert use.distance == max(theirs, 100.0)
        assert use.by.startswith("the official" if theirs > 100.0 else "the recommended")
    if theirs != 99.5:
        assert f": the {'official' if theirs > 100.0 else 'recommended'} one governs" in found.official[0]


@pytest.mark.parametrize(("theirs", "words"), [(499.0, "is larger than the official"), (500.0, "is not less than")])
def test_the_largest_throw_stands_against_the_official_maximum(theirs, words):
    found = distance_to_apply(hazard(), official(None, theirs), ())
    assert words in found.official[0]
    assert found.siting.distance == 100.0
    assert (found.disposal.distance, found.disposal.by) == (theirs, "the official maximum fragment distance")


def test_rules_count_for_their_own_use_alone_and_only_in_range():
    rules = [
        rule("siting", 381.0), rule("out", None, outside=300.0), rule("disposal", 1200.0, DISPOSAL),
        rule("other", 9e3, COMPARISON), rule("K", 32.0, against="blast"),
    ]  # fmt: skip
    found = distance_to_apply(hazard(), None, rules)
    assert (found.siting.distance, found.siting.by) == (381.0, "the rule “siting” (fragments)")
    assert found.disposal.distance == 1200.0
    assert found.line == "Distance to apply: 381 m (storage and handling), 1,200 m (disposal in the open)"
    assert found.computed == 100.0
    assert found.words == (
        "Storage and handling: 381 m, by the rule “siting” (fragments).",
        "Disposal in the open: 1,200 m, by the rule “disposal” (fragments).",
        "No official distance of the round is in the case (table [official]).",
    )


def test_a_missing_rule_is_named_with_its_distance_and_makes_the_line_incomplete():
    rules = [
        rule("waste", 204.0, DISPOSAL),
        rule("danger area", None, DISPOSAL, outside=1184.2, reason="works enclose the rounds", missing=True),
        rule("narrower", None, DISPOSAL, outside=830.0, reason="works enclose the rounds", missing=True),
        rule("smaller", None, DISPOSAL, outside=200.0, reason="works enclose the rounds", missing=True),
        rule("siting", 381.0), rule("by mass", None, reason="no masses", missing=True),
        rule("replaced", None, outside=400.0, reason="another takes its place"),
        rule("beside the point", None, outside=380.0, reason="a single round"),
    ]  # fmt: skip
    found = distance_to_apply(hazard(), None, rules)
    assert found.line == (
        "Distance to apply: at least 381 m (storage and handling, incomplete), "
        "at least 204 m (disposal in the open, incomplete)"
    )
    assert found.words[2:-1] == (
        (
            "Incomplete for storage and handling: left out “by mass”, because no masses. The authority must say what "
            "holds instead."
        ),
        (
            "Incomplete for disposal in the open: left out “danger area” (1,185 m by its formula), “narrower” (830 m "
            "by its formula), because works enclose the rounds. Apply 1,185 m unless the authority agrees to less."
        ),
        (
            "Not applied for storage and handling: left out “replaced” (400 m by its formula), because another takes "
            "its place."
        ),
    )
    assert DistanceToApply.read(json.loads(json.dumps(to_json(found)))) == found


def test_a_distance_that_is_not_determined_leaves_the_prescribed_one_incomplete():
    found = distance_to_apply(AIRBORNE, official(80.0, 400.0), [rule("r", 60.0)])
    assert (found.siting.distance, found.computed) == (80.0, None)
    assert found.line.startswith("Distance to apply: at least 80 m (storage and handling, incomplete), at least 400 m")
    assert found.words[2] == (
        "Incomplete for storage and handling and disposal in the open: left out “recommended distance of this "
        "computation”, because it is not determined: airborne. The authority must say what holds instead."
    )
    assert "the recommended distance is not determined and may be larger" in found.official[0]
    assert "the throw exceeded in 5 % of events is not determined" in found.official[1]
    nothing = distance_to_apply(AIRBORNE, None, ())
    assert nothing.siting.distance is None
    assert nothing.line == "Distance to apply: not known (storage and handling), not known (disposal in the open)"


def test_the_distance_without_ricochet_stands_beside():
    short = {"expected": 85.0, "upper": 88.0, "standard_error": 1.0, "recommended": 90.0}
    found = distance_to_apply(hazard(ricochet="soft_soil", without_ricochet=short), official(95.0), ())
    assert "The recommended distance, 100 m (without ricochet 90 m), is larger than" in found.official[0]


@pytest.mark.parametrize(("published", "covers"), [(1, False), (2, True), (3, True)])
def test_official_distances_hold_for_as_many_rounds_as_they_are_published_for(tmp_path, published, covers):
    text = (ROOT / "cases" / "m107_pair_mirrored.toml").read_text(encoding="utf-8")
    path = tmp_path / "pair.toml"
    path.write_text(text + OFFICIAL.format(hazardous="112 m") + f"rounds = {published}\n", encoding="utf-8")
    part = official_part(load_case(path))
    assert (part.rounds_here, part.covers) == (2, covers)  # the image behind the plane counts
    words = distance_to_apply(hazard(), part, ()).official
    assert any("published for one round; 2 stand here, which they do not cover" in one for one in words) == (not covers)


def test_equal_official_distances_are_accepted(tmp_path):
    path = tmp_path / "case.toml"
    text = RINGS + OFFICIAL.format(hazardous="112 m") + 'maximum_fragment_distance = "112 m"\n'
    path.write_text(text, encoding="utf-8")
    assert load_case(path).official.maximum_fragment_distance == 112.0


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
        assert (part.alike, part.covers) == (covers, covers)
        words = distance_to_apply(hazard(), part, ()).official
        assert any("rounds of different kinds stand here" in one for one in words) == (not covers)
        unknown = next(one for one in rules_for(contents_of(case), case.official) if "not known" in one.name)
        assert (unknown.distance is None) == covers


def test_check_shows_official_distances_quantity_and_rules(tmp_path):
    path = tmp_path / "case.toml"
    path.write_text(RINGS + OFFICIAL.format(hazardous="112 m"), encoding="utf-8")
    done = invoke("check", path)
    assert done.exit_code == 0, done.stderr
    assert "official, hazardous fragments: 112 m, Authority, table 1, p. 7" in done.stdout
    assert "net explosive quantity" in done.stdout
    assert "Distance to apply: 112 m (storage and handling), " in done.stdout
    assert "of a cased item whose own is not known” (381 m by its formula), because the round's own" in done.stdout
    found = fragfield.check(path).found
    assert found.official.covers is True
    path.write_text(RINGS, encoding="utf-8")
    assert "Distance to apply: 381 m (storage and handling), " in invoke("check", path).stdout
    assert fragfield.check(path).found.official is None


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("official")
    gate = '[[exposed]]\nname = "gate"\nposition = ["50 m", "0 m"]\n'
    (folder / "case.toml").write_text(RINGS + OFFICIAL.format(hazardous="9 km") + gate, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        leave_out_figures(patch)
        done = invoke("run", folder / "case.toml", "--out", folder / "run")
    assert done.exit_code in (0, 3), done.stderr
    return folder / "run", done.stdout


def test_every_view_of_a_run_shows_the_distance_to_apply(run):
    folder, stdout = run
    assert "official, hazardous fragments" in stdout
    line = "Distance to apply: 9,000 m (storage and handling), 9,000 m (disposal in the open)"
    assert line in stdout.splitlines()
    assert stdout.index(line) < stdout.index("recommended distance ")
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    assert summary["official"]["hazardous_fragment_distance"] == 9000.0
    assert summary["distance_to_apply"]["line"] == line
    opened = fragfield.open(folder)
    assert to_json(opened.summary.official) == summary["official"]
    found = opened.hazard.to_apply
    assert to_json(found) == summary["distance_to_apply"]
    assert found.computed == summary["hazard"]["recommended"]
    assert (found.siting.distance, found.siting.by) == (9000.0, "the official hazardous fragment distance")
    assert str(opened.hazard).startswith(f"{line}\nrecommended distance ")
    table = Report((folder / "report.html").read_text(encoding="utf-8")).tables["Prescribed distances"]
    lines = {entry[0]: entry[1:] for entry in table}
    assert lines["Official hazardous fragment distance"] == ("9,000", "Authority, table 1, p. 7")
    page, site = ((folder / name).read_text(encoding="utf-8") for name in ("report.html", "map.html"))
    assert line.removeprefix("Distance to apply: ") in page
    assert line in site
    assert "net explosive quantity" in page.casefold()


def test_rules_of_a_run_have_a_distance_or_a_reason(run):
    rules = json.loads((run[0] / "summary.json").read_text(encoding="utf-8"))["rules"]["rules"]
    assert len(rules) > 8
    for one in rules:
        assert (one["distance"] is None) == bool(one["reason"]), one
    row = next(one for one in rules if one["name"].endswith("items in a row"))
    assert row["reason"] == "a single round"
