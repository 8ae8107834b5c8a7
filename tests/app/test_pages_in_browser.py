"""The pages as their user works with them, in Chromium."""

from __future__ import annotations

import json
import subprocess
import sys
import urllib.error
import urllib.request

import pytest

from fragfield.case import load_case
from tests.app.conftest import ROOT, small, wait_for, with_cases

PAGES = ("start", "round", "arrangement", "site", "data", "run", "result", "confidence")
pytestmark = [pytest.mark.slow, pytest.mark.cores]
SITE = ("m107_pair_site.toml", "m107_pair_site.asc")


UNNAMED = """
    [...document.querySelectorAll('input:not([type=hidden], [type=file], .hidden), textarea, button')].filter(e => !(
        e.ariaLabel || e.innerText?.trim() || e.labels?.length || e.closest('label') || e.title
    )).map(e => e.outerHTML.slice(0, 150))
"""
"""Inputs and buttons for which a reader of the screen has no name."""


def test_own_round_from_a_drawing_to_a_signed_report(application):
    """The server is killed while the run goes; the run and the draft are there afterwards."""
    application.start()
    page = application.page()
    page.get_by_text("A round of my own drawing").click()
    page.locator("[data-key=new-name]").fill("Mein Geschoß")
    page.locator("#make").click()
    page.wait_for_url("**/round?**")
    wait_for(page, "260", at="table.facts")
    page.get_by_role("button", name="Diameters").click()
    page.wait_for_function("document.querySelector('[data-cell=outer-2-1]').value === '80'")
    page.locator("[data-cell=outer-2-1]").fill("85,5")
    wait_for(page, "85.50 mm", at="table.facts")
    page.locator("[data-cell=outer-2-1]").fill("wide")
    page.wait_for_selector(".contour.has-fault")
    page.locator("[data-cell=outer-2-1]").fill("85")
    page.wait_for_selector(".contour.has-fault", state="detached")
    case = "?case=Mein_Gescho%C3%9F.toml"
    page.goto(f"{application.base}/confidence{case}")
    page.locator('[data-key="document.prepared_by"]').fill("A. Person")
    page.wait_for_timeout(1000)
    page.goto(f"{application.base}/run{case}")
    page.wait_for_selector("[data-box=findings]")
    page.locator("[data-preset=quick]").click()
    page.wait_for_function("document.querySelector('[data-key=\"burst.cell_size\"]')?.value.startsWith('6.')")
    page.wait_for_selector("[data-box=findings]")
    page.locator("[data-act=start]").click()
    page.wait_for_selector("[data-state=running]")
    application.stop(kill=True)  # and nothing is lost
    page.close()
    application.start()
    page = application.page(f"/run{case}")
    page.wait_for_selector("[data-state=done]", timeout=500_000)
    page.goto(f"{application.base}/result{case}")
    summary = json.loads((application.folder / "runs" / "Mein_Geschoß" / "summary.json").read_text(encoding="utf-8"))
    assert (
        page.locator("[data-box=recommended]")
        .inner_text()
        .startswith(f"{-int(-summary['hazard']['recommended'] // 1)}")
    )
    page.goto(f"{application.base}/confidence{case}")
    page.locator("[data-act=sign]").click()
    wait_for(page, "A. Person", at="[data-box=signed]")
    printed = application.folder / "report.pdf"
    alone = application.page(f"/files/{'runs/Mein_Gescho%C3%9F'}/report.html")
    alone.pdf(path=str(printed))
    assert printed.read_bytes().startswith(b"%PDF")


def test_a_case_from_the_pages_runs_by_the_command_line_to_the_same_summary(application):
    name = small(application.folder)
    application.start(name)
    page = application.page(f"/run?case={name}")
    page.wait_for_selector("[data-box=findings]")
    page.locator('[data-key="seed"]').fill("17")
    page.wait_for_timeout(1500)
    page.locator("[data-act=start]").click()
    page.wait_for_selector("[data-state=done]", timeout=500_000)
    assert load_case(application.folder / name).seed == 17
    command = [sys.executable, "-m", "fragfield", "run", name, "--out", "other", "--quiet"]
    subprocess.run(command, cwd=application.folder, check=True, env={"PYTHONPATH": str(ROOT), "PATH": "/usr/bin:/bin"})
    ours, theirs = (
        json.loads((application.folder / run / "summary.json").read_text(encoding="utf-8"))
        for run in ("runs/tube", "other")
    )
    assert _results(ours) == _results(theirs)


def _results(summary):
    """A summary without times, memory and the hash over them."""
    if isinstance(summary, dict):
        skipped = ("peak_memory_bytes", "checksum")
        return {key: _results(value) for key, value in summary.items() if "seconds" not in key and key not in skipped}
    return [_results(value) for value in summary] if isinstance(summary, list) else summary


@pytest.mark.parametrize("width", [1280, 390])
def test_every_page_fits_and_names_its_fields(application, width):
    with_cases(application.folder, *SITE)
    application.start()
    page = application.page(width=width)
    for name in PAGES:
        page.goto(f"{application.base}/{name}" + ("" if name == "start" else f"?case={SITE[0]}"))
        page.wait_for_selector(".content")
        page.wait_for_timeout(1500)
        assert page.evaluate("document.documentElement.scrollWidth") <= width, name
        unnamed = page.evaluate(UNNAMED)
        assert unnamed == [], name


