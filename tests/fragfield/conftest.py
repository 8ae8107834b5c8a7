"""What several tests of the command line read and none changes."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

from tests.fragfield.plain_reports import leave_out_figures
from tests.fragfield.short_run import SHORT, command, environment
from tests.shared import made_once


@pytest.fixture(scope="session")
def reported_pair(tmp_path_factory) -> Path:
    """A made-up run of two rounds with its report, pictures and interactive views."""

    def make(folder: Path) -> None:
        from fragfield.report import write_report
        from tests.fragfield.synthetic_run import write_run

        write_report(write_run(folder / "pair", rounds=2, title="Two <rounds> & a gap"))

    return made_once(tmp_path_factory, "reported_pair", make) / "pair"


@pytest.fixture(scope="session")
def short_case(tmp_path_factory):
    path = tmp_path_factory.mktemp("case") / "short.toml"
    path.write_text(SHORT)
    return path


@pytest.fixture(scope="session")
def whole_run(tmp_path_factory):
    """A whole run by the real command, and what it printed."""

    def make(folder: Path) -> None:
        case = folder / "short.toml"
        case.write_text(SHORT)
        done = subprocess.run(
            command("run", case, "--out", folder / "whole", "--overwrite", "--json"),
            capture_output=True, text=True, env=environment(), timeout=300, check=False,
        )  # fmt: skip
        assert done.returncode == 0, done.stderr
        (folder / "printed.json").write_text(done.stdout)

    folder = made_once(tmp_path_factory, "whole_run", make)
    return folder / "whole", (folder / "printed.json").read_text()


@pytest.fixture
def without_figures(monkeypatch):
    """The report without its figures, which take longest."""
    leave_out_figures(monkeypatch)


@pytest.fixture
def run_copy(whole_run, tmp_path):
    return Path(shutil.copytree(whole_run[0], tmp_path / "copy"))
