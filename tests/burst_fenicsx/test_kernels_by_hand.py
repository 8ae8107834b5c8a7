"""Small kernels of the burst beside what they stand for: levels, colours, neighbours, groups of faces, rows, sums."""

from __future__ import annotations

import itertools

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from burst_fenicsx.contact.sliding import _LARGEST_PRESSURE, _MOST_CELLS
from burst_fenicsx.kernels.geometry.faces import FACES, face_neighbours
from burst_fenicsx.kernels.geometry.smooth_faces import face_vectors, group_vectors
from burst_fenicsx.kernels.lanes import LANES
from burst_fenicsx.kernels.step.colours import colour_groups
from burst_fenicsx.kernels.step.levels import blocks_are_mixed, move_lanes, node_levels, raise_levels
from burst_fenicsx.kernels.vectors.exact import quantise, quantum, rounding_constant
from burst_fenicsx.kernels.vectors.nodal_values import add_nodal_forces, gather, gather_means
from burst_fenicsx.kernels.vectors.rows import (
    add_rows,
    clear_rows,
    copy_motion,
    largest_speed,
    place_rows,
    sum_columns,
    take_means,
)
from tests.burst_fenicsx.boxes import box, distorted_box

pytestmark = pytest.mark.dolfinx


def mesh_and_levels(seed=0):
    """Hexahedra with random levels: nodes of each cell (cells, 8), and levels (cells,)."""
    mesh = box((4, 3, 2), (4.0, 3.0, 2.0))
    return mesh.cells.astype(np.int32), np.random.default_rng(seed).integers(0, 6, len(mesh.cells)).astype(np.int8)


@pytest.mark.parametrize("seed", range(3))
def test_levels_of_nodes_are_those_of_the_cells_around_them(seed):
    cells, level = mesh_and_levels(seed)
    nodes = int(cells.max()) + 1
    finest, coarsest = np.full(nodes, 9, dtype=np.int8), np.full(nodes, 9, dtype=np.int8)
    node_levels(cells, level, finest, coarsest)
    for node in range(nodes):
        around = level[(cells == node).any(axis=1)]
        assert (finest[node], coarsest[node]) == (around.max(), around.min())


@pytest.mark.parametrize("seed", range(4))
def test_levels_are_raised_until_neighbours_differ_by_one_and_no_farther(seed):
    """The lowest levels not below the given ones: the highest of those of all cells less the cells between."""
    cells, given = mesh_and_levels(seed)
    level, nodes = given.copy(), int(cells.max()) + 1
    finest, coarsest = np.empty(nodes, dtype=np.int8), np.empty(nodes, dtype=np.int8)
    raised = None
    while raised != 0:
        node_levels(cells, level, finest, coarsest)
        before = level.copy()
        raised = raise_levels(cells, finest, level)
        assert raised == (level != before).sum()
    index = np.array(list(itertools.product(range(4), range(3), range(2))))
    apart = np.abs(index[:, None] - index[None]).max(axis=2)  # cells that share a node are one apart
    np.testing.assert_array_equal(level, (given[None] - apart).max(axis=1))


def test_a_block_is_mixed_where_one_of_its_nodes_takes_shorter_steps():
    cells, _ = mesh_and_levels()
    blocks = np.resize(np.arange(len(cells), dtype=np.int32), (3, LANES))
    level = np.array([1, 2, 0], dtype=np.int8)
    for node in range(int(cells.max()) + 1):
        finest = np.zeros(int(cells.max()) + 1, dtype=np.int8)
        finest[node] = 2
        mixed = np.empty(3, dtype=np.int8)
        blocks_are_mixed(blocks, level, cells, finest, mixed)
        has = [(cells[block] == node).any() for block in blocks]
        np.testing.assert_array_equal(mixed, [has[0], False, has[2]])


def test_lanes_move_with_all_their_rows():
    rows, blocks = 5, 4
    old = np.random.default_rng(3).normal(size=(blocks, rows * LANES))
    source = np.random.default_rng(4).integers(0, blocks * LANES, 3 * LANES).astype(np.int32)
    by_slot = old.reshape(blocks, rows, LANES).transpose(0, 2, 1).reshape(-1, rows)
    for chosen in ([0, 1, 2], [0, 2], [1]):
        new = np.full((3, rows * LANES), np.nan)
        move_lanes(source, np.array(chosen), old, new)
        found = new.reshape(3, rows, LANES).transpose(0, 2, 1)
        np.testing.assert_array_equal(
            found[chosen].reshape(-1, rows), by_slot[source.reshape(3, LANES)[chosen].ravel()]
        )
        assert np.isnan(np.delete(found, chosen, axis=0)).all()


