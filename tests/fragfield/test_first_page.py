"""What stands on the first page and in `check`: the same doubts, one wall, wind and air, names, reasons that fit."""

from __future__ import annotations

import math
import re
from dataclasses import replace

import numpy as np
import pytest

import fragfield
from burst_fenicsx.geometry import Profile
from fragfield.case import load_case
from fragfield.case.conversion.rounds import burst_rounds
from fragfield.case.conversion.surroundings import air_words, wind_words
from fragfield.checking.case_warnings import doubts, thinnest_wall
from fragfield.hazard.recommended import recommended_of
from fragfield.hazard.verdict import part_text
from fragfield.interface.results import Run
from fragfield.report.figures.drawing import drawing_style, new_figure, plain_name
from fragfield.report.figures.registered import FIGURES
from fragfield.report.findings import convergence_findings
from fragfield.report.statements import reasons_for
from fragfield.results.convergence import Convergence
from fragfield.results.hazard import Hazard
from fragfield.results.site import ExposedSite
from fragfield.results.summary import Summary
from fragfield.results.words import certainty, parts_words, single_note
from tests.fragfield.example_results import example
from tests.fragfield.plain_reports import leave_out_figures
from tests.fragfield.short_run import RINGS, ROOT, invoke
from tests.fragfield.synthetic_run import run_of, write_run

