"""A live velocity field of dolfinx as the break-up takes it: in three dimensions and in the meridian, on ranks."""

from __future__ import annotations

import json

import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from dataclasses import replace

from mpi4py import MPI

from burst_fenicsx.simulation import Simulation
from tests.burst_fenicsx.tubes import SETTINGS, tube
from tests.transition import live_fields
from transition import BreakUpSettings, CasingInMesh, InputError, Snapshot, break_up, snapshot_of
from transition.cells import interpolated


@pytest.mark.parametrize("kind", ["hexahedra", "meridian"])
def test_values_at_points_are_those_of_the_function(kind):
    velocity, displacement, casing = live_fields.made(MPI.COMM_SELF, kind)
    snapshot = snapshot_of(velocity, casing, displacement=displacement)
    draw = np.random.default_rng(4)
    cells = draw.integers(len(snapshot.cells), size=200)
    place = draw.random((200, 3 if kind == "hexahedra" else 2))
    corners = snapshot.cells[cells]
    at = interpolated(snapshot.reference[corners], place)
    found = interpolated(snapshot.velocity[corners], place)
    here = at if kind == "hexahedra" else np.column_stack([*snapshot.half_plane.coordinates(at).T, np.zeros(200)])
    own = np.argsort(velocity.function_space.mesh.topology.original_cell_index)[cells]
    expected = velocity.eval(here, own)
    if kind == "meridian":
        found = snapshot.half_plane.components(found)
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("kind", ["hexahedra", "meridian"])
def test_two_ranks_give_what_one_gives(kind, on_ranks):
    one = live_fields.digest(MPI.COMM_SELF, kind)
    two = json.loads(on_ranks(2, "-m", "tests.transition.live_fields", kind).splitlines()[0])
    assert two["fragments"] == one["fragments"]
    for name in ("velocity", "position", "mass"):
        np.testing.assert_allclose(two[name], one[name], rtol=1e-12)


@pytest.mark.parametrize("geometry", ["3d", "axisymmetric"])
def test_the_burst_live_is_the_burst_in_its_file(geometry, tmp_path):
    settings = replace(SETTINGS, geometry=geometry, cell_size=15e-3, end_time=30e-6)
    burst = Simulation([tube()], settings, tmp_path, MPI.COMM_WORLD, {})
    burst.run()
    fields = burst.fields
    before = type(fields.functions["velocity"])(fields.functions["velocity"].function_space)
    before.x.array[:] = (fields.nodes.position - fields.start)[: len(before.x.array) // 3].ravel()
    burst.finish()
    of_file = Snapshot.read(tmp_path / "burst_snapshot.h5")
    data = of_file.rounds[0]
    casing = CasingInMesh(data.casing_density, data.length, tags=(0,), position=data.position, axis=data.axis)
    tags = live_fields.tags_of(fields.mesh, of_file)
    live = snapshot_of(fields.functions["velocity"], casing, displacement=before, mesh_moved=True, cell_tags=tags)
    for name in ("reference", "position", "velocity"):
        here, there = (getattr(one, name)[one.cells[one.casing]] for one in (live, of_file))
        np.testing.assert_allclose(here, there, rtol=1e-12, atol=1e-12 * np.abs(there).max())
    assert live.mass[live.casing].sum() == pytest.approx(of_file.mass[of_file.casing].sum(), rel=1e-3)
    pieces = [break_up(one, BreakUpSettings(mean_mass=5e-3)).fragments for one in (live, of_file)]
    assert abs(len(pieces[0]) - len(pieces[1])) <= 0.05 * len(pieces[1])


def test_what_is_no_casing_is_refused():
    velocity, _, casing = live_fields.made(MPI.COMM_SELF, "hexahedra")
    with pytest.raises(InputError, match="cell_tags: found none; needed where casings name tags"):
        snapshot_of(velocity, replace(casing, tags=(3,)))
    with pytest.raises(InputError, match="casing 'casing': no cell has the tag 3; found: 1, 2"):
        snapshot_of(velocity, replace(casing, tags=(3,)), cell_tags=live_fields.halves(velocity))
    with pytest.raises(InputError, match="found cells of the kind tetrahedron in 3 dimensions; allowed: hexahedra"):
        snapshot_of(live_fields.of_tetrahedra(MPI.COMM_SELF), casing)
    with pytest.raises(InputError, match="field: it is no vector of 3 components"):
        snapshot_of(live_fields.scalar(velocity), casing)
