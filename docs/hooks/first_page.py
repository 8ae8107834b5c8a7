"""Makes docs/pictures/report_first_page.png, README's picture of a report: `python docs/hooks/first_page.py [RUN]`.

Runs cases/m107_comp_b.toml, unless its run directory RUN is there already, and photographs the top of its report in
chromium.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

import fragfield

__all__ = ["main"]

ROOT = Path(__file__).resolve().parents[2]
CASE = ROOT / "cases" / "m107_comp_b.toml"
PICTURE = ROOT / "docs" / "pictures" / "report_first_page.png"
WIDTH, HEIGHT = 1280, 1560


def main(folder: Path) -> Path:
    """The picture of the report in a run directory, which is computed where it is missing.

    Raises
    ------
    FileNotFoundError
        chromium is not installed.
    subprocess.CalledProcessError
        chromium failed.
    """
    browser = shutil.which("chromium")
    if browser is None:
        raise FileNotFoundError("the picture of a report needs chromium: apt-get install chromium")
    if not (folder / "report.html").is_file():
        fragfield.run(CASE, out=folder, overwrite=True)
    with tempfile.TemporaryDirectory() as profile:
        options = [f"--user-data-dir={profile}", "--hide-scrollbars", f"--window-size={WIDTH},{HEIGHT}"]
        command = [browser, "--headless", "--no-sandbox", *options, f"--screenshot={PICTURE}"]
        address = (folder / "report.html").resolve().as_uri()
        subprocess.run([*command, address], check=True, capture_output=True, timeout=120)
    return PICTURE


if __name__ == "__main__":
    print("picture:", main(Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "runs" / "first_page")))
