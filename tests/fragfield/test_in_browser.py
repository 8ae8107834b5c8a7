"""The pages in a real browser: every figure drawn, nothing to scroll sideways, printed whole."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from html import escape, unescape
from pathlib import Path

import pytest

from tests.fragfield.browser import needs_chromium, open_page, script_errors
from tests.fragfield.test_report import SHOWN

pytestmark = needs_chromium
A4 = (210.0, 297.0)
MOST_BEFORE_ANNEXES = 12
POINT = 25.4 / 72.0

PROBE = """<script>
  addEventListener("load", () => {
    const images = [...document.images];
    const seen = images.map(i => i.complete && i.naturalWidth > 0 && i.getBoundingClientRect().width > 200);
    const root = document.documentElement;
    // A wide table may scroll in its own frame; nothing else may stick out of the page.
    const out = [...document.querySelectorAll("main *")].filter(
      e => !e.closest(".scroll, pre") && e.getBoundingClientRect().right > innerWidth + 1).map(e => e.tagName);
    const cut = [...document.querySelectorAll(".scroll")].filter(e => e.scrollWidth > e.clientWidth + 1);
    const tables = cut.map(e => e.querySelector("caption").textContent);
    parent.document.title = JSON.stringify({
      seen, out, tables, wide: root.scrollWidth - root.clientWidth, width: innerWidth,
      columns: new Set([...document.querySelectorAll("figure")].map(
        f => Math.round(f.getBoundingClientRect().left))).size});
  });</script></body>"""


@pytest.fixture(scope="module")
def run(reported_pair) -> Path:
    return reported_pair


@pytest.mark.parametrize("width", [1280, 390])
def test_every_figure_is_drawn_without_sideways_scrolling(run, tmp_path, width):
    # In a frame, since a window of headless chromium is never narrower than 500 pixels.
    html = (run / "report.html").read_text(encoding="utf-8")
    inner = escape(html.replace("</body>", PROBE), quote=True)
    frame = f'<title>-</title><iframe style="width:{width}px;height:900px;border:0" srcdoc="{inner}"></iframe>'
    page = tmp_path / "page.html"
    page.write_text(frame, encoding="utf-8")
    done = open_page(page, tmp_path, "--window-size=1400,1000", "--dump-dom")
    title = re.search(r"<title>(.*?)</title>", done.stdout)
    assert title is not None
    assert title[1] != "-", done.stderr
    found = json.loads(unescape(title[1]))
    assert found["width"] == width
    assert found["seen"] == [True] * len(SHOWN)
    assert found["wide"] == 0
    assert found["out"] == []
    assert found["tables"] == [], "tables that are cut at the edge"
    assert script_errors(done) == []
    assert (found["columns"] == 1) == (width < 620), "figures side by side, but on a telephone one below the other"


@pytest.mark.skipif(shutil.which("pdftotext") is None, reason="needs pdftotext")
def test_print_breaks_pages_where_a_reader_would(run, tmp_path):
    paper = tmp_path / "report.pdf"
    open_page(run / "report.html", tmp_path, "--no-pdf-header-footer", f"--print-to-pdf={paper}")
    box = re.search(rb"/MediaBox \[0 0 ([\d.]+) ([\d.]+)\]", paper.read_bytes())
    assert box is not None
    assert [float(side) * POINT for side in box.groups()] == pytest.approx(A4, abs=0.5)
    printed = subprocess.run(["pdftotext", "-layout", str(paper), "-"], capture_output=True, text=True, check=True)
    pages = [[line.strip() for line in page.splitlines() if line.strip()] for page in printed.stdout.split("\f")[:-1]]
    annexes = next(number for number, lines in enumerate(pages) if any(line.startswith("Annex A") for line in lines))
    assert 3 <= annexes <= MOST_BEFORE_ANNEXES
    assert annexes < len(pages) <= 60
    html = (run / "report.html").read_text(encoding="utf-8")
    heads = [unescape(text) for text in re.findall(r"<(?:h3|caption)>(.*?)</", html)]
    heads += [unescape(f"{count} {text}") for count, text in re.findall(r'"count">(\w+)</span>(.*?)</h2>', html)]
    for number, lines in enumerate(pages, 1):
        body = lines[:-1] if re.fullmatch(r"\d+ / \d+", lines[-1]) else lines
        last = re.sub(r"\s+", " ", body[-1])
        assert last not in heads, f"page {number} ends in the heading “{last}”"
    signed = [lines for lines in pages if any("Reviewed by" in line for line in lines)]
    assert len(signed) == 1
    assert signed[0] is pages[0], "the first page is the one that is signed"
    for words in ("Recommended distance", "Reasons against", "Computed by", "Approved by", "Name", "Date", "Signature"):
        assert any(words in line for line in signed[0]), words
    assert not any(re.match(r"2\s+Rounds", line) for line in pages[0])
    assert any(re.match(r"2\s+Rounds", line) for line in pages[1]), "the first page fits one"
