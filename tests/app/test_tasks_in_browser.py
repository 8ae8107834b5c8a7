"""Whole tasks, from an empty folder to their result, as their users do them, in Chromium."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from burst_fenicsx.geometry import load_profile
from fragfield.app.fields import page_texts
from fragfield.app.pages.result import Directions
from fragfield.case import load_case
from tests.app.conftest import PATIENCE, small, wait_for
from tests.fragfield.drawn_shells import write_dxf
from tests.fragfield.short_run import invoke

pytestmark = [pytest.mark.slow, pytest.mark.cores]

ARENA = """Arenasprengung Nr. 12;;;;;;
Polarwinkel von (°);Polarwinkel bis (°);Masse von (g);Masse bis (g);Stück;Masse mittel;v mittel (m/s)
0;60;1;10;40;4,200;720
60;85;1;10;510;3,900;905
60;85;10;200;150;31,500;880
85;105;1;10;1704;3,800;1190
85;105;10;200;590;34,100;1165
105;180;1;10;88;4,400;410
Summe;;;;3082;;
"""
"""33.9 kg of the 34.5 kg of an M107's casing; no cell shows what the comma is, and the mean mass has no unit."""


def new_case(application, template, name):
    """A case from a template of the first page, which leads to the page that comes next."""
    page = application.page()
    page.get_by_text(template).click()
    page.locator("[data-key=new-name]").fill(name)
    page.locator("#make").click()
    page.wait_for_url(f"**case={name}.toml")
    page.wait_for_selector(".content")
    return page


def choose(page, label, word):
    """Choose a word in the last box of a label."""
    page.get_by_role("combobox", name=label, exact=True).last.click()
    page.locator(".q-menu .q-item").get_by_text(word, exact=True).click()
    page.locator(".q-menu").wait_for(state="detached")


def run_to_its_end(page, seconds):
    """Follow the newest job of page 6, whose log is the message of a failure."""
    page.wait_for_selector("[data-box=queue] > .job:first-child:is(.done, .failed)", timeout=1000 * seconds * PATIENCE)
    newest = page.locator("[data-box=queue] > .job").first
    assert newest.get_attribute("data-state") == "done", newest.inner_text()
    return newest


