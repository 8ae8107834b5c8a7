"""The report of stacks: contact, rounds one by one, images behind planes of symmetry, and warnings."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from fragfield.case.load import case_from_document
from fragfield.hazard.verdict import exposure_words
from fragfield.report.findings import findings
from fragfield.results.burst import Exposure
from fragfield.results.summary import Summary
from fragfield.terminal.show import print_summary
from tests.fragfield.example_results import complete, example
from tests.fragfield.plain_reports import plain_report
from tests.fragfield.synthetic_run import run_of, write_run

CONTACT = {
    "max_interface_penetration_at_front": 4.2e-4, "max_interface_penetration": 2.4e-5,
    "max_collision_penetration": 3.6e-4, "max_plane_penetration": 0.0,
}  # fmt: skip


def changed(folder, change):
    """Change summary.json of a run by a function."""
    path = folder / "summary.json"
    summary = json.loads(path.read_text(encoding="utf-8"))
    change(summary)
    path.write_text(json.dumps(complete(Summary, summary)), encoding="utf-8")
    return folder


@pytest.fixture(scope="module")
def pallet(tmp_path_factory):
    def change(summary):
        burst = summary["burst"]
        burst["contact"] |= CONTACT
        for index, one in enumerate(burst["rounds"]):
            one["products_balance"] = 0.99 if index else 0.12
            one["mean_initial_speed"] = 1085.0 + 10.0 * index
        for index, one in enumerate(summary["break_up"]["rounds"]):
            one["mirror_of"] = f"round {chr(65 + index - 4)}" if index >= 4 else None

    return changed(write_run(tmp_path_factory.mktemp("stack") / "run", rounds=8), change)


ROUND = {"profile": "tube", "explosive": "tnt", "casing": "steel_paper"}

IGNITION = {
    "a": [{"by": "point", "time": 0.0, "place": [0.0, 0.0, 0.3], "station": 0.0},
          {"by": "delay", "time": 4e-6, "place": [0.0, 0.0, 0.0], "station": 0.3}],
    "b": [{"by": "shock", "time": 43.21e-6, "place": [0.1225, -0.01, 0.2], "station": 0.1}],
    "c": [],
}  # fmt: skip


def _initiated():
    rounds = [{"name": name, "ignition": found} for name, found in IGNITION.items()]
    rounds[2]["products_balance"] = 0.0
    return run_of(summary=example(Summary, burst={"rounds": rounds}))


def test_a_round_that_was_never_initiated_is_warned_of_once_and_one_initiated_by_shock_is_reported():
    reported = [one for one in findings(_initiated()) if "Round “" in one.text]
    assert [(one.weight, one.text.split("”")[0][-1]) for one in reported] == [("warning", "c"), ("note", "b")]
    assert "was never initiated" in reported[0].text
    assert "initiated by shock, at 43.2 µs" in reported[1].text


def test_every_round_has_its_line_with_the_products_balance(pallet):
    head, *lines = plain_report(pallet).tables["Rounds at the end of the burst"]
    assert len(lines) == 8
    assert all(len(line) == len(head) for line in lines)
    assert head[-1] == "Products (%)"
    assert [line[-1] for line in lines] == ["12", *["99"] * 7]
    assert [line[4] for line in lines[:3]] == ["1,085", "1,095", "1,105"]


def test_contact_is_reported_with_its_overlaps(pallet):
    page = plain_report(pallet)
    rows = {line[1]: line[2] for line in page.tables["Main numbers"]}
    assert rows["outer diameter at the end"] == "331 mm"
    assert any("while a front passes by up to" in text for _, text in page.findings)
    assert "8; 4 more behind planes of symmetry" in page.sections["decision"]


def reported(case=None, records=(), **burst):
    tables = {"burst": {"cell_size": "0.01 m"}, **(case or {})}
    rounds = tables.get("round", ({"name": "a"},))
    tables["round"] = [{**ROUND, "position": [f"{n} m", "0 m", "1 m"], **one} for n, one in enumerate(rounds)]
    summary = example(Summary, burst={"cell_size": 0.01, **burst}, findings=list(records))
    case = case_from_document(tables, source="case", folder=Path())
    run = run_of(values=case, summary=summary)
    return [(item.weight, item.text) for item in findings(run)]


@pytest.mark.parametrize(
    ("contact", "weight", "words"),
    [
        (
            {"max_interface_penetration_at_front": 6e-4},
            "warning",
            "while a front passes by up to 6.0 % of a cell; 5 % is",
        ),
        ({"max_interface_penetration_at_front": 4e-4}, "good", "overlap by at most 4 % of a cell"),
        ({"max_interface_penetration": 2e-4}, "warning", "after the front has passed by up to 2.0 % of a cell; 1 % is"),
        ({"max_collision_penetration": 7e-4}, "warning", "Colliding surfaces overlap by up to 7.0 %"),
        (
            {"max_plane_penetration": 7e-4},
            "warning",
            "Casings penetrate a plane of symmetry (found by the program) by up to 7.0 %",
        ),
    ],
)
def test_findings_follow_contact(contact, weight, words):
    found = reported(contact=contact)
    assert any(one == weight and words in text for one, text in found), found
    assert len([text for _, text in found if "of a cell" in text]) == 1


@pytest.mark.parametrize(
    ("passed", "weight", "words"),
    [
        ((0.0, 0.0, 0.0), "good", "No metal of the casings passed through a plane or into another round."),
        ((0.004, 0.0, 0.004), "good", "No more than 0.04 % of the metal of the casings passed through a plane"),
        ((0.03, 0.02, 0.04), "warning", ("0.4 % of the casings' mass passed through contact: up to 30 g lay behind a "
         "plane and 20 g within another round; at 1 % the burst stops.")),
    ],
)  # fmt: skip
def test_findings_report_what_has_passed_through(passed, weight, words):
    keys = ("largest_beyond_planes", "largest_in_other_rounds", "largest_together")
    burst = {"casing_mass": 10.0, "passed_through": dict(zip(keys, passed, strict=True))}
    for case in ({"plane": [{"name": "ground", "kind": "ground"}]}, {"round": [{"name": "a"}, {"name": "b"}]}):
        found = reported(case, **burst)
        assert [one for one, text in found if words in text] == [weight], found
    assert not any("passed through" in text for _, text in reported({"round": [{"name": "a"}]}, **burst))


def test_nothing_is_said_of_contact_where_nothing_touched():
    assert not any("of a cell" in text for _, text in reported(contact=dict.fromkeys(CONTACT, 0)))


def test_rounds_without_contact_are_reported_once():
    case = {"round": [{"name": "a"}, {"name": "b"}], "burst": {"cell_size": "0.01 m", "contact": {"surfaces": False}}}
    text = "2 rounds are computed as if each stood alone: contact of surfaces is switched off"
    record = {"stage": "burst", "code": "rounds_alone", "severity": "warning", "text": text}
    alone = [text for _, text in reported(case, [record]) if "alone" in text]
    assert len(alone) == 1
    assert alone[0].startswith("burst.contact.surfaces = false: 2 rounds are computed as if each stood alone")
    case["burst"]["contact"]["surfaces"] = True
    assert not [text for _, text in reported(case) if "alone" in text]


def test_a_round_that_did_not_detonate_is_named():
    balances = {"donor": 0.98, "waiting": 0.0}
    rounds = [
        {"name": name, "products_balance": balance, "ignition": IGNITION["a"]} for name, balance in balances.items()
    ]
    found = [text for weight, text in reported(rounds=rounds) if weight == "warning" and "Round “" in text]
    assert len(found) == 1
    assert found[0].startswith("Round “waiting” gave 0 % of its charge's heat")
    assert not any("Round “" in text for _, text in reported(rounds=rounds[:1]))


def test_hourglass_control_that_shows_in_the_speeds_is_reported():
    work = np.array([0.0, 1e6, 2e6])
    for share, reported in ((0.37, True), (0.08, False)):
        run = run_of(summary=example(Summary, burst={}), history={"products_work": work, "hourglass": share * work})
        texts = [item.text for item in findings(run) if "Hourglass" in item.text]
        assert len(texts) == reported
        assert not reported or texts[0].startswith("Hourglass control took 37 % of the products' work")
    assert not [item for item in findings(run_of()) if "Hourglass" in item.text]


def test_names_with_brackets_are_printed_as_they_are(capsys):
    rounds = [{"name": name, "ignition": IGNITION["b"]} for name in ("shell [north]", "shell [/south]")]
    print_summary(example(Summary, title="store [1]", burst={"rounds": rounds}))
    printed = capsys.readouterr().out
    assert "store [1]" in printed
    assert "ignition of shell [north]" in printed
    assert "ignition of shell [/south]" in printed


# --- Rounds that waited for a shock: sentences and findings

EXPOSURE = {
    "peak_pressure": 3.95e9, "energy": 1.5e6, "pulse_pressure": 3.2e9, "held_time": 2.5e-6, "floor": 1e9,
    "resolved_cell": 1.8e-3, "resolved": False, "critical_energy": [1.38e6, 1.84e6],
    "ratio": [1.087, 0.815], "verdict": "within",
}  # fmt: skip


def run_with(ignition=(), **changes):
    rounds = [
        {"name": "donor", "ignition": [{"by": "point"}]},
        {"name": "acceptor", "ignition": list(ignition), "exposure": {**EXPOSURE, **changes}},
    ]
    return run_of(summary=example(Summary, burst={"rounds": rounds}))


def test_a_sentence_gives_pressure_time_energy_threshold_and_what_the_cells_allow():
    assert exposure_words(example(Exposure, **EXPOSURE)) == (
        "largest pressure 3.95 GPa; strongest pulse 3.2 GPa held for 2.5 us, 1.5 MJ/m2 against 1.38 to 1.84 MJ/m2 "
        "(ratio 0.81 to 1.1): within the scatter of the published critical energies; the cells are too coarse to "
        "resolve this pulse, which needs 1.8 mm or less: pressure and energy increase with smaller cells"
    )
    weak = exposure_words(example(Exposure, **{**EXPOSURE, "energy": 0.0, "peak_pressure": 0.4e9}))
    assert weak == "largest pressure 0.4 GPa, never above the threshold of 1 GPa from which a pulse is counted"


def test_the_loading_of_a_round_that_a_shock_initiated_stands_in_its_note():
    (note,) = [one for one in findings(run_with(ignition=IGNITION["b"])) if "“acceptor” was initiated" in one.text]
    assert note.weight == "note"
    assert "at 43.2 µs (largest pressure 3.95 GPa; strongest pulse 3.2 GPa held for 2.5 us" in note.text


@pytest.mark.parametrize(
    ("changes", "weight"),
    [
        ({}, "warning"),
        ({"verdict": "below", "resolved": True}, "note"),
        ({"verdict": "below", "resolved": False}, "warning"),
        ({"verdict": "above", "resolved": True}, "warning"),
    ],
)
def test_a_finding_never_calls_a_round_safe(changes, weight):
    reported = [one for one in findings(run_with(**changes)) if "was not initiated" in one.text]
    assert [one.weight for one in reported] == [weight]
    assert reported[0].text.endswith("a round below it is not therefore safe.")
