"""Whole tasks, from an empty folder to their result, as their users do them, in Chromium."""

from __future__ import annotations

import json
import re

import pytest

from tests.app.conftest import wait_for

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


def run_to_its_end(page, seconds):
    """Follow the newest job of page 6, whose log is the message of a failure."""
    page.wait_for_selector("[data-box=queue] > .job:first-child:is(.done, .failed)", timeout=1000 * seconds)
    newest = page.locator("[data-box=queue] > .job").first
    assert newest.get_attribute("data-state") == "done", newest.inner_text()
    return newest


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
