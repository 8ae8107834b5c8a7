"""Metal beyond planes and within other rounds: cells that hold points, masses, sums of ranks, the stop, its message."""

from __future__ import annotations

import logging
import textwrap
from dataclasses import replace

import h5py
import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from mpi4py import MPI

from burst_fenicsx.contact.planes import PlaneContact
from burst_fenicsx.errors import NumericalStop
from burst_fenicsx.meshing import merge
from burst_fenicsx.meshing.cut import cut_mesh, split_charges
from burst_fenicsx.problem import ContactSettings, Mirror, Part, RigidPlane, Round
from burst_fenicsx.records.interpenetration import LARGEST_PASSED_FRACTION, InterpenetrationCheck
from burst_fenicsx.records.within_rounds import hold
from burst_fenicsx.simulation import Simulation
from fragfield.errors import exit_code_of
from tests.burst_fenicsx.bodies import QUIET, bodies, moved
from tests.burst_fenicsx.boxes import ELASTIC, TNT, box, rotation_matrix
from tests.burst_fenicsx.tubes import SETTINGS, tube

pytestmark = pytest.mark.dolfinx

OVERLAP = """
import sys
from dataclasses import replace
from pathlib import Path
sys.path.insert(0, str(Path.cwd()))
import numpy as np
from mpi4py import MPI
from burst_fenicsx.problem import RigidPlane
from burst_fenicsx.simulation import Simulation
from tests.burst_fenicsx.tubes import SETTINGS, tube

wall = RigidPlane("wall", (-0.08, 0.0, 0.0), (1.0, 0.0, 0.0))
rounds = [tube(name="left"), tube(name="right", position=(0.16, 0.01, 0.005))]
going = Simulation(rounds, replace(SETTINGS, planes=(wall,)), Path(sys.argv[1]), MPI.COMM_WORLD, {})
fields = going.fields
right = np.unique(fields.mesh.all_dofmap[fields.mesh.all_round == 1])
fields.nodes.position[:, 0] -= 0.006
fields.nodes.position[right, 0] -= 0.03
found = going.interpenetration.look(0.0)
values = [*found.together, *found.in_rounds, *found.beyond_planes, found.deepest, *found.centre.ravel()]
if MPI.COMM_WORLD.rank == 0:
    print(" ".join(float(value).hex() for value in values))
"""
CELL = 0.01
DENSITY = ELASTIC.density
WALL = RigidPlane("wall", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
CUBE = np.array([[x, y, z] for z in (-1.0, 1.0) for y in (-1.0, 1.0) for x in (-1.0, 1.0)])
SHELL = 8 * CELL  # edge of a cube with walls of two cells around a charge of 4 x 4 x 4


def inside(points, corner, overlap=0.0, outward=False):
    count = len(points)
    return hold(np.broadcast_to(corner, (count, 8, 3)), points, np.broadcast_to(outward, (count, 6)), overlap)


def test_points_of_oblique_cells_are_held_exactly():
    """Cells with plane faces, their images under random linear maps: held if and only if no coordinate exceeds 1."""
    random = np.random.default_rng(4)
    for _ in range(20):
        matrix = 0.003 * (np.eye(3) + random.uniform(-0.4, 0.4, (3, 3)))
        natural = random.uniform(-1.3, 1.3, (400, 3))
        wanted = np.abs(natural).max(axis=1) < 1.0
        assert 50 < wanted.sum() < 350
        assert np.array_equal(inside(natural @ matrix, CUBE @ matrix), wanted)


def test_bent_cells_that_fill_a_block_hold_its_points_once():
    """Nodes within the block moved by up to a fifth of a cell: 1 % of the points may lie in two cells or in none."""
    mesh = box((4, 4, 4), (4 * CELL,) * 3)
    random = np.random.default_rng(6)
    free = ((mesh.nodes > 0.5 * CELL) & (mesh.nodes < 3.5 * CELL)).all(axis=1)
    nodes = mesh.nodes + 0.2 * CELL * random.uniform(-1.0, 1.0, mesh.nodes.shape) * free[:, None]
    points = random.uniform(0.0, 4 * CELL, (2000, 3))
    times = sum(inside(points, nodes[cell]).astype(int) for cell in mesh.cells)
    assert np.mean(times != 1) < 0.01
    assert not any(inside(points + 4 * CELL, nodes[cell]).any() for cell in mesh.cells)


def test_a_point_must_lie_deeper_than_the_overlap_from_faces_that_look_outward():
    """A brick of 4 x 2 x 0.4 mm and 0.1 mm: on the thin sides an eighth of the width, 0.05 mm, at most."""
    corner = 0.5e-3 * CUBE * [4.0, 2.0, 0.4]
    along = np.array([[x, 0.0, 0.0] for x in (-1.91e-3, -1.89e-3, 1.89e-3, 1.91e-3)])
    across = np.array([[0.0, 0.0, z] for z in (-0.16e-3, -0.14e-3, 0.14e-3, 0.16e-3)])
    for points in (along, across):
        assert inside(points, corner, 1e-4, outward=True).tolist() == [False, True, True, False]
        assert inside(points, corner, 1e-4).all()
    # Faces -z, +z, -y, +x, +y, -x.
    assert inside(along, corner, 1e-4, [False, False, False, True, False, False]).tolist() == [True, True, True, False]
    assert inside(across, corner, 1e-4, [True, False, False, False, False, False]).tolist() == [False, True, True, True]


def check_of(meshes, settings, names=("left", "right")):
    solver = bodies(meshes, [(0.0, 0.0, 0.0)] * len(meshes), settings)
    mesh = merge([replace(one, segments=((),)) for one in meshes])
    rounds = [Round(name=name, explosive=TNT, casing=ELASTIC) for name, _ in zip(names, meshes, strict=False)]
    return solver, InterpenetrationCheck(mesh, solver.fields, rounds, settings)


def test_the_mass_behind_a_plane_is_that_of_its_nodes():
    """A bar of 10 cells pushed 2.5 cells behind the plane: the nodes of three sections, 0.5 + 1 + 1 cells of mass."""
    settings = replace(QUIET, cell_size=CELL, planes=(WALL,))
    solver, check = check_of([box((10, 2, 2), (10 * CELL, 2 * CELL, 2 * CELL))], settings)
    whole = 10 * 4 * CELL**3 * DENSITY
    assert check.casing_mass == pytest.approx([whole])
    assert check.look(0.0).together.sum() == 0.0
    solver.fields.nodes.position[:, 0] -= 2.5 * CELL
    found = check.look(1e-6)
    assert found.beyond_planes == pytest.approx([0.25 * whole])
    assert found.deepest == pytest.approx(2.5 * CELL)
    assert found.in_rounds.sum() == 0.0
    assert found.centre[0] == pytest.approx([-CELL * (0.5 * 2.5 + 1.5 + 0.5) / 2.5, CELL, CELL])


def test_a_hundredth_of_a_cell_counts_as_contact():
    settings = replace(QUIET, cell_size=CELL, planes=(WALL,))
    solver, check = check_of([box((4, 2, 2), (4 * CELL, 2 * CELL, 2 * CELL))], settings)
    for depth, passed in ((0.009, False), (0.011, True)):
        solver.fields.nodes.position[:] = solver.fields.start - [depth * CELL, 0.0, 0.0]
        assert (check.look(0.0).together.sum() > 0.0) == passed


@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_the_mass_within_another_round_is_that_of_its_nodes(turn):
    """A bar of 8 cells thrust 2.5 cells deep into a block, in two positions: its sections at 0.5, 1.5, 2.5 cells."""
    matrix = rotation_matrix((1.0, 2.0, 3.0), turn)
    bar = moved(box((8, 1, 1), (8 * CELL, CELL, CELL)), (-5.5 * CELL, 2.2 * CELL, 2.3 * CELL))
    block = moved(box((6, 6, 6), (6 * CELL, 6 * CELL, 6 * CELL)), (0.0, 0.0, 0.0), 1)
    meshes = [replace(mesh, nodes=mesh.nodes @ matrix.T) for mesh in (bar, block)]
    settings = replace(QUIET, cell_size=CELL)
    _, check = check_of(meshes, settings)
    found = check.look(0.0)
    assert found.in_rounds[0] == pytest.approx(2.5 * CELL**3 * DENSITY)
    # And the block's nodes within the bar: at y and z of 3 cells, at x of 0 (half a cell's mass), 1 and 2 cells.
    assert found.in_rounds[1] == pytest.approx(2.5 * CELL**3 * DENSITY)
    assert found.together == pytest.approx(found.in_rounds)
    _, apart = check_of(meshes, replace(settings, contact=ContactSettings(surfaces=False)))
    assert not apart.needed


def shell(cuts=()):
    """A charge of 4 x 4 x 4 cells in a casing two cells thick, centred on the origin; the charge has its own nodes."""
    mesh = box((8, 8, 8), (SHELL, SHELL, SHELL))
    mesh = replace(mesh, nodes=mesh.nodes - 0.5 * SHELL)
    near = np.abs(mesh.nodes[mesh.cells].mean(axis=1)).max(axis=1) < 2 * CELL
    part = np.where(near, Part.CHARGE, Part.CASING).astype(np.int32)
    return moved(split_charges(cut_mesh(replace(mesh, part=part), cuts)), (0.0, 0.0, 0.0), 1)


def passed(bar, around, cuts=()):
    """Mass, in cells, of the bar that has passed into the shell, whose charge has grown to `around` times its size."""
    target = shell(cuts)
    settings = replace(QUIET, cell_size=CELL)
    solver = bodies([bar, target], [(0.0, 0.0, 0.0)] * 2, settings)
    rounds = [Round(name, TNT, ELASTIC) for name in ("bar", "shell")]
    mesh = merge([replace(one, segments=((),)) for one in (bar, target)])
    check = InterpenetrationCheck(mesh, solver.fields, rounds, settings)
    own = np.unique(solver.fields.mesh.dofmap[solver.fields.mesh.part == Part.CHARGE])
    solver.fields.nodes.position[own] *= around
    return check.look(0.0).in_rounds[0] / (CELL**3 * ELASTIC.density)


@pytest.mark.parametrize(("around", "metal"), [(0.99, 7.5), (3.0, 3.5 + 4.0 / 27.0)])
def test_metal_among_products_that_have_come_out_has_passed_through_nothing(around, metal):
    """A bar along x from -8.8 to 3.2 cells: of its sections the last eight lie in the shell, the last one half a cell.

    Where the charge has burst out to three times its size, two more sections lie among products in front of the wall,
    and the four within the wall among products that fill a 27th of the space.
    """
    bar = moved(box((12, 1, 1), (12 * CELL, CELL, CELL)), (-8.8 * CELL, -0.3 * CELL, 0.2 * CELL))
    assert passed(bar, around) == pytest.approx(metal, abs=1e-9)


@pytest.mark.parametrize(("void", "share"), [(0.0, 0.5), (0.25, 1.0 / 3.0), (0.5, 0.0), (0.6, 0.0)])
def test_torn_metal_that_finds_room_in_torn_metal_has_passed_through_nothing(void, share):
    """A bar 2.5 cells deep in a block that is half void: of its metal counts what the block's void does not take."""
    bar = moved(box((8, 1, 1), (8 * CELL, CELL, CELL)), (-5.5 * CELL, 2.2 * CELL, 2.3 * CELL))
    block = moved(box((6, 6, 6), (6 * CELL, 6 * CELL, 6 * CELL)), (0.0, 0.0, 0.0), 1)
    solver, check = check_of([bar, block], replace(QUIET, cell_size=CELL))
    position, of_block = (
        solver.fields.nodes.position,
        np.unique(solver.fields.mesh.dofmap[solver.fields.mesh.round == 1]),
    )
    of_bar = np.setdiff1d(np.arange(len(position)), of_block)
    position[of_block, 2] *= 2.0
    position[of_bar, 1] = 2.7 * CELL + (position[of_bar, 1] - 2.7 * CELL) / (1.0 - void)
    assert check.look(0.0).in_rounds[0] == pytest.approx(2.5 * share * CELL**3 * DENSITY, abs=1e-12)


def test_metal_at_the_plane_that_cuts_a_round_is_within_its_casing():
    """Half a shell: metal in the plane of symmetry, and near it, has passed; beside the shell none has."""
    cut = Mirror("middle", (0.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    for height in (0.0, 1e-6):
        bar = moved(box((12, 1, 1), (12 * CELL, CELL, CELL)), (-8.8 * CELL, height, 0.2 * CELL))
        assert passed(bar, 3.0, (cut,)) == pytest.approx(3.5 + 4.0 / 27.0, abs=1e-9)


def test_a_run_stops_where_a_hundredth_has_passed(caplog):
    """The stop names the round, the masses, the place and the time; below a hundredth it only warns, once."""
    settings = replace(QUIET, cell_size=CELL, planes=(WALL,))
    solver, check = check_of([box((30, 2, 2), (30 * CELL, 2 * CELL, 2 * CELL))], settings, names=("shell",))
    solver.fields.nodes.position[:, 0] -= 0.6 * CELL
    message = (
        r"0\.0157 of 0\.942 kg \(1\.7 %\) of the casing of round 'shell' have passed through: 0\.0157 kg behind a "
        r"plane, up to 6 mm, 0 kg within other rounds, around \(-6\.0, 10\.0, 10\.0\) mm; allowed 1 %\. Contact has "
        r"failed there: repeat with other cells \(at 12\.00 us\)"
    )
    with pytest.raises(NumericalStop, match=message) as stop:
        check.check(12e-6)
    assert stop.value.time == 12e-6
    assert check.largest == pytest.approx([0.0157, 0.0, 0.0157, 6e-3])
    # Half of the section: below the bound.
    solver.fields.nodes.position[:] = solver.fields.start
    behind = np.flatnonzero((solver.fields.start[:, 0] == 0.0) & (solver.fields.start[:, 1] == 0.0))
    solver.fields.nodes.position[behind, 0] = -0.5 * CELL
    caplog.set_level(logging.INFO)
    caplog.clear()
    check.check(13e-6)
    share = 0.25 / 60.0
    assert 0.1 * LARGEST_PASSED_FRACTION < share < LARGEST_PASSED_FRACTION
    (record,) = caplog.records  # the warning came with the first that passed
    assert record.levelno == logging.INFO
    assert "have passed through" in record.message
    summary = check.summary()
    assert summary["beyond_planes"] == pytest.approx(share * 0.942)
    assert summary["largest_beyond_planes"] == pytest.approx(0.0157)


def test_a_burst_whose_casing_passes_a_plane_stops_with_its_outputs_written(tmp_path, monkeypatch):
    """A plane that pushes nothing: the run ends where it is looked at, exit code 3, with all outputs before it."""
    monkeypatch.setattr(PlaneContact, "add_forces", lambda *_: None)
    middle = Mirror("middle", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    settings = replace(SETTINGS, end_time=80e-6, output_interval=10e-6, planes=(middle,))
    going = Simulation([tube(name="right", position=(0.08, 0.0, 0.0))], settings, tmp_path, MPI.COMM_SELF, {})
    with pytest.raises(NumericalStop, match="casing of round 'right' have passed through") as stop:
        going.run()
    assert exit_code_of(stop.value) == 3
    times = [h5py.File(path).attrs["time"] for path in sorted((tmp_path / "burst").iterdir())]
    assert times[-1] == pytest.approx(40e-6)
    assert times[-1] <= stop.value.time < times[-1] + 1e-6
    assert len(times) == round(stop.value.time / settings.output_interval) + 1
    assert going.interpenetration.last.together[0] > LARGEST_PASSED_FRACTION * going.interpenetration.casing_mass[0]


def test_the_sums_do_not_depend_on_the_ranks(tmp_path, on_ranks):
    """Two tubes of which one is moved 30 mm into the other: the same masses to the last bit on three ranks."""
    script = tmp_path / "interpenetration.py"
    script.write_text(textwrap.dedent(OVERLAP))
    lines = [on_ranks(ranks, script, tmp_path).strip().splitlines()[-1] for ranks in (1, 3)]
    assert float.fromhex(lines[0].split()[0]) > 0.1
    assert lines[0] == lines[1]
