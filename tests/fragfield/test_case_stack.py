"""Stacks in the case file: arrangements, contact, planes, initiation by shock, and what is refused of them."""

from __future__ import annotations

import math
import re
import tomllib
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from burst_fenicsx.geometry import load_profile
from burst_fenicsx.kernels.geometry.faces import reordered
from burst_fenicsx.meshing import mesh_profile, mesh_round
from burst_fenicsx.problem import ContactSettings, Mirror, RigidPlane, ShockInitiation
from fragfield.case import differences, load_case, read_resolved, to_toml
from fragfield.case.conversion.rounds import burst_rounds
from fragfield.case.load import case_from_document
from fragfield.case.problem import burst_settings
from fragfield.errors import InputError

ROUND = {"name": "shell", "profile": "m107", "explosive": "comp_b", "casing": "steel_m107"}
SHOCK = {"pressure": "5 GPa", "duration": "0.2 us"}
WIDTH, LENGTH = 0.155, 0.6039


def _case(*, round=None, burst=None, **tables):  # noqa: A002
    rounds = round if isinstance(round, list) else [{**ROUND, **(round or {})}]
    document = {"burst": {"cell_size": "10 mm", **(burst or {})}, "round": rounds, **tables}
    return case_from_document(document, source="my.toml", folder=Path())


def _refused(*parts, **tables):
    with pytest.raises(InputError) as caught:
        _case(**tables)
    message = str(caught.value)
    assert message.startswith("my.toml: ")
    for part in parts:
        assert part in message, message


def _positions(case):
    return np.array([entry.position for entry in case.round])


# ---- arrangements


def test_a_pair_stands_along_x_symmetric_about_the_template():
    case = _case(round={"position": ["1 m", "2 m", "3 m"]}, stack={"arrangement": "row", "count": 2, "gap": "21.7 mm"})
    assert [entry.name for entry in case.round] == ["shell_1", "shell_2"]
    assert _positions(case) == pytest.approx(np.array([[0.91165, 2, 3], [1.08835, 2, 3]]), abs=1e-12)
    assert case.stack is None, "the rounds stand for themselves once the case is read"


def test_every_round_of_a_stack_stands_on_its_own_ground(tmp_path):
    """On a slope of 10 %, said of the round that is copied or of the stack; the layers of a pallet keep their pitch."""
    rows = [" ".join(f"{0.1 * (10.0 * column - 100.0)}" for column in range(21))] * 21
    head = "ncols 21\nnrows 21\nxllcenter -100\nyllcenter -100\ncellsize 10\n"
    (tmp_path / "slope.asc").write_text(head + "\n".join(rows) + "\n")
    flight = {"ground": {"map": str(tmp_path / "slope.asc"), "site": ["0 m", "0 m"], "ricochet": "none"}}
    flight["ground"]["beyond"] = "level"
    stack = {"arrangement": "row", "count": 4, "gap": "100 mm"}
    for base, own in (("ground", None), (None, "ground")):
        round_ = {"attitude": "upright"} | ({"base": base} if base else {})
        found = _positions(_case(round=round_, stack=stack | ({"base": own} if own else {}), flight=flight))
        assert np.ptp(found[:, 0]) == pytest.approx(3 * (WIDTH + 0.1), rel=1e-3)
        assert found[:, 2] == pytest.approx(0.1 * found[:, 0], abs=1e-9)
    pallet = {"arrangement": "pallet", "counts": [2, 1, 2], "gap": "100 mm", "base": "ground"}
    x, _, z = _positions(_case(round={"attitude": "upright"}, stack=pallet, flight=flight)).T
    assert sorted(np.round(z - 0.1 * x, 6)) == pytest.approx([0.0, 0.0, LENGTH + 0.1, LENGTH + 0.1], abs=2e-3)


def test_a_lying_row_keeps_the_clear_distance_along_x():
    """Lying along y the diameters face each other along x; lying along x nose and base do."""
    stack = {"arrangement": "row", "count": 3, "gap": "10 mm"}
    across = _positions(_case(round={"axis": [0, 1, 0], "position": ["0 m", "0 m", "1 m"]}, stack=stack))
    assert np.diff(across[:, 0]) == pytest.approx([WIDTH + 0.01] * 2)
    along = _positions(_case(round={"axis": [1, 0, 0], "position": ["0 m", "0 m", "1 m"]}, stack=stack))
    assert np.diff(along[:, 0]) == pytest.approx([LENGTH + 0.01] * 2)


@pytest.mark.parametrize("axis", [[0, 0, 1], [0, 1, 0]])
def test_a_triangle_has_equal_gaps(axis):
    stack = {"arrangement": "triangle", "gap": "15 mm", "base": "0 m"}
    case = _case(round={"axis": axis}, stack=stack, burst={"cell_size": "6 mm"})
    places = _positions(case)
    assert len(places) == 3
    distances = [np.linalg.norm(a - b) for a, b in combinations(places, 2)]
    assert distances == pytest.approx([WIDTH + 0.015] * 3)
    if axis == [0, 1, 0]:
        assert places[:, 2] == pytest.approx([WIDTH / 2, WIDTH / 2, WIDTH / 2 + 0.75**0.5 * (WIDTH + 0.015)])
    else:
        assert not places[:, 2].any()


