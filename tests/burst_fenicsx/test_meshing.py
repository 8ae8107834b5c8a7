"""O-grid meshes: volumes, closed surfaces, shape of the cells, placement, and the messages."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from burst_fenicsx.errors import InputError
from burst_fenicsx.geometry import Contour, Fuze, Profile, load_profile, profile_names
from burst_fenicsx.kernels.geometry.faces import FACES, reordered
from burst_fenicsx.materials.library import load_casing, load_explosive
from burst_fenicsx.meshing import (
    HexahedralMesh,
    cell_centres,
    cell_volumes,
    merge,
    mesh_profile,
    mesh_round,
    part_volumes,
    quality,
    scaled_jacobians,
)
from burst_fenicsx.meshing.placement import frame, to_local
from burst_fenicsx.meshing.quality import folded_cells
from burst_fenicsx.problem import Part, Round

UNIT_CUBE = np.array([[x, y, z] for z in (0, 1) for y in (0, 1) for x in (0, 1)], dtype=float)


def one_cell(corners):
    """Return a mesh of one hexahedron."""
    zero = np.zeros(1, dtype=np.int32)
    return HexahedralMesh(np.asarray(corners, dtype=float), np.arange(8)[None, :], zero, zero, zero, np.zeros(1))


def void_front():
    """Return the M107 with an empty fuze well."""
    full = load_profile("m107")
    return Profile("void", full.outer, full.cavity, full.charge_front, Fuze("void"), full.segments)


def boundary_faces(cells):
    """Return the outward faces that belong to one cell, after checking that all others belong to exactly two."""
    faces = cells[:, FACES].reshape(-1, 4)
    _, index, count = np.unique(np.sort(faces, axis=1), axis=0, return_inverse=True, return_counts=True)
    assert count.max() <= 2
    return faces[count[index.ravel()] == 1]


def check_closed(mesh):
    """Check that every interior face has two cells, seen from opposite sides, and that the rest is a closed surface."""
    outside = boundary_faces(mesh.cells)
    edges = np.stack([outside, np.roll(outside, -1, axis=1)], axis=-1).reshape(-1, 2)
    # A closed oriented surface runs over every edge once in each direction (or k times each where surfaces touch).
    forward = np.sort(edges[:, 0] * len(mesh.nodes) + edges[:, 1])
    backward = np.sort(edges[:, 1] * len(mesh.nodes) + edges[:, 0])
    np.testing.assert_array_equal(forward, backward)
    # Divergence theorem over the outside, bilinear faces split at their mean: the volume within.
    corners = mesh.nodes[outside]
    middle = corners.mean(axis=1)
    following = np.roll(corners, -1, axis=1)
    triangles = np.einsum("ijk,ijk->ij", corners, np.cross(following, middle[:, None, :])).sum() / 6
    assert triangles == pytest.approx(cell_volumes(mesh).sum(), rel=1e-9)


@pytest.mark.parametrize("cell_size", [12e-3, 8e-3])
@pytest.mark.parametrize("name", profile_names())
def test_built_in_rounds_have_good_cells_and_true_masses(name, cell_size):
    profile = load_profile(name)
    mesh = mesh_profile(profile, cell_size)
    found = quality(mesh, profile)
    assert found.min_scaled_jacobian > 0.6
    assert scaled_jacobians(mesh).min() == found.min_scaled_jacobian
    assert cell_volumes(mesh).min() > 0
    assert set(found.mass_errors) == set(np.unique(mesh.part))
    limit = 5e-3 if cell_size <= 8e-3 else 1e-2
    assert max(abs(error) for error in found.mass_errors.values()) < limit
    wall = profile.section(np.linspace(profile.charge_front, profile.charge_end, 101)).wall.mean()
    if wall > 1.25 * cell_size:  # a thinner one takes three cells whatever the cell size
        assert found.cells == pytest.approx(profile.outer.volume() / cell_size**3, rel=0.1)
        assert found.max_aspect_ratio < 7.5  # an even core leaves less choice
        assert found.min_edge > 0.2 * cell_size


def test_wall_has_at_least_three_cells_everywhere():
    profile = load_profile("m107")
    mesh = mesh_profile(profile, 12e-3)
    centres = cell_centres(mesh)
    azimuth = np.round(np.degrees(np.arctan2(centres[:, 1], centres[:, 0])), 6)
    ringed = (mesh.part == Part.CASING) & (mesh.station < profile.charge_end)
    columns = np.column_stack([mesh.station, azimuth])[ringed]
    _, through = np.unique(columns, axis=0, return_counts=True)
    assert through.min() >= 3


@pytest.mark.parametrize("name", profile_names())
def test_cells_meet_face_to_face_and_close(name):
    check_closed(mesh_profile(load_profile(name), 12e-3))


def test_parts_are_closed_bodies_and_share_their_interface():
    profile = load_profile("m107")
    mesh = mesh_profile(profile, 10e-3)
    faces = {}
    for part in Part:
        cells = mesh.cells[mesh.part == part]
        faces[part] = {tuple(face) for face in np.sort(boundary_faces(cells), axis=1)}
    assert faces[Part.CHARGE] & faces[Part.CASING]
    assert faces[Part.CHARGE] & faces[Part.FUZE]
    # The charge lies wholly within casing and fuze.
    assert faces[Part.CHARGE] <= faces[Part.CASING] | faces[Part.FUZE]
    front = -mesh.nodes[np.unique(mesh.cells[mesh.part == Part.CHARGE]), 2].max() + profile.length
    assert front == pytest.approx(profile.charge_front, abs=1e-12)


def test_volumes_converge_with_the_second_power_of_the_cell_size():
    outer = Contour.from_points([(0, 0.05), (0.3, 0.05)], [0.25])
    cavity = Contour.from_points([(0, 0.03), (0.3, 0.03)], [0.3])
    profile = Profile("barrel", outer, cavity, 0.0)
    sizes = np.array([20e-3, 10e-3, 5e-3])
    meshes = [mesh_profile(profile, size) for size in sizes]
    errors = np.array([abs(quality(mesh, profile).mass_errors[Part.CHARGE]) for mesh in meshes])
    layers = np.array([len(np.unique(mesh.station)) for mesh in meshes])
    rate = -np.polyfit(np.log(layers), np.log(errors), 1)[0]
    assert rate == pytest.approx(2.0, abs=0.1), f"observed rate {rate:.2f}, errors {errors}"
    assert errors[-1] < 4e-4


def test_cones_and_cylinders_have_exact_volumes():
    outer = Contour.from_points([(0, 0.04), (0.1, 0.06), (0.2, 0.06)])
    cavity = Contour.from_points([(0.02, 0.02), (0.15, 0.045)])
    profile = Profile("cone", outer, cavity, 0.06, Fuze("inert", 0.3))
    errors = quality(mesh_profile(profile, 9e-3), profile).mass_errors
    assert set(errors) == {Part.CASING, Part.CHARGE, Part.FUZE}
    # Every band is conical here, and what a solid end's inner band loses on one side it gains on the other.
    assert max(abs(error) for error in errors.values()) < 1e-12


def test_segments_hold_their_share_of_the_casing():
    profile = load_profile("grenade_155")
    mesh = mesh_profile(profile, 6e-3)
    assert np.all(mesh.segment[mesh.part != Part.CASING] == -1)
    volumes = cell_volumes(mesh)
    for index, segment in enumerate(profile.segments):
        found = volumes[mesh.segment == index].sum()
        assert found == pytest.approx(profile.volumes(segment.start, segment.end).casing, rel=1e-3)
        stations = mesh.station[mesh.segment == index]
        assert segment.start < stations.min()
        assert stations.max() < segment.end


def test_void_front_has_no_cells_and_no_loose_nodes():
    profile = void_front()
    mesh = mesh_profile(profile, 8e-3)
    assert set(np.unique(mesh.part)) == {Part.CASING, Part.CHARGE}
    assert len(np.unique(mesh.cells)) == len(mesh.nodes)
    found = quality(mesh, profile)
    assert max(abs(error) for error in found.mass_errors.values()) < 1e-3
    assert found.cells == pytest.approx((profile.casing_volume + profile.charge_volume) / 8e-3**3, rel=0.1)
    check_closed(mesh)


def test_mesh_is_its_own_mirror_image():
    mesh = mesh_profile(load_profile("tube"), 8e-3)
    for mirror in ([-1, 1, 1], [1, -1, 1]):
        mirrored = mesh.nodes * mirror
        key = [np.lexsort(np.round(points, 9).T) for points in (mesh.nodes, mirrored)]
        np.testing.assert_allclose(mesh.nodes[key[0]], mirrored[key[1]], atol=2e-9)


@pytest.mark.parametrize("axis", [(0, 0, 1), (0, 0, -2), (1, 0, 0), (0, -1, 0), (0.3, -0.5, -0.81)])
def test_placement_moves_the_round_and_changes_nothing_else(axis):
    profile = load_profile("m107")
    position = (1.0, -2.0, 0.5)
    still = mesh_profile(profile, 12e-3)
    moved = mesh_profile(profile, 12e-3, position=position, axis=axis, round_index=3)
    np.testing.assert_array_equal(moved.cells, still.cells)
    np.testing.assert_allclose(to_local(moved.nodes, position, axis), still.nodes, atol=1e-14)
    np.testing.assert_allclose(cell_volumes(moved), cell_volumes(still), rtol=1e-9)
    np.testing.assert_allclose(scaled_jacobians(moved), scaled_jacobians(still), rtol=1e-9)
    along = (cell_centres(moved) - position) @ (np.asarray(axis) / np.linalg.norm(axis))
    np.testing.assert_allclose(profile.length - along, moved.station, atol=1e-12)
    assert np.all(moved.round == 3)


def test_frames_are_right_handed_and_start_from_x_and_y():
    np.testing.assert_array_equal(frame((0, 0, 5)), np.eye(3))
    for axis in [(0, 0, -1), (1, 1, 1), (-1, 2, -30), (1e-9, 0, -1)]:
        rows = frame(axis)
        np.testing.assert_allclose(rows @ rows.T, np.eye(3), atol=1e-9)
        assert np.linalg.det(rows) == pytest.approx(1.0)
        np.testing.assert_allclose(rows[2], np.asarray(axis) / np.linalg.norm(axis), atol=1e-12)
    with pytest.raises(InputError, match="three finite numbers, not all zero"):
        frame((0, 0, 0))


def test_cell_volume_is_that_of_the_trilinear_map():
    corners = UNIT_CUBE + 0.2 * np.random.default_rng(1).uniform(-1, 1, (8, 3))
    point = np.array([-1, 1]) / np.sqrt(3)
    volume = 0.0
    signs = 2 * UNIT_CUBE - 1
    for place in np.stack(np.meshgrid(point, point, point), axis=-1).reshape(-1, 3):
        factors = 1 + signs * place
        gradient = np.stack(
            [signs[:, k] * np.prod(np.delete(factors, k, axis=1), axis=1) / 8 for k in range(3)], axis=1
        )
        volume += np.linalg.det(gradient.T @ corners)
    assert cell_volumes(one_cell(corners))[0] == pytest.approx(volume, rel=1e-13)


def test_scaled_jacobian_of_known_cells():
    assert scaled_jacobians(one_cell(UNIT_CUBE * [1, 2, 5]))[0] == pytest.approx(1.0)
    sheared = UNIT_CUBE + np.outer(UNIT_CUBE[:, 2], [1.0, 0, 0])
    assert scaled_jacobians(one_cell(sheared))[0] == pytest.approx(np.sqrt(0.5))
    assert scaled_jacobians(one_cell(UNIT_CUBE[[4, 5, 6, 7, 0, 1, 2, 3]]))[0] == pytest.approx(-1.0)
    found = quality(one_cell(UNIT_CUBE * [1, 2, 5]))
    assert (found.max_aspect_ratio, found.min_edge, found.cells, found.nodes) == (5.0, 1.0, 1, 8)


def test_scaled_jacobian_agrees_with_verdict():
    pyvista = pytest.importorskip("pyvista")
    mesh = mesh_profile(load_profile("m107"), 12e-3)
    cells = np.column_stack([np.full(len(mesh.cells), 8), reordered(mesh.cells)]).ravel()
    grid = pyvista.UnstructuredGrid(cells, np.full(len(mesh.cells), 12), mesh.nodes)
    theirs = grid.cell_quality("scaled_jacobian")["scaled_jacobian"]
    np.testing.assert_allclose(scaled_jacobians(mesh), theirs, rtol=1e-6)


def test_rounds_are_merged_without_joining():
    profile = load_profile("tube")
    one = mesh_profile(profile, 12e-3)
    two = mesh_profile(profile, 12e-3, position=(0.1767, 0, 0), round_index=1)
    both = merge([one, two])
    assert len(both.nodes) == 2 * len(one.nodes)
    assert np.all(both.cells[len(one.cells) :] >= len(one.nodes))
    assert both.segments == (profile.segments, profile.segments)
    assert both.lengths == (profile.length, profile.length)
    assert part_volumes(both)[Part.CHARGE] == pytest.approx(2 * part_volumes(one)[Part.CHARGE])
    with pytest.raises(InputError, match=r"round indices \[0, 0\]; 0, 1, 2"):
        merge([one, one])
    with pytest.raises(InputError, match="no mesh is given"):
        merge([])


def test_a_round_is_meshed_where_it_stands():
    profile = load_profile("tube")
    material = {"explosive": load_explosive("tnt"), "casing": load_casing("steel_paper")}
    mesh = mesh_round(Round("one", profile=profile, position=(0, 0, 2.0), **material), 12e-3, 1)
    assert mesh.nodes[:, 2].min() == pytest.approx(2.0)
    assert mesh.nodes[:, 2].max() == pytest.approx(2.3)
    assert np.all(mesh.round == 1)
    with pytest.raises(InputError, match="round 'none': found neither of profile and mesh file"):
        mesh_round(Round("none", **material), 12e-3)
    with pytest.raises(InputError, match="round 'two': found both of profile and mesh file"):
        mesh_round(Round("two", profile=profile, mesh_file=Path("a.msh"), **material), 12e-3)


@pytest.mark.parametrize(
    ("cell_size", "message"),
    [
        (0.0, "cell_size = 0.0 m; a positive length is expected"),
        (float("nan"), "a positive length is expected"),
        (0.1, r"cell_size = 100 mm; at most the round's radius is allowed \(tube: 77.5 mm\)"),
        (1e-5, r"makes 5.66e\+12 cells; at most 5e\+07 are allowed \(tube: at least 0.48 mm\)"),
    ],
)
def test_cell_size_out_of_bounds_is_refused(cell_size, message):
    with pytest.raises(InputError, match=message):
        mesh_profile(load_profile("tube"), cell_size)


def test_contours_finer_than_the_cells_are_refused():
    outer = Contour.from_points([(0, 0.05), (0.4, 0.05)])
    bead = Contour.from_points([(0.1, 0.03), (0.19, 0.03), (0.2, 0.045), (0.21, 0.03), (0.3, 0.03)])
    profile = Profile("bead", outer, bead, 0.1)
    mesh = mesh_profile(profile, 5e-3)
    assert max(abs(error) for error in quality(mesh, profile).mass_errors.values()) < 1e-6
    wide = Contour.from_points([(0, 0.12), (0.4, 0.12)])
    bowl = Contour.from_points([(0.1, 0.03), (0.3, 0.03)], [0.105])
    with pytest.raises(
        InputError, match=r"bowl meshed with 60 mm: the mass of the \w+ is off by [+-]\d+\.\d%; at most 2%"
    ):
        mesh_profile(Profile("bowl", wide, bowl, 0.1), 60e-3)


def test_tips_and_steep_contours_are_refused():
    tip = Contour.from_points([(0, 0.0), (0.2, 0.05), (0.4, 0.05)], name="mine [outer]")
    cavity = Contour.from_points([(0.1, 0.015), (0.2, 0.03), (0.3, 0.03)], name="mine [cavity]")
    with pytest.raises(
        InputError, match=r"mine \[outer\]: radius 0 mm at its end, station 0 mm; an O-grid needs a flat end"
    ):
        mesh_profile(Profile("mine", tip, cavity, 0.1), 5e-3)
    outer = Contour.from_points([(0, 0.05), (0.4, 0.05)])
    step = Contour.from_points([(0.1, 0.006), (0.101, 0.045), (0.3, 0.045)])
    with pytest.raises(InputError, match=r"scaled Jacobian 0\.\d+ at station 100.5 mm; at least 0.2 is needed"):
        mesh_profile(Profile("steep", outer, step, 0.1), 5e-3)


def test_the_cell_behind_a_face_has_the_same_four_nodes():
    """In a mesh whose nodes have random numbers, two of them interface_pairs of one place."""
    mesh = mesh_profile(load_profile("tube"), 25e-3)
    number = np.random.default_rng(6).permutation(len(mesh.nodes))
    cells = number[mesh.cells]
    twin = len(mesh.nodes)
    cells = np.where((cells == number[30]) & (np.arange(len(cells)) % 2 == 0)[:, None], twin, cells)
    place = np.append(np.arange(twin), number[30])
    pairs = np.array([[twin, number[30]]])
    found = replace(mesh, cells=cells, nodes=np.zeros((twin + 1, 3)), interface_pairs=pairs).neighbours
    corners = [[frozenset(place[cells[cell, side]].tolist()) for side in FACES] for cell in range(len(cells))]
    of_face = {}
    for cell, sides in enumerate(corners):
        for side in sides:
            of_face.setdefault(side, []).append(cell)
    for cell, sides in enumerate(corners):
        for side, nodes in enumerate(sides):
            behind = [other for other in of_face[nodes] if other != cell]
            assert found[cell, side] == (behind[0] if behind else -1)


def test_a_cell_is_folded_where_the_edges_at_a_corner_have_no_positive_triple_product():
    """Of hexahedra at random, some of them folded."""
    random = np.random.default_rng(6)
    signs = 2.0 * UNIT_CUBE - 1.0
    found = []
    for _ in range(60):
        corners = signs + random.uniform(-1.2, 1.2, (8, 3))
        edges = [[corners[k ^ (1 << axis)] - corners[k] for axis in range(3)] for k in range(8)]
        # Of two flips of axes, or none, the product is positive.
        smallest = (-signs.prod(axis=1) * np.linalg.det(edges)).min()
        found.append(bool(folded_cells(corners, np.arange(8, dtype=np.int32)[None])[0]))
        assert found[-1] == (smallest <= 0.0)
    assert 10 < sum(found) < 50
