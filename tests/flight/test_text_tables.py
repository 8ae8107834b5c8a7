"""Tables as text: every cell as C writes it, a million rows in little memory."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.flight_files import plainly, written
from flight.files.text_tables import ROWS_AT_ONCE, Labels, write_columns

ROWS = 20_000


def _lines(path):
    return path.read_text().splitlines()[1:]


def _decimal(values):
    return [f"{value:.10g}" for value in np.asarray(values, dtype=np.float64).tolist()]


@pytest.fixture(scope="module")
def drawn():
    """Numbers of every kind, most of them where rounding is hard."""
    draw = np.random.default_rng(18)
    bits = draw.integers(-(2**63), 2**63 - 1, ROWS)
    ends = np.array([0.0, -0.0, np.nan, np.inf, -np.inf, 5e-324, 1.7976931348623157e308, 1e-5, 1e-4, 9999999999.5])
    halves = draw.integers(-(2**40), 2**40, ROWS) / 2.0 ** draw.integers(0, 12, ROWS)
    powers = 10.0 ** draw.integers(-50, 50, ROWS)
    beside = np.nextafter(10.0 ** draw.integers(-20, 20, ROWS), draw.choice([-np.inf, np.inf], ROWS))
    nines = (1e10 - draw.integers(0, 30, ROWS) / 10.0) * 10.0 ** draw.integers(-20, 10, ROWS)
    return {
        "bits": np.concatenate([ends, bits.view(np.float64)[len(ends) :]]),
        "halves of the last digit": halves,
        "powers of ten": powers,
        "beside powers of ten": beside,
        "nines": nines,
        "short": np.round(draw.uniform(-1000.0, 1000.0, ROWS), 3),
        "single": draw.normal(size=ROWS).astype(np.float32),
        "whole": bits,
        "small": (bits >> 57).astype(np.int8),
        "yes or no": bits > 0,
    }


def test_every_cell_is_as_c_writes_it(tmp_path, drawn):
    write_columns(tmp_path / "ours.csv", drawn, {})
    plainly(tmp_path / "plain.csv", drawn)
    ours, plain = _lines(tmp_path / "ours.csv"), _lines(tmp_path / "plain.csv")
    assert len(ours) == ROWS
    assert [(a, b) for a, b in zip(ours, plain, strict=True) if a != b] == []


@settings(max_examples=100, deadline=None, derandomize=True)
@given(st.lists(st.floats(), min_size=1, max_size=50))
def test_no_number_is_written_otherwise(tmp_path_factory, numbers):
    path = tmp_path_factory.mktemp("table") / "numbers.csv"
    write_columns(path, {"x": np.array(numbers)}, {})
    assert _lines(path) == _decimal(numbers)


@pytest.mark.parametrize("number", [0, 1, ROWS_AT_ONCE - 1, ROWS_AT_ONCE, ROWS_AT_ONCE + 1])
def test_blocks_join_without_a_seam(tmp_path, number):
    which = np.arange(number) % 2
    columns = {"name": Labels(["a,b", "ü"], which), "row": np.arange(number), "half": 0.5 * np.arange(number)}
    path = write_columns(tmp_path / "table.csv", columns, {"case": "mine"})
    names = ['"a,b"', "ü"]
    assert path.read_text().splitlines() == [
        '# case = "mine"',
        "name,row,half",
        *(f"{names[row % 2]},{row},{0.5 * row:.10g}" for row in range(number)),
    ]


def test_a_column_of_a_structured_array_and_no_labels(tmp_path):
    table = np.zeros(3, dtype=[("x", "f8", 3), ("n", "i4")])
    table["x"] = np.arange(9.0).reshape(3, 3) / 7.0
    path = write_columns(tmp_path / "t.csv", {"y": table["x"][:, 1], "n": table["n"]}, {})
    assert _lines(path) == [f"{value:.10g},0" for value in table["x"][:, 1]]
    empty = write_columns(tmp_path / "e.csv", {"name": Labels([], np.zeros(0, dtype=np.int32))}, {})
    assert empty.read_text() == "name\n"


@pytest.mark.slow
def test_a_million_fragments_are_flown_and_written():
    """0.91 GB and 33.7 core-seconds for `fragfield fly` before 2026-11-23, 15 of them for files."""
    found = written(1_000_000)
    assert found["same_text_as_row_by_row"]
    assert found["bytes_written"] > 6e8, found
    assert found["peak_bytes"] < 0.72e9, found
    assert found["row_by_row_over_this"] > 2.0, found
    assert found["core_seconds_of_the_files"] < 0.5 * found["core_seconds_of_the_flight"], found
