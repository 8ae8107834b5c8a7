"""The report: one file that needs nothing else, true to the run's files, whole or in part."""

from __future__ import annotations

import base64
import json
import math
import re
from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

import h5py
import numpy as np
import pytest

from fragfield.errors import InputError
from fragfield.files.run_directory import stamped_toml
from fragfield.interface.results import Run
from fragfield.report import write_report
from fragfield.report.figures.drawing import LINES
from fragfield.report.figures.registered import FIGURES
from tests.fragfield.plain_reports import Report, plain_report
from tests.fragfield.synthetic_run import write_run

if TYPE_CHECKING:
    from pathlib import Path

SHOWN = [
    "drawing_1", "plan", "elevation", "density_curve", "landing_map", "polar_by_sector", "number_by_mass",
    "picture_of_fragments", "speed_along_round", "casing_over_time", "picture_of_burst", "energy_ledger",
]  # fmt: skip
BODY = ["decision", "rounds", "hazard", "warnings", "fragments", "speeds", "convergence"]
ANNEXES = ["numbers", "validation", "provenance", "inputs"]


@pytest.fixture(scope="module")
def html(reported_pair) -> str:
    return (reported_pair / "report.html").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def page(html) -> Report:
    return Report(html)


def test_page_is_whole_and_in_order(html):
    body = re.search(r"(?s)<body>.*</body>", html)
    assert body is not None
    ET.fromstring(re.sub(r"<(img|br)\b([^>]*)>", r"<\1\2/>", body[0]))  # every element is closed, in order
    assert re.findall(r'<section id="([^"]+)"', html) == [*BODY, *ANNEXES]
    assert re.findall(r'<section id="([^"]+)" class="annex"', html) == ANNEXES
    assert re.findall(r'<a href="#([^"]+)"><span>([^<]+)', html) == [
        *((key, str(1 + place)) for place, key in enumerate(BODY)),
        *((key, "ABCD"[place]) for place, key in enumerate(ANNEXES)),
    ]


def test_the_first_page_says_what_how_far_why_and_who_signs(page):
    words = ("Computed: recommended distance", "What was computed", "TNT, 9.29 kg", "Attitude and height",
             "12 mm; grid convergence", "Reasons to trust it", "Reasons against", "Computed by", "Reviewed by",
             "Approved by")  # fmt: skip
    places = [page.sections["decision"].index(text) for text in words]
    assert places == sorted(places)


def test_page_needs_nothing_else(html):
    assert not re.search(r"<(script|link|iframe|object|embed)\b", html)
    for value in re.findall(r'(?:src|srcset|href|data|poster)="([^"]*)"', html):
        assert value.startswith(("data:image/", "#")), value[:60]
    assert "url(" not in html.partition("</style>")[0]
    assert "@import" not in html.partition("</style>")[0]


def test_every_figure_is_there_once(html, reported_pair):
    assert re.findall(r'<figure id="figure-([^"]+)"', html) == SHOWN
    assert re.findall(r"<strong>Figure (\d+)\.", html) == [str(1 + place) for place in range(len(SHOWN))]
    images = re.findall(r'<img src="data:image/([^;]+);base64,([^"]+)" alt="[^"]+"', html)
    assert len(images) == len(set(images)) == len(SHOWN)
    for name, (kind, data) in zip(SHOWN, images, strict=True):
        content = base64.b64decode(data)
        assert (reported_pair / "figures" / f"{name}.{kind.partition('+')[0]}").read_bytes() == content
        if kind == "png":
            assert content.startswith(b"\x89PNG")
            continue
        links = {value for item in ET.fromstring(content).iter() for key, value in item.attrib.items()
                 if key.endswith("href")}  # fmt: skip
        assert all(link.startswith(("#", "data:")) for link in links)


