"""Tables as text: ten significant digits, whole numbers in full, what is written is read back equal."""

from __future__ import annotations

import tracemalloc

import numpy as np
import pytest

from flight.files.text_tables import ROWS_AT_ONCE, Labels, read_columns, write_columns


def _lines(path):
    return path.read_text().splitlines()[1:]


def test_cells_have_ten_digits_and_whole_numbers_all(tmp_path):
    columns = {
        "x": np.array([0.1, -0.0, np.nan, np.inf, 5e-324, 1e10 / 3.0, 9999999999.5]),
        "n": np.array([-(2**63), 2**63 - 1, 0, 7, -7, 10**10, 1]),
        "yes": np.arange(7) % 2 == 0,
    }
    path = write_columns(tmp_path / "table.csv", columns)
    assert _lines(path) == [
        "0.1,-9223372036854775808,1", "-0,9223372036854775807,0", "nan,0,1", "inf,7,0", "4.940656458e-324,-7,1",
        "3333333333,10000000000,0", "1e+10,1,1",
    ]  # fmt: skip


def test_numbers_are_read_back_equal_to_ten_digits(tmp_path):
    drawn = np.random.default_rng(18).integers(-(2**63), 2**63 - 1, 20_000).view(np.float64)
    drawn = drawn[np.isfinite(drawn) & (np.abs(drawn) > 1e-300)]
    path = write_columns(tmp_path / "numbers.csv", {"x": drawn, "n": np.arange(len(drawn))})
    found = read_columns(path)
    np.testing.assert_allclose(found["x"], drawn, rtol=5.1e-10, atol=0.0)
    np.testing.assert_array_equal(found["n"], np.arange(len(drawn)))


@pytest.mark.slow
def test_a_million_rows_are_never_in_memory_as_text(tmp_path):
    columns = {name: np.random.default_rng(3).normal(size=1_000_000) for name in ("x", "y", "z")}
    tracemalloc.start()
    try:
        path = write_columns(tmp_path / "table.csv", columns)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert path.stat().st_size > 3.5e7
    assert peak < 0.2 * path.stat().st_size


@pytest.mark.parametrize("number", [0, 1, ROWS_AT_ONCE, ROWS_AT_ONCE + 1])
def test_blocks_join_without_a_seam(tmp_path, number):
    columns = {"name": Labels(["a,b", "ü"], np.arange(number) % 2), "half": 0.5 * np.arange(number)}
    path = write_columns(tmp_path / "table.csv", columns)
    names = ['"a,b"', "ü"]
    assert path.read_text().splitlines() == [
        "name,half", *(f"{names[row % 2]},{0.5 * row:.10g}" for row in range(number)),
    ]  # fmt: skip
