"""Metal beyond planes and within other rounds: inverse mapping, masses, ranks' sums, the stop and its message."""

from __future__ import annotations

import logging
import textwrap
from dataclasses import replace

import h5py
import numpy as np
import pytest

pytest.importorskip("dolfinx")

from mpi4py import MPI

from burst_fenicsx.contact.planes import PlaneContact
from burst_fenicsx.errors import NumericalStop
from burst_fenicsx.kernels.geometry.inside import points_inside
from burst_fenicsx.meshing import merge
from burst_fenicsx.problem import ContactSettings, Part, RigidPlane, Round
from burst_fenicsx.records.passage import LARGEST_SHARE, Passage
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
found = going.passage.look(0.0)
values = [*found.together, *found.in_rounds, *found.beyond_planes, found.deepest, *found.centre.ravel()]
if MPI.COMM_WORLD.rank == 0:
    print(" ".join(float(value).hex() for value in values))
"""
CELL = 0.01
DENSITY = ELASTIC.density
WALL = RigidPlane("wall", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
CUBE = np.array([[x, y, z] for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)], dtype=float)


def trilinear(corner, natural):
    """Places (n, 3) of natural coordinates (n, 3) in a cell."""
    weight = 0.125 * np.prod(1.0 + natural[:, None, :] * CUBE[None], axis=2)
    return weight @ corner


def inside(points, corner, skin=0.0, outward=False):
    count = len(points)
    found = np.empty(count, dtype=np.int32)
    sides = np.broadcast_to(outward, (1, 6)).copy()
    cells = np.arange(8, dtype=np.int32)[None]
    first = np.arange(count + 1, dtype=np.int64)
    points_inside(points, first, np.zeros(count, dtype=np.int32), corner, cells, skin, sides, found)
    return found == 0


def test_points_of_distorted_cells_are_found_inside_or_outside():
    """Natural coordinates drawn at random and mapped: inside if and only if none exceeds 1 in size."""
    random = np.random.default_rng(4)
    for _ in range(20):
        corner = 0.003 * (CUBE + random.uniform(-0.3, 0.3, CUBE.shape))
        natural = random.uniform(-1.3, 1.3, (400, 3))
        wanted = np.abs(natural).max(axis=1) < 1.0
        assert 50 < wanted.sum() < 350
        assert np.array_equal(inside(trilinear(corner, natural), corner), wanted)


def test_a_skin_is_left_at_sides_that_look_outward():
    """A brick of 4 x 2 x 0.4 mm and a skin of 0.1 mm: on the thin sides an eighth of the width, 0.05 mm, at most."""
    corner = 0.5e-3 * CUBE * [4.0, 2.0, 0.4]
    along = np.array([[x, 0.0, 0.0] for x in (-1.91e-3, -1.89e-3, 1.89e-3, 1.91e-3)])
    across = np.array([[0.0, 0.0, z] for z in (-0.16e-3, -0.14e-3, 0.14e-3, 0.16e-3)])
    for points in (along, across):
        assert inside(points, corner, 1e-4, outward=True).tolist() == [False, True, True, False]
        assert inside(points, corner, 1e-4).all()
        assert inside(points, corner, 1e-4, outward=[False, True] * 3).tolist() == [True, True, True, False]


def passage_of(meshes, settings, names=("left", "right")):
    solver = bodies(meshes, [(0.0, 0.0, 0.0)] * len(meshes), settings)
    mesh = merge([replace(one, segments=((),)) for one in meshes])
    rounds = [Round(name=name, explosive=TNT, casing=ELASTIC) for name, _ in zip(names, meshes, strict=False)]
    return solver, Passage(mesh, solver.fields, rounds, settings)


def test_the_mass_behind_a_plane_is_that_of_its_nodes():
    """A bar of 10 cells pushed 2.5 cells behind the plane: the nodes of three sections, 0.5 + 1 + 1 cells of mass."""
    settings = replace(QUIET, cell_size=CELL, planes=(WALL,))
    solver, passage = passage_of([box((10, 2, 2), (10 * CELL, 2 * CELL, 2 * CELL))], settings)
    whole = 10 * 4 * CELL**3 * DENSITY
    assert passage.casing_mass == pytest.approx([whole])
    assert passage.look(0.0).together.sum() == 0.0
    solver.fields.nodes.position[:, 0] -= 2.5 * CELL
    found = passage.look(1e-6)
    assert found.beyond_planes == pytest.approx([0.25 * whole])
    assert found.deepest == pytest.approx(2.5 * CELL)
    assert found.in_rounds.sum() == 0.0
    assert found.centre[0] == pytest.approx([-CELL * (0.5 * 2.5 + 1.5 + 0.5) / 2.5, CELL, CELL])


def test_a_hundredth_of_a_cell_counts_as_contact():
    settings = replace(QUIET, cell_size=CELL, planes=(WALL,))
    solver, passage = passage_of([box((4, 2, 2), (4 * CELL, 2 * CELL, 2 * CELL))], settings)
    for depth, passed in ((0.009, False), (0.011, True)):
        solver.fields.nodes.position[:] = solver.fields.start - [depth * CELL, 0.0, 0.0]
        assert (passage.look(0.0).together.sum() > 0.0) == passed


@pytest.mark.parametrize("turn", [0.0, 0.7])
def test_the_mass_within_another_round_is_that_of_its_nodes(turn):
    """A bar of 8 cells thrust 2.5 cells deep into a block, in two positions: its sections at 0.5, 1.5, 2.5 cells."""
    matrix = rotation_matrix((1.0, 2.0, 3.0), turn)
    bar = moved(box((8, 1, 1), (8 * CELL, CELL, CELL)), (-5.5 * CELL, 2.2 * CELL, 2.3 * CELL))
    block = moved(box((6, 6, 6), (6 * CELL, 6 * CELL, 6 * CELL)), (0.0, 0.0, 0.0), 1)
    meshes = [replace(mesh, nodes=mesh.nodes @ matrix.T) for mesh in (bar, block)]
    settings = replace(QUIET, cell_size=CELL)
    _, passage = passage_of(meshes, settings)
    found = passage.look(0.0)
    assert found.in_rounds[0] == pytest.approx(2.5 * CELL**3 * DENSITY)
    # And the block's nodes within the bar: at y and z of 3 cells, at x of 0 (half a cell's mass), 1 and 2 cells.
    assert found.in_rounds[1] == pytest.approx(2.5 * CELL**3 * DENSITY)
    assert found.together == pytest.approx(found.in_rounds)
    _, apart = passage_of(meshes, replace(settings, contact=ContactSettings(surfaces=False)))
    assert not apart.needed


def test_metal_that_has_gone_through_a_wall_into_the_charge_is_found():
    """Cells of the other round's charge hold what has passed right through its casing."""
    bar = moved(box((4, 1, 1), (4 * CELL, CELL, CELL)), (1.5 * CELL, 2.2 * CELL, 2.3 * CELL))
    block = moved(box((8, 6, 6), (8 * CELL, 6 * CELL, 6 * CELL)), (0.0, 0.0, 0.0), 1)
    centre = block.nodes[block.cells].mean(axis=1)
    charge = centre[:, 0] > CELL
    block = replace(block, part=np.where(charge, Part.CHARGE, Part.CASING).astype(np.int32))
    mesh_settings = replace(QUIET, cell_size=CELL, contact=ContactSettings(charge_casing="shared"))
    _, passage = passage_of([bar, block], mesh_settings)
    assert passage.look(0.0).in_rounds[0] == pytest.approx(4 * CELL**3 * DENSITY)