def test_numbers_are_those_of_the_summary(page, reported_pair):
    hazard = json.loads((reported_pair / "summary.json").read_text(encoding="utf-8"))["hazard"]
    assert page.card("Computed: recommended distance") == str(math.ceil(hazard["recommended"]))
    left_out = "grid (no other cell size gave a distance), inputs (no study of uncertain inputs)"
    parts = hazard["parts"]
    name = "quadrature" if parts["quadrature"] is not None else "randomness"
    label = {"quadrature": "points of the expected density", "randomness": "randomness of the break-up"}[name]
    words = f"expected distance {parts['expected']:.1f} m; added as squares: {label}"
    together = f"together {math.ceil(10.0 * hazard['recommended']) / 10.0:.1f} m"
    assert f"{words} {parts[name]:.1f} m; {together}; not included: {left_out}." in page.sections["decision"]
    low, high = hazard["single_event"]["low"], hazard["single_event"]["high"]
    assert f"{round(low):,} – {round(high):,}" in page.sections["hazard"]


def changed(folder: Path, **parts: dict) -> Path:
    """Change parts of a run's summary."""
    found = json.loads((folder / "summary.json").read_text())
    for name, values in parts.items():
        found[name] |= values
    (folder / "summary.json").write_text(json.dumps(found))
    return folder


def test_a_distance_that_is_not_determined_is_said_in_place_of_a_number(tmp_path):
    reason = "3 % of the mass that could be hazardous has not landed"
    absent = ("recommended", "expected", "upper", "standard_error", "direction_deg", "single_event", "max_bias")
    undetermined = {"determined": False, "converged": False, "reason": reason, **dict.fromkeys(absent)}
    folder = changed(write_run(tmp_path / "run"), hazard=undetermined)
    with h5py.File(folder / "ensemble.h5", "a") as file:
        file.attrs["undetermined"] = reason
    page = plain_report(folder)
    assert f"Computed: recommended distance not determined {reason}" in page.sections["decision"]
    assert ("stop", f"The distance is not determined: {reason}.") in page.findings


def test_the_tilt_of_the_realisations_stands_below_the_distance(tmp_path):
    folder = write_run(tmp_path / "run")
    words = "tilted at random from the vertical, by a standard deviation of 2° about"
    for degrees, shown in ((2.0, True), (0.0, False)):
        page = plain_report(changed(folder, break_up={"tilt_deviation": math.radians(degrees)}))
        assert (words in page.sections["hazard"]) == shown
        assert ("tilted at random" in page.text) == shown


def test_title_is_shown_as_text(html, page):
    assert "<rounds>" not in html
    assert "Two <rounds> & a gap" in page.text


@pytest.mark.parametrize(
    ("stages", "missing"), [(0, "burst, break-up, flight"), (1, "break-up, flight"), (2, "flight"), (3, "")]
)
def test_missing_stages_are_said(tmp_path, stages, missing):
    page = plain_report(write_run(tmp_path / "run", stages=stages))
    assert list(page.sections) == [key for key in [*BODY, *ANNEXES] if key != "numbers" or stages]
    assert (f"Not yet run: {missing}." in page.text) == bool(missing)
    for stage in ("burst", "break-up", "flight"):
        assert (f"the stage “{stage}” has not been run" in page.text) == (stage in missing.split(", "))


@pytest.mark.parametrize("stages", [0, 1, 2])
def test_figures_without_data_are_left_out(tmp_path, stages):
    of_stage = {"density_curve": 3, "landing_map": 3, "polar_by_sector": 3, "number_by_mass": 2,
                "picture_of_fragments": 2,
                "speed_along_round": 1, "casing_over_time": 1, "picture_of_burst": 1, "energy_ledger": 1}  # fmt: skip
    write_report(write_run(tmp_path / "run", stages=stages))
    drawn = {path.stem for path in (tmp_path / "run" / "figures").iterdir()}
    assert drawn == {name for name in SHOWN if of_stage.get(name, 0) <= stages}


def test_flight_of_fragments_from_elsewhere(tmp_path):
    """Nothing of a burst is said to be missing, and nothing is stated of one."""
    folder = write_run(tmp_path / "run")
    for name in ("burst_snapshot.h5", "burst.xdmf"):
        (folder / name).unlink()
    found = json.loads((folder / "summary.json").read_text())
    del found["burst"], found["break_up"]
    found["flight"]["fragments_file"] = "arena_test.csv"
    (folder / "summary.json").write_text(json.dumps(found))
    page = plain_report(folder)
    assert list(page.sections) == [key for key in [*BODY, *ANNEXES] if key not in ("rounds", "speeds", "convergence")]
    assert "of arena_test.csv; no burst was computed" in page.sections["decision"]
    said = page.text.partition("case.toml, as resolved")[0].partition("Comparisons that bear")[0]
    for false in ("Not yet run", "prescribed burn", "Every round is assumed", "leakage", "random break-up", "handed"):
        assert false not in said, false


