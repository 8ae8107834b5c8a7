"""The line of the cavity through the solid ends of a casing, as both kinds of mesh have it."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from burst_fenicsx.axisymmetric.mesh import mesh_meridian
from burst_fenicsx.geometry import load_profile
from burst_fenicsx.meshing.sizing import band_radii


@pytest.mark.parametrize("name", ["m107", "tube"])
def test_the_cavitys_line_goes_on_smoothly_into_the_solid_ends(name):
    """Without a jump at the cavity's ends, and within the contour everywhere."""
    profile = load_profile(name)
    even, small = 0.6, 1e-9
    ends = [end for end in (profile.cavity.start, profile.cavity.end) if small < end < profile.length - small]
    stations = np.sort(np.concatenate([[end - small, end, end + small] for end in ends] or [[0.5 * profile.length]]))
    radii = band_radii(profile, stations, even)
    for row in range(0, len(stations) - 2, 3):
        assert np.ptp(radii[row : row + 3]) < 1e-6
    everywhere = np.linspace(0.0, profile.length, 200)[1:-1]
    radii = band_radii(profile, everywhere, even)
    assert (radii > 0.0).all()
    assert (radii < profile.outer.radius(everywhere)).all()


@pytest.mark.parametrize("at_front", [True, False])
def test_columns_become_even_one_radius_into_a_solid_end(at_front):
    """A cavity of 60 mm in a body of 100 mm: halfway the mean of both shares, from one radius on even columns."""
    start, end = (0.5, 0.9) if at_front else (0.1, 0.5)
    profile = SimpleNamespace(
        cavity=SimpleNamespace(start=start, end=end, radius=lambda x: 0.06 + 0.0 * np.asarray(x)),
        outer=SimpleNamespace(radius=lambda x: 0.1 + 0.0 * np.asarray(x)), max_radius=0.1,
    )  # fmt: skip
    reach = np.array([-0.5, 0.0, 0.25, 0.5, 0.75, 1.0, 1.5, 3.0])
    stations = 0.5 - 0.1 * reach if at_front else 0.5 + 0.1 * reach
    radii = band_radii(profile, stations, 0.75)
    blend = np.array([0.0, 0.0, 5.0 / 32.0, 0.5, 27.0 / 32.0, 1.0, 1.0, 1.0])
    np.testing.assert_allclose(radii, 0.06 + blend * (0.075 - 0.06), rtol=1e-12)


@pytest.mark.parametrize("name", ["m107", "tube"])
def test_columns_are_even_to_both_sides_of_the_cavitys_line_and_end_on_the_contour(name):
    profile = load_profile(name)
    mesh = mesh_meridian(profile, 8e-3)
    heights = np.unique(mesh.nodes[:, 2])
    rows = [np.sort(mesh.nodes[mesh.nodes[:, 2] == height, 0]) for height in heights]
    whole = max(map(len, rows))
    checked = 0
    for height, radii in zip(heights, rows, strict=True):
        if len(radii) < whole:  # beside a void
            continue
        checked += 1
        station = np.array([profile.length - height])
        np.testing.assert_allclose(radii[-1], profile.outer.radius(station)[0], rtol=1e-12)
        widths = np.diff(radii)
        assert (widths > 0.0).all()
        steps = np.flatnonzero(np.abs(np.diff(widths)) > 1e-9 * radii[-1])
        assert len(steps) <= 1, "columns change their width at the cavity's line alone"
    assert checked > 20
