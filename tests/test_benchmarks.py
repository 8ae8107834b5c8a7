"""The benchmarks' command line."""

from __future__ import annotations

import pytest

pytestmark = pytest.mark.dolfinx


def test_an_unknown_benchmark_is_refused_by_name(capsys):
    from benchmarks.__main__ import main

    assert main(["stepp"]) == 2
    assert "none is named 'stepp'; there are step, threads" in capsys.readouterr().err