def test_statements_are_of_the_case_at_hand(tmp_path):
    """One round on open ground, and two beside a barricade, on the same files."""
    folder = write_run(tmp_path / "run")
    alone = plain_report(folder).text
    assert "nothing stops them: the case has no walls, barricades or buildings" in alone
    assert "Casings of neighbouring rounds" not in alone
    case = (folder / "case.toml").read_text().rpartition("\n# checksum")[0]
    bank = (
        '[[obstacle]]\nname = "bank"\nkind = "barricade"\nstart = ["-9 m", "12 m"]\nend = ["9 m", "12 m"]\n'
        'height = "3 m"\n[[plane]]\nname = "middle"\nkind = "symmetry"\nnormal = [1.0, 0.0, 0.0]\n'
        'point = ["-1 m", "0 m", "0 m"]\n'
    )
    (folder / "case.toml").write_text(stamped_toml(f"{case}\n{bank}"), encoding="utf-8")
    beside = plain_report(folder).text
    assert "only what the case defines stops them: barricade “bank”" in beside
    assert "nothing stops them" not in beside
    assert "Casings of neighbouring rounds" in beside


def test_numbers_are_written_for_readers_and_words_without_marks(page):
    assert "`" not in page.text.partition("case.toml, as resolved")[0]
    results = page.text.partition("Files of the run")[0]  # whose checksums may look like numbers
    # A revision of the source may look like one in its middle.
    assert not re.search(r"(?<!\w)\d+(\.\d+)?[eE][+-]?\d+(?!\w)", results)


def test_report_may_be_written_elsewhere_and_figures_repeat(tmp_path):
    folder = write_run(tmp_path / "run", stages=1)
    (tmp_path / "out").mkdir()
    assert write_report(folder, tmp_path / "out" / "report.html") == tmp_path / "out" / "report.html"
    assert not (folder / "report.html").exists()
    again = FIGURES["speed_along_round"].svg(Run(folder))
    assert (tmp_path / "out" / "figures" / "speed_along_round.svg").read_bytes() == again


def test_damaged_and_foreign_input_is_named(tmp_path):
    with pytest.raises(InputError, match="nowhere: no such run directory"):
        write_report(tmp_path / "nowhere")
    with pytest.raises(InputError, match="not a run directory, it contains none of the files"):
        write_report(tmp_path)
    folder = write_run(tmp_path / "run")
    whole = (folder / "burst_snapshot.h5").read_bytes()
    (folder / "burst_snapshot.h5").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(InputError, match=r"burst_snapshot\.h5: cut off, or not an HDF5 file"):
        write_report(folder)
    with h5py.File(folder / "burst_snapshot.h5", "w") as file:
        file.attrs["time"] = 1.0
    with pytest.raises(InputError, match=r"burst_snapshot\.h5: not a complete burst snapshot.*run `fragfield burst`"):
        write_report(folder)
    (folder / "summary.json").write_text('{"burst": ', encoding="utf-8")
    with pytest.raises(InputError, match=r"summary\.json: damaged"):
        write_report(folder)


def test_nothing_landed_is_no_fault(tmp_path):
    folder = write_run(tmp_path / "run")
    with h5py.File(folder / "landing.h5", "a") as file:
        rows = file["landing"][()]
        rows["status"] = 2
        file["landing"][...] = rows
    run = Run(folder)
    assert FIGURES["landing_map"].svg(run) is None
    assert FIGURES["density_curve"].svg(run) is None
    assert "decision" in plain_report(folder).sections


def test_report_in_grey_keeps_lines_distinguishable():
    """Neighbouring styles differ in lightness or in dashes, so that a grey copy can be read."""
    from matplotlib.colors import to_rgb

    grey = [float(np.dot(to_rgb(style["color"]), (0.299, 0.587, 0.114))) for style in LINES]
    assert len({str(style["linestyle"]) for style in LINES}) == len(LINES)
    assert max(grey) < 0.62, "a line too light to print"
