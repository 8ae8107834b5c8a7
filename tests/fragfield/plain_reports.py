"""Reports without what takes longest in them, the figures, and a report as its sections, tables and text.

`python -m tests.fragfield.plain_reports ARGUMENTS`: the command line with such reports.
"""

from __future__ import annotations

import html
import re
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from fragfield.cli import main
from fragfield.report import assemble

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["Report", "leave_out_figures", "plain_report"]

_SPACES = str.maketrans({"\u00a0": " ", "\u202f": " ", "\u2212": "-"})


def leave_out_figures(patch: pytest.MonkeyPatch) -> None:
    """Have reports written without figures."""
    patch.setattr(assemble, "FIGURES", {})


def plain_report(folder: Path) -> Report:
    """The report of a run without its figures, written and read."""
    with pytest.MonkeyPatch.context() as patch:
        leave_out_figures(patch)
        return Report(assemble.write_report(folder).read_text(encoding="utf-8"))


class Report:
    """A page as its reader sees it: spaces that do not break and the minus sign are plain ones."""

    def __init__(self, page: str) -> None:
        sections = re.findall(r'(?s)<section id="([^"]+)"(.*?)</section>', page)
        self.sections = {key: _plain(body.partition(">")[2]) for key, body in sections}
        self.text = _plain(re.sub(r"(?s)<style>.*?</style>", "", page))
        found = re.findall(r'(?s)<li class="(stop|warning|note|good)">.*?class="text">(.*?)</span></li>', page)
        self.findings = [(weight, _plain(text)) for weight, text in found]
        self.tables = dict(_tables(page))
        """By title: a tuple for each line, that of the heads first."""

    def card(self, label: str) -> str:
        """Value of a key number."""
        return self.text.partition(f" {label} ")[2].split()[0]


def _plain(page: str) -> str:
    text = html.unescape(re.sub(r"(?s)<[^>]+>", " ", page)).translate(_SPACES)
    return re.sub(r"\s+", " ", text).strip()


def _tables(page: str) -> Iterator[tuple[str, list[tuple[str, ...]]]]:
    for table in re.findall(r"(?s)<table.*?</table>", page):
        (title,) = re.findall(r"(?s)<caption>(.*?)</caption>", table)
        lines = re.findall(r"(?s)<tr>(.*?)</tr>", table)
        cells = [tuple(_plain(cell) for cell in re.findall(r"(?s)<t[hd][^>]*>(.*?)</t[hd]>", line)) for line in lines]
        yield _plain(title), cells


if __name__ == "__main__":
    leave_out_figures(pytest.MonkeyPatch())
    main()
