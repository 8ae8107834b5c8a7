"""Meridians swept around their axis: volumes, fields, bounds on the number of cells, coarser grids."""

from __future__ import annotations

import numpy as np
import pytest

from burst_fenicsx.files.revolve import MOST_SECTORS, revolution, write_revolved
from burst_fenicsx.meshing.placement import frame, place

AXIS, POSITION = (0.3, -0.8, 0.4), (1.0, 2.0, -0.5)


def grid(columns, rows, inner=0.0):
    """Nodes in (r, z) of a rectangle 2 by 3, rows shifted against each other, and its quadrilaterals."""
    r, z = np.meshgrid(np.linspace(inner, 2.0, columns + 1), np.linspace(0.0, 3.0, rows + 1))
    number = np.arange(r.size).reshape(r.shape)
    cells = np.stack([number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]], axis=-1).reshape(-1, 4)
    return np.column_stack([r.ravel(), z.ravel()]), cells


def world(flat):
    """In the half plane of the contract: outward is the first row of the frame of the axis."""
    return place(np.column_stack([flat[:, 0], 0.0 * flat[:, 0], flat[:, 1]]), POSITION, AXIS)


def volumes(points, cells):
    """Volumes of hexahedra (m, 8) by 2 x 2 x 2 Gauss points."""
    signs = np.array(
        [[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]]
    )
    total, corners = np.zeros(len(cells)), points[cells]
    for point in signs / np.sqrt(3.0):
        factor = 1.0 + signs * point
        slope = np.stack([signs[:, a] * factor[:, (a + 1) % 3] * factor[:, (a + 2) % 3] / 8.0 for a in range(3)])
        total += np.linalg.det(np.einsum("ak,mkb->mab", slope, corners))
    return total


@pytest.mark.parametrize("inner", [0.0, 0.5])
def test_volume_is_that_of_the_body_but_for_chords(inner):
    flat, cells = grid(4, 5, inner)
    swept = revolution(world(flat), cells, POSITION, AXIS)
    points = swept.positions(world(flat))
    found = volumes(points, swept.cells)
    assert swept.sectors == MOST_SECTORS
    assert found.min() > 0.0
    chords = np.sin(2.0 * np.pi / swept.sectors) * swept.sectors / (2.0 * np.pi)
    assert found.sum() == pytest.approx(np.pi * (4.0 - inner**2) * 3.0 * chords, rel=1e-12)
    assert swept.wedges.sum() == (5 * swept.sectors if inner == 0.0 else 0)
    assert len(points) == (6 if inner == 0.0 else 0) + swept.sectors * 6 * (4 if inner == 0.0 else 5)
    assert np.unique(np.round(points, 9), axis=0).shape == points.shape  # every place has one node


@pytest.mark.parametrize("turn", range(4))
def test_wedges_are_not_inside_out_whichever_node_comes_first(turn):
    pyvista = pytest.importorskip("pyvista")
    flat, cells = grid(3, 4)
    swept = revolution(world(flat), np.roll(cells, turn, axis=1), POSITION, AXIS)
    wedges = swept.wedge_nodes()
    if pyvista.vtk_version_info < (9, 7):
        wedges = wedges[:, [0, 2, 1, 3, 5, 4]]
    kinds = {pyvista.CellType.WEDGE: wedges, pyvista.CellType.HEXAHEDRON: swept.cells[~swept.wedges]}
    found = pyvista.UnstructuredGrid(kinds, swept.positions(world(flat))).compute_cell_sizes()["Volume"]
    assert found.min() > 0.0
    assert found.sum() == pytest.approx(volumes(swept.positions(world(flat)), swept.cells).sum(), rel=1e-9)