def test_own_round_from_a_drawing_to_a_signed_pdf(application, tmp_path_factory):
    """A DXF of the 105 mm M1 is brought in, drawn, run while the server is killed, read, signed and printed."""
    drawing = write_dxf(tmp_path_factory.mktemp("drawings") / "M1 half section.dxf")
    application.start()
    page = application.page()
    with page.expect_navigation():  # the page is shown again, with the file in the folder
        page.locator("input[type=file]").set_input_files(drawing)
    assert (application.folder / "M1_half_section.dxf").read_bytes() == drawing.read_bytes()
    page.get_by_text("A round of my own drawing").click()
    page.locator("[data-key=new-name]").fill("Mein Geschoß")
    page.locator("#make").click()
    page.wait_for_url("**/round?**")
    wait_for(page, "260", at="table.facts")
    page.get_by_label("How it is read").fill("charge_front=50 mm, fuze=0.192 kg")
    page.locator("[data-act=take-file]").click()
    wait_for(page, "383.4 × ⌀ 104.8 mm", at="table.facts")
    assert "nose left, the narrower end" in page.locator(".q-notification").inner_text()
    page.get_by_role("button", name="Diameters", exact=True).click()
    page.wait_for_function("document.querySelector('[data-cell=outer-1-1]').value === '104.8'")
    widest = max(page.locator("[data-cell^=outer-][data-cell$='-1']").all(), key=lambda one: float(one.input_value()))
    assert float(widest.input_value()) == pytest.approx(2e3 * load_profile("m1_105").max_radius, abs=0.01)
    value = widest.input_value()
    widest.fill("wide")
    page.wait_for_selector(".contour.has-fault")
    widest.fill(value.replace(".", ","))
    page.wait_for_selector(".contour.has-fault", state="detached")
    name = "Mein_Geschoß.toml"
    page.goto(f"{application.base}/confidence?case={name}")
    page.locator('[data-key="document.prepared_by"]').fill("A. Person")
    page.wait_for_timeout(1000 * PATIENCE)
    page.goto(f"{application.base}/run?case={name}")
    page.wait_for_selector("[data-box=findings]")
    page.locator("[data-preset=quick]").click()
    page.wait_for_function("document.querySelector('[data-key=\"burst.cell_size\"]')?.value.startsWith('8')")
    page.wait_for_selector("[data-box=findings]")
    page.locator("[data-act=start]").click()
    page.wait_for_selector("[data-state=running]")
    application.stop(kill=True)  # and nothing is lost
    page.close()
    application.start()
    page = application.page(f"/run?case={name}")
    run_to_its_end(page, 500)
    run = application.folder / "runs" / "Mein_Geschoß"
    assert load_case(run / "case.toml").round[0].profile["charge"]["front"] == pytest.approx(50.0)
    page.goto(f"{application.base}/result?case={name}")
    shown = page.locator("[data-box=recommended]").inner_text()
    assert int(re.sub(r"\D", "", shown)) == -int(-_summary(run)["hazard"]["recommended"] // 1)
    page.goto(f"{application.base}/confidence?case={name}")
    page.locator("[data-act=sign]").click()
    wait_for(page, "A. Person", at="[data-box=signed]")
    printed = application.folder / "report.pdf"
    alone = application.page("/files/runs/Mein_Gescho%C3%9F/report.html")
    alone.pdf(path=str(printed))
    assert printed.read_bytes().startswith(b"%PDF")
    assert len(re.findall(rb"/Type\s*/Page\b", printed.read_bytes())) > 3
    signed = {file: file.read_bytes() for file in run.rglob("*") if file.is_file()}
    for words in (("run", "--overwrite"), ("fly",), ("report",)):  # locked for the command line
        done = invoke(words[0], application.folder / name, "--out", run, *words[1:])
        assert done.exit_code == 2
        assert "was signed by A. Person" in done.stderr
    page.goto(f"{application.base}/run?case={name}")  # and for the pages
    page.wait_for_selector("[data-box=findings]")
    page.locator("[data-act=again]").click()
    page.get_by_text("was signed by A. Person").wait_for()
    assert {file: file.read_bytes() for file in run.rglob("*") if file.is_file()} == signed
    page.goto(f"{application.base}/confidence?case={name}")
    page.locator("[data-act=withdraw]").click()
    page.locator("[data-act=sign]").wait_for()
    assert not (run / "signature.json").exists()


def test_an_arena_table_with_decimal_commas_is_imported_and_flown(application):
    (application.folder / "Arena 12.csv").write_bytes(ARENA.encode("cp1252"))
    application.start()
    page = new_case(application, "An arena test", "arena_12")
    page.locator("[data-act=read-table]").click()
    page.get_by_role("button", name="comma", exact=True).click()
    page.get_by_role("button", name="mass=g", exact=True).click()
    wait_for(page, "pieces: 3082", at="[data-box=imported]")
    words = page.locator("[data-box=imported]").inner_text()
    assert "encoding: cp1252" in words
    assert "mass of the casing: 34.53 kg" in words
    assert "of it recovered: 98.1%" in words
    page.locator("[data-act=write-table]").click()
    page.wait_for_function("document.querySelector('[data-act=write-table]') === null")
    choose(page, "Table", "Arena_12_arena.csv")
    page.locator("[data-act=check-file]").click()
    page.get_by_role("img", name="Number by polar zone").wait_for()
    assert "3,082" in page.locator("table.facts").inner_text()
    page.locator("[data-act=fly-file]").click()
    page.wait_for_url("**/run?**")
    run_to_its_end(page, 400).get_by_role("link").click()
    page.wait_for_selector("[data-box=recommended]")
    run = application.folder / "runs" / "arena_12_Arena_12_arena"
    summary = json.loads((run / "summary.json").read_text(encoding="utf-8"))
    assert "burst" not in summary or not summary["burst"]
    shown = page.locator("[data-box=recommended]").inner_text()
    assert int(re.sub(r"\D", "", shown)) == -int(-summary["hazard"]["recommended"] // 1) > 100


def heights(path):
    """A plain that rises by 2 % to the north, as a grid of 50 m about the origin."""
    side, cell = 61, 50.0
    head = f"ncols {side}\nnrows {side}\nxllcorner {-0.5 * side * cell}\nyllcorner {-0.5 * side * cell}\n"
    rows = [" ".join([f"{100.0 - 0.02 * cell * (row - side // 2):.1f}"] * side) for row in range(side)]
    path.write_text(f"{head}cellsize {cell}\nnodata_value -9999\n" + "\n".join(rows) + "\n", encoding="ascii")


def drag(page, name, right, down):
    """Drag the first mark of a place on the map, by pixels."""
    page.locator(f"#site-map .handle[aria-label^='{name}']").first.scroll_into_view_if_needed()
    page.wait_for_timeout(1500 * PATIENCE)
    box = page.locator(f"#site-map .handle[aria-label^='{name}']").first.bounding_box()
    x, y = box["x"] + 0.5 * box["width"], box["y"] + 0.5 * box["height"]
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + right, y + down, steps=5)
    page.mouse.up()
    page.wait_for_timeout(1500 * PATIENCE)


def verdicts(page):
    """What page 7 says of each place."""
    rows = page.locator("table.facts:has(.verdict) tr:has(.verdict)").all()
    return {row.locator("th, td").first.inner_text(): row.locator(".verdict").inner_text() for row in rows}


def test_four_shells_at_a_workshop_on_terrain(application):
    """Placed, run, and after a place was moved flown again without another burst."""
    heights(application.folder / "plain.asc")
    application.start()
    page = new_case(application, "A row of four at a workshop and a road", "four")
    page.wait_for_url("**/site?**")
    for name in ("person", "barricade"):
        page.locator(f"[data-add={name}]").click()
    drag(page, "barricade", 0, -30)  # its bank now lies over the rounds, which is said above the map
    wait_for(page, "4 rounds start inside it", at=".faults")
    drag(page, "barricade", -10, 45)
    page.wait_for_selector(".faults .fault", state="detached")
    drag(page, "person", 25, 0)
    box = page.get_by_role("combobox", name="map of heights").last
    box.fill("plain.asc")
    box.press("Enter")
    wait_for(page, "heights -30 to 30 m", at="body")
    page.goto(f"{application.base}/run?case=four.toml")
    page.wait_for_selector("[data-box=findings]")
    page.locator("[data-preset=quick]").click()
    page.wait_for_function("document.querySelector('[data-key=\"burst.cell_size\"]')?.value === '12 mm'")
    page.locator('[data-key="burst.cell_size"]').fill("16 mm")
    wait_for(page, "cells of 16 mm", at="[data-box=findings]")
    assert "Error" not in page.locator("[data-box=findings]").inner_text()
    page.locator("[data-act=start]").click()
    run_to_its_end(page, 400).get_by_role("link").click()
    page.wait_for_selector("[data-box=recommended]")
    before = verdicts(page)
    assert set(before) == {"workshop", "road", "person 3"}
    run = application.folder / "runs" / "four"
    case = load_case(run / "case.toml")
    assert len(case.round) == 4
    assert [one.kind for one in case.obstacle] == ["building", "barricade"]
    assert Path(case.flight.ground.map).name == "plain.asc"
    _look_along(page, run, 40.0)
    burst, person, first = _burst(run), case.exposed[2].position, _summary(run)["exposed"][2]
    page.goto(f"{application.base}/site?case=four.toml")
    page.wait_for_selector("#site-map .handle")
    page.get_by_role("button", name="Zoom out").click(click_count=3)
    drag(page, "person", 250, -200)
    page.goto(f"{application.base}/result?case=four.toml")
    page.get_by_role("tab", name="Map").click()
    page.locator("[data-act=fly]").click()
    page.wait_for_url("**/run?**")
    page.wait_for_selector("[data-box=queue] > .job:nth-child(2)")
    run_to_its_end(page, 400).get_by_role("link").click()
    page.wait_for_selector("[data-box=recommended]")
    assert _burst(run) == burst
    there = load_case(run / "case.toml").exposed[2].position
    assert max(abs(new - old) for new, old in zip(there, person, strict=True)) > 100.0
    after = {one["name"]: one["verdict"] for one in _summary(run)["exposed"]}
    assert verdicts(page) == after
    assert before["person 3"] != "met"
    moved = _summary(run)["exposed"][2]
    assert moved["distance"] > 100.0 + first["distance"]
    assert moved["expected_hits"]["upper"] < first["expected_hits"]["upper"]


def _look_along(page, run, azimuth):
    """The density along a chosen direction, as the run holds it."""
    page.get_by_role("tab", name="Directions").click()
    known = Directions.of(run)
    assert known.differ
    page.locator("[data-key=azimuth]").fill(f"{azimuth:g}")
    for _, words in known.facts(azimuth, page_texts()):
        wait_for(page, words, at=".q-tab-panel table.facts")
    curve = page.locator(".q-tab-panel polyline.normal-curve").get_attribute("points")
    assert curve in known.svg(azimuth, page_texts())
    assert curve not in known.svg(known.deciding, page_texts())


def _summary(run):
    return json.loads((run / "summary.json").read_text(encoding="utf-8"))


def _expected(run):
    return _summary(run)["hazard"]["expected"]


def _burst(run):
    """Name, size and time of every file that a burst writes."""
    return {one.name: (one.stat().st_size, one.stat().st_mtime_ns) for one in run.glob("burst*") if one.is_file()}


def test_uncertainty_with_sixty_samples(application):
    """A shell at the cells of the quick preset, its run sampled from page 8, to the shares of the inputs."""
    application.start()
    page = new_case(application, "One round (M107, TNT)", "one")
    page.goto(f"{application.base}/run?case=one.toml")
    page.wait_for_selector("[data-box=findings]")
    page.locator("[data-preset=quick]").click()
    page.wait_for_function("document.querySelector('[data-key=\"burst.cell_size\"]')?.value === '12 mm'")
    page.wait_for_selector("[data-box=findings]")
    page.locator("[data-act=start]").click()
    run_to_its_end(page, 400)
    page.goto(f"{application.base}/confidence?case=one.toml")
    assert page.get_by_role("spinbutton", name="Samples").input_value() == "60"
    page.locator("[data-act=sample]").click()
    page.wait_for_url("**/run?**")
    page.wait_for_selector("[data-box=queue] > .job:nth-child(2)")
    run_to_its_end(page, 900)
    page.goto(f"{application.base}/confidence?case=one.toml")
    wait_for(page, "60 of 60", at="body")
    folder = application.folder / "runs" / "one_uncertainty"
    indices = json.loads((folder / "uncertainty.json").read_text(encoding="utf-8"))["distance"]["indices"]
    largest = max(indices, key=lambda one: one["total"])
    first = page.locator(".tornado .stage").first.inner_text()
    assert largest["name"] in first
    assert f"{100.0 * largest['total']:.0f} %" in first
    assert page.locator(".tornado .stage").count() == min(len(indices), 12)


def test_two_runs_are_compared(application):
    """Their inputs that differ stand first, then the results of both."""
    application.start(small(application.folder))
    path = application.folder / "tube.toml"
    other = application.folder / "other.toml"
    text = path.read_text(encoding="utf-8").replace('end_time = "120 us"', 'end_time = "120 us"\nconvergence = "off"')
    path.write_text(text, encoding="utf-8")
    other.write_text(text.replace("dimension = 2", "dimension = 3"), encoding="utf-8")
    for number, name in enumerate(("tube", "other"), start=1):
        page = application.page(f"/run?case={name}.toml")
        page.wait_for_selector("[data-box=findings]")
        page.locator("[data-act=start]").click()
        page.wait_for_selector(f"[data-box=queue] > .job:nth-child({number})")
        run_to_its_end(page, 300)
        page.close()
    page = application.page("/confidence?case=tube.toml")
    page.get_by_text("✓").or_(page.get_by_text("✗")).first.wait_for()  # the evidence, last to come
    choose(page, "Run", "runs/tube")
    choose(page, "Reference", "runs/other")
    page.get_by_role("heading", name="distances", exact=True).wait_for()
    assert page.get_by_text("break_up.dimension: reference 3, run 2").count() == 1
    words = page.get_by_role("row").filter(has_text="Expected distance").inner_text().split("\t")
    ratio = _expected(application.folder / "runs" / "tube") / _expected(application.folder / "runs" / "other")
    assert float(words[6]) == pytest.approx(ratio, abs=6e-4)
    assert ratio != 1.0
