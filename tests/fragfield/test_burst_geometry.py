"""`burst.geometry`: what auto chooses and why, what is refused and in which words, what `check` and burst report."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from burst_fenicsx.axisymmetric.applicability import CLEARANCE
from fragfield.case import load_case
from fragfield.case.load import case_from_document
from fragfield.case.problem import burst_geometry, burst_settings
from fragfield.checking.check import check_report
from fragfield.checking.show import print_check
from fragfield.errors import exit_code_of
from tests.datasets import same_data
from tests.fragfield.short_run import RINGS, invoke

CASES = Path(__file__).parents[2] / "cases"
ROUND = {"name": "shell", "profile": "m107", "explosive": "tnt", "casing": "steel_m107"}
RADIUS = 0.0775  # largest, m
FREE = "one round of revolution, initiated on its axis, out of reach of any plane"
SHOCK = {"pressure": "5 GPa", "duration": "0.2 us"}


def case(burst=None, plane=None, **changes):
    document = {"burst": {"cell_size": "12 mm", **(burst or {})}, "round": [{**ROUND, **changes}]}
    return case_from_document(document | ({"plane": plane} if plane else {}), source="my.toml", folder=Path())


def wall(distance):
    """A wall whose clear distance from the upright round is so many of its largest radii."""
    point = [f"{(1.0 + distance) * RADIUS!r} m", "0 m", "0 m"]
    return [{"name": "wall", "kind": "wall", "point": point, "normal": [-1, 0, 0]}]


@pytest.mark.parametrize(
    ("made", "reason"),
    [
        (lambda **burst: case(burst), None),
        (lambda **burst: case(burst, position=["1 m", "0 m", "2 m"], axis=[1, 1, 0]), None),
        (lambda **burst: case(burst, wall(1.01 * CLEARANCE)), None),
        (lambda **burst: case(burst, wall(0.99 * CLEARANCE)), "the casing may reach plane 'wall'"),
        (
            lambda **burst: case(burst, ignition=[{"station": "nose", "offset": ["1 mm", "0 mm"]}]),
            "round 'shell' is initiated off its axis",
        ),
        (lambda **burst: case(burst, initiation=SHOCK), "round 'shell' may be initiated by shock"),
        (
            lambda **burst: case(burst, initiation=SHOCK, ignition=[{"station": "nose"}]),
            "round 'shell' may be initiated by shock",
        ),
        (lambda **burst: case({"quadrature": "full", **burst}), "full quadrature belongs to hexahedra"),
    ],
)
def test_auto_takes_the_meridian_where_it_can_and_says_why_not(made, reason):
    found = burst_geometry(made())
    assert found.geometry == ("axisymmetric" if reason is None else "3d")
    assert found.reason == (reason or FREE)
    assert burst_settings(made()).geometry == found.geometry
    # What auto would not take is refused where it is asked for, and never computed otherwise.
    if reason is None:
        assert burst_geometry(made(geometry="axisymmetric")).geometry == "axisymmetric"
    else:
        words = f'burst.geometry: found "axisymmetric", but {reason}; allowed here: "3d", or "auto", which chooses it'
        with pytest.raises(Exception, match=r"burst\.geometry") as refused:
            made(geometry="axisymmetric")
        assert words in str(refused.value)
        assert exit_code_of(refused.value) == 2


def test_three_dimensions_are_computed_where_they_are_asked_for():
    found = burst_geometry(case({"geometry": "3d"}))
    assert found.geometry == "3d"
    assert found.words == 'three dimensions: asked for by burst.geometry = "3d"'


@pytest.mark.parametrize(
    ("name", "geometry", "reason"),
    [
        ("m107_tnt", "axisymmetric", FREE),
        (
            "grenade_155_tnt",
            "axisymmetric",
            "one round of revolution, initiated on its axis, out of reach of any plane",
        ),
        ("m107_pair", "3d", "2 rounds may meet"),
        ("m107_pair_mirrored", "3d", "plane 'middle' mirrors the round"),
        ("m107_pallet_2x4", "3d", "8 rounds may meet"),
    ],
)
def test_ready_cases(name, geometry, reason):
    found = burst_geometry(load_case(CASES / f"{name}.toml"))
    assert (found.geometry, found.reason) == (geometry, reason)


def test_check_shows_the_choice_and_meshes_the_whole_ring(capsys):
    """The meridian's masses are those of the whole round: no plane of symmetry cuts it."""
    one = case({"cell_size": "8 mm"})
    found = check_report(one)
    assert found["geometry"] == {"choice": "axisymmetric", "reason": burst_geometry(one).reason}
    assert 500 < found["mesh"]["cells"] < 1000
    assert abs(found["rounds"][0]["mass_error_of_mesh"]["casing_mass"]) < 1e-3
    assert abs(found["rounds"][0]["mass_error_of_mesh"]["charge_mass"]) < 1e-3
    print_check(found, one)
    assert "burst: axisymmetric (one round of revolution, initiated on its axis" in capsys.readouterr().out


@pytest.mark.dolfinx
def test_a_casing_that_reaches_a_plane_ends_with_exit_code_3(tmp_path):
    """The tube beside a wall that auto takes to be out of reach, with time enough to reach it."""
    path = tmp_path / "case.toml"
    text = RINGS.replace('end_time = "12 us"', 'end_time = "1 ms"').replace('interval = "4 us"', 'interval = "100 us"')
    at = (1.0 + 1.01 * CLEARANCE) * RADIUS * 1e3
    wall_table = f'[[plane]]\nname = "wall"\nkind = "wall"\npoint = ["{at} mm", "0 mm", "0 mm"]\nnormal = [-1, 0, 0]\n'
    path.write_text(text + "\n" + wall_table)
    done = invoke("burst", path, "--out", tmp_path / "run", "--json")
    assert done.exit_code == 3, done.stderr
    assert "has reached the plane 'wall', which an axisymmetric burst leaves aside" in done.stderr
    assert 'burst.geometry = "3d"' in done.stderr
    assert (tmp_path / "run" / "burst.xdmf").is_file()
    assert not (tmp_path / "run" / "burst_snapshot.h5").exists()


@pytest.mark.dolfinx
@pytest.mark.mpi
def test_two_ranks_give_the_snapshot_of_one(mpirun, tmp_path):
    """The first rank computes while the other waits: the same data to the bit, reported once, with the reason."""
    path = tmp_path / "case.toml"
    path.write_text(RINGS)
    assert invoke("burst", path, "--out", tmp_path / "one", "--json").exit_code == 0
    done = mpirun(2, "-m", "fragfield", "burst", path, "--out", tmp_path / "two", "--json")
    summary = json.loads(done.stdout)["burst"]
    assert summary["geometry"] == "axisymmetric"
    assert summary["geometry_reason"].startswith("one round of revolution")
    assert same_data(*(tmp_path / name / "burst_snapshot.h5" for name in ("one", "two"))) > 5
