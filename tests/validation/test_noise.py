"""The table of what last bits move."""

from __future__ import annotations

from validation.noise import table


def burst(end, speed, left):
    return {
        "end_time": end, "mean_speed_at_end": speed, "acceleration_left": left,
        "mean_initial_speed": speed * (1.0 + (left or 0.0)) ** 0.5,
    }  # fmt: skip


def test_rows_are_means_and_spreads_in_the_units_of_their_names():
    rows = table("single", "6 mm", [burst(160e-6, 1000.0, 0.21), burst(161e-6, 1000.5, 0.21)])
    assert rows == [
        "| single, 6 mm | end (us) | 160.50 | 1 |",
        "| single, 6 mm | mean speed at the end (m/s) | 1000.25 | 0.5 |",
        "| single, 6 mm | its asymptote (m/s) | 1100.28 | 0.55 |",
        "| single, 6 mm | mean speed handed over (m/s) | 1100.28 | 0.55 |",
    ]


def test_a_burst_without_an_asymptote_has_no_such_row():
    assert len(table("pair", "12 mm", [burst(160e-6, 1000.0, None)])) == 3
