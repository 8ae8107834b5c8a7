"""The smallest symmetric part: planes that are found, rounds that are cut, and the completed burst."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from burst_fenicsx.meshing import cell_volumes, merge, mesh_round
from burst_fenicsx.problem import IgnitionPoint, RigidPlane, ShockInitiation
from burst_fenicsx.symmetry import smallest_part, symmetry_words
from fragfield.case.conversion.stack import pallet, row, triangle
from tests.burst_fenicsx.tubes import SETTINGS, tube

AUTO = replace(SETTINGS, symmetry="auto")
PITCH = 0.17
WALL = RigidPlane("wall", (0.0, 0.3, 0.0), (0.0, -1.0, 0.0))


def stack(places, **changes):
    return [tube(name=f"tube_{k}", position=tuple(place), **changes) for k, place in enumerate(places, start=1)]


def turned(places, degrees):
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.asarray(places) @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])


def shares(part):
    return sorted(0.5 ** len(cuts) for cuts in part.cuts)


LYING = replace(tube(), axis=(1.0, 0.0, 0.0))
ARRANGEMENTS = {
    "single": ([tube()], (), 2, [0.25]),
    "single beside a wall": ([tube()], (WALL,), 1, [0.5]),
    "pair": (stack(row(2, PITCH)), (), 2, [0.5]),
    "oblique pair": (stack(turned(row(2, PITCH), 30.0)), (), 2, [0.5]),
    "row of three": (stack(row(3, PITCH)), (), 2, [0.25, 0.5]),
    "row of four": (stack(row(4, PITCH)), (), 2, [0.5, 0.5]),
    "pallet of 2 x 2": (stack(pallet((2, 2, 1), (PITCH, PITCH, 0.0))), (), 2, [1.0]),
    "pallet of 2 x 4": (stack(pallet((2, 4, 1), (PITCH, PITCH, 0.0))), (), 2, [1.0, 1.0]),
    "triangle": (stack(triangle(2, PITCH, (0.0, 0.0, 1.0))), (), 1, [0.5, 1.0]),
    "unequal distances": (stack([[0.0, 0.0, 0.0], [PITCH, 0.0, 0.0], [3 * PITCH, 0.0, 0.0]]), (), 1, [0.5] * 3),
    "nose to nose": (
        [replace(LYING, position=(-0.31, 0.0, 0.5)), replace(LYING, position=(0.31, 0.0, 0.5), axis=(-1.0, 0.0, 0.0))],
        (), 3, [0.25],
    ),
    "nose to nose on a deck": (
        [replace(LYING, position=(-0.31, 0.0, 0.5)), replace(LYING, position=(0.31, 0.0, 0.5), axis=(-1.0, 0.0, 0.0))],
        (RigidPlane("deck", (0.0, 0.0, 0.4), (0.0, 0.0, 1.0)),), 2, [0.5],
    ),
    "one initiated later": (
        [tube(), tube(name="late", position=(PITCH, 0.0, 0.0), ignition=(IgnitionPoint(0.0, delay=1e-6),))],
        (), 1, [0.5, 0.5],
    ),
    "initiated off the axis": ([tube(ignition=(IgnitionPoint(0.0, (0.02, 0.0)),))], (), 1, [0.5]),
    "initiated at two opposite points": (
        [tube(ignition=(IgnitionPoint(0.0, (0.02, 0.02)), IgnitionPoint(0.0, (-0.02, -0.02))))], (), 2, [0.25],
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", sorted(ARRANGEMENTS))
def test_planes_of_an_arrangement(name):
    """How many planes there are and what of which round is computed; the parts' images make up every round once."""
    rounds, planes, count, expected = ARRANGEMENTS[name]
    part = smallest_part(rounds, replace(AUTO, planes=planes))
    normals = np.array([plane.normal for plane in part.planes]).reshape(-1, 3)
    assert len(normals) == count
    assert shares(part) == expected
    np.testing.assert_allclose(normals @ normals.T, np.eye(count), atol=1e-12)
    # Shares of all images together are the rounds.
    assert part.images * sum(0.5 ** len(cuts) for cuts in part.cuts) == pytest.approx(len(rounds))
    for item, source, mirrors in zip(rounds, part.source, part.mirrors.tolist(), strict=True):
        origin = part.rounds[source]
        np.testing.assert_allclose(part.place(np.array(origin.position), mirrors), item.position, atol=1e-12)
        np.testing.assert_allclose(part.matrix(mirrors) @ np.array(origin.axis), item.axis, atol=1e-12)
    # Nothing that is computed lies behind a plane.
    for item in part.rounds:
        assert ((np.array(item.position) - part.point) @ normals.T > -1e-12).all()


