"""Rounds that waited for a shock: sentences, table and findings."""

from __future__ import annotations

from pathlib import Path

import pytest

from fragfield.hazard.shock_exposure import exposed_rounds, exposure_words
from fragfield.report.findings.findings import findings
from fragfield.report.reading.run_files import RunFiles
from fragfield.report.tables.ignition import exposure_table

EXPOSURE = {
    "peak_pressure": 3.95e9, "energy": 1.5e6, "pulse_pressure": 3.2e9, "held_time": 2.5e-6, "place": [0.0, 0.0, 0.0],
    "time": 4e-5, "floor": 1e9, "resolved_cell": 1.8e-3, "resolved": False, "critical_energy": [1.38e6, 1.84e6],
    "ratio": [1.087, 0.815], "verdict": "within",
}  # fmt: skip


def run_with(**changes):
    rounds = [
        {"name": "donor", "ignition": [{"by": "point"}]},
        {"name": "acceptor", "ignition": [], "exposure": {**EXPOSURE, **changes}},
    ]
    return RunFiles(Path(), summary={"burst": {"rounds": rounds}})


def test_a_sentence_gives_pressure_time_energy_threshold_and_what_the_cells_allow():
    assert exposure_words(EXPOSURE) == (
        "largest pressure 3.95 GPa; strongest pulse 3.2 GPa held for 2.5 us, 1.5 MJ/m2 against 1.38 to 1.84 MJ/m2 "
        "(ratio 0.81 to 1.1): within the scatter of the published critical energies; the cells are too coarse to "
        "resolve this pulse, which needs 1.8 mm or less: pressure and energy increase with smaller cells"
    )
    weak = exposure_words({**EXPOSURE, "energy": 0.0, "peak_pressure": 0.4e9})
    assert weak == "largest pressure 0.4 GPa, never above the threshold of 1 GPa from which a pulse is counted"


def test_only_rounds_that_wait_are_in_the_table():
    run = run_with()
    assert [(name, initiated) for name, _, initiated in exposed_rounds(run.part("burst"))] == [("acceptor", False)]
    (table,) = exposure_table(run)
    assert table.lines == (
        ("acceptor", "no", "3.95", "3.20", "2.50", "1.50", "1.38 to 1.84", "within, cells too coarse", "1.8"),
    )
    assert list(exposure_table(RunFiles(Path(), summary={"burst": {"rounds": [{"name": "donor"}]}}))) == []


@pytest.mark.parametrize(
    ("changes", "weight"),
    [
        ({}, "warning"),
        ({"verdict": "below", "resolved": True}, "note"),
        ({"verdict": "below", "resolved": False}, "warning"),
        ({"verdict": "above", "resolved": True}, "warning"),
    ],
)
def test_a_finding_never_calls_a_round_safe(changes, weight):
    reported = [one for one in findings(run_with(**changes)) if "was not initiated" in one.text]
    assert [one.weight for one in reported] == [weight]
    assert reported[0].text.endswith("a round below it is not therefore safe.")