@pytest.mark.parametrize("words", [1, 2])
def test_groups_of_one_colour_share_no_node_and_no_colour_could_be_lower(words):
    cells, _ = mesh_and_levels()
    order = np.random.default_rng(5).permutation(len(cells)).astype(np.int32)
    first = np.array([0, 3, 4, 9, 15, 16, 20, len(cells)])
    taken, colour = np.zeros((int(cells.max()) + 1, words), dtype=np.uint64), np.full(7, -1, dtype=np.int32)
    assert colour_groups(order, first, cells, taken, colour)
    nodes = [set(cells[order[a:b]].ravel().tolist()) for a, b in itertools.pairwise(first)]
    for group, other in itertools.combinations(range(7), 2):
        assert colour[group] != colour[other] or not nodes[group] & nodes[other]
    for group in range(7):
        for lower in range(colour[group]):
            assert any(colour[k] == lower and nodes[k] & nodes[group] for k in range(group))


@pytest.mark.parametrize("words", [1, 2])
def test_colours_end_with_their_bits(words):
    """Groups that all share one node need a colour each: there are 64 to a word."""
    most = 64 * words
    for number, enough in ((most, True), (most + 1, False)):
        dofmap = np.column_stack([np.zeros(number), np.arange(1, number + 1)]).astype(np.int32)
        taken, colour = np.zeros((number + 1, words), dtype=np.uint64), np.empty(number, dtype=np.int32)
        found = colour_groups(np.arange(number, dtype=np.int32), np.arange(number + 1), dofmap, taken, colour)
        assert found == enough
        np.testing.assert_array_equal(colour[:most], np.arange(most))


def test_the_cell_behind_a_face_has_the_same_four_nodes():
    """In a box whose nodes have random numbers, some of them twins of one place."""
    mesh = box((3, 2, 4), (3.0, 2.0, 4.0))
    number = np.random.default_rng(6).permutation(len(mesh.nodes))
    cells = number[mesh.cells]
    twin = len(mesh.nodes)
    cells = np.where((cells == number[30]) & (np.arange(len(cells)) % 2 == 0)[:, None], twin, cells)
    place = np.append(np.arange(len(mesh.nodes)), number[30])
    found = face_neighbours(cells, place)
    corners = [[frozenset(place[cells[cell, side]].tolist()) for side in FACES] for cell in range(len(cells))]
    of_face = {}
    for cell, sides in enumerate(corners):
        for side in sides:
            of_face.setdefault(side, []).append(cell)
    for cell, sides in enumerate(corners):
        for side, nodes in enumerate(sides):
            behind = [other for other in of_face[nodes] if other != cell]
            assert found[cell, side] == (behind[0] if behind else -1)


def test_faces_of_a_hexahedron_look_outward():
    cube = box((1, 1, 1), (1.0, 1.0, 1.0))
    corner = cube.nodes[cube.cells[0]]
    for side in FACES:
        a, b, c, d = corner[side]
        normal = 0.5 * np.cross(c - a, d - b)
        assert normal @ (corner[side].mean(axis=0) - corner.mean(axis=0)) == pytest.approx(0.5)


def test_area_vectors_are_summed_over_groups_of_faces():
    """A roof with a ridge: two faces on each side of it."""
    x, y = np.meshgrid([0.0, 1.0, 2.0], [0.0, 1.0, 2.0], indexing="ij")
    nodes = np.column_stack([x.ravel(), y.ravel(), -np.abs(x.ravel() - 1.0)])
    number = np.arange(9).reshape(3, 3)
    faces = np.array(
        [[number[i, j], number[i + 1, j], number[i + 1, j + 1], number[i, j + 1]] for i in (0, 1) for j in (0, 1)]
    )
    vectors, total = np.empty((4, 3)), np.empty((2, 3))
    face_vectors(nodes, faces, np.arange(4), vectors)
    np.testing.assert_allclose(vectors, [[-1.0, 0.0, 1.0]] * 2 + [[1.0, 0.0, 1.0]] * 2, atol=1e-15)
    group_vectors(np.array([0, 3, 4]), np.array([0, 1, 2, 3]), np.arange(2), vectors, total)
    np.testing.assert_allclose(total, [[-1.0, 0.0, 3.0], [1.0, 0.0, 1.0]], atol=1e-15)


def values_and_rows(columns=3, rows=50, seed=7):
    random = np.random.default_rng(seed)
    return random.normal(size=(200, columns)), random.permutation(200)[:rows].astype(np.int32)


@pytest.mark.parametrize("columns", [1, 3, 4])
def test_rows_are_cleared_and_placed(columns):
    values, rows = values_and_rows(columns)
    before, others = values.copy(), np.setdiff1d(np.arange(200), rows)
    clear_rows(values, rows)
    assert (values[rows] == 0.0).all()
    np.testing.assert_array_equal(values[others], before[others])
    place_rows(before[rows], rows, values)
    np.testing.assert_array_equal(values, before)


