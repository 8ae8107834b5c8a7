"""Where a section lies, what is refused, and its mesh."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from burst_fenicsx.errors import InputError
from burst_fenicsx.geometry import load_profile
from burst_fenicsx.plane_section.mesh import mesh_section, section_quality
from burst_fenicsx.plane_section.section import find_section, widest_station
from burst_fenicsx.problem import IgnitionPoint, Part, RigidPlane, ShockInitiation
from tests.burst_fenicsx.tubes import SETTINGS, tube

PLANE = replace(SETTINGS, geometry="plane", cell_size=5e-3)


def tube_section(cell_size, centre=(0.0, 0.0), index=0):
    return mesh_section(load_profile("tube"), 0.15, cell_size, centre=centre, round_index=index)


def pair(**changes):
    return [tube(name="one"), tube(name="two", **{"position": (0.2, 0.0, 0.0), **changes})]


def reason(rounds, settings=PLANE):
    section, words = find_section(rounds, settings)
    assert (section is None) != (words is None)
    return words


@pytest.mark.parametrize("cell_size", [10e-3, 4e-3, 1.5e-3])
def test_areas_are_those_of_the_circles_and_the_mesh_is_symmetric(cell_size):
    """Charge and casing to round-off, cells of the size asked for, a node for every node's image in u and in v."""
    mesh = tube_section(cell_size)
    inner, outer = 0.055, 0.0775
    charge = mesh.part == Part.CHARGE
    assert mesh.volumes[charge].sum() == pytest.approx(np.pi * inner**2, rel=1e-9)
    assert mesh.volumes[~charge].sum() == pytest.approx(np.pi * (outer**2 - inner**2), rel=1e-9)
    assert mesh.volumes.min() > 0.0
    assert mesh.mean_edge == pytest.approx(cell_size, rel=0.15)
    assert section_quality(mesh).min_scaled_jacobian > 0.5
    at = {tuple(row) for row in np.round(mesh.nodes[:, [0, 2]] * 1e7).astype(int)}
    for sign in ([-1, 1], [1, -1]):
        assert {tuple(row) for row in np.round(mesh.nodes[:, [0, 2]] * sign * 1e7).astype(int)} == at


def test_cells_are_refused_that_are_too_large_or_too_many():
    with pytest.raises(InputError, match=r"cell_size = 60 mm; at most the charge's radius in the section is allowed"):
        tube_section(60e-3)
    with pytest.raises(InputError, match=r"cell_size = 0.01 mm makes .* cells in the section of a round"):
        tube_section(1e-5)


def test_the_section_lies_by_default_in_the_middle_of_the_widest_charge():
    """The M107's cylinder of 119 mm bore lies between 310 and 535 mm from the nose."""
    profile = load_profile("m107")
    station = widest_station(profile)
    assert profile.section(station).charge_radius == pytest.approx(profile.cavity.max_radius, rel=1e-6)
    assert 0.40 < station < 0.44
    assert widest_station(load_profile("tube")) == pytest.approx(0.15, abs=1e-6)


def test_every_round_is_cut_by_one_plane_and_ignited_by_its_own_front():
    """Of a second round that stands 20 mm higher and is initiated 7 us later, upside down."""
    first = tube(name="one")
    above = tube(name="two", position=(0.2, 0.0, 0.02), ignition=(IgnitionPoint(station=0.0, delay=7e-6),))
    section, _ = find_section([first, above], replace(PLANE, section_station=0.1))
    np.testing.assert_allclose(section.stations, [0.1, 0.12], atol=1e-12)
    np.testing.assert_allclose(section.ignition, [0.1 / 6940.0, 7e-6 + 0.12 / 6940.0], rtol=1e-12)
    np.testing.assert_allclose(section.centres, [[0.0, 0.0], [0.2, 0.0]], atol=1e-12)
    turned = tube(name="two", position=(0.2, 0.0, 0.3), axis=(0.0, 0.0, -1.0))
    section, _ = find_section([first, turned], replace(PLANE, section_station=0.1))
    np.testing.assert_allclose(section.stations, [0.1, 0.2], atol=1e-12)


def test_points_of_lying_rounds_are_carried_to_the_world_and_planes_from_it():
    rounds = [tube(axis=(1.0, 0.0, 0.0), position=(-0.15, 0.0, 0.5))]
    ground = RigidPlane("ground", (0.0, 0.0, 0.3), (0.0, 0.0, 1.0))
    wall = RigidPlane("wall", (2.0, 0.0, 0.0), (-1.0, 0.0, 0.0))
    section, _ = find_section(rounds, replace(PLANE, planes=(ground, wall)))
    np.testing.assert_allclose(section.origin, [0.0, 0.0, 0.5], atol=1e-12)
    np.testing.assert_allclose(section.directions @ section.directions.T, np.eye(3), atol=1e-15)
    (kept,) = section.planes((ground, wall))  # the wall lies along the section
    assert kept.name == "ground"
    world = section.world(np.array([kept.point, np.add(kept.point, kept.normal)]))
    assert world[0, 2] == pytest.approx(0.3)
    np.testing.assert_allclose(world[1] - world[0], [0.0, 0.0, 1.0], atol=1e-12)


def test_what_has_no_section_is_refused_in_words(tmp_path):
    assert "'two' is not parallel to that of 'one'" in reason(pair(axis=(0.0, 0.3, 1.0)))
    words = reason(pair(position=(0.2, 0.0, 0.25)))
    assert "cuts round 'two' at station 400 mm, where it has no charge; its charge lies between 0 and 300 mm" in words
    assert "cuts round 'one' at station 310 mm" in reason(pair(), replace(PLANE, section_station=0.31))
    assert "comes from a mesh file" in reason(pair(profile=None, mesh_file=tmp_path / "round.msh"))
    assert "may be initiated by shock" in reason(pair(ignition=(), initiation=ShockInitiation(5e9)))
    oblique = RigidPlane("bank", (1.0, 0.0, 0.0), (-1.0, 0.0, 1.0))
    assert "plane 'bank' is neither along the rounds' axes" in reason(pair(), replace(PLANE, planes=(oblique,)))
    assert "full quadrature" in reason(pair(), replace(PLANE, quadrature="full"))
