"""Lines of the meridian's mesh through the solid ends of a casing."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from burst_fenicsx.axisymmetric.mesh import _radii
from burst_fenicsx.geometry import load_profile


@pytest.mark.parametrize("name", ["m107", "tube"])
def test_the_cavitys_line_goes_on_smoothly_into_the_solid_ends(name):
    """Without a jump at the cavity's ends; no line crosses another, and the outermost is the contour."""
    profile = load_profile(name)
    core, wall, small = 6, 4, 1e-9
    ends = [end for end in (profile.cavity.start, profile.cavity.end) if small < end < profile.length - small]
    stations = np.sort(np.concatenate([[end - small, end, end + small] for end in ends] or [[0.5 * profile.length]]))
    radii = _radii(profile, stations, core, wall)
    for row in range(0, len(stations) - 2, 3):
        assert np.ptp(radii[row : row + 3, core]) < 1e-6
    everywhere = _radii(profile, np.linspace(0.0, profile.length, 200)[1:-1], core, wall)
    assert (np.diff(everywhere, axis=1) > 0.0).all()
    np.testing.assert_allclose(everywhere[:, -1], profile.outer.radius(np.linspace(0.0, profile.length, 200)[1:-1]))


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
    core, wall = 6, 2
    radii = _radii(profile, stations, core, wall)
    blend = np.array([0.0, 0.0, 5.0 / 32.0, 0.5, 27.0 / 32.0, 1.0, 1.0, 1.0])
    np.testing.assert_allclose(radii[:, core], 0.06 + blend * (0.075 - 0.06), rtol=1e-12)
    np.testing.assert_allclose(radii[:, core // 2], 0.5 * radii[:, core], rtol=1e-12)
    np.testing.assert_allclose(radii[:, core + 1], 0.5 * (radii[:, core] + 0.1), rtol=1e-12)
    np.testing.assert_allclose(radii[:, -1], 0.1, rtol=1e-12)
    np.testing.assert_allclose(radii[:, 0], 0.0, atol=1e-15)