def test_a_pallet_stands_on_its_deck():
    stack = {"arrangement": "pallet", "counts": [2, 4, 2], "gap": "20 mm", "layer_gap": "50 mm", "base": "0.15 m"}
    places = _positions(_case(round={"position": ["0 m", "0 m", "3 m"]}, stack=stack))
    assert len(places) == 16
    assert np.unique(places[:, 2].round(9)) == pytest.approx([0.15, 0.15 + LENGTH + 0.05])
    assert np.unique(places[:, 0].round(9)) == pytest.approx([-0.0875, 0.0875])
    assert np.unique(places[:, 1].round(9)) == pytest.approx(0.175 * np.array([-1.5, -0.5, 0.5, 1.5]))
    without = _positions(_case(stack={key: value for key, value in stack.items() if key not in ("layer_gap", "base")}))
    assert np.unique(without[:, 2].round(9)) == pytest.approx([0, LENGTH + 0.02])


def test_a_round_turned_upside_down_stands_on_the_base_height_with_its_nose():
    stack = {"arrangement": "row", "count": 1, "gap": "0 m", "base": "0.2 m"}
    case = _case(round={"axis": [0, 0, -1]}, stack=stack)
    assert case.round[0].position[2] == pytest.approx(0.2 + LENGTH)


def test_other_rounds_stay_as_they_are_beside_the_stack():
    other = {**ROUND, "name": "donor", "position": ["0 m", "1 m", "0 m"]}
    case = _case(round=[other, ROUND], stack={"arrangement": "row", "round": "shell", "count": 2, "gap": "10 mm"})
    assert [entry.name for entry in case.round] == ["donor", "shell_1", "shell_2"]
    assert case.round[0].position == (0.0, 1.0, 0.0)


def test_delays_are_added_and_the_others_wait_for_the_shock():
    points = [{"station": "base", "delay": "1 us"}, {"station": "nose"}]
    case = _case(
        round={"ignition": points, "initiation": SHOCK},
        stack={"arrangement": "row", "count": 3, "gap": "10 mm", "delays": ["0 s", "0 s", "5 us"],
               "initiated": ["shell_1", 3]},
    )  # fmt: skip
    assert [[point.delay for point in entry.ignition] for entry in case.round] == [
        [1e-6, 0.0], [], [pytest.approx(6e-6), 5e-6],
    ]  # fmt: skip
    first, second, _ = burst_rounds(case)
    assert second.ignition == ()
    assert first.initiation == second.initiation == ShockInitiation(5e9, pytest.approx(0.2e-6))


def test_a_resolved_stack_reads_back_as_the_same_case(tmp_path):
    tables = {
        "round": {"initiation": SHOCK},
        "stack": {"arrangement": "pallet", "counts": [2, 2, 1], "gap": "20 mm", "base": "0.1 m", "initiated": [1]},
        "plane": [{"name": "deck", "kind": "wall", "point": ["0 m", "0 m", "10 cm"], "normal": [0, 0, 7]},
                  {"name": "earth", "kind": "ground"},
                  {"name": "middle", "kind": "symmetry", "normal": [0.3, 0.1, 0], "point": ["-1 m", "0 m", "0 m"]}],
        "burst": {"contact": {"charge_casing": "shared", "surface_friction_angle": "0.3 rad", "cohesion": "4 MPa"}},
    }  # fmt: skip
    case = _case(**tables)
    path = tmp_path / "case.toml"
    path.write_text(to_toml(case), encoding="utf-8")
    assert read_resolved(path) == case
    assert load_case(path) == case
    assert "stack" not in tomllib.loads(path.read_text())
    assert differences(case, load_case(path, {"burst.cell_size": "9 mm"})) == [
        'burst.cell_size: stored "0.01 m", now "0.009 m"'
    ]


# ---- rounds in each other


def test_rounds_of_a_stack_without_a_gap_touch_with_their_meshes():
    """At a gap of zero the meshes do not overlap, and are apart by far less than a cell."""
    case = _case(stack={"arrangement": "row", "count": 2, "gap": "0 mm"})
    left, right = (mesh_round(entry, burst_settings(case).cell_size) for entry in burst_rounds(case))
    assert 0.0 <= right.nodes[:, 0].min() - left.nodes[:, 0].max() < 1e-3
    places = _positions(case)
    assert 0.0 < places[1, 0] - places[0, 0] - WIDTH < 1e-3, "far less than a cell of 10 mm"
    alone = _positions(
        _case(stack={"arrangement": "row", "count": 2, "gap": "0 mm"}, burst={"contact": {"surfaces": False}})
    )
    assert np.diff(alone[:, 0]) == pytest.approx(WIDTH)


