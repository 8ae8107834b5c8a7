"""Fragments of an axisymmetric burst show neither the meridian's cells nor any azimuth.

Field, samples and null distributions are those of `tests.transition.test_imprint`: v = (k r, c z') on coarse rings,
whole realisations as the sample, at 1 %. No realisation is turned before.
"""

from __future__ import annotations

import numpy as np
import pytest

from tests.transition.meridian import Meridian
from tests.transition.test_imprint import AXIAL, LEVEL, OUTWARD, elevation_test, imprints, phase_test
from transition import BreakUp, BreakUpSettings

MESHES = {8: {"axial": 37, "radial_cells": 2}, 3: {"axial": 100, "radial_cells": 6}}


def linear(r, z):
    return np.column_stack([OUTWARD * r, AXIAL * (z - 0.15)])


def velocities(folder, size, count):
    """Masses and velocities of `count` realisations on a tube of one segment."""
    tube = Meridian(**MESHES[size], velocity=linear, ends=(), kinds=("wall",))
    prepared = BreakUp(tube.read(folder / "s.h5"), BreakUpSettings(random_roll=False, direction_scatter=0.0))
    return [(f.mass, f.velocity) for f in (prepared.fragments(29, number) for number in range(count))]


@pytest.fixture(scope="module")
def coarse(tmp_path_factory):
    return velocities(tmp_path_factory.mktemp("rings"), 8, 60)


def check(found):
    p_values = imprints(found, 36)  # columns of the hexahedra of this cell size
    for name, fold in (("opposite points", 2), ("blocks of four points", 4)):
        azimuths = [np.degrees(np.arctan2(v[:, 1], v[:, 0])) for _, v in found]
        p_values[f"phase, {name}"] = phase_test(azimuths, fold)
    assert all(p_value > LEVEL for _, p_value in p_values.values()), p_values


def test_directions_show_no_mesh_and_no_azimuth(coarse):
    check(coarse)


@pytest.mark.slow
@pytest.mark.parametrize("size", [8, 3])
def test_directions_of_many_show_no_mesh_and_no_azimuth(tmp_path, size):
    check(velocities(tmp_path, size, 200))


def test_points_all_in_the_half_plane_would_be_found(coarse):
    """The tests see what they are for: azimuths in blocks of four at fixed places, elevations of whole rings."""
    height = 0.3 / MESHES[8]["axial"] * AXIAL
    azimuths, tangents = [], []
    for _, v in coarse:
        bearing = np.degrees(np.arctan2(v[:, 1], v[:, 0]))
        azimuths.append(np.where(np.arange(bearing.size) % 8 == 0, np.round(bearing / 90.0) * 90.0, bearing))
        up = np.round(v[:, 2] / height) * height
        tangents.append(up / np.hypot(v[:, 0], v[:, 1]))
    assert phase_test(azimuths, 4)[1] < LEVEL
    assert elevation_test(tangents, np.random.default_rng(1))[1] < LEVEL
