"""The report: one file that needs nothing else, true to the run's files, whole or in part."""

from __future__ import annotations

import base64
import json
import math
import re
from html.parser import HTMLParser
from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

import h5py
import numpy as np
import pytest

from fragfield.errors import InputError
from fragfield.files.stamped import stamped_toml
from fragfield.report import read_run, write_report
from fragfield.report.figures.burst import speed_along_round
from fragfield.report.figures.drawing import drawing_style, to_bytes
from fragfield.report.sections import sections
from tests.fragfield.synthetic_run import write_run

if TYPE_CHECKING:
    from pathlib import Path

FIGURES = [
    "drawing_1", "arrangement", "density_curve", "landing_map", "number_by_mass", "directions", "picture_of_fragments",
    "speed_along_round", "casing_over_time", "picture_of_burst", "energy_ledger", "polar_by_sector",
]  # fmt: skip
BODY = ["decision", "rounds", "hazard", "warnings", "fragments", "speeds", "convergence"]
ANNEXES = ["flight", "break-up", "burst", "validation", "provenance", "inputs"]
SECTIONS = [*BODY, *ANNEXES]
NO_CONTENT = {"meta", "link", "img", "source", "br"}


class Page(HTMLParser):
    """Collects what the tests ask of a page."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[tuple[str, dict[str, str | None]]] = []
        self.open: list[str] = []
        self.texts: list[str] = []
        self.feed(text)
        self.close()

    def handle_starttag(self, tag, attrs):
        """Note an element."""
        self.tags.append((tag, dict(attrs)))
        if tag not in NO_CONTENT:
            self.open.append(tag)

    def handle_endtag(self, tag):
        """Close the last one open."""
        assert self.open.pop() == tag, f"</{tag}> closes another element"

    def handle_data(self, data):
        """Note text, but for the style sheet."""
        if self.open and self.open[-1] != "style":
            self.texts.append(data)

    @property
    def text(self) -> str:
        """All text, spaces joined."""
        return re.sub(r"\s+", " ", " ".join(self.texts))

    def all(self, tag: str) -> list[dict[str, str | None]]:
        """Attributes of every element of that name."""
        return [attributes for name, attributes in self.tags if name == tag]


@pytest.fixture(scope="module")
def run(reported_pair) -> Path:
    return reported_pair


@pytest.fixture(scope="module")
def html(run) -> str:
    return (run / "report.html").read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def page(html) -> Page:
    return Page(html)


@pytest.fixture(scope="module")
def summary(run) -> dict:
    return json.loads((run / "summary.json").read_text(encoding="utf-8"))


def card(page: Page, label: str) -> str:
    """Value of a key number."""
    place = next(i for i, text in enumerate(page.texts) if text.strip() == label)
    return next(text.strip() for text in page.texts[place + 1 :] if text.strip())


def test_page_is_well_formed_and_in_order(page):
    assert page.open == []
    assert [attributes["id"] for attributes in page.all("section")] == SECTIONS
    assert [one["id"] for one in page.all("section") if one.get("class") == "annex"] == ANNEXES
    links = {str(attributes["href"]) for attributes in page.all("a")}
    assert links == {f"#{key}" for key in SECTIONS}


def test_the_first_page_says_what_how_far_why_and_who_signs(page):
    """In that order, and before the second section."""
    first = page.text.partition("Drawing of")[0]
    words = ("What was computed", "TNT, 9.29 kg", "upright, nose up", "12 mm; grid convergence", "Reasons to trust it",
             "Reasons against", "Computed by", "Reviewed by", "Approved by")  # fmt: skip
    places = [first.index(text) for text in words]
    assert places == sorted(places)
    assert "Computed: recommended distance" in first[: first.index("Reasons to trust it")]


def test_page_needs_nothing_else(html, page):
    assert not {tag for tag, _ in page.tags} & {"script", "link", "iframe", "object", "embed"}
    for tag, attributes in page.tags:
        for name in ("src", "srcset", "href", "data", "poster"):
            value = attributes.get(name) or "#"
            known = value.startswith(("data:image/", "#"))
            assert known, f"<{tag} {name}> leads to {value[:60]}"
    style = re.search(r"<style>(.*?)</style>", html, re.DOTALL)
    assert style is not None
    assert "url(" not in style[1]
    assert "@import" not in style[1]


def test_every_figure_is_there_once(page, run):
    assert [attributes["id"] for attributes in page.all("figure")] == [f"figure-{name}" for name in FIGURES]
    images = [attributes["src"] for attributes in page.all("img")]
    assert len(images) == len(set(images)) == len(FIGURES)
    assert all(attributes["alt"] for attributes in page.all("img"))
    for uri in images:
        kind, data = str(uri).removeprefix("data:image/").split(";base64,")
        content = base64.b64decode(data)
        if kind == "png":
            assert content.startswith(b"\x89PNG")
            continue
        root = ET.fromstring(content)
        links = {value for item in root.iter() for key, value in item.attrib.items() if key.endswith("href")}
        assert all(link.startswith(("#", "data:")) for link in links)
    for name in FIGURES:
        kind, mark = ("png", b"\x89PNG") if name.startswith("picture") else ("svg", b"<svg")
        assert mark in (run / "figures" / f"{name}.{kind}").read_bytes()


def test_numbers_are_those_of_the_summary(page, summary):
    hazard = summary["hazard"]
    assert card(page, "Computed: recommended distance") == str(math.ceil(hazard["recommended"]))
    texts = " ".join(page.texts)
    left_out = "grid (no other cell size gave a distance), inputs (no study of uncertain inputs)"
    parts = hazard["parts"]
    name = "quadrature" if parts["quadrature"] is not None else "randomness"
    label = {"quadrature": "points of the expected density", "randomness": "randomness of the break-up"}[name]
    words = f"expected distance {parts['expected']:.1f} m; added as squares: {label}"
    together = f"together {math.ceil(10.0 * hazard['recommended']) / 10.0:.1f} m"
    assert f"{words} {parts[name]:.1f} m; {together}; not included: {left_out}." in texts
    low, high = hazard["single_event"]["low"], hazard["single_event"]["high"]
    assert f"{round(low):,}\u00a0–\u00a0{round(high):,}" in texts


def test_a_distance_that_is_not_determined_is_said_in_place_of_a_number(tmp_path):
    folder = write_run(tmp_path / "run")
    found = json.loads((folder / "summary.json").read_text())
    reason = "3 % of the mass that could be hazardous has not landed"
    absent = ("recommended", "expected", "upper", "standard_error", "direction_deg", "single_event", "max_bias")
    found["hazard"] |= {"determined": False, "converged": False, "reason": reason, **dict.fromkeys(absent)}
    (folder / "summary.json").write_text(json.dumps(found))
    with h5py.File(folder / "ensemble.h5", "a") as file:
        file.attrs["undetermined"] = reason
    _, _, words = outline(folder)
    assert (
        "Card(label='Computed: recommended distance', value='not determined', unit='', note='3 % of the mass" in words
    )
    assert f"The distance is not determined: {reason}" in words
    assert "weight='stop'" in words


def test_the_tilt_of_the_realisations_stands_below_the_distance(tmp_path):
    folder = write_run(tmp_path / "run")
    for degrees, words in (
        (2.0, "tilted at random from the vertical, by a standard deviation of 2° about"),
        (0.0, None),
    ):
        found = json.loads((folder / "summary.json").read_text())
        found["break_up"]["tilt_deviation"] = math.radians(degrees)
        (folder / "summary.json").write_text(json.dumps(found))
        _, _, text = outline(folder)
        assert ("tilted at random" in text) == (words is not None)
        assert words is None or words in text


def test_title_is_shown_as_text(html, page):
    assert "<rounds>" not in html
    assert "Two <rounds> & a gap" in page.text


def outline(folder: Path) -> tuple[list[str], list[str], str]:
    """Keys of the sections, names of the figures that there is data for, and all words, without drawing to files."""
    run, names = read_run(folder), []

    def draw(name, title, caption, function):
        with drawing_style():
            if function(run) is not None:
                names.append(name)
        return []

    def picture(name, title, caption):
        names.append(name)
        return []

    parts = sections(run, draw, picture)
    return [part.key for part in parts], names, " ".join(str(block) for part in parts for block in part.blocks)


@pytest.mark.parametrize(
    ("stages", "missing", "figures"),
    [
        (0, "burst, break-up, flight", FIGURES[:2]),
        (1, "break-up, flight", [*FIGURES[:2], *FIGURES[7:11]]),
        (2, "flight", [*FIGURES[:2], *FIGURES[4:11]]),
        (3, "", FIGURES),
    ],
)
def test_missing_stages_are_said(tmp_path, stages, missing, figures):
    keys, names, words = outline(write_run(tmp_path / "run", stages=stages))
    of_stage = {"flight": 3, "break-up": 2, "burst": 1}
    assert keys == [key for key in SECTIONS if of_stage.get(key, 0) <= stages]
    assert names == figures
    assert (f"Not yet run: {missing}." in words) == bool(missing)
    for stage in ("burst", "break-up", "flight"):
        assert (f"the stage “{stage}” has not been run" in words) == (stage in missing.split(", "))


def test_flight_of_fragments_from_elsewhere(tmp_path):
    """Nothing of a burst is said to be missing, and nothing is stated of one."""
    folder = write_run(tmp_path / "run")
    for name in ("burst_snapshot.h5", "burst.xdmf"):
        (folder / name).unlink()
    found = json.loads((folder / "summary.json").read_text())
    del found["burst"], found["break_up"]
    found["flight"]["fragments_file"] = "arena_test.csv"
    (folder / "summary.json").write_text(json.dumps(found))
    keys, names, words = outline(folder)
    assert keys == [key for key in SECTIONS if key not in ("rounds", "speeds", "burst", "convergence")]
    assert names == [name for name in [*FIGURES[2:7], FIGURES[-1]] if name != "directions"]
    assert "of arena_test.csv; no burst was computed" in words
    said = words.partition("case.toml, as resolved")[0].partition("Comparisons that bear")[0]
    for false in ("Not yet run", "prescribed burn", "Every round is assumed", "leakage", "random break-up", "handed"):
        assert false not in said, false


def test_statements_are_of_the_case_at_hand(tmp_path):
    """One round on open ground, and two beside a barricade, on the same files."""
    folder = write_run(tmp_path / "run")
    _, _, alone = outline(folder)
    assert "nothing stops them: the case has no walls, barricades or buildings" in alone
    assert "Casings of neighbouring rounds" not in alone
    case = (folder / "case.toml").read_text().rpartition("\n# checksum")[0]
    bank = (
        '[[obstacle]]\nname = "bank"\nkind = "barricade"\nstart = ["-9 m", "12 m"]\nend = ["9 m", "12 m"]\n'
        'height = "3 m"\n[[plane]]\nname = "middle"\nkind = "symmetry"\nnormal = [1.0, 0.0, 0.0]\n'
        'point = ["-1 m", "0 m", "0 m"]\n'
    )
    (folder / "case.toml").write_text(stamped_toml(f"{case}\n{bank}"), encoding="utf-8")
    _, _, beside = outline(folder)
    assert "only what the case defines stops them: barricade “bank”" in beside
    assert "nothing stops them" not in beside
    assert "Casings of neighbouring rounds" in beside


def test_results_come_before_inputs(page):
    """The annex of inputs is the last section; the recommended distance stands on the first page."""
    assert page.text.index("Recommended distance") < page.text.rindex("Versions and files")
    assert page.text.rindex("Versions and files") < page.text.rindex("Inputs as resolved")
    assert "`" not in page.text.partition("case.toml, as resolved")[0]
    results = page.text.partition("Files of the run")[0]  # whose checksums may look like numbers
    # A revision of the source may look like one in its middle.
    assert not re.search(r"(?<!\w)\d+(\.\d+)?[eE][+-]?\d+(?!\w)", results)


def test_report_may_be_written_elsewhere_and_figures_repeat(tmp_path):
    folder = write_run(tmp_path / "run", stages=1)
    (tmp_path / "out").mkdir()
    assert write_report(folder, tmp_path / "out" / "report.html", pictures=False) == tmp_path / "out" / "report.html"
    assert not (folder / "report.html").exists()
    with drawing_style():
        figure = speed_along_round(read_run(folder))
        assert figure is not None
        again = to_bytes(figure, "svg")
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
        file["landing/status"][:] = 2
    _, names, _ = outline(folder)
    assert "landing_map" not in names
    assert "density_curve" not in names


def test_report_in_grey_keeps_lines_distinguishable():
    """Neighbouring styles differ in lightness or in dashes, so that a grey copy can be read."""
    from matplotlib.colors import to_rgb

    from fragfield.report.figures.drawing import LINES

    grey = [float(np.dot(to_rgb(style["color"]), (0.299, 0.587, 0.114))) for style in LINES]
    dashes = [str(style["linestyle"]) for style in LINES]
    assert len(set(dashes)) == len(LINES)
    assert max(grey) < 0.62, "a line too light to print"