def test_a_run_stops_where_a_hundredth_has_passed(caplog):
    """The stop names the round, the masses, the place and the time; below a hundredth it only warns."""
    settings = replace(QUIET, cell_size=CELL, planes=(WALL,))
    solver, passage = passage_of([box((30, 2, 2), (30 * CELL, 2 * CELL, 2 * CELL))], settings, names=("shell",))
    solver.fields.nodes.position[:, 0] -= 0.6 * CELL
    message = (
        r"0\.0157 of 0\.942 kg \(1\.7 %\) of the casing of round 'shell' have passed through: 0\.0157 kg behind a "
        r"plane, up to 6 mm, 0 kg within other rounds, around \(-6\.0, 10\.0, 10\.0\) mm; allowed 1 %\. Contact has "
        r"failed there: repeat with other cells \(at 12\.00 us\)"
    )
    with pytest.raises(NumericalStop, match=message) as stop:
        passage.check(12e-6)
    assert stop.value.time == 12e-6
    assert passage.largest == pytest.approx([0.0157, 0.0, 0.0157, 6e-3])
    # Half of the section: below the bound.
    solver.fields.nodes.position[:] = solver.fields.start
    behind = np.flatnonzero((solver.fields.start[:, 0] == 0.0) & (solver.fields.start[:, 1] == 0.0))
    solver.fields.nodes.position[behind, 0] = -0.5 * CELL
    caplog.set_level(logging.WARNING)
    caplog.clear()
    passage.check(13e-6)
    share = 0.25 / 60.0
    assert 0.1 * LARGEST_SHARE < share < LARGEST_SHARE
    assert "have passed through" in caplog.text
    summary = passage.summary()
    assert summary["beyond_planes"] == pytest.approx(share * 0.942)
    assert summary["largest_beyond_planes"] == pytest.approx(0.0157)


def test_a_burst_whose_casing_passes_a_plane_stops_with_its_outputs_written(tmp_path, monkeypatch):
    """A plane that pushes nothing: the run ends at an output with exit code 3, and that output is in the file."""
    monkeypatch.setattr(PlaneContact, "add_forces", lambda *_: None)
    middle = RigidPlane("middle", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), symmetry=True)
    settings = replace(SETTINGS, end_time=80e-6, output_interval=10e-6, planes=(middle,))
    going = Simulation([tube(name="right", position=(0.08, 0.0, 0.0))], settings, tmp_path, MPI.COMM_SELF, {})
    with pytest.raises(NumericalStop, match="casing of round 'right' have passed through") as stop:
        going.run()
    assert exit_code_of(stop.value) == 3
    times = [h5py.File(path).attrs["time"] for path in sorted((tmp_path / "burst").iterdir())]
    assert times[-1] == pytest.approx(stop.value.time)
    assert len(times) == round(stop.value.time / settings.output_interval) + 1
    assert going.passage.last.together[0] > LARGEST_SHARE * going.passage.casing_mass[0]


def test_the_sums_do_not_depend_on_the_ranks(tmp_path, on_ranks):
    """Two tubes of which one is moved 30 mm into the other: the same masses to the last bit on three ranks."""
    script = tmp_path / "passage.py"
    script.write_text(textwrap.dedent(OVERLAP))
    lines = [on_ranks(ranks, script, tmp_path).strip().splitlines()[-1] for ranks in (1, 3)]
    assert float.fromhex(lines[0].split()[0]) > 0.1
    assert lines[0] == lines[1]
