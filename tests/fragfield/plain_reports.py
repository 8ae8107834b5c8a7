"""Reports without what takes longest in them: pictures and figures.

`python -m tests.fragfield.plain_reports ARGUMENTS`: the command line with such reports.
"""

from __future__ import annotations

from functools import partial

import pytest

import fragfield.report
from fragfield.cli import main
from fragfield.report import assemble

__all__ = ["draw_nothing", "leave_out_figures", "leave_out_pictures"]


def leave_out_figures(patch: pytest.MonkeyPatch) -> None:
    """Have reports written without figures."""
    patch.setattr(assemble._Illustrator, "draw", lambda *_: [])


def draw_nothing(patch: pytest.MonkeyPatch) -> None:
    """Have reports written without pictures and figures."""
    leave_out_figures(patch)
    leave_out_pictures(patch)


def leave_out_pictures(patch: pytest.MonkeyPatch) -> None:
    """Have reports written without pictures."""
    patch.setattr(fragfield.report, "write_report", partial(fragfield.report.write_report, pictures=False))


if __name__ == "__main__":
    draw_nothing(pytest.MonkeyPatch())
    main()
