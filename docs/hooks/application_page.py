"""Makes docs/pictures/application_round.png, page 2 of the application: `python docs/hooks/application_page.py`.

Starts `fragfield app` in a temporary folder on a new case of an own drawing, as the first page's template makes it,
and photographs the page of the round in chromium.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from playwright.sync_api import Page

__all__ = ["main"]

ROOT = Path(__file__).resolve().parents[2]
PICTURE = ROOT / "docs" / "pictures" / "application_round.png"
WIDTH, HEIGHT = 1280, 1000


def main() -> Path:
    """The picture of page 2.

    Raises
    ------
    FileNotFoundError
        chromium is not installed.
    ImportError
        playwright is not installed.
    """
    browser = shutil.which("chromium")
    if browser is None:
        raise FileNotFoundError("the picture of the application needs chromium: apt-get install chromium")
    from playwright.sync_api import sync_playwright

    with tempfile.TemporaryDirectory() as folder, sync_playwright() as found:
        application = subprocess.Popen(
            [sys.executable, "-m", "fragfield", "app", "--no-browser"], cwd=folder, text=True,
            env={**os.environ, "PYTHONPATH": str(ROOT)}, stdout=subprocess.PIPE,
        )  # fmt: skip
        chromium = found.chromium.launch(executable_path=browser, args=["--no-sandbox"])
        try:
            _photograph(chromium.new_page(viewport={"width": WIDTH, "height": HEIGHT}), _address(application))
        finally:
            chromium.close()
            application.terminate()
            application.wait(timeout=60)
    return PICTURE


def _address(application: subprocess.Popen[str]) -> str:
    """What the command prints when it listens."""
    for line in application.stdout or ():
        if found := re.match(r"http://\S+", line):
            return found[0]
    raise subprocess.SubprocessError(f"fragfield app: ended with {application.wait()} before it listened")


def _photograph(page: Page, address: str) -> None:
    page.goto(address)
    page.get_by_text("A round of my own drawing").click()
    page.locator("[data-key=new-name]").fill("shell_by_drawing")
    page.locator("#make").click()
    page.wait_for_url("**/round?**")
    page.locator("table.facts").first.wait_for()
    page.get_by_role("button", name="Diameters", exact=True).click()
    page.wait_for_function("document.querySelector('[data-cell=outer-2-1]').value === '80'")
    page.mouse.move(0, 0)
    page.wait_for_timeout(1000)  # the marks of clicks fade
    page.screenshot(path=PICTURE)


if __name__ == "__main__":
    print("picture:", main())
