"""Placing: every cell's mass is given out exactly once, whatever the mesh and the fragments."""

from __future__ import annotations

import numpy as np
import pytest

from transition.adjacency import face_neighbours
from transition.placing import cell_sides, patch_means, place, trilinear


def block(nx, ny, nz):
    """Hexahedra of a block of unit cells: nodes and cells in VTK order."""
    x, y, z = np.meshgrid(range(nx + 1), range(ny + 1), range(nz + 1), indexing="ij")
    nodes = np.column_stack([x.ravel(), y.ravel(), z.ravel()]).astype(float)

    def number(i, j, k):
        return (i * (ny + 1) + j) * (nz + 1) + k

    i, j, k = (a.ravel() for a in np.meshgrid(range(nx), range(ny), range(nz), indexing="ij"))
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    return nodes, np.column_stack([number(i + a, j + b, k + c) for a, b, c in corners])


def partition(total, number, generator):
    """Random masses with a heavy tail, falling, of a given sum."""
    masses = np.sort(generator.exponential(size=number) ** 3)[::-1]
    return masses * (total / masses.sum())


def test_neighbours_of_a_block():
    _, cells = block(3, 4, 5)
    neighbours = face_neighbours(cells, np.zeros(60, dtype=np.int64))
    place_of = np.array(np.unravel_index(np.arange(60), (3, 4, 5))).T
    for cell in range(60):
        near = {other for other in range(60) if np.abs(place_of[cell] - place_of[other]).sum() == 1}
        assert set(neighbours[cell][neighbours[cell] >= 0]) == near


def test_groups_are_not_neighbours():
    _, cells = block(4, 1, 1)
    neighbours = face_neighbours(cells, np.array([0, 0, 1, 1]))
    assert [set(row[row >= 0]) for row in neighbours] == [{1}, {0}, {3}, {2}]


@pytest.mark.parametrize("seed", range(40))
def test_every_cells_mass_is_given_once(seed):
    """Random blocks with holes (often in several parts), random cell masses, fragments from crumbs to many cells."""
    generator = np.random.default_rng(seed)
    _, cells = block(*generator.integers(1, 12, 3))
    cells = cells[generator.random(len(cells)) < generator.uniform(0.4, 1.0)]
    if not len(cells):
        cells = block(1, 1, 1)[1]
    mass = generator.lognormal(sigma=1.0, size=len(cells)) * 1e-3
    number = int(np.exp(generator.uniform(0.0, np.log(4.0 * len(cells) + 2.0))))
    asked = partition(mass.sum(), number, generator)
    neighbours = face_neighbours(cells, np.zeros(len(cells), dtype=np.int64))
    patches = place(asked, mass, neighbours, generator, take_all=True)
    np.testing.assert_allclose(np.bincount(patches.cell, patches.piece, minlength=len(mass)), mass, rtol=1e-12)
    assert patches.mass.sum() == pytest.approx(mass.sum(), rel=1e-12)
    assert patches.mass.size == number
    np.testing.assert_allclose(np.sort(patches.mass)[::-1], asked, rtol=0.0, atol=1e-12 * mass.sum())
    assert (patches.piece > 0.0).all()
    assert (patches.cell[patches.offset[:-1]] == patches.seed).all()


def test_patches_said_to_hang_together_do():
    generator = np.random.default_rng(3)
    _, cells = block(10, 10, 10)
    neighbours = face_neighbours(cells, np.zeros(1000, dtype=np.int64))
    patches = place(partition(1000.0, 150, generator), np.ones(1000), neighbours, generator, take_all=True)
    assert patches.contiguous.mean() > 0.75
    for fragment in np.flatnonzero(patches.contiguous):
        own = slice(patches.offset[fragment], patches.offset[fragment + 1])
        covered = set(patches.cell[own][patches.piece[own] > 1e-9])  # the last one also takes round-off
        reached, open_cells = {patches.seed[fragment]}, [patches.seed[fragment]]
        while open_cells:
            for other in neighbours[open_cells.pop()]:
                if other in covered and other not in reached:
                    reached.add(other)
                    open_cells.append(other)
        assert reached == covered


def test_less_than_the_whole_mass_leaves_the_rest():
    generator = np.random.default_rng(4)
    _, cells = block(5, 5, 5)
    neighbours = face_neighbours(cells, np.zeros(125, dtype=np.int64))
    asked = np.full(30, 2.5)
    patches = place(asked, np.ones(125), neighbours, generator, take_all=False)
    np.testing.assert_allclose(patches.mass, asked, rtol=1e-14)
    assert np.bincount(patches.cell, patches.piece, minlength=125).max() <= 1.0 + 1e-14


def test_seeds_fall_on_cells_by_their_mass():
    """One small fragment on cells of mass 1 to 5, four thousand times."""
    _, cells = block(5, 1, 1)
    neighbours = face_neighbours(cells, np.zeros(5, dtype=np.int64))
    mass, generator = np.arange(1.0, 6.0), np.random.default_rng(2)
    seeds = [place(np.array([0.01]), mass, neighbours, generator, take_all=False).seed[0] for _ in range(4000)]
    share = mass / mass.sum()
    assert (np.abs(np.bincount(seeds, minlength=5) - 4000 * share) < 4.0 * np.sqrt(4000 * share)).all()


