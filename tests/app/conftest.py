"""The application in a browser, where both are there."""

from __future__ import annotations

import importlib.util
import os
import re
import shutil
import subprocess
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]
CHROMIUM = shutil.which("chromium")
PATIENCE = float(os.environ.get("FRAGFIELD_PAGE_PATIENCE", "1"))
"""Factor on every time that is waited for, for a machine that does other things as well."""


@dataclass
class Application:
    """`fragfield app` as a process over a folder, and what the browser met there."""

    folder: Path
    browser: Any
    process: subprocess.Popen[str] | None = None
    base: str = ""
    address: str = ""
    foreign: set[str] = field(default_factory=set)
    errors: list[str] = field(default_factory=list)

    def start(self, *words: str) -> None:
        """Start it, and wait for its address."""
        self.process = subprocess.Popen(
            [sys.executable, "-m", "fragfield", "app", "--no-browser", *words], cwd=self.folder, text=True,
            env={**os.environ, "PYTHONPATH": str(ROOT)}, stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        )  # fmt: skip
        assert self.process.stdout is not None
        lines = iter(self.process.stdout.readline, "")
        self.address = next(line.strip() for line in lines if line.startswith("http"))
        self.base = re.match(r"http://[^/]+", self.address)[0]

    def stop(self) -> str:
        """End it; what it wrote on standard error."""
        assert self.process is not None
        self.process.terminate()
        return self.process.communicate(timeout=60)[1]

    def page(self, place: str = "", width: int = 1280) -> Any:
        """A new page of a browser that has the token."""
        context = self.browser.new_context(viewport={"width": width, "height": 900})
        page = context.new_page()
        page.set_default_timeout(90_000 * PATIENCE)
        page.on("request", lambda request: self._seen(request.url))
        page.on("pageerror", lambda error: self.errors.append(str(error)))
        page.goto(self.address)
        if place:
            page.goto(self.base + place)
        return page

    def _seen(self, address: str) -> None:
        if not address.startswith((self.base, "data:", "blob:", self.base.replace("http", "ws"))):
            self.foreign.add(address)


def wait_for(page, words, *, at):
    """Until a part of the page holds words."""
    page.wait_for_function("([at, words]) => document.querySelector(at)?.innerText.includes(words)", arg=[at, words])


def with_cases(folder, *names):
    """Put cases of this repository into a folder."""
    for name in names:
        shutil.copy(ROOT / "cases" / name, folder)


def small(folder: Path) -> str:
    """A case that is computed in seconds."""
    with_cases(folder, "tube.toml")
    path = folder / "tube.toml"
    path.write_text(path.read_text(encoding="utf-8").replace('"6 mm"', '"14 mm"'), encoding="utf-8")
    return path.name


@pytest.fixture(scope="session")
def browser():
    """Chromium by Playwright."""
    if CHROMIUM is None or any(importlib.util.find_spec(name) is None for name in ("playwright", "nicegui")):
        pytest.skip("needs chromium, playwright and nicegui")
    from playwright.sync_api import sync_playwright

    with sync_playwright() as found:
        chromium = found.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        yield chromium
        chromium.close()


@pytest.fixture
def application(browser, tmp_path):
    """The application in a folder of its own: no page may fail, or ask another machine for anything."""
    running = Application(tmp_path, browser)
    yield running
    assert not running.foreign
    assert running.errors == []
    if running.process is not None and running.process.poll() is None:
        assert "Traceback" not in running.stop()
    log = tmp_path / ".fragfield" / "app.log"
    assert not log.exists() or "Traceback" not in log.read_text(encoding="utf-8")
