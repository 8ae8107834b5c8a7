"""Makes README's picture of a report and the example of "Which number": `python docs/hooks/first_page.py [RUN]`.

Runs cases/m107_tnt.toml, unless its run directory RUN is there already, photographs the top of its report in chromium,
and keeps the numbers beside the picture; a test compares both with what the program says now.
"""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import fragfield
from fragfield.results.hazard import Hazard
from fragfield.results.part import to_json
from fragfield.results.rules import DistanceToApply
from fragfield.results.words import metres, parts_of, parts_words

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["example", "main", "shown_words", "stored"]

ROOT = Path(__file__).resolve().parents[2]
CASE = ROOT / "cases" / "m107_tnt.toml"
PICTURE = ROOT / "docs" / "pictures" / "report_first_page.png"
NUMBERS = PICTURE.with_suffix(".json")
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
    summary = to_json(fragfield.open(folder).summary)
    shown = {key: summary[key] for key in ("hazard", "distance_to_apply")}
    text = json.dumps({**shown, "words": shown_words(shown)}, indent=1, ensure_ascii=False)
    NUMBERS.write_text(f"{text}\n", encoding="utf-8")
    return PICTURE


def stored() -> dict[str, Any]:
    """The parts `hazard` and `distance_to_apply` of the run in the picture, and its `words`."""
    found: dict[str, Any] = json.loads(NUMBERS.read_text(encoding="utf-8"))
    return found


def shown_words(parts: Mapping[str, Any]) -> list[str]:
    """What a summary's first lines say of it."""
    hazard = Hazard.read(parts["hazard"])
    line = DistanceToApply.read(parts["distance_to_apply"]).line
    return [line, f"recommended distance {metres(hazard.recommended)}", f"  {parts_words(hazard)}"]


def example() -> str:
    """The first lines and their sum as Markdown."""
    found = stored()
    hazard = Hazard.read(found["hazard"])
    base, *others = [part.value for part in parts_of(hazard) if part.value is not None]
    widths = " + ".join(f"{width:.1f}^2" for width in others)
    lines = "\n".join(found["words"])
    total = rf"${base:.1f} + \sqrt{{{widths}}} = {hazard.recommended:.1f}$ m"
    return f"```text\n{lines}\n```\n\n{total}, rounded up to whole metres in print."


if __name__ == "__main__":
    print("picture:", main(Path(sys.argv[1] if len(sys.argv) > 1 else ROOT / "runs" / "first_page")))
