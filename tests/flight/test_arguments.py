"""What a user of the library may get wrong in its arguments and tables: texts with units, and foreign delimiters."""

from __future__ import annotations

import numpy as np
import pytest

import flight
from flight.arena import ArenaTable, is_arena_file
from flight.fluence import PolarGrid
from flight.hazard import Criteria
from flight.hazard.density.directions import Directions
from flight.hazard.exposed import Prism
from fragfield.hazard.tp12 import effective_number
from fragfield.hazard.walls import StoppingWall
from fragfield.places.site import Site

ONE = flight.Fragments(0.01, (0.0, 0.0, 1.0), (800.0, 0.0, 100.0))
SQUARE = [(0.0, 0.0), (4.0, 0.0), (4.0, 4.0), (0.0, 4.0)]
HEAT = "zone_from_deg;zone_to_deg;mass_from_kg;mass_to_kg;number;mean_mass_kg;mean_speed_m_s\n0;180;0;1;3;0.01;900\n"


@pytest.mark.parametrize(
    ("call", "words"),
    [
        (lambda: flight.Cylinder(radius="7 m"), "witness cylinder: radius is the text '7 m'; needed: metres as a num"),
        (lambda: flight.Cylinder(radius=7.0, centre=("1 m", 0.0)), "centre is .*'1 m'.*; needed: metres as numbers"),
        (lambda: flight.Cylinder(radius=None), "radius is None; needed: metres as a number"),
        (lambda: flight.Cylinder(radius=True), "radius is True; needed: metres as a number"),
        (lambda: flight.Cylinder(radius=np.array([1.0, 2.0])), "radius is array.*; needed: metres as a number"),
        (lambda: flight.Panel((0, 0, 0), ("1", 0, 0), 2.0, 3.0), "normal is .*; needed: plain numbers"),
        (lambda: flight.Wall((0, 0), (1, 0), "2 m"), "obstacle wall: height is the text '2 m'; needed: metres"),
        (lambda: flight.ConstantAir("1.2 kg/m3"), "density_everywhere is the text .*; needed: kilograms per cubic"),
        (lambda: flight.Wind.profile(["0 m", "9 m"], [1, 2], 0.0), "wind: height is .*; needed: metres as numbers"),
        (lambda: flight.Ricochet("8 deg", 0.5), "ricochet own: critical_angle is the text '8 deg'; needed: degrees"),
        (lambda: flight.Drag.constant("0.6"), "drag: constant coefficient is the text '0.6'; needed: a plain number"),
        (lambda: flight.FixedStep("0.1 ms"), "integrator: step is the text '0.1 ms'; needed: seconds as a number"),
        (lambda: StoppingWall("steel", "6 mm"), "wall: thickness is the text '6 mm'; needed: metres as a number"),
        (lambda: Criteria(energy="79 J"), "hazard: energy is the text '79 J'; needed: joules as a number"),
        (lambda: Prism(SQUARE, 0.0, "3 m"), "exposed: top is the text '3 m'; needed: metres as a number"),
        (lambda: Site("46.9", 7.4, 0.0), "site: latitude is the text '46.9'; needed: degrees as a number"),
        (lambda: effective_number("4", 2), "stack rule: side is the text '4'; needed: a plain number"),
        (lambda: flight.hazard_distance(ONE, kernel="10 deg"), "hazard_distance: kernel is the text '10 deg'; needed"),
        (lambda: Directions(PolarGrid(), kernel="10 deg"), "hazard: kernel is the text '10 deg'; needed: degrees"),
        (lambda: flight.fly(ONE, gravity="9.81"), "fly: gravity is the text '9.81'; needed: metres per second squared"),
        (lambda: ArenaTable.of([ONE]).realisation(1, axis=(0, 0, 0)), "arena: axis is .*, needed: a direction"),
        (lambda: flight.Contact(between="round"), r"contact: between is 'round'.*'rounds'"),
        (lambda: flight.fly(ONE, air="1.2 kg/m3"), "air: unknown name '1.2 kg/m3'.* or a density in kg/m3"),
    ],
)  # fmt: skip
def test_a_unit_in_a_text_is_refused_in_words(call, words):
    with pytest.raises(flight.InputError, match=words):
        call()


