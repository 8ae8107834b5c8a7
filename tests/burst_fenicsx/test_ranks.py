"""Ranks: ghosts and names; runs that agree to the last bit; an error on one ends all with one message."""

from __future__ import annotations

import shutil
import textwrap
import time

import h5py
import numba
import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from mpi4py import MPI

from burst_fenicsx.errors import InputError
from tests.burst_fenicsx.rank_states import OF_RANKS, burst, differences, state, summary_text, tubes
from tests.datasets import same_data

pytestmark = [pytest.mark.dolfinx, pytest.mark.mpi]


DISTRIBUTION = """
import sys
from pathlib import Path
sys.path.insert(0, str(Path.cwd()))
import numpy as np
from dataclasses import replace
from dolfinx import fem
from mpi4py import MPI
from burst_fenicsx import compat
from burst_fenicsx.meshing import merge, mesh_round
from burst_fenicsx.meshing.distributed import distribute
from burst_fenicsx.meshing.cut import split_charges
from tests.burst_fenicsx.tubes import tube

comm = MPI.COMM_WORLD
rounds = [tube(), tube(position=(0.2, 0.0, 0.0))]
mesh = merge([split_charges(mesh_round(item, 20e-3, index)) for index, item in enumerate(rounds)])
pairs = len(mesh.interface_pairs)
assert pairs > 0
assert np.array_equal(mesh.nodes[mesh.interface_pairs[:, 0]], mesh.nodes[mesh.interface_pairs[:, 1]])
at_random = np.random.default_rng(3).integers(0, comm.size, len(mesh.cells)).astype(np.int32)
for owner in (None, at_random):  # in runs of cells, and at random
    given = mesh if comm.rank == 0 else None
    spread = distribute(comm, given, destination=owner)

    # Every cell has one owner and keeps its names and nodes, ghosts too.
    assert np.array_equal(np.sort(np.concatenate(comm.allgather(spread.cell))), np.arange(len(mesh.cells)))
    assert np.array_equal(spread.all_cell[: spread.cells], spread.cell)
    assert np.array_equal(spread.all_dofmap[: spread.cells], spread.dofmap)
    assert np.array_equal(spread.node[spread.all_dofmap], mesh.cells[spread.all_cell])
    assert np.array_equal(spread.all_part, mesh.part[spread.all_cell])
    assert np.array_equal(spread.all_round, mesh.round[spread.all_cell])
    assert np.array_equal(spread.domain.geometry.x, mesh.nodes[spread.node])
    assert np.array_equal(np.sort(spread.row[: spread.cells]), np.arange(spread.cells))
    original = np.asarray(spread.domain.topology.original_cell_index)
    assert np.array_equal(spread.all_cell[spread.row], original)
    assert np.array_equal(compat.geometry_dofmap(spread.domain), spread.all_dofmap[spread.row])

    # Functions of nodes and of cells carry the owners' values to the ghosts, and the ghosts' sums back.
    function = fem.Function(spread.vector_space)
    values = function.x.array.reshape(-1, 3)
    values[: spread.owned_nodes, 1] = spread.node[: spread.owned_nodes]
    function.x.scatter_forward()
    assert np.array_equal(values[:, 1], spread.node)
    values[:] = 1.0
    compat.add_ghosts(function.x)
    function.x.scatter_forward()
    copies = sum(comm.allgather(np.bincount(spread.node, minlength=len(mesh.nodes))))
    assert np.array_equal(values[:, 0], copies[spread.node])
    for points in (1, 8):
        function = fem.Function(spread.cell_space(6, points))
        values = function.x.array.reshape(-1, points, 6)
        values[: spread.cells] = spread.cell[:, None, None] + 0.1 * np.arange(points)[:, None]
        function.x.scatter_forward()
        assert np.array_equal(values[:, :, 5], spread.all_cell[:, None] + 0.1 * np.arange(points))
    assert comm.allreduce(spread.owned_nodes) == len(mesh.nodes)

    # A rank has every cell that touches a place which a cell of its own touches, once, and no other.
    place = np.arange(len(mesh.nodes))
    place[mesh.interface_pairs[:, 0]] = mesh.interface_pairs[:, 1]
    places = place[mesh.cells]
    touched = np.zeros(len(place), dtype=bool)
    touched[places[spread.cell]] = True
    assert np.array_equal(np.sort(spread.all_cell), np.flatnonzero(touched[places].any(axis=1)))

    # Numbers to local nodes and back.
    local = spread.local_node(np.arange(len(mesh.nodes)))
    assert np.array_equal(local[spread.node], np.arange(len(spread.node)))
    assert (np.delete(local, spread.node) == -1).all()
    both = spread.local_node(mesh.interface_pairs)
    assert both.dtype == np.int32 and both.shape == mesh.interface_pairs.shape
    assert np.array_equal(both[:, 0] >= 0, both[:, 1] >= 0)
    assert (spread.local_node(np.array([-1, len(mesh.nodes)])) == -1).all()

if comm.rank == 0:
    print("distributed")
"""