def test_centres_of_mass_keep_the_casings_first_moment_where_cells_are_covered_whole():
    nodes, cells = block(6, 6, 6)
    generator = np.random.default_rng(6)
    neighbours = face_neighbours(cells, np.zeros(216, dtype=np.int64))
    patches = place(np.array([100.0, 60.0, 40.0, 16.0]), np.ones(216), neighbours, generator, take_all=True)
    places = patch_means(patches, nodes[cells])
    np.testing.assert_allclose(patches.mass @ places, nodes[cells].mean(axis=1).sum(axis=0), rtol=1e-12)


def test_fragments_smaller_than_a_cell_lie_apart_inside_it():
    nodes, cells = block(1, 1, 1)
    generator = np.random.default_rng(6)
    neighbours = face_neighbours(cells, np.zeros(1, dtype=np.int64))
    patches = place(np.full(50, 0.02), np.ones(1), neighbours, generator, take_all=True)
    places = patch_means(patches, nodes[cells])
    assert (places > 0.0).all()
    assert (places < 1.0).all()
    assert np.unique(places, axis=0).shape == (50, 3)


def test_trilinear_is_exact_for_its_own_monomials():
    generator = np.random.default_rng(8)
    nodes, cells = block(1, 1, 1)
    corners, points = np.repeat(nodes[cells], 20, axis=0), generator.random((20, 3))
    np.testing.assert_allclose(trilinear(corners, points), points, atol=1e-15)
    x, y, z = corners[..., 0], corners[..., 1], corners[..., 2]
    values = np.stack([x * y * z, x * y - 2 * z, y * z + 3], axis=-1)
    u, v, w = points.T
    expected = np.column_stack([u * v * w, u * v - 2 * w, v * w + 3])
    np.testing.assert_allclose(trilinear(values, points), expected, atol=1e-14)


def test_patch_mean_of_a_constant_is_that_constant():
    generator = np.random.default_rng(9)
    _, cells = block(4, 4, 4)
    neighbours = face_neighbours(cells, np.zeros(64, dtype=np.int64))
    patches = place(partition(64.0, 20, generator), np.ones(64), neighbours, generator, take_all=True)
    mean = patch_means(patches, np.tile([1.0, -2.0, 3.0], (64, 8, 1)))
    np.testing.assert_allclose(mean, np.tile([1.0, -2.0, 3.0], (20, 1)), rtol=1e-13)


@pytest.mark.parametrize("seed", range(20))
@pytest.mark.parametrize("take_all", [True, False])
def test_pieces_of_a_cell_have_its_mean_of_any_nodal_field(seed, take_all):
    """Fields that differ wildly from node to node, crumbs and heavy fragments; also where mass is left over."""
    generator = np.random.default_rng(seed)
    _, cells = block(*generator.integers(1, 6, 3))
    mass = generator.lognormal(sigma=1.0, size=len(cells))
    asked = partition(
        mass.sum() * (1.0 if take_all else 0.7), int(generator.integers(1, 8 * len(cells) + 2)), generator
    )
    neighbours = face_neighbours(cells, np.zeros(len(cells), dtype=np.int64))
    sides = generator.uniform(0.2, 3.0, (len(cells), 3))
    patches = place(asked, mass, neighbours, generator, take_all=take_all, sides=sides)
    field = generator.normal(scale=1000.0, size=(len(cells), 8, 3))
    values = trilinear(field[patches.cell], patches.centre) * patches.piece[:, None]
    given = np.bincount(patches.cell, patches.piece, minlength=len(cells))
    found = np.column_stack([np.bincount(patches.cell, values[:, i], minlength=len(cells)) for i in range(3)])
    scale = 1000.0 * mass.max()
    np.testing.assert_allclose(found, given[:, None] * field.mean(axis=1), rtol=0.0, atol=1e-13 * scale)
    total = patches.mass @ patch_means(patches, field)
    np.testing.assert_allclose(total, given @ field.mean(axis=1), rtol=0.0, atol=1e-14 * 1000.0 * mass.sum())


def test_whole_cells_give_the_mean_of_their_nodes():
    generator = np.random.default_rng(5)
    _, cells = block(4, 4, 4)
    neighbours = face_neighbours(cells, np.zeros(64, dtype=np.int64))
    patches = place(np.array([40.0, 16.0, 8.0]), np.ones(64), neighbours, generator, take_all=True)
    field = generator.normal(size=(64, 8, 3))
    np.testing.assert_array_equal(patches.centre, 0.5)
    means = [field[patches.cell[patches.offset[f] : patches.offset[f + 1]]].mean(axis=(0, 1)) for f in range(3)]
    np.testing.assert_allclose(patch_means(patches, field), means, rtol=0.0, atol=1e-14)


def test_a_shared_cell_is_cut_across_its_longest_side():
    _, cells = block(1, 1, 1)
    neighbours = face_neighbours(cells, np.zeros(1, dtype=np.int64))
    for axis in range(3):
        sides = np.ones((1, 3))
        sides[0, axis] = 3.0
        generator = np.random.default_rng(axis)
        patches = place(np.array([0.75, 0.25]), np.ones(1), neighbours, generator, take_all=True, sides=sides)
        others = [i for i in range(3) if i != axis]
        np.testing.assert_array_equal(patches.centre[:, others], 0.5)
        along = patches.centre[:, axis]
        assert sorted(np.abs(along - 0.5)) == pytest.approx([0.125, 0.375])
        assert np.prod(along - 0.5) < 0.0


def test_sides_of_a_skewed_box():
    nodes, cells = block(1, 1, 1)
    skewed = nodes @ np.array([[2.0, 0.0, 0.0], [0.0, 3.0, 4.0], [0.0, 0.0, 7.0]])
    np.testing.assert_allclose(cell_sides(skewed[cells]), [[2.0, 5.0, 7.0]])