@pytest.mark.parametrize(
    ("argument", "value", "words"),
    [
        ("mass", "10 g", "fragments: mass is the text '10 g'; needed: kilograms as numbers"),
        ("mass", ["0.01", "0.02"], "fragments: mass is .*; needed: kilograms as numbers"),
        ("mass", [0.01, "0.02"], "fragments: mass is .*; needed: kilograms as numbers"),
        ("position", ("0 m", "0 m", "1 m"), "fragments: position is .*; needed: metres as numbers"),
        ("velocity", ("1 km/s", 0, 0), "fragments: velocity is .*; needed: metres per second as numbers"),
        ("shape_factor", "2600", "fragments: shape_factor is the text '2600'; needed: kilograms per cubic metre as"),
        ("round", "one", "fragments: round is the text 'one'; needed: plain numbers"),
    ],
)
def test_fragments_take_no_text_even_where_numpy_would(argument, value, words):
    values = {"mass": 0.01, "position": (0.0, 0.0, 1.0), "velocity": (1.0, 0.0, 0.0), argument: value}
    with pytest.raises(flight.InputError, match=words):
        flight.Fragments(**values)


def test_numbers_of_every_kind_are_taken():
    for seven in (7, 7.0, np.float32(7.0), np.int64(7), np.array(7.0)):
        assert flight.Cylinder(radius=seven).area == pytest.approx(float("inf"))
        assert flight.Wall((0, 0), (1, 0), height=seven).height == 7
    assert len(flight.Fragments([1, 2], (0, 0, 1), (1, 0, 0), round=np.array([0.0, 1.0]))) == 2


@pytest.mark.parametrize("delimiter", [",", ";", "\t", " ; "])
def test_the_delimiter_of_a_table_is_found(tmp_path, delimiter):
    path = tmp_path / "fragments.csv"
    rows = [["mass_kg", "vx_m_s", "vy_m_s", "vz_m_s"], ["0.01", "800", "0", "1e2"], ["0.02", "-700", "0.5", "0"]]
    path.write_text("# a test\n" + "\n".join(delimiter.join(row) for row in rows) + "\n")
    found = flight.Fragments.read(path)
    assert found.mass.tolist() == [0.01, 0.02]
    assert found.velocity.tolist() == [[800.0, 0.0, 100.0], [-700.0, 0.5, 0.0]]
    table = tmp_path / "drag.csv"
    table.write_text(delimiter.join(["mach", "cd"]) + "\n" + "\n".join(delimiter.join(p) for p in ("01", "25")) + "\n")
    drag = flight.Drag.read(table)
    assert (drag.mach.tolist(), drag.coefficient.tolist()) == ([0.0, 2.0], [1.0, 5.0])


def test_an_arena_table_with_semicolons_is_known_as_one(tmp_path):
    path = tmp_path / "test.csv"
    path.write_text(HEAT)
    assert is_arena_file(path)
    assert ArenaTable.read(path).number.tolist() == [3.0]
    path.write_text(HEAT.replace("deg;", "deg,", 1))
    assert not is_arena_file(path)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (
            "mach;cd,\n0;1\n",
            "found comma and semicolon in the line of column names, 'mach;cd,'; allowed: one comma",
        ),
        ("mach cd\n0 1\n", "no delimiter in the line of column names, 'mach cd'; allowed between cells: comma, semico"),
        ("mach;cd\n0;1\n1,5;2\n", "line 3, column mach: '1,5' is not a number; decimals need a point"),
        ("mach,cd\n0;1\n", "line 2 has 1 cells, the 2 columns are mach, cd; it holds semicolon, the column names com"),
        ("mach\tcd\n0\tone\n", "line 2, column cd: 'one' is not a number;"),
    ],
)
def test_a_delimiter_that_does_not_fit_is_refused_in_words(tmp_path, text, words):
    path = tmp_path / "drag.csv"
    path.write_text(text)
    with pytest.raises(flight.InputError, match=words):
        flight.Drag.read(path)