def test_a_place_is_dragged_and_moved_by_keys(application):
    with_cases(application.folder, *SITE)
    application.start()
    page = application.page(f"/site?case={SITE[0]}")
    mark = page.locator("#site-map .handle[aria-label^=sentry]")
    mark.wait_for()
    page.wait_for_timeout(1500)
    box = mark.bounding_box()
    page.mouse.move(box["x"] + 7, box["y"] + 7)
    page.mouse.down()
    page.mouse.move(box["x"] + 67, box["y"] + 7, steps=4)
    page.mouse.up()
    page.wait_for_function("document.querySelector('.state').innerText.includes('not saved')")
    mark.focus()
    page.keyboard.press("Shift+ArrowUp")
    page.wait_for_timeout(1500)
    page.locator("#save").click()
    page.wait_for_function("document.querySelector('.state').innerText === 'saved'")
    case = load_case(application.folder / SITE[0])
    x, y = case.exposed[0].position
    assert x > 55.0
    assert y == pytest.approx(-80.0, abs=0.02)


def test_a_second_window_says_so_and_a_fault_leads_to_its_field(application):
    with_cases(application.folder, *SITE)
    application.start()
    first = application.page(f"/run?case={SITE[0]}")
    first.wait_for_selector("[data-box=findings]")
    second = application.page(f"/round?case={SITE[0]}")
    wait_for(second, "open in another window", at=".news")
    first.wait_for_timeout(1200)
    assert "another window" not in first.locator(".news").inner_text()
    second.goto(f"{application.base}/site?case={SITE[0]}")
    second.goto(f"{application.base}/confidence?case={SITE[0]}")
    second.locator('[data-key="document.number"]').fill("N-2")
    first.wait_for_timeout(3000)
    first.locator('[data-key="burst.cell_size"]').first.fill("6")
    first.wait_for_function("document.body.innerText.includes('without a unit')")
    second.wait_for_timeout(3000)  # it is shown again, with the fault of the other window
    second.locator(".faults a", has_text="burst.cell_size").click()
    second.wait_for_url("**/run?**")
    second.wait_for_function("document.activeElement?.dataset.key === 'burst.cell_size'")
    assert 'cell_size = "6"' not in (application.folder / SITE[0]).read_text(encoding="utf-8")


def test_nonsense_in_every_field_of_a_page_is_no_fault_of_the_program(application):
    with_cases(application.folder, *SITE)
    application.start()
    for name in ("round", "arrangement", "site", "run", "confidence"):
        page = application.page(f"/{name}?case={SITE[0]}")
        page.wait_for_timeout(1500)
        closed = page.locator(".q-expansion-item:not(.q-expansion-item--expanded) > div > .q-item")
        for _ in range(min(closed.count(), 12)):
            closed.first.click()
            page.wait_for_timeout(400)
        page.wait_for_timeout(1000)
        for box in page.locator("input[data-key]:visible").all():
            if not box.evaluate("e => e.closest('.q-select') !== null"):
                box.fill("\u202e]] {17} \\ ' nonsense")
        page.wait_for_timeout(1500)
        assert "fault of the program" not in page.locator("body").inner_text()
        page.close()
    assert "nonsense" in next((application.folder / ".fragfield" / "drafts").iterdir()).read_text(encoding="utf-8")


def test_the_browser_is_closed_and_the_run_is_stopped_and_resumed(application):
    name = small(application.folder)
    path = application.folder / name
    path.write_text(path.read_text(encoding="utf-8").replace('"14 mm"', '"2 mm"'), encoding="utf-8")
    application.start()
    page = application.page(f"/run?case={name}")
    page.wait_for_selector("[data-box=findings]")
    page.locator("[data-act=start]").click()
    page.wait_for_selector("[data-state=running]")
    page.context.close()
    page = application.page(f"/run?case={name}")
    page.wait_for_selector(".bar")
    page.wait_for_timeout(3000)
    page.locator("[data-act=cancel]").click()
    page.wait_for_selector("[data-state=stopped]", timeout=120_000)
    page.reload()
    page.wait_for_selector("[data-box=findings]")
    page.locator("[data-act=resume]").click()
    page.wait_for_selector("[data-state=running], [data-state=done]", timeout=120_000)
    if page.locator("[data-act=cancel]").count():
        page.locator("[data-act=cancel]").click()
        page.wait_for_selector("[data-state=running]", state="detached", timeout=120_000)


def test_who_has_no_token_gets_nothing(application):
    application.start()
    for place in (
        "/",
        "/start",
        "/static/app.js",
        "/files/case.toml",
        "/_nicegui_ws/socket.io/?EIO=4&transport=polling",
    ):
        for headers in ({}, {"Cookie": "fragfield-1=x"}):
            with pytest.raises(urllib.error.HTTPError) as refused:
                urllib.request.urlopen(urllib.request.Request(application.base + place, headers=headers))
            assert refused.value.code == 403
