"""The pages as their user works with them, in Chromium."""

from __future__ import annotations

import hashlib
import http.server
import json
import subprocess
import sys
import threading
import urllib.error
import urllib.request

import pytest

from fragfield.case import load_case
from tests.app.conftest import PATIENCE, ROOT, small, wait_for, with_cases

PAGES = ("start", "round", "arrangement", "site", "run", "result")
pytestmark = [pytest.mark.slow, pytest.mark.cores]
SITE = ("m107_pair_site.toml", "m107_pair_site.asc")


UNNAMED = """
    [...document.querySelectorAll('input:not([type=hidden], [type=file], .hidden), textarea, button')].filter(e => !(
        e.ariaLabel || e.innerText?.trim() || e.labels?.length || e.closest('label') || e.title
    )).map(e => e.outerHTML.slice(0, 150))
"""
"""Inputs and buttons for which a reader of the screen has no name."""
WIDER = """
    [...document.querySelectorAll('.picture, .form, .table-box, .contour')]
        .filter(e => e.scrollWidth > e.clientWidth + 1)
        .map(e => e.outerHTML.slice(0, 150))
"""
"""Parts that scroll sideways."""


def test_a_case_from_the_pages_runs_by_the_command_line_to_the_same_summary(application):
    name = small(application.folder)
    application.start(name)
    page = application.page(f"/run?case={name}")
    page.wait_for_selector("[data-box=findings]")
    page.locator('[data-key="seed"]').fill("17")
    page.wait_for_timeout(1500 * PATIENCE)
    page.locator("[data-act=start]").click()
    page.wait_for_selector("[data-state=done]", timeout=500_000 * PATIENCE)
    assert load_case(application.folder / name).seed == 17
    command = [sys.executable, "-m", "fragfield", "run", name, "--out", "other", "--quiet"]
    subprocess.run(command, cwd=application.folder, check=True, env={"PYTHONPATH": str(ROOT), "PATH": "/usr/bin:/bin"})
    ours, theirs = (
        json.loads((application.folder / run / "summary.json").read_text(encoding="utf-8"))
        for run in ("runs/tube", "other")
    )
    assert _results(ours) == _results(theirs)
    _signed(application, page, name)


def _signed(application, page, name):
    """The report is written with number and names, and holds the digest; a case that is changed later is marked."""
    page.goto(f"{application.base}/result?case={name}")
    page.locator('[data-key="document.number"]').fill("R-17")
    page.locator('[data-key="document.approved_by"]').fill("A. Engineer")
    page.wait_for_timeout(1500 * PATIENCE)
    assert not page.locator("[data-box=changed]").is_visible()
    page.locator("[data-act=write-report]").click()
    page.wait_for_url("**/run?**")
    page.wait_for_selector("[data-state=done]", timeout=100_000 * PATIENCE)
    run = application.folder / "runs" / "tube"
    report = (run / "report.html").read_text(encoding="utf-8")
    digest = hashlib.sha256((run / "summary.json").read_bytes()).hexdigest()[:16]
    for words in ("R-17", "A. Engineer"):
        assert words in report
    assert f"R-17 · summary.json SHA-256 {digest}" in report, "at the foot of every printed page"
    page.wait_for_selector("[data-box=findings]")
    page.locator('[data-key="seed"]').fill("18")
    page.wait_for_function("document.querySelector('.state').innerText.includes('not saved')")
    page.goto(f"{application.base}/result?case={name}")
    wait_for(page, "seed: in the run 17, now 18", at="[data-box=changed]")


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
        page.wait_for_timeout(1500 * PATIENCE)
        assert page.evaluate("document.documentElement.scrollWidth") <= width, name
        assert page.evaluate(WIDER) == [], name
        unnamed = page.evaluate(UNNAMED)
        assert unnamed == [], name
        if name != "start":
            here = page.locator("nav a[aria-current]").bounding_box()
            assert 0.0 <= here["x"] <= width - here["width"], name


def test_a_stack_stands_on_the_map_as_it_is_computed(application):
    with_cases(application.folder, "m107_row4.toml")
    application.start()
    page = application.page("/site?case=m107_row4.toml")
    wait_for(page, "Hazardous fragment distance", at=".content")
    rounds = "[...document.querySelectorAll('#site-map path > title')].map(e => e.textContent)"
    wanted = [one.name for one in load_case(application.folder / "m107_row4.toml").round]
    assert len(wanted) == 4
    page.wait_for_function(f"{rounds}.length === 4")
    assert page.evaluate(rounds) == wanted
    circles = "[...document.querySelectorAll('#site-map circle:not(.handle)')].map(e => e.getBBox())"
    size = page.evaluate(
        "[document.querySelector('#site-map svg').clientWidth, document.querySelector('#site-map svg').clientHeight]"
    )
    found = page.evaluate(f"{circles}.map(b => [b.x, b.y, b.x + b.width, b.y + b.height])")
    assert found, "the distances by rules"
    for left, top, right, foot in found:
        assert min(left, top) >= 0.0, "all of every distance is seen"
        assert right <= size[0]
        assert foot <= size[1]