SITE = """
[flight.wind]
model = "power_law"
speed = "20 m/s"
towards = "90 deg"
[site]
latitude = "51.5 deg"
longitude = "7 deg"
bearing = "0 deg"
[[exposed]]
name = "store A, rent 5 $ to 6 $"
position = ["40 m", "0 m"]
[[exposed]]
name = "lot $a^{b$"
position = ["0 m", "40 m"]
[[exposed]]
name = "학교"
position = ["-40 m", "0 m"]
"""


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("first_page")
    (folder / "case.toml").write_text(RINGS + SITE, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patch:
        leave_out_figures(patch)
        done = invoke("run", folder / "case.toml", "--out", folder / "run")
    assert done.exit_code in (0, 3), done.stderr
    return folder / "run", done.stdout


def test_check_and_report_have_the_same_doubts_and_run_prints_them(run):
    folder, printed = run
    warned = fragfield.check(folder / "case.toml").warnings
    (thin,) = [words for words in warned if words.startswith("the thinnest wall")]
    assert "22.5 mm at 0 mm from the nose, is 1.9 cells of 12 mm thick; 3 or more" in thin
    assert thin.endswith("set burst.cell_size to 7.5 mm or less")
    in_report = fragfield.open(folder).warnings
    doubted = list(doubts(load_case(folder / "case.toml")))
    assert thin in doubted
    assert set(doubted) <= set(warned)
    assert all(any(words[1:] in one for one in in_report) for words in doubted)
    assert all(words in printed.splitlines() for words in in_report)


@pytest.mark.parametrize(("size", "doubted"), [("7.5 mm", False), ("7.6 mm", True)])
def test_the_advice_on_cells_ends_where_the_wall_has_three(tmp_path, size, doubted):
    (tmp_path / "case.toml").write_text(RINGS.replace('cell_size = "12 mm"', f'cell_size = "{size}"'), encoding="utf-8")
    assert any("thinnest wall" in words for words in doubts(load_case(tmp_path / "case.toml"))) == doubted


def test_the_thinnest_wall_is_that_of_the_contour_wherever_it_lies():
    m107 = burst_rounds(load_case(ROOT / "cases" / "m107_tnt.toml"))[0].profile
    wall, station = thinnest_wall(m107)
    assert isinstance(m107, Profile)
    assert float(m107.section(station).wall) == wall
    charge = np.linspace(m107.charge_front, m107.charge_end, 5001)
    assert wall == pytest.approx(float(m107.section(charge).wall.min()), rel=1e-4)
    assert f"{1e3 * wall:.1f}" == "17.3"


def test_the_mean_walls_of_check_are_those_that_the_burst_records(run):
    folder, _ = run
    (round_,) = fragfield.check(folder / "case.toml").found.rounds
    recorded = Run(folder).rounds[0].segments
    assert [one.mean_wall for one in round_.segments] == pytest.approx(recorded["wall_thickness"].tolist(), rel=1e-9)


def test_wind_air_and_every_direction_are_given_by_bearing_where_there_is_a_site(run):
    folder, _ = run
    case = load_case(folder / "case.toml")  # x points north, so that the azimuth of 90 degrees is west
    assert wind_words(case) == "20 m/s towards bearing 270° (W) at 10 m, power law"
    assert air_words(case) == "standard atmosphere, 15 °C and 1.225 kg/m³ on the ground, 0 m above sea level"
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert wind_words(case) in page
    assert air_words(case) in page
    text = re.sub(r"<[^>]+>", " ", re.sub(r"(?s)<(style|script|svg).*?</\1>", " ", page))
    assert "bearing 270° (W)" in text.partition("Inputs as resolved")[2]
    assert not re.search(r"azimuth \d", text)
    checked = invoke("check", folder / "case.toml").stdout.splitlines()
    assert f"wind: {wind_words(case)}" in checked
    assert f"air: {air_words(case)}" in checked


@pytest.mark.parametrize(
    ("flight", "wind", "air"),
    [
        ({}, "none", "standard atmosphere, 15 °C and 1.225 kg/m³ on the ground, 0 m above sea level"),
        (
            {"wind.speed": "5 m/s", "wind.towards": "90 deg", "air.altitude": "1000 m"},
            "5 m/s towards azimuth 90° at all heights",
            "standard atmosphere, 9 °C and 1.112 kg/m³ on the ground, 1000 m above sea level",
        ),
        (
            {"air.model": "constant", "air.density": "1.4 kg/m^3", "air.sound_speed": "319 m/s"},
            "none",
            "1.4 kg/m³ everywhere, speed of sound 319 m/s (air of -20 °C)",
        ),
    ],
)
def test_wind_and_air_without_a_site(tmp_path, flight, wind, air):
    (tmp_path / "case.toml").write_text(RINGS, encoding="utf-8")
    changes = {f"flight.{key}": value for key, value in flight.items()}
    case = fragfield.Case.from_toml(tmp_path / "case.toml", set=changes).values
    assert (wind_words(case), air_words(case)) == (wind, air)


def test_names_are_neither_mathematics_nor_boxes():
    for name in ("rent 5 $ to 6 $", "lot $a^{b$", "$", r"a\$b$"):
        with drawing_style():
            figure, (axis,) = new_figure(height=1.0)
            text = axis.set_title(plain_name(name))
            figure.canvas.draw()
            drawn = text._preprocess_math(text.get_text())  # what is drawn, and whether as mathematics
        assert drawn[1] is False
        assert drawn[0].replace("\\", "") == name.replace("\\", "")
    with drawing_style():
        korean, chinese, private = (plain_name(name) for name in ("학교", "学校", "shed \U0010f123"))
    assert korean != chinese
    assert private == "shed [10F123]"  # of private use: no font has it
    with drawing_style():
        assert plain_name("Haus 1, côté – Ω") == "Haus 1, côté – Ω"


def test_figures_with_such_names_are_drawn(run):
    read = Run(run[0])
    assert b"<svg" in FIGURES["site_map"].svg(read)


def test_a_comparison_of_a_single_round_is_no_reason_to_trust_a_stack(tmp_path):
    single, pair = (Run(write_run(tmp_path / str(rounds), rounds=rounds)) for rounds in (1, 2))
    assert reasons_for(single)[0].startswith("Validation ")
    assert not any(words in " ".join(reasons_for(pair)) for words in ("m107_1944", "polar_zones", "copper_cylinder"))
    assert "paper_3_2" not in " ".join(reasons_for(pair)), "off by 78 % in one of seven numbers"


@pytest.mark.parametrize(
    ("bound", "words"), [(None, "–"), (0.0, "0"), (0.8912, "0.90"), (1.0003, "1.1"), (143.0, "150"), (2.0e-6, "2")]
)
def test_a_part_of_the_limit_is_rounded_up_in_every_view(bound, words):
    limit = 1e-6 if bound == 2.0e-6 else 1.0
    density = None if bound is None else {"expected": 0.5 * bound, "upper": bound}
    criterion = {"quantity": "density", "limit": limit}
    site = example(ExposedSite, criterion=criterion, density_normal=density, density_ground=None)
    assert part_text(site) == words


def finding(kind: str, width: float, **hazard: object) -> str:
    convergence = {"reason": "", "quantities": {"expected_distance": {"uncertainty": width, "kind": kind}}}
    known = {"determined": True, "expected": 100.0, "tolerance": 0.02, **hazard}
    (found,) = convergence_findings(run_of(summary=example(Summary, convergence=convergence, hazard=known)))
    return f"{found.weight}: {found.text}"


@pytest.mark.parametrize(
    ("kind", "words"),
    [
        ("statistical", "more realisations reduce it (a smaller hazard.tolerance) and smaller cells do not"),
        ("monotone", "smaller cells reduce it (burst.cell_size)"),
        ("oscillating", "a further size need not reduce it"),
    ],
)
def test_the_advice_on_the_grid_is_what_the_numbers_show(kind, words):
    assert finding(kind, 12.0).startswith("warning: ")
    assert words in finding(kind, 12.0)
    assert finding(kind, 5.9).startswith("good: ")


def test_the_advice_on_realisations_is_above_the_maximum_already_set():
    hazard = example(
        Hazard, determined=True, converged=False, realisations=500, more_realisations=True, expected=100.0,
        standard_error=2.1, max_bias=0.0, tolerance=0.02, method="realisations",
    )  # fmt: skip
    assert certainty(hazard).endswith("fix the expected distance to 2.1 % (standard error), not to 2 %; "
                                      "set hazard.max_realisations above 500")  # fmt: skip


def test_single_events_are_no_distance_to_keep_for_the_true_reason():
    hazard = example(Hazard, single_event={"realisations": 60}, basis="worst_direction")
    assert single_note(hazard) == "no distance to keep: each of 60 events alone in its own worst direction"
    assert single_note(replace(hazard, basis="all_azimuths")) == "no distance to keep: each of 60 events alone"


@pytest.mark.parametrize("expected", [132.3, 100.04, 99.96])
def test_printed_parts_add_up_to_the_printed_distance(expected):
    hazard = example(Hazard, determined=True, expected=expected, upper=expected + 2.44, method="realisations")
    grid = example(Convergence, quantities={"expected_distance": {"uncertainty": 12.24}})
    found = recommended_of(hazard, grid)
    words = parts_words(found)
    base, randomness, width, together = (float(number) for number in re.findall(r"([0-9.]+) m\b", words))
    assert together == pytest.approx(base + math.hypot(randomness, width), abs=0.2)
    assert math.ceil(together) == math.ceil(found.recommended)
    assert found.parts.expected == expected
