"""Lines of the meridian's mesh through the solid ends of a casing."""

from __future__ import annotations

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