def test_off_computes_everything():
    rounds = stack(row(2, PITCH))
    part = smallest_part(rounds, SETTINGS)
    assert part.images == 1
    assert part.rounds == tuple(rounds)
    assert part.planes == ()
    assert symmetry_words(part.summary()) == []


def test_an_arrangement_without_symmetry_is_computed_in_full():
    places = [[0.0, 0.0, 0.0], [PITCH, 0.0, 0.0], [0.3 * PITCH, 2 * PITCH, 0.0]]
    part = smallest_part(stack(places), AUTO)
    assert part.images == 1
    assert len(part.rounds) == 3


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"ignition": (), "initiation": ShockInitiation(5e9, 1e-7)}, "differ in shape, filling, casing or initiation"),
        ({"ignition": (IgnitionPoint(0.0, delay=1e-6),)}, "are not initiated alike"),
        ({"casing": replace(tube().casing, density=7900.0)}, "differ in shape, filling, casing or initiation"),
    ],
)
def test_a_refused_plane_is_named_with_its_reason(changes, reason):
    """Rounds that stand as images but are not alike: the plane between them is refused, that along both is used."""
    rounds = stack(row(2, PITCH))
    rounds[1] = replace(rounds[1], **changes)
    part = smallest_part(rounds, AUTO)
    words = symmetry_words(part.summary())
    assert words[0].startswith(
        "symmetry: a half of the arrangement is computed (a half of tube_1 and a half of tube_2), bounded by y = 0 mm "
        "(through tube_1 and tube_2)"
    )
    assert words[1].startswith("no symmetry about the plane normal to x: round 'tube_1' and its image, round 'tube_2',")
    assert reason in words[1]


def test_rounds_from_mesh_files_are_never_cut(tmp_path):
    rounds = [replace(item, profile=None, mesh_file=tmp_path / "round.msh") for item in stack(row(2, PITCH))]
    part = smallest_part(rounds, AUTO)
    assert part.images == 1
    assert all("mesh file" in one.reason for one in part.refused)


def test_words_of_a_quarter():
    part = smallest_part(stack(row(2, PITCH)), AUTO)
    (words,) = symmetry_words(part.summary())
    assert words == (
        "symmetry: a quarter of the arrangement is computed (a half of tube_1), bounded by x = 0 mm (between rounds) "
        "and y = 0 mm (through tube_1 and tube_2); the rest are its images, joined to whole rounds before the break-up"
    )
    found = part.summary()
    assert found["computed_rounds"] == [{"name": "tube_1", "share": 0.5}]
    assert found["image_rounds"] == [{"name": "tube_2", "image_of": "tube_1"}]