def test_the_smallest_distance_that_a_refusal_names_is_enough():
    """Closer than the corners of the mesh reach is refused; at the distance that the message allows they are apart."""

    def pair(gap: str) -> list[dict]:
        there = f"{1e3 * WIDTH + float(gap.split(maxsplit=1)[0])!r} mm"
        return [ROUND, {**ROUND, "name": "b", "position": [there, *ROUND.get("position", ["0 m", "0 m", "0 m"])[1:]]}]

    with pytest.raises(InputError) as caught:
        _case(round=pair("0 mm"))
    message = str(caught.value)
    assert 'round[2].position: "shell" and "b" stand 0 mm apart' in message
    smallest = re.search(r"allowed: at least (\S+ mm) apart", message)[1]
    case = _case(round=pair(smallest))
    left, right = (mesh_round(entry, burst_settings(case).cell_size) for entry in burst_rounds(case))
    assert left.nodes[:, 0].max() < right.nodes[:, 0].min()
    assert float(smallest.split()[0]) < 1.0, "far less than a cell of 10 mm"
    _refused("round[2].position", round=pair(f"{float(smallest.split()[0]) - 0.01} mm"))
    assert len(_case(round=pair("0 mm"), burst={"contact": {"surfaces": False}}).round) == 2


def test_a_round_from_a_mesh_file_is_seen_too(tmp_path):
    meshio = pytest.importorskip("meshio")
    mesh = mesh_profile(load_profile("tube"), 0.02)
    meshio.Mesh(
        mesh.nodes, [("hexahedron", reordered(mesh.cells))],
        field_data={"casing": np.array([1, 3]), "charge": np.array([2, 3])},
        cell_data={"gmsh:physical": [mesh.part + 1], "gmsh:geometrical": [mesh.part + 1]},
    ).write(tmp_path / "tube.msh", file_format="gmsh22", binary=False)  # fmt: skip
    entry = {"name": "a", "mesh": str(tmp_path / "tube.msh"), "explosive": "tnt", "casing": "copper"}
    _refused(
        '"b" reaches', 'into round[1] "a"', round=[entry, {**entry, "name": "b", "position": ["15 cm", "0 m", "0 m"]}]
    )
    case = _case(round=[entry], stack={"arrangement": "row", "count": 2, "gap": "10 mm"})
    width = np.ptp(mesh.nodes[:, 0])
    assert np.diff(_positions(case)[:, 0]) == pytest.approx([width + 0.01])


# ---- contact and planes


def test_contact_reaches_the_burst_and_its_defaults_are_the_stages():
    assert burst_settings(_case()).contact == ContactSettings()
    contact = {"charge_casing": "shared", "cohesion": "4 MPa", "tensile_strength": "0 Pa", "friction_angle": "25 deg",
               "surfaces": False, "surface_friction_angle": "0 deg"}  # fmt: skip
    assert burst_settings(_case(burst={"contact": contact})).contact == ContactSettings(
        "shared", 4e6, 0.0, 25.0, False, 0.0
    )


def test_planes_reach_the_burst():
    case = _case(
        round={"position": ["100 mm", "100 mm", "0.1 m"]},
        plane=[
            {"name": "earth", "kind": "ground", "height": "100 mm"},
            {"name": "left", "kind": "symmetry", "normal": [2, 0, 0]},
            {"name": "wall", "kind": "wall", "point": ["0 m", "1 m", "0 m"], "normal": [0, -3, 0],
             "friction_angle": "0 deg"},
        ],
    )  # fmt: skip
    assert burst_settings(case).planes == (
        RigidPlane("earth", (0.0, 0.0, 0.1), (0.0, 0.0, 1.0), 20.0),
        Mirror("left", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0)),
        RigidPlane("wall", (0.0, 1.0, 0.0), (0.0, -1.0, 0.0), 0.0),
    )
    tilted = _case(
        plane=[{"name": "slope", "kind": "ground", "normal": [-0.1, 0.2, 3], "point": ["0 m", "0 m", "-1 m"]}]
    )
    assert math.hypot(*tilted.plane[0].normal) == pytest.approx(1.0, abs=1e-15)


def test_upright_rounds_stand_on_the_ground_and_lying_ones_just_above_it():
    ground = {"name": "earth", "kind": "ground"}
    assert len(_case(plane=[ground]).plane) == 1
    lying = {"axis": [0, 1, 0], "position": ["0 m", "0 m", "77.5 mm"]}
    _refused('"shell" stands 0 mm from plane[1] "earth"', "allowed: at least", round=lying, plane=[ground])
    lying["position"] = ["0 m", "0 m", "78.5 mm"]
    assert len(_case(round=lying, plane=[ground]).plane) == 1


def test_half_a_pair_against_a_plane_stands_where_the_whole_pair_does():
    """The one round of the mirrored ready case is the right one of the pair, and its plane lies midway."""
    cases = Path(__file__).parents[2] / "cases"
    pair, mirrored = load_case(cases / "m107_pair.toml"), load_case(cases / "m107_pair_mirrored.toml")
    (alone,) = mirrored.round
    assert alone.position == pytest.approx(pair.round[1].position, abs=1e-9)
    (plane,) = burst_settings(mirrored).planes
    assert plane == Mirror(plane.name, (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    reflected = np.array(alone.position) * [-1, 1, 1]
    assert reflected == pytest.approx(pair.round[0].position, abs=1e-9)
