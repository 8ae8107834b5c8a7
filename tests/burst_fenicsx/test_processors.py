"""On a processor without vectors of 512 bits kernels and bursts give the same numbers to the last bit."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import h5py
import numpy as np
import pytest

from tests.fragfield.short_run import RINGS, command

ROOT = Path(__file__).parents[2]
CPUINFO = Path("/proc/cpuinfo")


def arrays(path: Path) -> dict[str, np.ndarray]:
    """Every array of a file by its name."""
    found: dict[str, np.ndarray] = {}

    def keep(name: str, item: object) -> None:
        if isinstance(item, h5py.Dataset):
            found[name] = item[()]

    with h5py.File(path) as file:
        file.visititems(keep)
    return found


@pytest.mark.slow
@pytest.mark.dolfinx
@pytest.mark.skipif(
    not CPUINFO.is_file() or "avx512dq" not in CPUINFO.read_text(), reason="this processor has no vectors of 512 bits"
)
def test_a_run_with_avx2_is_that_with_wider_vectors(tmp_path):
    """Burst and break-up, and with them the numpy that leads to them."""
    (tmp_path / "case.toml").write_text(RINGS)
    wide = {name: value for name, value in os.environ.items() if name != "FRAGFIELD_PROCESSOR"}
    for name, variables in (("wide", wide), ("avx2", wide | {"FRAGFIELD_PROCESSOR": "avx2"})):
        for stage, of in (("burst", tmp_path / "case.toml"), ("break-up", tmp_path / name)):
            arguments = (stage, of, "--out", tmp_path / name) if stage == "burst" else (stage, of)
            subprocess.run(command(*arguments, "--threads", "1", "--quiet"), env=variables, check=True)
    bursts, fragments = (
        [arrays(tmp_path / run / file) for run in ("wide", "avx2")] for file in ("burst_snapshot.h5", "fragments.h5")
    )
    wide, narrow = bursts
    of_cells_and_nodes = [key for key in wide if key.startswith(("cells/", "nodes/"))]
    assert len(of_cells_and_nodes) > 5
    assert [key for key in of_cells_and_nodes if wide[key].tobytes() != narrow[key].tobytes()] == []
    # Masses come from numpy's own logarithm: round-off in the velocities, which close the momentum.
    wide, narrow = fragments
    np.testing.assert_allclose(wide["fragments/velocity"], narrow["fragments/velocity"], rtol=0.0, atol=1e-7)