@pytest.mark.parametrize("name", ["single", "oblique pair", "row of three", "nose to nose"])
def test_cut_rounds_are_completed_to_the_whole_mesh(name):
    """The completed mesh is that of whole rounds: places, volumes, parts, and no seam at the planes."""
    pytest.importorskip("burst_fenicsx.compat")
    from burst_fenicsx.symmetry.completion import Completion

    rounds, planes, _, _ = ARRANGEMENTS[name]
    part = smallest_part(rounds, replace(AUTO, planes=planes))
    size = 18e-3
    mesh = merge(
        [
            mesh_round(item, size, index, cuts)
            for index, (item, cuts) in enumerate(zip(part.rounds, part.cuts, strict=True))
        ]
    )
    whole = Completion(part, mesh)
    nodes = whole.point_fields({"position": mesh.nodes})["position"]
    assert len(nodes) == whole.nodes == whole.cells.max() + 1
    for index, item in enumerate(rounds):
        own = whole.names["round"] == index
        used = np.unique(whole.cells[own])
        # No two nodes of a round in one place: both sides of a plane share theirs.
        assert len(np.unique(np.round(nodes[used], 9), axis=0)) == len(used)
        bare = replace(item, ignition=(IgnitionPoint(0.0),))
        cuts = part.cuts[part.source[index]]
        full = mesh_round(bare, size, 0, ()) if not cuts else None
        volumes = _volumes(nodes, whole.cells[own])
        assert volumes.min() > 0.0
        exact = item.profile.volumes()
        assert volumes[whole.names["part"][own] == 0].sum() == pytest.approx(exact.casing, rel=2e-3)
        assert volumes[whole.names["part"][own] == 1].sum() == pytest.approx(exact.charge, rel=2e-3)
        if full is not None:
            np.testing.assert_allclose(cell_volumes(full).sum(), volumes.sum(), rtol=1e-12)
    # Every face within a round is shared by two cells: the closed surface has as many outer faces as a whole round's.
    assert (mesh.neighbours >= 0).sum() > 0
    for cut in part.cuts[0]:
        height = (mesh.nodes - np.array(cut.point)) @ np.array(cut.normal)
        np.testing.assert_array_equal(np.abs(height) < 1e-12, mesh.held >> cut.bit & 1)


def _volumes(nodes, cells):
    from burst_fenicsx.kernels.cells.hexahedron import hexahedron_volumes
    from burst_fenicsx.kernels.geometry.faces import reordered

    return hexahedron_volumes(np.ascontiguousarray(nodes), reordered(cells).astype(np.int32))


@pytest.mark.dolfinx
def test_the_quarter_of_a_round_bursts_as_the_whole(tmp_path):
    """A quarter against a whole round on the same grid, node by node; masses, speeds, diameter, energies, momentum."""
    pytest.importorskip("burst_fenicsx.compat")
    from mpi4py import MPI

    from burst_fenicsx.simulation import Simulation

    runs = {}
    for name in ("auto", "off"):
        (tmp_path / name).mkdir()
        # An edge at which the grid's core is even with and without the cut.
        settings = replace(SETTINGS, cell_size=16e-3, end_time=40e-6, symmetry=name)
        run = Simulation([tube()], settings, tmp_path / name, MPI.COMM_SELF, {})
        run.run()
        runs[name] = run, run.finish()
    (part, quarter), (_, full) = runs["auto"], runs["off"]
    assert quarter.summary["symmetry"]["all_cells"] == full.summary["cells"] == 4 * quarter.summary["cells"]
    for key in ("casing_mass", "charge_mass", "folded_casing_mass"):
        assert quarter.summary[key] == pytest.approx(full.summary[key], rel=1e-9, abs=1e-12)
    for key in ("mean_initial_speed", "max_initial_speed", "outer_diameter", "products_balance"):
        assert quarter.summary[key] == pytest.approx(full.summary[key], rel=1e-5)
    for key in ("kinetic", "products_work", "plastic", "contact"):
        assert quarter.history[key][-1] == pytest.approx(full.history[key][-1], rel=1e-4)
    assert quarter.summary["momentum_error"] < 1e-12
    one, other = (_snapshot(tmp_path / name) for name in ("auto", "off"))
    scale = np.linalg.norm(other["velocity"], axis=1).max()
    assert np.abs(one["velocity"] - other["velocity"]).max() < 1e-4 * scale
    # Nodes in the planes have not left them.
    held = part.mesh.held[part.fields.mesh.node]
    for plane in part.part.planes:
        assert np.abs(part.fields.nodes.position[held >> plane.bit & 1 == 1] @ plane.normal).max() < 1e-12


def _snapshot(folder):
    """Nodes by their reference position: a casing's first, then the charge's of the same place."""
    import h5py

    with h5py.File(folder / "burst_snapshot.h5") as file:
        nodes = {name: file[f"nodes/{name}"][()] for name in ("reference", "velocity")}
        cells, part = file["cells/nodes"][()], file["cells/part"][()]
    charge = np.zeros(len(nodes["reference"]), dtype=bool)
    charge[cells[part == 1]] = True
    key = np.round(nodes["reference"] * 1e7) + 0.0
    order = np.lexsort((*key.T, charge))
    return {name: values[order] for name, values in nodes.items()}
