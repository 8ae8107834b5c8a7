"""Parts of the meridian by hand: edges and what lies behind them, corners of a slide line, parts by station, planes."""

from __future__ import annotations

from contextlib import nullcontext
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from burst_fenicsx.axisymmetric.applicability import CLEARANCE, clearance, why_not_axisymmetric
from burst_fenicsx.axisymmetric.meridian import MERIDIAN, RING
from burst_fenicsx.axisymmetric.mesh import (
    areas,
    edge_neighbours,
    longest_edges,
    mesh_meridian,
    outer_edges,
    ring_volumes,
)
from burst_fenicsx.axisymmetric.slide_line import smooth_line
from burst_fenicsx.errors import InputError, NumericalStop
from burst_fenicsx.geometry import load_profile
from burst_fenicsx.problem import IgnitionPoint, Mirror, Part, RigidPlane, ShockInitiation
from burst_fenicsx.records.surfaces import radial_surfaces
from tests.burst_fenicsx.axisymmetric.meridians import named, random_meridian, rectangle
from tests.burst_fenicsx.tubes import SETTINGS, tube

pytestmark = pytest.mark.dolfinx


def ends_of(mesh):
    """Edges (cells, 4) of a mesh as sets of their two nodes."""
    return [[frozenset((int(row[k]), int(row[(k + 1) % 4]))) for k in range(4)] for row in mesh.cells]


@pytest.mark.parametrize("inner", [0.0, 0.1])
def test_edges_of_the_outside_are_those_that_one_cell_has(inner):
    """Those on the axis are none; the cell lies to the left of its edges."""
    mesh = rectangle((3, 4), (inner, 0.4), 0.5)
    sides, behind = ends_of(mesh), edge_neighbours(mesh)
    for cell, own in enumerate(sides):
        for k, edge in enumerate(own):
            others = [other for other, theirs in enumerate(sides) if edge in theirs and other != cell]
            assert behind[cell, k] == (others[0] if others else -1)
    group = np.arange(len(mesh.cells)) % 3 - 1
    found, owner, back = outer_edges(mesh, group)
    wanted = {
        (cell, edge)
        for cell, own in enumerate(sides)
        for k, edge in enumerate(own)
        if group[cell] >= 0
        and (behind[cell, k] < 0 or group[behind[cell, k]] != group[cell])
        and (mesh.nodes[list(edge), 0] > 0.0).any()
    }
    assert {(int(cell), frozenset(edge.tolist())) for cell, edge in zip(owner, found, strict=True)} == wanted
    for edge, cell, other in zip(found, owner, back, strict=True):
        start, end = mesh.nodes[edge][:, [0, 2]]
        centre = mesh.nodes[mesh.cells[cell]].mean(axis=0)[[0, 2]]
        along, inward = end - start, centre - start
        assert along[0] * inward[1] - along[1] * inward[0] > 0.0
        assert other == behind[cell, sides[cell].index(frozenset(edge.tolist()))]


def test_parts_of_the_charge_are_equally_long_and_bins_are_those_of_the_round():
    """A charge from 0.2 to 0.8 m in a tube of 1 m: three parts of 0.2 m, five bins of 0.2 m from the nose."""
    mesh = rectangle((4, 20), (0.0, 0.4), 1.0)
    centre = mesh.nodes[mesh.cells].mean(axis=1)
    inside = (centre[:, 0] < 0.2) & (np.abs(centre[:, 2] - 0.5) < 0.3)
    mesh = named(mesh, np.where(inside, Part.CHARGE, Part.CASING))
    found = radial_surfaces(mesh, [tube()], 3, 5)
    station = 1.0 - centre[:, 2]
    np.testing.assert_array_equal(found.cell_slice[inside], ((station[inside] - 0.2) / 0.2).astype(int))
    assert (found.cell_slice[~inside] == 3).all()
    r, z = mesh.nodes[:, 0], mesh.nodes[:, 2]
    # Nodes on the charge's side: all at r = 0.2 m from end to end; its flat ends are no side.
    side = np.isclose(r, 0.2) & (np.abs(z - 0.5) < 0.3 + 1e-9)
    np.testing.assert_array_equal(found.charge_slice >= 0, side)
    between = side & ~np.isclose((0.8 - z) % 0.2, 0.0) & ~np.isclose((0.8 - z) % 0.2, 0.2)
    np.testing.assert_array_equal(found.charge_slice[between], ((0.8 - z[between]) / 0.2).astype(int))
    assert set(found.charge_slice[side].tolist()) == {0, 1, 2}
    outside = np.isclose(r, 0.4)
    np.testing.assert_array_equal(found.casing_bin >= 0, outside)
    assert set(found.casing_bin[outside].tolist()) == {0, 1, 2, 3, 4}
    np.testing.assert_allclose(found.bin_station, [0.1, 0.3, 0.5, 0.7, 0.9])
    np.testing.assert_array_equal(found.radius, r)
    np.testing.assert_array_equal(found.outward, np.broadcast_to([1.0, 0.0, 0.0], mesh.nodes.shape))
    assert (radial_surfaces(rectangle((2, 2), (0.1, 0.2), 1.0), [tube()], 3, 2).cell_slice == 3).all()