def test_the_link_opens_from_a_page_of_another_site(application):
    """Clicked in a chat or in a terminal that runs in the browser: a site of another name."""
    application.start()
    link = f'<a id="link" href="{application.address}">open</a>'.encode()

    class Chat(http.server.BaseHTTPRequestHandler):
        def do_GET(self):
            self.send_response(200)
            self.send_header("content-type", "text/html")
            self.end_headers()
            self.wfile.write(link)

        def log_message(self, *_):
            pass

    chat = http.server.HTTPServer(("127.0.0.1", 0), Chat)
    threading.Thread(target=chat.serve_forever, daemon=True).start()
    try:
        page = application.browser.new_context().new_page()
        page.goto(f"http://localhost:{chat.server_port}/")
        page.click("#link")
        wait_for(page, "Hazard distances of fragments", at="body")
        assert "token" not in page.url
        page.reload()
        wait_for(page, "Hazard distances of fragments", at="body")
    finally:
        chat.shutdown()
        chat.server_close()


def test_a_file_changed_outside_is_kept(application):
    with_cases(application.folder, "tube.toml")
    application.start()
    page = application.page("/run?case=tube.toml")
    page.wait_for_selector("[data-box=findings]")
    path = application.folder / "tube.toml"
    outside = path.read_text(encoding="utf-8") + "\n# from an editor\n"
    page.locator('[data-key="seed"]').fill("17")
    page.wait_for_function("document.querySelector('.state').innerText.includes('not saved')")
    path.write_text(outside, encoding="utf-8")
    page.locator("#save").click()
    wait_for(page, "another program has changed the file", at=".q-notification")
    assert path.read_text(encoding="utf-8") == outside


def test_a_place_is_dragged_and_moved_by_keys(application):
    with_cases(application.folder, *SITE)
    application.start()
    page = application.page(f"/site?case={SITE[0]}")
    mark = page.locator("#site-map .handle[aria-label^=sentry]")
    mark.wait_for()
    page.wait_for_timeout(1500 * PATIENCE)
    box = mark.bounding_box()
    page.mouse.move(box["x"] + 7, box["y"] + 7)
    page.mouse.down()
    page.mouse.move(box["x"] + 67, box["y"] + 7, steps=4)
    page.mouse.up()
    page.wait_for_function("document.querySelector('.state').innerText.includes('not saved')")
    mark.focus()
    page.keyboard.press("Shift+ArrowUp")
    page.wait_for_timeout(1500 * PATIENCE)
    page.locator("#save").click()
    page.wait_for_function("document.querySelector('.state').innerText === 'saved'")
    case = load_case(application.folder / SITE[0])
    x, y = case.exposed[0].position
    assert x > 55.0
    assert y == pytest.approx(-80.0, abs=0.02)


def test_a_fault_leads_from_another_page_to_its_field(application):
    with_cases(application.folder, *SITE)
    application.start()
    page = application.page(f"/run?case={SITE[0]}")
    page.wait_for_selector("[data-box=findings]")
    page.locator('[data-key="burst.cell_size"]').first.fill("6")
    page.wait_for_function("document.body.innerText.includes('without a unit')")
    page.goto(f"{application.base}/site?case={SITE[0]}")
    page.locator(".faults a", has_text="burst.cell_size").click()
    page.wait_for_url("**/run?**")
    page.wait_for_function("document.activeElement?.dataset.key === 'burst.cell_size'")
    assert 'cell_size = "6"' not in (application.folder / SITE[0]).read_text(encoding="utf-8")


def test_nonsense_in_every_field_of_a_page_is_no_fault_of_the_program(application):
    with_cases(application.folder, *SITE)
    application.start()
    for name in ("round", "arrangement", "site", "run"):
        page = application.page(f"/{name}?case={SITE[0]}")
        page.wait_for_timeout(1500 * PATIENCE)
        closed = page.locator(".q-expansion-item:not(.q-expansion-item--expanded) > div > .q-item")
        for _ in range(min(closed.count(), 12)):
            closed.first.click()
            page.wait_for_timeout(400 * PATIENCE)
        page.wait_for_timeout(1000 * PATIENCE)
        for box in page.locator("input[data-key]:visible").all():
            if not box.evaluate("e => e.closest('.q-select') !== null"):
                box.fill("\u202e]] {17} \\ ' nonsense")
        page.wait_for_timeout(1500 * PATIENCE)
        assert "fault of the program" not in page.locator("body").inner_text()
        page.close()


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
    page.wait_for_selector(".stage .q-linear-progress")
    page.wait_for_timeout(3000 * PATIENCE)
    page.locator("[data-act=cancel]").click()
    page.wait_for_selector("[data-state=stopped]", timeout=120_000 * PATIENCE)
    assert not page.locator("[data-act=start]").is_visible()
    assert page.locator("[data-act=resume]").is_visible()
    page.locator("[data-act=resume-job]").click()
    page.wait_for_selector("[data-state=running], [data-state=done]", timeout=120_000 * PATIENCE)
    if page.locator("[data-act=cancel]").count():
        page.locator("[data-act=cancel]").click()
        page.wait_for_selector("[data-state=running]", state="detached", timeout=120_000 * PATIENCE)


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