def test_fields_turn_with_the_sectors():
    """A radial velocity stays radial, a hoop stress stays in the hoop direction, numbers stay with their cells."""
    flat, cells = grid(4, 5)
    swept = revolution(world(flat), cells, POSITION, AXIS, most_cells=20 * 36)
    assert swept.sectors == 36
    base = frame(AXIS)
    points = swept.positions(world(flat))
    away = points - POSITION
    outward = away - np.outer(away @ base[2], base[2])
    velocity = swept.point_field(flat[:, :1] * base[0] + 7.0 * base[2])
    np.testing.assert_allclose(velocity, outward + 7.0 * base[2], atol=1e-12)
    np.testing.assert_allclose(swept.point_field(flat[:, 1]), away @ base[2], atol=1e-12)

    hoop = np.outer(base[1], base[1])
    six = np.array([hoop[0, 0], hoop[1, 1], hoop[2, 2], hoop[0, 1], hoop[1, 2], hoop[2, 0]])
    stress = swept.cell_field(np.tile(six, (len(cells), 1)))
    centre = outward[swept.cells].mean(axis=1)
    direction = np.cross(base[2], centre)
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    wanted = np.einsum("mi,mj->mij", direction, direction)
    np.testing.assert_allclose(stress[:, [0, 3, 4, 5]], wanted[:, [0, 0, 1, 2], [0, 1, 2, 0]], atol=1e-12)
    np.testing.assert_array_equal(swept.cell_field(np.arange(len(cells))), np.tile(np.arange(20), 36))


@pytest.mark.parametrize(
    ("most", "sectors"), [(200_000, 96), (100_000, 80), (60_000, 48), (20_000, 24), (2_880, 24), (2_879, 4), (400, 4)]
)
def test_fewer_sectors_bound_the_number_of_cells(most, sectors):
    """Of 1200 quadrilaterals: as many as allowed from 24 to 96, four where 24 make more than ten times what is.

    The bound is kept where it allows 24; else there are ten times as many cells at most, or four sectors of them.
    """
    flat, cells = grid(20, 60)
    swept = revolution(world(flat), cells, POSITION, AXIS, most_cells=most)
    assert swept.sectors == sectors
    assert swept.sectors % 4 == 0
    assert len(swept.cells) == sectors * 1200 <= (most if most >= 24 * 1200 else max(10 * most, 4 * 1200))
    field = np.random.default_rng(1).random(len(cells))
    assert swept.cell_field(field).sum() == pytest.approx(sectors * field.sum(), rel=1e-12)
    np.testing.assert_array_equal(np.bincount(swept.cell), sectors)
    chords = np.sin(2.0 * np.pi / sectors) * sectors / (2.0 * np.pi)
    assert volumes(swept.positions(world(flat)), swept.cells).sum() == pytest.approx(12.0 * np.pi * chords, rel=1e-12)


def test_file_for_paraview_is_read_back(tmp_path):
    """Hexahedra and wedges with positive volumes; velocity and stress turned; parts as they were."""
    pyvista = pytest.importorskip("pyvista")
    flat, cells = grid(4, 5)
    base = frame(AXIS)
    swept = revolution(world(flat), cells, POSITION, AXIS)
    part = (flat[cells].mean(axis=1)[:, 0] < 1.0).astype(np.int32)
    write_revolved(
        tmp_path / "burst_revolved", swept, 1.2e-4, world(2.0 * flat), {"velocity": flat[:, :1] * base[0]},
        {"part": part, "stress": np.ones((len(cells), 6))}, {"seed": "1"},
    )  # fmt: skip
    reader = pyvista.get_reader(str(tmp_path / "burst_revolved.xdmf"))
    assert reader.time_values == [1.2e-4]
    found = reader.read()
    assert found.n_cells == 20 * 96
    assert found.cell_data["stress"].shape == (20 * 96, 9)
    np.testing.assert_array_equal(found.cell_data["part"], np.tile(part, 96))
    away = found.points - POSITION
    outward = away - np.outer(away @ base[2], base[2])
    np.testing.assert_allclose(found.point_data["velocity"], 0.5 * outward, atol=1e-6)
    volume = found.compute_cell_sizes()["Volume"]
    assert volume.min() > 0.0
    assert volume.sum() == pytest.approx(np.pi * 16.0 * 6.0, rel=1e-3)
    # The outside is closed: degenerate faces on the axis are not part of what is seen.
    surface = found.extract_surface(algorithm="dataset_surface").triangulate().clean()
    assert surface.volume == pytest.approx(volume.sum(), rel=1e-6)