def line(turns):
    """Nodes (n, 3) and edges (n - 1, 2) of a line of unit edges that turns left by these angles (degrees)."""
    angle = np.radians(np.cumsum([0.0, *turns]))
    flat = np.zeros((len(angle) + 1, 2))
    flat[1:] = np.cumsum(np.column_stack([np.cos(angle), np.sin(angle)]), axis=0)
    flat[:, 0] += 5.0
    nodes = np.column_stack([flat[:, 0], np.zeros(len(flat)), flat[:, 1]])
    return nodes, np.column_stack([np.arange(len(flat) - 1), np.arange(1, len(flat))])


@pytest.mark.parametrize("order", [[0, 1, 2, 3, 4], [3, 0, 4, 2, 1]])
def test_a_line_is_smooth_where_it_turns_by_less_than_half_a_right_angle(order):
    """And creases that turn right are hollow on the right, where the charge lies to the left of none."""
    nodes, edges = line([44.0, -44.0, 46.0, -46.0])
    edges = edges[order]
    surface, group_node = smooth_line(nodes, edges)
    at = {int(edge[0]): k for k, edge in enumerate(edges)}  # edge by its first node
    for node in range(5):
        own = at[node]
        for k, side, other in ((0, 3, node - 1), (1, 1, node + 1)):
            corner = node if k == 0 else node + 1
            smooth, hollow = corner in (1, 2), corner == 4
            assert surface.neighbour[own, side] == (at[other] if smooth else -1)
            assert surface.hollow[own, side] == (at[other] if hollow else -1)
            group = surface.corner[own, k]
            assert group_node[group] == corner
            members = surface.member[surface.first[group] : surface.first[group + 1]]
            assert sorted(members.tolist()) == sorted([own, at[other]] if smooth else [own])
    assert len(group_node) == 2 * 5 - 2


def test_areas_edges_and_rates_of_quadrilaterals():
    """A kite, wherever it lies: half the product of its diagonals; its longest edge; Pappus' volume."""
    nodes = np.array([[2.0, 0, 0.0], [3.0, 0, 1.0], [2.0, 0, 4.0], [1.0, 0, 1.0]])
    cells = np.array([[0, 1, 2, 3]])
    assert areas(nodes, cells) == pytest.approx([4.0])
    assert longest_edges(nodes, cells) == pytest.approx([np.sqrt(10.0)])
    assert ring_volumes(nodes, cells) == pytest.approx([2.0 * np.pi * 2.0 * 4.0])
    corners = nodes[cells]
    assert RING.burn_rates(corners, np.zeros(1), 7000.0) == pytest.approx([2.0 * 7000.0 * np.sqrt(10.0) / (3.0 * 4.0)])
    # The face that its longest edge sweeps is no larger than that of its farthest corner.
    assert RING.largest_faces(corners) == pytest.approx([2.0 * np.pi * 3.0 * np.sqrt(10.0)])
    for shift in range(4):
        turned = np.roll(cells, shift, axis=1)
        assert areas(nodes, turned) == pytest.approx([4.0])
        assert longest_edges(nodes, turned) == pytest.approx([np.sqrt(10.0)])


def test_the_shortest_edge_and_the_mean_one_of_a_mesh():
    mesh = rectangle((3, 4), (0.1, 0.4), 0.2)
    assert mesh.shortest_edge == pytest.approx(0.05)
    assert mesh.mean_edge == pytest.approx(np.sqrt(0.1 * 0.05))
    moved = random_meridian(5, 0.02)
    sides = np.diff(moved.nodes[moved.cells[:, [0, 1, 2, 3, 0]]], axis=1)
    assert moved.shortest_edge == pytest.approx(np.linalg.norm(sides, axis=2).min())


def test_a_mesh_that_is_too_fine_is_refused_and_a_coarse_one_has_three_cells_through_the_wall():
    profile = load_profile("m107")
    with pytest.raises(InputError, match="cells in the meridian; at most"):
        mesh_meridian(profile, 2e-5)
    mesh = mesh_meridian(profile, 12e-3)
    station = np.unique(mesh.station)
    for one in station:
        row = mesh.part[mesh.station == one]
        if (row == Part.CHARGE).any():
            assert (row == Part.CASING).sum() >= 3
            assert (row == Part.CHARGE).sum() >= 2
    fine = mesh_meridian(profile, 4e-3)
    assert fine.mean_edge == pytest.approx(4e-3, rel=0.25)
    for part, volume in ((Part.CASING, profile.volumes().casing), (Part.CHARGE, profile.volumes().charge)):
        assert fine.volumes[fine.part == part].sum() == pytest.approx(volume, rel=0.02)
    assert set(fine.segment[fine.part == Part.CASING].tolist()) == set(range(len(profile.segments)))
    assert (fine.segment[fine.part != Part.CASING] == -1).all()
    for number, segment in enumerate(profile.segments):
        inside = fine.segment == number
        assert fine.station[inside].min() > segment.start - 1e-9
        assert fine.station[inside].max() < segment.end + 1e-9