@pytest.mark.parametrize("ranks", [1, 3, pytest.param(4, marks=pytest.mark.slow)])
def test_both_sides_of_a_split_are_where_either_is(tmp_path, on_ranks, ranks):
    """Two split rounds on ranks, in runs of cells and at random: ghosts, names, number of nodes, local nodes."""
    script = tmp_path / "distribution.py"
    script.write_text(textwrap.dedent(DISTRIBUTION))
    assert on_ranks(ranks, script).strip() == "distributed"


@pytest.fixture(scope="module")
def pair(tmp_path_factory):
    """State of the pair with bonds and colliding surfaces on one rank, and the folder with its files."""
    folder = tmp_path_factory.mktemp("pair")
    going = burst(folder, MPI.COMM_SELF)
    (folder / "state.json").write_text(summary_text(going.finish()))
    found = state(going)
    assert found["steps"] > 90
    assert going.leakage.factor.min() < 0.99
    penetrations = going.solver.contact.penetrations
    assert penetrations.collision > 0.0
    assert penetrations.interface_after > 0.0
    return found, folder


@pytest.mark.parametrize(
    ("ranks", "partition"),
    [
        (2, "sectors"),
        (3, "random"),
        *(
            pytest.param(ranks, partition, marks=pytest.mark.slow)  # the same for other numbers and partitions
            for ranks, partition in ((2, "random"), (3, "sectors"), (4, "sectors"), (4, "random"))
        ),
    ],
)
def test_ranks_change_no_bit(tmp_path, on_ranks, pair, ranks, partition):
    """Two tubes that meet, with contact, leakage and bonds: fields, histories, ledger, segments, summary."""
    path = tmp_path / "state.npz"
    on_ranks(ranks, "-m", "tests.burst_fenicsx.rank_states", path, partition)
    found = dict(np.load(path))
    assert found.pop("ranks") == ranks
    received = found.pop("received")
    if (ranks, partition) == (2, "sectors"):  # a round each: of the other's surface, what is near
        assert 0.0 < received < 0.25
    assert differences(pair[0], found) == []
    for name in ("burst", "burst_snapshot.h5"):
        same_data(pair[1] / name, tmp_path / name)
    assert (tmp_path / "state.json").read_text() == (pair[1] / "state.json").read_text()


def test_ranks_with_threads_change_no_bit(tmp_path, mpirun, pair):
    """Two ranks of two threads each."""
    if numba.config.NUMBA_NUM_THREADS < 2:
        pytest.skip("one thread only")
    path = tmp_path / "state.npz"
    mpirun(2, "-m", "tests.burst_fenicsx.rank_states", path, threads=2)
    assert differences(pair[0], {name: values for name, values in np.load(path).items() if name not in OF_RANKS}) == []


@pytest.mark.parametrize("options", [pytest.param(("shared",), marks=pytest.mark.slow), ("shared", "full", "jwl")])
def test_ranks_change_no_bit_without_contact(tmp_path, on_ranks, options):
    """Charge and casing on the same nodes, both quadratures, by two product models, cells dealt at random."""
    alone = state(burst(tmp_path, MPI.COMM_SELF, frozenset(options)))
    path = tmp_path / "state.npz"
    on_ranks(3, "-m", "tests.burst_fenicsx.rank_states", path, "random", *options)
    assert differences(alone, {name: values for name, values in np.load(path).items() if name not in OF_RANKS}) == []


def test_ranks_change_no_bit_of_half_rounds(tmp_path, on_ranks):
    """A half and a quarter of tubes that meet, on one rank and on two: every bit, and all rounds in the files."""
    alone = tmp_path / "alone"
    alone.mkdir()
    going = burst(alone, MPI.COMM_SELF, frozenset({"symmetry"}))
    (alone / "state.json").write_text(summary_text(going.finish()))
    assert [len(cuts) for cuts in going.part.cuts] == [1, 2]
    assert going.solver.contact.penetrations.collision > 0.0
    path = tmp_path / "state.npz"
    on_ranks(2, "-m", "tests.burst_fenicsx.rank_states", path, "random", "symmetry")
    found = dict(np.load(path))
    assert found.pop("ranks") == 2
    assert found.pop("received") > 0.0
    assert differences(state(going), found) == []
    for name in ("burst", "burst_snapshot.h5"):
        same_data(alone / name, tmp_path / name)
    assert (alone / "state.json").read_text() == (tmp_path / "state.json").read_text()
    with h5py.File(tmp_path / "burst_snapshot.h5") as file:
        assert "planes" not in file  # nothing is left for the break-up to mirror
        assert [file[f"rounds/{k}"].attrs["name"] for k in range(3)] == ["tube_-1", "tube_0", "tube_1"]
        places = [file[f"rounds/{k}"].attrs["position"][0] for k in range(3)]
        assert places == pytest.approx([-0.16, 0.0, 0.16], abs=1e-12)
        position, velocity = file["nodes/position"][()], file["nodes/velocity"][()]
        cells, of_round, mass = (file[f"cells/{name}"][()] for name in ("nodes", "round", "mass"))
    momenta = []
    for index, place in enumerate(places):
        own = cells[of_round == index]
        assert position[own].mean(axis=(0, 1))[0] == pytest.approx(place, abs=0.01)
        momenta.append(mass[of_round == index] @ velocity[own].mean(axis=1))
    assert momenta[0][0] < 0.0 < momenta[2][0]  # reflected from each other
    np.testing.assert_allclose(momenta[0][:2], -momenta[2][:2], atol=1e-9 * momenta[2][0])


