"""Whole tasks, from an empty folder to their result, as their users do them, in Chromium."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from burst_fenicsx.geometry import load_profile
from fragfield.case import load_case
from tests.app.conftest import PATIENCE, wait_for
from tests.fragfield.drawn_shells import write_dxf

pytestmark = [pytest.mark.slow, pytest.mark.cores]


def new_case(application, template, name):
    """A case from a template of the first page, which leads to the page that comes next."""
    page = application.page()
    page.get_by_text(template).click()
    page.locator("[data-key=new-name]").fill(name)
    page.locator("#make").click()
    page.wait_for_url(f"**case={name}.toml")
    page.wait_for_selector(".content")
    return page


def run_to_its_end(page, seconds):
    """Follow the run of page 5, whose log is the message of a failure."""
    page.wait_for_selector("[data-box=job] > .job:is(.done, .failed)", timeout=1000 * seconds * PATIENCE)
    job = page.locator("[data-box=job] > .job")
    assert job.get_attribute("data-state") == "done", job.inner_text()
    return job


def test_own_round_from_a_drawing_to_a_printed_report(application, tmp_path_factory):
    """A DXF of the 105 mm M1 is brought in, drawn, run while the page is closed, read and printed."""
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
    # of the nose, a point of the drawing; the points after it are chords of its arc
    page.wait_for_function("document.querySelector('[data-cell=outer-0-1]').value === '56'")
    widest = max(page.locator("[data-cell^=outer-][data-cell$='-1']").all(), key=lambda one: float(one.input_value()))
    assert float(widest.input_value()) == pytest.approx(2e3 * load_profile("m1_105").max_radius, abs=0.01)
    value = widest.input_value()
    widest.fill("wide")
    page.wait_for_selector(".contours.has-fault")
    widest.fill(value.replace(".", ","))  # as everywhere
    page.wait_for_timeout(1000 * PATIENCE)
    assert page.locator(".contours.has-fault").count() == 1
    widest.fill(value)
    page.wait_for_selector(".contours.has-fault", state="detached")
    name = "Mein_Geschoß.toml"
    page.goto(f"{application.base}/run?case={name}")
    page.wait_for_selector("[data-box=findings]")
    page.locator("[data-preset=quick]").click()
    page.wait_for_function("document.querySelector('[data-key=\"burst.cell_size\"]')?.value.startsWith('8')")
    page.wait_for_selector("[data-box=findings]")
    page.locator("[data-act=start]").click()
    page.wait_for_selector("[data-state=running]")
    page.close()  # the run goes on
    page = application.page(f"/run?case={name}")
    run_to_its_end(page, 500)
    run = application.folder / "runs" / "Mein_Geschoß"
    assert load_case(run / "case.toml").round[0].profile["charge"]["front"] == pytest.approx(50.0)
    page.goto(f"{application.base}/result?case={name}")
    shown = page.locator("[data-box=recommended]").inner_text()
    assert int(re.sub(r"\D", "", shown)) == -int(-_summary(run)["hazard"]["recommended"] // 1)
    printed = application.folder / "report.pdf"
    alone = application.page("/files/runs/Mein_Gescho%C3%9F/report.html")
    alone.pdf(path=str(printed))
    assert printed.read_bytes().startswith(b"%PDF")
    assert len(re.findall(rb"/Type\s*/Page\b", printed.read_bytes())) > 3


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
    """What page 6 says of each place."""
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
    drag(page, "barricade", 0, -50)  # its bank now lies over the rounds, which is said above the map
    wait_for(page, "4 rounds start inside it", at=".faults")
    drag(page, "barricade", -10, 65)
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
    burst, person, first = _burst(run), case.exposed[2].position, _summary(run)["exposed"][2]
    page.goto(f"{application.base}/site?case=four.toml")
    page.wait_for_selector("#site-map .handle")
    page.get_by_role("button", name="Zoom out").click(click_count=3)
    drag(page, "person", 250, -200)
    page.goto(f"{application.base}/result?case=four.toml")
    page.locator("[data-act=fly]").click()
    page.wait_for_url("**/run?**")
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


def _summary(run):
    return json.loads((run / "summary.json").read_text(encoding="utf-8"))


def _burst(run):
    """Name, size and time of every file that a burst writes."""
    return {one.name: (one.stat().st_size, one.stat().st_mtime_ns) for one in run.glob("burst*") if one.is_file()}
