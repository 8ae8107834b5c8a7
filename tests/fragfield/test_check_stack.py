"""`fragfield check` of stacks: places, clear distances, planes, contact, initiation, and what many rounds cost."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

from fragfield.case.conversion.rounds import mirrored
from fragfield.case.load import case_from_document
from fragfield.checking.check import check_report
from fragfield.hazard.contents import with_images
from tests.fragfield.short_run import ROOT, invoke

ROUND = {"name": "shell", "profile": "m107", "explosive": "comp_b", "casing": "steel_m107"}
SHOCK = {"pressure": "5 GPa", "duration": "0.2 us"}
WIDTH = 0.155


def _case(*, round=None, burst=None, **tables):  # noqa: A002
    rounds = round if isinstance(round, list) else [{**ROUND, **(round or {})}]
    document = {
        "burst": {"cell_size": "12 mm", "end_time": "150 us", "geometry": "3d", **(burst or {})},
        "round": rounds,
        **tables,
    }
    return case_from_document(document, source="my.toml", folder=Path())


def _row(count, gap="21.7 mm", **keys):
    return {"arrangement": "row", "count": count, "gap": gap, **keys}


def test_the_arrangement_is_reported_with_its_nearest_pair():
    other = {**ROUND, "name": "other", "position": ["0 m", "0.5 m", "0 m"]}
    found = check_report(_case(round=[ROUND, other], stack={**_row(3, "30 mm"), "round": "shell"})).arrangement
    assert [entry.name for entry in found.rounds] == ["shell_1", "shell_2", "shell_3", "other"]
    assert found.rounds[0].position == pytest.approx([-(WIDTH + 0.03), 0.0, 0.0])
    assert found.min_clearance.rounds == ("shell_1", "shell_2")
    assert found.min_clearance.clearance == pytest.approx(0.03)
    assert found.planes == ()
    assert check_report(_case()).arrangement.min_clearance is None


def test_planes_report_their_nearest_round():
    planes = [
        {"name": "mid", "kind": "symmetry", "normal": [1, 0, 0]},
        {"name": "deck", "kind": "wall", "point": ["0 m", "0 m", "0.2 m"], "normal": [0, 0, 1],
         "friction_angle": "9 deg"},
    ]  # fmt: skip
    case = _case(round={"position": ["0.3 m", "0 m", "0.2 m"]}, stack=_row(2), plane=planes)
    mid, deck = check_report(case).arrangement.planes
    assert (mid.nearest_round, mid.friction_angle_deg) == ("shell_1", None)
    assert mid.clearance == pytest.approx(0.3 - WIDTH - 0.0217 / 2)
    assert (deck.clearance, deck.friction_angle_deg) == (pytest.approx(0.0, abs=1e-12), 9.0)


def test_images_of_the_rounds_in_two_planes_of_symmetry():
    planes = [
        {"name": "x", "kind": "symmetry", "normal": [1, 0, 0]},
        {"name": "y", "kind": "symmetry", "normal": [0, -1, 0], "point": ["0 m", "1 m", "0 m"]},
        {"name": "earth", "kind": "ground"},
    ]
    case = _case(round={"position": ["0.3 m", "0.5 m", "0 m"]}, plane=planes)
    images = with_images(case)
    expected = [[0.3, 0.5, 0], [-0.3, 0.5, 0], [0.3, 1.5, 0], [-0.3, 1.5, 0]]
    assert images == pytest.approx(np.array(expected))
    bodies = mirrored(case, [(np.array([0.3, 0.5, 0.0]), np.array([0.6, 0.8, 0.0]), "shell")])
    assert np.array([place for place, _, _ in bodies]) == pytest.approx(np.array(expected))
    assert [axis.tolist() for _, axis, _ in bodies] == [[x, y, 0.0] for y in (0.8, -0.8) for x in (0.6, -0.6)]


def test_mirrored_rounds_count_for_how_near_the_witness_stands():
    ring = [{"name": "ring", "radius": "1 m"}]
    far = {"position": ["0.4 m", "0 m", "0 m"]}
    plane = [{"name": "x", "kind": "symmetry", "normal": [1, 0, 0], "point": ["0.2 m", "0 m", "0 m"]}]
    centred = {**ring[0], "centre": ["0.4 m", "0 m"]}
    assert not [line for line in check_report(_case(round=far, witness=[centred])).warnings if "witness" in line]
    found = check_report(_case(round=far, witness=[centred], plane=plane)).warnings
    assert any("witness[1].radius = 1 m: so close" in line for line in found)


def test_rounds_that_pass_through_each_other_are_warned_of_and_others_are_not():
    apart = {"contact": {"surfaces": False}}
    warned = [line for line in check_report(_case(stack=_row(2), burst=apart)).warnings if "stood alone" in line]
    assert len(warned) == 1
    assert warned[0].startswith("burst.contact.surfaces = false: 2 rounds")
    for case in (_case(stack=_row(2)), _case(burst=apart)):
        assert not any("stood alone" in line or "pass through" in line for line in check_report(case).warnings)


def test_a_round_that_no_shock_can_reach_is_warned_of():
    tables = {"round": {"initiation": SHOCK}, "stack": _row(3, initiated=[2])}
    found = check_report(_case(**tables, burst={"contact": {"surfaces": False}})).warnings
    assert any("no shock reaches shell_1 and 1 more" in line for line in found)
    assert not any("no shock" in line for line in check_report(_case(**tables)).warnings)


def test_two_heights_of_the_ground_are_warned_of():
    ground = {"name": "earth", "kind": "ground", "height": "-0.5 m"}
    found = check_report(_case(plane=[ground])).warnings
    assert any(
        line.startswith("plane[1] (earth) is ground at z = -0.5 m") and "flight.ground is at 0 m there" in line
        for line in found
    )
    agreed = _case(plane=[ground], flight={"ground": {"height": "-0.5 m"}})
    assert not any("earth" in line for line in check_report(agreed).warnings)


def test_rounds_that_are_alike_are_warned_of_once():
    tube = {**ROUND, "name": "tube", "profile": "tube", "position": ["1 m", "0 m", "0 m"]}
    case = _case(round=[ROUND, tube], stack={**_row(4), "round": "shell"}, burst={"end_time": "20 us"})
    over = [line for line in check_report(case).warnings if "ends before the front" in line]
    assert [line.split(":")[0] for line in over] == ["round[1] (shell_1 and 3 alike)", "round[5] (tube)"]


def test_the_cost_of_a_stack_is_that_of_its_rounds():
    one, eight = (check_report(_case(stack=_row(count), burst={"symmetry": "off"})) for count in (1, 8))
    assert eight.mesh.cells == 8 * one.mesh.cells
    assert eight.mesh.nodes == 8 * one.mesh.nodes
    assert eight.mesh.min_edge == pytest.approx(one.mesh.min_edge)
    assert one.expected.memory_bytes < eight.expected.memory_bytes < 8 * one.expected.memory_bytes
    assert len(eight.rounds) == 8
    (first,), last = one.rounds, eight.rounds[7]
    assert (last.casing_mass, last.gurney_speed) == (first.casing_mass, first.gurney_speed)


def test_check_says_what_is_computed_by_symmetry():
    """A row of four: two half rounds, a quarter of the cells of as many rounds in full on the same grid."""
    found = check_report(_case(stack=_row(4)))
    assert found.symmetry.share == 0.25
    assert [one.share for one in found.symmetry.computed_rounds] == [0.5, 0.5]
    quarter = check_report(_case())
    assert quarter.symmetry.share == 0.25
    assert found.mesh.cells == 4 * quarter.mesh.cells
    # Masses are those of whole rounds.
    full = check_report(_case(burst={"symmetry": "off"}))
    assert quarter.rounds[0].casing_mass == full.rounds[0].casing_mass
    assert abs(quarter.rounds[0].mass_error_of_mesh["casing_mass"]) < 0.02


def test_check_names_the_plane_that_one_initiation_breaks():
    initiation = {"pressure": "5 GPa", "duration": "0.2 us"}
    shell = {**ROUND, "initiation": initiation}
    found = check_report(_case(round=[shell], stack={**_row(2), "initiated": [1]})).symmetry
    assert found.share == 0.5
    (refused,) = found.not_used
    assert refused.normal == (1.0, 0.0, 0.0)
    assert refused.reason.endswith("are not initiated alike")


@pytest.mark.slow
def test_a_pallet_of_a_thousand_rounds_is_checked_in_seconds(tmp_path):
    """35 s of processor time before 2026-11-23: places, profiles and meshes were compared and made one by one."""
    text = (ROOT / "cases" / "m107_pallet_2x4.toml").read_text()
    path = tmp_path / "pallet.toml"
    path.write_text(text.replace("counts = [2, 4, 1]", "counts = [10, 10, 10]"))
    began = time.process_time()
    done = invoke("check", path)
    assert done.exit_code == 0
    assert "a quarter of the arrangement is computed" in done.stdout
    assert time.process_time() - began < 15.0
