"""Vectors turned into rows over the lanes and back: exactly, for repeated places, and within the array."""

from __future__ import annotations

import numpy as np
import pytest
from numba.core.errors import TypingError

from burst_fenicsx.kernels.lanes import LANES, kernel
from burst_fenicsx.kernels.vectors.nodal_values import (
    add_nodal_forces,
    gather_mean_modes,
    gather_modes,
    make_gather,
)
from burst_fenicsx.kernels.vectors.transposition import (
    WIDTH,
    add_triples,
    address,
    addresses,
    load_triples,
    store_triples,
)

gather, gather_means = make_gather(8)


@kernel
def there(field, index, rows):
    """Load eight vectors."""
    chosen = (index[0], index[1], index[2], index[3], index[4], index[5], index[6], index[7])
    load_triples(addresses(address(field), np.uint64(24), chosen), rows, 0)


@kernel
def back(rows, index, field):
    """Store eight vectors."""
    chosen = (index[0], index[1], index[2], index[3], index[4], index[5], index[6], index[7])
    store_triples(rows, 0, addresses(address(field), np.uint64(24), chosen))


@kernel
def onto(rows, index, field):
    """Add eight vectors."""
    chosen = (index[0], index[1], index[2], index[3], index[4], index[5], index[6], index[7])
    add_triples(rows, 0, addresses(address(field), np.uint64(24), chosen))


@pytest.fixture
def block():
    random = np.random.default_rng(5)
    field, means = random.normal(size=(40, 3)), random.normal(size=(40, 3))
    cells = random.permutation(30)[:LANES].astype(np.int32)
    dofmap = random.integers(0, 40, (30, 8)).astype(np.int32)
    dofmap[cells[3]] = dofmap[cells[4]]  # nodes that several cells of the block share
    dofmap[cells[5], 2] = 39  # the last one, behind which nothing may be read
    return field, means, cells, dofmap


@pytest.mark.parametrize("field", [np.zeros((3, 20)).T, np.zeros((20, 3), dtype=np.float32)])
def test_what_lies_otherwise_is_refused(field):
    with pytest.raises(TypingError, match="float64 without gaps"):
        there(field, np.arange(8, dtype=np.uint64), np.zeros(3 * LANES))


def test_vectors_become_rows_and_come_back():
    field, index = np.random.default_rng(1).normal(size=(20, 3)), np.array([3, 19, 0, 7, 8, 5, 11, 2], dtype=np.uint64)
    rows, other = np.zeros(3 * LANES), np.zeros((20, 3))
    there(field, index, rows)
    np.testing.assert_array_equal(rows.reshape(3, LANES)[:, :WIDTH].T, field[index])
    back(rows, index, other)
    np.testing.assert_array_equal(other[index], field[index])
    assert np.count_nonzero(other) == 3 * WIDTH
    index[:] = [3, 3, 3, 0, 0, 1, 2, 3]  # vectors that add to the same place
    other[:] = 0.0
    onto(np.round(1024.0 * rows), index, other)
    wanted = np.zeros((20, 3))
    np.add.at(wanted, index, np.round(1024.0 * rows).reshape(3, LANES)[:, :WIDTH].T)
    np.testing.assert_array_equal(other, wanted)


def modes(nodal):
    """Modes 1, 2, 4, 3, 5, 6, 7 of nodal values (cells, 8, 3), as rows (7, 3, cells)."""
    signs = [[(-1.0) ** (m & ~n & 7).bit_count() for n in range(8)] for m in (1, 2, 4, 3, 5, 6, 7)]
    return np.einsum("mn,kni->mik", signs, nodal)


def rows_of_cells(cells, dofmap, which):
    """Make halves of a block rows of cells, in which the nodes of every corner follow one another."""
    for half in np.flatnonzero(which):
        lanes = slice(half * WIDTH, (half + 1) * WIDTH)
        cells[lanes] = np.arange(11 * half, 11 * half + WIDTH)
        dofmap[cells[lanes]] = np.array([0, 1, 9, 10, 20, 21, 29, 30]) + np.arange(WIDTH)[:, None]
    return np.array(which, dtype=np.int8)


HALVES = pytest.mark.parametrize("which", [(0, 0), (1, 0), (0, 1), (1, 1)])


@HALVES
def test_gathered_modes_are_those_of_the_cells(block, which):
    field, means, cells, dofmap = block
    in_rows = rows_of_cells(cells, dofmap, which)
    rows, of_means = np.zeros(21 * LANES), np.zeros(21 * LANES)
    gather_modes(cells, dofmap, in_rows, field, rows)
    np.testing.assert_allclose(rows.reshape(7, 3, LANES), modes(field[dofmap[cells]]), rtol=0, atol=1e-14)
    finest = np.random.default_rng(2).integers(0, 3, len(field)).astype(np.int8)
    gather_mean_modes(cells, dofmap, 1, finest, field, means, of_means)
    expected = modes(np.where(finest[:, None] > 1, means, field)[dofmap[cells]])
    np.testing.assert_allclose(of_means.reshape(7, 3, LANES), expected, rtol=0, atol=1e-14)
    gather_mean_modes(cells, dofmap, 2, finest, field, means, of_means)
    np.testing.assert_array_equal(of_means, rows)


def test_gathered_rows_are_the_nodes_of_the_cells(block):
    field, _, cells, dofmap = block
    rows = np.zeros(24 * LANES)
    gather(cells, dofmap, field, rows)
    np.testing.assert_array_equal(rows.reshape(8, 3, LANES), field[dofmap[cells]].transpose(1, 2, 0))


def test_nodes_of_shorter_steps_give_their_mean_velocity(block):
    field, means, cells, dofmap = block
    finest = np.random.default_rng(2).integers(0, 3, len(field)).astype(np.int8)
    rows = np.zeros(24 * LANES)
    gather_means(cells, dofmap, 1, finest, field, means, rows)
    expected = np.where(finest[:, None] > 1, means, field)[dofmap[cells]].transpose(1, 2, 0)
    np.testing.assert_array_equal(rows.reshape(8, 3, LANES), expected)


@HALVES
@pytest.mark.parametrize("count", [LANES, LANES - 5])
def test_forces_of_shared_nodes_add_up(block, count, which):
    field, _, cells, dofmap = block
    in_rows = rows_of_cells(cells, dofmap, which)
    rows = np.round(np.random.default_rng(3).normal(size=(8, 3, LANES)) * 1024.0)  # whole numbers: any order is exact
    force, expected = field * 0.0, field * 0.0
    add_nodal_forces(count, cells, dofmap, in_rows, rows.ravel(), force)
    np.add.at(expected, dofmap[cells[:count]], rows.transpose(2, 0, 1)[:count])
    np.testing.assert_array_equal(force, expected)
