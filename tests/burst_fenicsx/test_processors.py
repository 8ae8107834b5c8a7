"""On a processor without vectors of 512 bits kernels and bursts give the same numbers to the last bit."""

from __future__ import annotations

import os
import platform
import subprocess
import sys
from pathlib import Path

import h5py
import numpy as np
import pytest

from tests.fragfield.short_run import RINGS, command

ROOT = Path(__file__).parents[2]
CPUINFO = Path("/proc/cpuinfo")

BLOCK = """
import hashlib
import numpy as np
from numba.core.registry import cpu_target
from burst_fenicsx.kernels.step.assembly import make_scratch
from burst_fenicsx.kernels.cells.one_point import velocity_gradient
from burst_fenicsx.kernels.cells.layout import POSITION, STRESS, VELOCITY
from burst_fenicsx.kernels.lanes import LANES
from burst_fenicsx.kernels.cells.solid import return_stress

corners = np.array([[(n >> i) & 1 for i in range(3)] for n in range(8)], dtype=float)
random = np.random.default_rng(7)
rows = make_scratch(1)[0]
places = 4e-3 * (corners[:, :, None] + 0.2 * random.random((8, 3, LANES)))
rows[POSITION * LANES : (POSITION + 24) * LANES] = places.ravel()
rows[VELOCITY * LANES : (VELOCITY + 24) * LANES] = 1e3 * random.standard_normal(24 * LANES)
velocity_gradient(1e-8, rows)
moved = rows.copy()
rows[:] = 0.0
rows[STRESS * LANES : (STRESS + 6) * LANES] = 2e9 * random.standard_normal(6 * LANES)
trial = rows.copy()
material = np.array([2.05e11, 0.29, 7850.0, 0.06, 1.5, 0.1, 0.05, 0.0, 4e8, 9e8, 2.0, 5.0])
return_stress(material, rows)
assert np.isfinite(moved).all() and np.isfinite(rows).all() and (rows != trial).any()
name = cpu_target.target_context.codegen().magic_tuple()[1]
print(name, hashlib.sha256(moved.tobytes() + rows.tobytes()).hexdigest())
"""


def processor_and_digest(**variables: str) -> list[str]:
    """Name of the processor that a process compiles a block's kernels for, and the digest of what they compute."""
    done = subprocess.run(
        [sys.executable, "-c", BLOCK], cwd=ROOT, env={**os.environ, **variables}, stdout=subprocess.PIPE, text=True,
        check=True,
    )  # fmt: skip
    return done.stdout.split()


@pytest.mark.slow
@pytest.mark.skipif(platform.machine() != "x86_64", reason="the other processor is one of this kind")
def test_narrower_vectors_give_the_same_bits():
    # Without the empty list of features the other processor would have this one's.
    other, found = processor_and_digest(NUMBA_CPU_NAME="x86-64-v3", NUMBA_CPU_FEATURES="")
    assert other == "x86-64-v3"
    assert found == processor_and_digest()[1]


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
