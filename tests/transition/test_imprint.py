"""Directions of fragments show no mesh: a velocity field whose distribution is known, on coarse cells, many times.

The field is linear, v = (k x, k y, c z'): the finite-element field has it exactly on any mesh, and the mean over a
fragment is the field at its centre of mass, however large the fragment. Places are spread evenly along the axis, so
the tangent of the elevation, c z'/(k r), is spread evenly too, for every radius, away from the ends of the tube.
Fragments of one realisation are not independent: heavy ones leave no room for others near them. So every test takes
whole realisations as its sample, and finds its null distribution by what leaves the truth as it is: signs of the
realisations' deviations, or turns of each realisation about the axis. No realisation is turned before.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.transition.synthetic import Tube
from transition import BreakUp, BreakUpSettings

AXIAL, OUTWARD = 2427.0, 1000.0 / (1.9 * 0.0685)  # 1/s: 20 degrees of elevation at the ends
STEEPEST = np.tan(np.radians(15.0))
LEVEL = 0.01


def linear(places):
    return places * [OUTWARD, OUTWARD, AXIAL] - [0.0, 0.0, 0.15 * AXIAL]


MESHES = {
    8: {"around": 36, "axial": 37, "radial_cells": 2},
    3: {"around": 160, "axial": 100, "radial_cells": 6},
}


def velocities(folder, size, count, **settings):
    """Masses and velocities of `count` realisations on a tube of one segment."""
    tube = Tube(**MESHES[size], velocity=linear, ends=(), kinds=("wall",))
    prepared = BreakUp(tube.read(folder / "s.h5"), BreakUpSettings(**settings, direction_scatter=0.0))
    return [(f.mass, f.velocity) for f in (prepared.fragments(29, number) for number in range(count))]


def elevation_test(tangents, generator):
    """Kolmogorov-Smirnov distance from even spread within 15 degrees, and the p-value of a larger one."""
    grid = np.linspace(-STEEPEST, STEEPEST, 801)
    expected = (grid + STEEPEST) / (2.0 * STEEPEST)
    deviation = []
    for values in tangents:
        inside = np.sort(values[np.abs(values) < STEEPEST])
        deviation.append(np.searchsorted(inside, grid) - expected * inside.size)
    deviation = np.array(deviation)
    total = sum(int((np.abs(values) < STEEPEST).sum()) for values in tangents)
    distance = np.abs(deviation.sum(axis=0)).max() / total
    centred = deviation - deviation.mean(axis=0)
    weights = generator.standard_normal((2000, len(tangents)))
    return distance, float((np.abs(weights @ centred).max(axis=1) / total >= distance).mean())


def sector_test(azimuths, generator):
    """Chi-square per degree of freedom over 72 sectors, and its p-value when every realisation is turned at random."""
    counts = np.array([np.bincount(np.round(a / 5.0).astype(int) % 72, minlength=72) for a in azimuths], dtype=float)

    def chi_square(numbers):
        return float(((numbers - numbers.mean()) ** 2).sum() / numbers.mean() / 71.0)

    found = chi_square(counts.sum(axis=0))
    turned = []
    for _ in range(2000):
        shift = generator.integers(0, 72, len(counts))
        turned.append(chi_square(counts[np.arange(len(counts))[:, None], (np.arange(72) + shift[:, None]) % 72].sum(0)))
    return found, float((np.array(turned) >= found).mean())


def phase_test(azimuths, columns):
    """Rayleigh's statistic of the phase within a column, and its p-value when every realisation is turned at random."""
    sums = np.array([np.exp(1j * columns * np.radians(a)).sum() for a in azimuths])
    return abs(sums.sum()) / sum(a.size for a in azimuths), float(
        np.exp(-(abs(sums.sum()) ** 2) / (abs(sums) ** 2).sum())
    )


def imprints(found, columns):
    """p-value of each statistic, over all fragments, those of 5 to 20 g and those below 2 g."""
    generator = np.random.default_rng(1)
    p_values = {}
    for name, low, high in (("all", 0.0, np.inf), ("5-20 g", 5e-3, 20e-3), ("below 2 g", 0.0, 2e-3)):
        chosen = [velocity[(mass >= low) & (mass < high)] for mass, velocity in found]
        tangents = [v[:, 2] / np.hypot(v[:, 0], v[:, 1]) for v in chosen]
        azimuths = [np.degrees(np.arctan2(v[:, 1], v[:, 0])) for v in chosen]
        p_values[f"elevation, {name}"] = elevation_test(tangents, generator)
        p_values[f"sectors, {name}"] = sector_test(azimuths, generator)
        p_values[f"phase, {name}"] = phase_test(azimuths, columns)
    return p_values


@pytest.fixture(scope="module")
def coarse(tmp_path_factory):
    return velocities(tmp_path_factory.mktemp("coarse"), 8, 60)


def test_directions_show_no_mesh(coarse):
    p_values = imprints(coarse, MESHES[8]["around"])
    assert all(p_value > LEVEL for _, p_value in p_values.values()), p_values


@pytest.mark.slow
@pytest.mark.parametrize("size", [8, 3])
def test_directions_of_many_show_no_mesh(tmp_path, size):
    p_values = imprints(velocities(tmp_path, size, 200), MESHES[size]["around"])
    assert all(p_value > LEVEL for _, p_value in p_values.values()), p_values


def test_velocities_of_whole_cells_would_be_found(coarse):
    """The tests see what they are for: fragments that move as the middle of the cell that they lie in."""
    height, turn = 0.3 / MESHES[8]["axial"] * AXIAL, 2.0 * np.pi / MESHES[8]["around"]
    jumping = []
    for mass, v in coarse:
        up = (np.floor(v[:, 2] / height + 0.5)) * height
        angle = (np.floor(np.arctan2(v[:, 1], v[:, 0]) / turn) + 0.5) * turn
        level = np.hypot(v[:, 0], v[:, 1])
        jumping.append((mass, np.column_stack([level * np.cos(angle), level * np.sin(angle), up])))
    p_values = imprints(jumping, MESHES[8]["around"])
    assert all(p_value <= LEVEL for name, (_, p_value) in p_values.items() if "phase" in name or "sectors" in name), (
        p_values
    )


def test_order_of_the_cells_plays_no_part(tmp_path):
    """The same casing with its cells reversed: other fragments, the same numbers by direction and compactness."""
    tube = Tube(around=18, axial=18, radial_cells=2, velocity=linear, ends=(), kinds=("wall",)).read(tmp_path / "s.h5")
    order = np.arange(len(tube.cells))[::-1]
    names = ("cells", "part", "round", "segment", "station", "mass")
    other = replace(tube, **{name: np.ascontiguousarray(getattr(tube, name)[order]) for name in names})
    samples = []
    for snapshot, seed in ((tube, 3), (other, 4)):
        prepared = BreakUp(snapshot)
        rows = []
        for number in range(40):
            v = prepared.fragments(seed, number).velocity
            tangent = v[:, 2] / np.hypot(v[:, 0], v[:, 1])
            rows.append(np.histogram(tangent, np.linspace(-0.4, 0.4, 13))[0])
        samples.append(np.array(rows, dtype=float))
    error = np.sqrt(sum(s.var(axis=0, ddof=1) for s in samples) / 40.0)
    assert (np.abs(samples[0].mean(axis=0) - samples[1].mean(axis=0)) < 3.5 * error).all()