def test_rows_are_added_copied_and_searched_for_the_fastest():
    source, rows = values_and_rows()
    target = source[::-1].copy()
    before, to = target.copy(), values_and_rows(seed=8)[1]
    add_rows(0.3, source, rows, target)
    expected = before.copy()
    expected[rows] += 0.3 * source[rows]
    np.testing.assert_array_equal(target, expected)
    speeds, expected_speeds = 2.0 * target, 2.0 * expected
    copy_motion(source, -source, rows, to, target, speeds)
    expected[to], expected_speeds[to] = source[rows], -source[rows]
    np.testing.assert_array_equal(target, expected)
    np.testing.assert_array_equal(speeds, expected_speeds)
    for axis in range(3):
        velocity = np.full((30, 3), 0.1)
        velocity[11, axis] = -5.0
        fastest = np.sqrt(25.0 + 0.02)
        assert largest_speed(velocity, np.array([3, 11, 4], dtype=np.int32)) == pytest.approx(fastest, rel=1e-14)
        assert largest_speed(velocity, np.array([3, 4], dtype=np.int32)) == pytest.approx(np.sqrt(0.03), rel=1e-14)
    assert largest_speed(velocity, np.zeros(0, dtype=np.int32)) == 0.0


def test_mean_velocities_stand_in_for_those_of_the_nodes_until_they_are_put_back():
    position, rows = values_and_rows()
    velocity, last = position * 3.0, position[rows] - 0.25 * np.arange(1.0, 151.0).reshape(50, 3)
    before, own = velocity.copy(), np.empty((50, 3))
    take_means(rows, position, 0.5, last, own, velocity)
    np.testing.assert_allclose(velocity[rows], 0.5 * np.arange(1.0, 151.0).reshape(50, 3), rtol=1e-12)
    np.testing.assert_array_equal(last, position[rows])
    place_rows(own, rows, velocity)
    np.testing.assert_array_equal(velocity, before)


def test_columns_are_summed_each_for_itself():
    values = np.arange(40.0).reshape(10, 4) ** 2
    rows = np.array([7, 2, 9], dtype=np.int32)
    assert sum_columns(values, rows, rounding_constant(1e4)).tolist() == values[rows].sum(axis=0).tolist()


def test_nodal_values_are_gathered_by_lanes_and_forces_go_back_to_their_nodes():
    mesh = distorted_box(3, 0.1)
    dofmap = mesh.cells.astype(np.int32)
    field, means = (np.random.default_rng(k).normal(size=mesh.nodes.shape) for k in (1, 2))
    cells = np.resize(np.random.default_rng(3).permutation(len(dofmap)).astype(np.int32), LANES)

    def in_rows(values):
        return values[dofmap[cells]].transpose(1, 2, 0).reshape(-1)

    rows = np.full(24 * LANES, np.nan)
    gather(cells, dofmap, field, rows)
    np.testing.assert_array_equal(rows, in_rows(field))
    finest = np.random.default_rng(4).integers(0, 4, len(mesh.nodes)).astype(np.int8)
    gather_means(cells, dofmap, 1, finest, field, means, rows)
    np.testing.assert_array_equal(rows, in_rows(np.where((finest > 1)[:, None], means, field)))
    forces = np.round(rows * 2.0**20) / 2.0**20  # sums in any order are exact
    for count in (LANES, LANES - 1, 3, 1):
        found, expected = np.zeros_like(field), np.zeros_like(field)
        add_nodal_forces(count, cells, dofmap, forces, found)
        by_lane = forces.reshape(8, 3, LANES)
        for lane in range(count):
            np.add.at(expected, dofmap[cells[lane]], by_lane[:, :, lane])
        np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("largest", [np.inf, np.nan, 0.0, -1.0])
def test_no_rounding_goes_by_a_largest_term_that_is_none(largest):
    with pytest.raises(ValueError, match="it must be positive and finite"):
        rounding_constant(largest)


@pytest.mark.parametrize(("largest", "number"), [(1e11, 8), (_LARGEST_PRESSURE / 8.0, 32), (1.0, int(_MOST_CELLS))])
def test_pressures_and_burnt_shares_around_a_node_are_summed_exactly(largest, number):
    """Of detonation, 20 to 30 GPa and of its reflection; and of as many cells as ever share a node."""
    bound = _LARGEST_PRESSURE if largest > 1.0 else _MOST_CELLS
    terms = quantise(np.random.default_rng(1).uniform(0.5, 1.0, number) * largest, rounding_constant(bound))
    sums = {float(np.add.accumulate(np.random.default_rng(k).permutation(terms))[-1]) for k in range(40)}
    assert len(sums) == 1
    assert quantum(rounding_constant(bound)) < 1e-9 * largest