@pytest.mark.parametrize(
    ("axis", "normal", "distance"),
    [
        ((0, 0, 1.0), (0, 0, 1.0), 0.0),  # stands on it: the base is nearest
        ((0, 0, 2.0), (0, 0, -1.0), 0.3),  # hangs from it: the nose is
        ((1.0, 0, 0), (0, 0, 5.0), 77.5e-3),  # lies beside it
        ((0, 3.0, 4.0), (0, 0, 1.0), 0.6 * 77.5e-3),  # leans: the rim of its base is
    ],
)
def test_the_clearance_of_a_tube_is_that_of_its_nearest_rim(axis, normal, distance):
    """Length 0.3 m, radius 77.5 mm; the centre of the base is 2 m from the plane."""
    unit = np.asarray(normal) / np.linalg.norm(normal)
    item = tube(axis=axis, position=tuple(2.0 * unit + [0.7, 0.0, 0.0] * (1.0 - np.abs(unit))))
    plane = RigidPlane("deck", (0.0, 0.0, 0.0), normal)
    assert clearance(item, plane) == pytest.approx(2.0 - distance, rel=1e-9)


def test_the_meridian_is_taken_where_nothing_stands_within_four_radii():
    settings = replace(SETTINGS, planes=())
    item, near = tube(), 77.5e-3
    assert why_not_axisymmetric([item], settings) is None
    assert pytest.approx(4.0) == CLEARANCE
    for distance, refused in ((3.99, True), (4.01, False)):
        plane = RigidPlane("deck", (0.0, 0.0, -distance * near), (0.0, 0.0, 1.0))
        reason = why_not_axisymmetric([item], replace(settings, planes=(plane,)))
        assert reason == ("the casing may reach plane 'deck'" if refused else None)
    far = Mirror("deck", (0.0, 0.0, -9.0), (0.0, 0.0, 1.0))
    assert why_not_axisymmetric([item], replace(settings, planes=(far,))) == "plane 'deck' mirrors the round"
    assert why_not_axisymmetric([], settings) == "0 rounds may meet"
    assert why_not_axisymmetric([item, item], settings) == "2 rounds may meet"
    assert "full quadrature" in why_not_axisymmetric([item], replace(settings, quadrature="full"))
    shock = "round 'tube' may be initiated by shock"
    assert why_not_axisymmetric([replace(item, ignition=())], settings) == shock
    assert why_not_axisymmetric([replace(item, initiation=ShockInitiation(1e9))], settings) == shock
    for offset in ((1e-3, 0.0), (0.0, 1e-3)):
        aside = replace(item, ignition=(IgnitionPoint(0.0), IgnitionPoint(0.1, offset)))
        assert why_not_axisymmetric([aside], settings) == "round 'tube' is initiated off its axis"


@pytest.mark.parametrize(
    ("axis", "least"), [((0.0, 0.0, 1.0), -0.1), ((0.0, 1.0, 0.0), -0.4), ((0.0, 0.6, 0.8), -0.32)]
)
def test_a_ring_that_reaches_a_plane_stops_the_run(axis, least):
    """Rings of radius 0.4 m at heights from -0.1 to 0.3 m; those of the charge, twice as wide, do not count."""
    position = np.array([[0.4, 0.0, -0.1], [0.4, 0.0, 0.3], [0.8, 0.0, 0.0], [0.2, 0.0, 0.1]])
    mesh = SimpleNamespace(dofmap=np.array([[0, 1, 1, 3], [2, 2, 2, 2]]), part=np.array([Part.CASING, Part.CHARGE]))
    for gap, stops in ((1e-6, False), (-1e-6, True)):
        plane = RigidPlane("deck", (0.0, 0.0, 0.0), (0.0, 0.0, 2.0))
        fields = SimpleNamespace(mesh=mesh, nodes=SimpleNamespace(position=position))
        item = tube(axis=axis, position=(3.0, 4.0, gap - least))
        message = "the casing of round 'tube' has reached the plane 'deck'"
        with pytest.raises(NumericalStop, match=message) if stops else nullcontext():
            MERIDIAN.check_state(fields, [item], replace(SETTINGS, planes=(plane,)), 1e-5)