def test_ranks_change_no_bit_at_walls_nor_after_a_resume(tmp_path, on_ranks):
    """Two planes with friction, three ranks; they go on from their checkpoint, one rank refuses it."""
    alone, several, resumed = (tmp_path / name for name in ("alone", "several", "resumed"))
    alone.mkdir()
    several.mkdir()
    options = frozenset({"walls"})
    going = burst(alone, MPI.COMM_SELF, options)
    expected = summary_text(going.finish())
    assert going.contact.penetrations.plane > 0.0
    assert going.contact.penetrations.collision > 0.0
    assert going.contact.impulse[0] > 0.0
    on_ranks(3, "-m", "tests.burst_fenicsx.rank_states", several / "state.npz", "random", *options)
    assert (several / "state.json").read_text() == expected
    shutil.copytree(several, resumed)
    with h5py.File(resumed / "checkpoint.h5") as file:
        assert 0.0 < file.attrs["time"] < 0.9 * going.solver.time
    with pytest.raises(InputError, match=r"written on 3 ranks, and this run has 1; resume it on as many, or delete it"):
        tubes(resumed, MPI.COMM_SELF, options).resume()
    on_ranks(3, "-m", "tests.burst_fenicsx.rank_states", resumed / "state.npz", "random", "resume", *options)
    assert (resumed / "state.json").read_text() == expected
    for folder in (several, resumed):
        for name in ("burst", "burst_snapshot.h5"):
            same_data(alone / name, folder / name)


CASE = """
title = "Two tubes"

[burst]
cell_size = "20 mm"
end_time = "40 us"

[[round]]
name = "left"
profile = "tube"
explosive = "tnt"
casing = "steel_paper"

[[round]]
name = "right"
profile = "tube"
explosive = "tnt"
casing = "steel_paper"
position = ["0.3 m", "0 m", "0 m"]
"""

SCRIPT = """
import sys
from pathlib import Path
sys.path.insert(0, str(Path.cwd()))
import numpy as np
from mpi4py import MPI
from burst_fenicsx.mechanics.solver import BurstSolver
from fragfield.cli import main

what, where = sys.argv[1], int(sys.argv[2])
usual = BurstSolver._add_forces

def hurt(solver, step, substep):
    last = substep == 2**solver.levels.highest
    if MPI.COMM_WORLD.rank == where and solver.steps == 7 and last and step > 0.0:
        if what == "fault":
            raise RuntimeError("something gave way")
        dofmap, position = solver.fields.mesh.dofmap, solver.fields.nodes.position
        nodes = dofmap[len(dofmap) // 2]
        position[nodes] = position[nodes[[4, 5, 6, 7, 0, 1, 2, 3]]]
    usual(solver, step, substep)

BurstSolver._add_forces = hurt
sys.argv = ["fragfield", *sys.argv[3:]]
main()
"""


@pytest.mark.parametrize(
    ("ranks", "where", "what"),
    [
        (2, 1, "fault"),
        (2, 0, "lost"),
        pytest.param(3, 2, "lost", marks=pytest.mark.slow),
        pytest.param(4, 3, "fault", marks=pytest.mark.slow),
    ],
)
def test_an_error_on_one_rank_ends_all_with_one_message(tmp_path, mpirun, ranks, where, what):
    """A cell turned inside out, and a fault in the middle of a step, while the others wait for that rank."""
    case, script = tmp_path / "case.toml", tmp_path / "hurt.py"
    case.write_text(CASE)
    script.write_text(textwrap.dedent(SCRIPT))
    code, message = (3, "lost cell: cell ") if what == "lost" else (4, "something gave way")
    began = time.monotonic()
    out = tmp_path / "run"
    done = mpirun(ranks, script, what, str(where), "burst", case, "--out", out, check=False, timeout=120.0)
    assert done.returncode == code, done.stderr
    # Open MPI's own words may come in between, and leave a space before ours.
    reported = [line.strip() for line in done.stderr.splitlines() if line.strip().startswith("fragfield: ")]
    assert len(reported) == 1, done.stderr
    assert message in reported[0]
    if what == "lost":
        assert "has turned inside out (at " in reported[0]
        assert "Traceback" not in done.stderr
    elif where > 0:
        assert reported[0].startswith(f"fragfield: rank {where}: ")
    assert time.monotonic() - began < 100.0
