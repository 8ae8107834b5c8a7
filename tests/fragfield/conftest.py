"""What several tests of the front door read and none changes."""

from __future__ import annotations

from pathlib import Path

import pytest


@pytest.fixture(scope="session")
def reported_pair(tmp_path_factory) -> Path:
    """A made-up run of two rounds with its report, pictures and interactive views."""
    from fragfield.report import write_report
    from tests.fragfield.synthetic_run import write_run

    folder = write_run(tmp_path_factory.mktemp("report") / "pair", rounds=2, title="Two <rounds> & a gap")
    write_report(folder)
    return folder
