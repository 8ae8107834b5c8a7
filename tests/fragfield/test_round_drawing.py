"""The dimensioned drawing of a round: its numbers against closed forms and the contour, its files, and refusals."""

from __future__ import annotations

import html
import math
import re
import subprocess
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree as ET

import numpy as np
import pytest

import fragfield
from burst_fenicsx.geometry import profile_from_table
from fragfield.case.conversion.rounds import burst_rounds, masses_of
from fragfield.numbers import number
from fragfield.report.figures.rounds import centre_of_mass, draw_round
from tests.fragfield.short_run import command, environment

CASES = Path(__file__).resolve().parents[2] / "cases"
CASE = """
[burst]
cell_size = "20 mm"
[[round]]
name = "first"
explosive = "tnt"
casing = "steel_m107"
profile = "tube"
position = ["0 m", "0 m", "1 m"]
"""


def m107():
    return burst_rounds(fragfield.Case.from_toml(CASES / "m107_tnt.toml").values)[0]


def words_of(item, expected=None) -> list[str]:
    return [html.unescape(words) for words in re.findall(r"<text[^>]*>([^<]*)</text>", draw_round(item, expected))]


def test_centre_of_mass_of_a_solid_cylinder_with_a_charge_in_half_of_it():
    """Casing of L and R about a charge from L/2 to the base: first moments of two cylinders, over their masses."""
    table = {
        "unit": "mm", "outer": {"points": [[0, 50], [400, 50]]}, "cavity": {"points": [[200, 30], [400, 30]]},
        "charge": {"front": 200},
    }  # fmt: skip
    item = replace(m107(), profile=profile_from_table(table, where="test"))
    steel, fill = item.casing.density, item.explosive.density
    whole, hole = math.pi * 0.05**2 * 0.4, math.pi * 0.03**2 * 0.2
    mass = steel * (whole - hole) + fill * hole
    assert masses_of(item).whole == pytest.approx(mass, rel=1e-9)
    moment = steel * (whole * 0.2 - hole * 0.3) + fill * hole * 0.3
    assert centre_of_mass(item) == pytest.approx(moment / mass, rel=1e-9)


def test_centre_of_mass_of_a_cone_lies_at_three_quarters_of_its_height():
    """A cone of steel from a nose of nearly no radius, with a charge too thin to matter."""
    table = {
        "unit": "mm", "outer": {"points": [[0, 0.001], [400, 80]]}, "cavity": {"points": [[100, 0.01], [399, 0.01]]},
        "charge": {"front": 100},
    }  # fmt: skip
    item = replace(m107(), profile=profile_from_table(table, where="test"))
    assert centre_of_mass(item) == pytest.approx(0.3, rel=1e-4)


def test_drawing_names_lengths_diameters_walls_and_masses():
    item = m107()
    words = words_of(item)
    section = item.profile.section(np.linspace(0.0, item.profile.length, 2001))
    assert f"length {1e3 * item.profile.length:.1f} mm" in words
    (diameters,) = (text for text in words if text.startswith("⌀"))
    widest = (2e3 * radius.max() for radius in (section.outer_radius, section.charge_radius))
    assert diameters == "⌀ {:.0f} mm, charge ⌀ {:.1f} mm".format(*widest)
    assert any(text.startswith("nose ⌀ 60.50 mm, base ⌀") for text in words)
    charge = item.profile.charge_end - item.profile.charge_front
    assert f"charge {1e3 * charge:.1f} mm" in words
    lengths = {f"{number(1e3 * (one.end - one.start))} mm" for one in item.profile.segments if one.name != "boat-tail"}
    assert lengths <= set(words)
    assert {"nose", "ogive", "front cylinder", "rear cylinder"} <= set(words)
    middles = [0.5 * (one.start + one.end) for one in item.profile.segments if one.kind == "wall"]
    drawn = [text for text in words if text.startswith("wall ")]
    assert len(drawn) >= 3
    assert set(drawn) <= {f"wall {number(1e3 * float(item.profile.section(at).wall))} mm" for at in middles}
    assert f"centre of mass {1e3 * centre_of_mass(item):.1f} mm" in words
    assert any("casing 34.53 kg (steel_m107), charge 6.863 kg" in text for text in words)


def test_drawing_compares_the_masses_with_those_of_the_rounds_own_drawing():
    item = m107()
    words = words_of(item, {"casing": 34.0, "charge": 6.863})
    (line,) = (text for text in words if text.startswith("By its drawing: "))
    masses = masses_of(item)
    assert f"casing 34 kg ({100.0 * (masses.casing / 34.0 - 1.0):+.2f} %)" in line
    assert "charge 6.863 kg (" in line


def test_check_writes_the_drawing_before_anything_is_computed(tmp_path):
    case = tmp_path / "case.toml"
    case.write_text(CASE)
    target = tmp_path / "round.svg"
    done = subprocess.run(
        command("check", case, "--drawing", target), capture_output=True, text=True, env=environment(), timeout=120,
        check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert f"drawing: {target}" in done.stdout.replace("\n", "")
    assert ET.fromstring(target.read_text(encoding="utf-8")).tag == "{http://www.w3.org/2000/svg}svg"
    with pytest.raises(fragfield.InputError, match=r"found round\.png; allowed: a name that ends in \.svg"):
        fragfield.check(case).draw(tmp_path / "round.png")


def test_different_rounds_have_a_drawing_each_and_alike_ones_share_it(tmp_path):
    case = tmp_path / "case.toml"
    second = CASE.partition("[[round]]")[2].replace("first", "second").replace('"0 m", "0 m"', '"1 m", "0 m"')
    third = second.replace("second", "third").replace("tube", "m107").replace('"1 m", "0 m"', '"2 m", "0 m"')
    case.write_text(f"{CASE}\n[[round]]{second}\n[[round]]{third}")
    written = fragfield.check(case).draw(tmp_path / "round.svg")
    assert [path.name for path in written] == ["round_1.svg", "round_2.svg"]
    assert len({path.read_bytes() for path in written}) == 2
