"""A coarse, short tube as a round, and runs of it."""

from __future__ import annotations

import os
import signal
from dataclasses import replace
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from burst_fenicsx.geometry import load_profile
from burst_fenicsx.problem import BurstSettings, IgnitionPoint, Round
from tests.burst_fenicsx.boxes import STEEL, TNT

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from burst_fenicsx.geometry import Profile
    from burst_fenicsx.simulation import Simulation

SETTINGS = BurstSettings(cell_size=20e-3, end_time=20e-6, output_interval=10e-6, symmetry="off")


@cache
def profile() -> Profile:
    return load_profile("tube")


def tube(**changes: Any) -> Round:
    """155/110 mm steel tube with TNT, initiated at the nose end, on the axis."""
    item = Round(name="tube", explosive=TNT, casing=STEEL, profile=profile(), ignition=(IgnitionPoint(station=0.0),))
    return replace(item, **changes)


def interrupted(
    folder: Path, settings: BurstSettings, time: float, rounds: Sequence[Round] = (), *, resume: bool = False
) -> None:
    """Run until the first progress report after `time` (s) and press Ctrl-C there."""
    from mpi4py import MPI

    from burst_fenicsx.run_burst import simulate

    def press(progress: Any) -> None:
        if progress.time > time:
            os.kill(os.getpid(), signal.SIGINT)

    options = {"comm": MPI.COMM_SELF, "provenance": {"case": "tube"}, "on_progress": press, "resume": resume}
    with pytest.raises(KeyboardInterrupt):
        simulate(rounds or [tube()], settings, folder, **options)


def check_balances(going: Simulation, at_end: float, interface: str) -> np.ndarray:
    """Momentum to 1e-12, energy to 1 % once a little is burnt and to `at_end` at the end; what contact makes aside.

    Gives the errors of the energy. Shared nodes have no contact.
    """
    entries, errors = going.ledger.entries, going.ledger.columns()["energy_error"]
    settled = going.ledger.columns()["products_work"] > 0.03 * going.ledger.chemical_energies[0]
    made = np.array([entry.contact_error for entry in entries])
    assert max(entry.momentum_error for entry in entries) < 1e-12
    assert errors[settled].max() < 0.01, errors
    assert errors[-1] < at_end, errors
    assert made.max() == 0.0 if interface == "shared" else 0.0 < made.max() < 0.04, made
    assert made[-1] < 0.02
    return errors
