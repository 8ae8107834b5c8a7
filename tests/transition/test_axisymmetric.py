"""Breaking up axisymmetric bursts: what is refused, the ledger, segments, directions, interpolation."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import norm

from burst_fenicsx.geometry import load_profile
from burst_fenicsx.meshing.placement import frame
from tests.transition.meridian import Meridian
from tests.transition.profiles import hexahedral_snapshot, meridian_snapshot
from tests.transition.synthetic import Tube, fill, joined, sealed
from transition import BreakUp, BreakUpSettings, InputError, Snapshot, break_up
from transition.law.segments import casing_segments
from transition.motion import SymmetryPlane

SMALL = Meridian(radial_cells=1, axial=10)
AXIS = (0.6, -0.3, 0.5)


def tilted(**changes):
    """A tube that stands askew and off the origin, its meridian in the plane that the contract names."""
    return Meridian(axis=AXIS, outward=tuple(frame(AXIS)[0]), position=(0.4, -0.2, 1.3), **changes)


@pytest.fixture
def path(tmp_path):
    return SMALL.write(tmp_path / "burst_snapshot.h5", seed="1")


def test_is_read(path):
    snapshot = Snapshot.read(path)
    assert snapshot.is_axisymmetric
    assert snapshot.casing.size == 10
    assert snapshot.provenance == {"seed": "1"}
    np.testing.assert_allclose(snapshot.half_plane.frame, np.eye(3), atol=1e-15)


def test_files_of_hexahedra_may_say_3d_or_nothing(tmp_path):
    path = Tube(radial_cells=1, around=8, axial=10).write(tmp_path / "a.h5")
    for act in (lambda file: None, lambda file: file.attrs.__setitem__("geometry", "3d")):
        assert Snapshot.read(sealed(path, act)).geometry == "3d"


def test_half_plane_of_a_tilted_round(tmp_path):
    np.testing.assert_allclose(tilted().read(tmp_path / "s.h5").half_plane.frame, frame(AXIS), atol=1e-14)


def swap(name, one, other):
    def act(file):
        rows = file[name][()]
        rows[:, [one, other]] = rows[:, [other, one]]
        file[name][...] = rows

    return act


@pytest.mark.parametrize(
    ("act", "message"),
    [
        (lambda f: f.attrs.__setitem__("geometry", "2d"), "geometry is '2d'; allowed: 3d, axisymmetric"),
        (lambda f: f.attrs.__setitem__("geometry", "3d"), r"cells has shape \(30, 4\), needed \(30, 8\)"),
        (fill("nodes/position", (5, 1), 1e-3), "position of node 5 lies 0.001 m outside the half plane"),
        (fill("nodes/reference", (6, 1), 1e-3), "reference of node 6 lies 0.001 m outside the half plane"),
        (fill("nodes/reference", (0, 0), -1e-3), "node 0 lies beyond the axis before the burst"),
        (fill("nodes/velocity", (7, 1), 3.0), "node 7 has a velocity of 3 m/s across the half plane"),
        (swap("cells/nodes", 1, 3), "is not convex and counter-clockwise seen in"),
        (
            lambda f: f["cells/mass"].__setitem__(slice(None), f["cells/mass"][()] / (2.0 * np.pi)),
            r"casing cells have 2.90\d* kg, their rings 18.2\d* kg by volume and density; cells/mass must be that of",
        ),
    ],
)
def test_refused(path, act, message):
    with pytest.raises(InputError, match=message):
        Snapshot.read(sealed(path, act))


def test_several_rounds_are_refused(tmp_path):
    with pytest.raises(InputError, match="2 rounds; an axisymmetric burst has one"):
        Meridian(names=("a", "b")).read(tmp_path / "s.h5")


def test_a_plane_of_symmetry_must_be_clear_of_the_whole_round(tmp_path):
    """The meridian stands in front of the plane, the other side of its round behind it."""
    snapshot = SMALL.read(tmp_path / "s.h5")
    clear = replace(snapshot, planes=(SymmetryPlane("wall", (-0.08, 0.0, 0.0), (1.0, 0.0, 0.0)),))
    result = BreakUp(clear).realisation(1)
    assert [r.name for r in BreakUp(clear).rounds] == ["round 0", "round 0 mirrored at wall"]
    assert abs(result.ledger.mass_error) < 1e-12
    assert result.ledger.momentum_error < 1e-12
    with pytest.raises(InputError, match=r"casing nodes stand 0.0175 m behind the plane of symmetry 'wall'"):
        replace(snapshot, planes=(SymmetryPlane("wall", (-0.06, 0.0, 0.0), (1.0, 0.0, 0.0)),))


@pytest.mark.parametrize("velocity", ["mean", "interpolation"])
def test_ledger_closes_for_a_tilted_round(tmp_path, velocity):
    """Mass and momentum to round-off by the mean; axial momentum is the burst's nodal one."""

    def field(r, z):
        return np.column_stack([900.0 + 150.0 * np.sin(9.0 * z), 150.0 + 400.0 * r + 300.0 * z])

    snapshot = tilted(velocity=field, radial_cells=2).read(tmp_path / "s.h5")
    result = break_up(snapshot, BreakUpSettings(velocity=velocity, direction_scatter=0.0), seed=4)
    ledger = result.ledger
    nodal = np.zeros(len(snapshot.reference))
    np.add.at(nodal, snapshot.cells[snapshot.casing], snapshot.mass[snapshot.casing][:, None] * snapshot.ring_shares)
    axis = snapshot.half_plane.frame[2]
    np.testing.assert_allclose(ledger.casing_momentum, (nodal @ snapshot.velocity @ axis) * axis, rtol=1e-12)
    assert ledger.casing_energy == pytest.approx(0.5 * nodal @ (snapshot.velocity**2).sum(axis=1), rel=1e-12)
    assert abs(ledger.mass_error) < 1e-12
    exact = velocity == "mean"
    assert ledger.momentum_error < (1e-12 if exact else 0.03)
    assert abs(ledger.energy_error) < 0.03


def test_segments_are_those_of_the_revolved_tube(tmp_path):
    """Expansion, outline, wall and charge radius of recut segments: closed forms, which hexahedra only approach."""
    found = casing_segments(Meridian().read(tmp_path / "m.h5"), (0.1, 0.2))
    chords = casing_segments(Tube(around=96).read(tmp_path / "t.h5"), (0.1, 0.2))
    for ring, hexahedral in zip(found, chords, strict=True):
        assert ring.data.outer_radius == pytest.approx(0.0775, rel=1e-12)
        assert ring.data.wall_thickness == pytest.approx(0.018, rel=1e-12)
        assert ring.data.casing_mass == pytest.approx(7850.0 * np.pi * (0.0775**2 - 0.0595**2) * 0.1, rel=1e-12)
        assert ring.data.charge_radius == pytest.approx(0.0595, rel=1e-12)
        for name in ("outer_radius", "wall_thickness", "casing_mass", "speed"):
            assert getattr(ring.data, name) == pytest.approx(getattr(hexahedral.data, name), rel=2e-3)
        assert ring.expansion == pytest.approx(hexahedral.expansion, rel=2e-3)


def test_directions_of_rings_are_those_of_many_hexahedra(tmp_path):
    """Upright: every sector has the same share. Askew: the shares of a fine mesh of hexahedra."""

    def field(r, z):
        return np.column_stack([1000.0 * r / 0.14, 2400.0 * (z - 0.15)])

    def solid(x):
        return x * [1000.0 / 0.14, 1000.0 / 0.14, 2400.0] - [0.0, 0.0, 360.0]

    upright = break_up(Meridian(velocity=field).read(tmp_path / "m.h5"), seed=1).directions[0]
    np.testing.assert_allclose(upright.azimuth_cells, 1.0 / 72.0, rtol=1e-12)
    tube = Tube(around=144, velocity=solid).read(tmp_path / "t.h5")
    fine = break_up(tube, seed=1).directions[0]
    np.testing.assert_allclose(upright.polar_cells, fine.polar_cells, atol=2e-3)
    lying = Meridian(velocity=field, axis=(0.0, 1.0, 0.0), outward=(1.0, 0.0, 0.0)).read(tmp_path / "l.h5")
    found = break_up(lying, seed=1).directions[0]
    # Upright velocities (vx, vy, vz) laid down: (vx, vz, -vy)
    laid = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    turned = replace(
        tube,
        reference=tube.reference @ laid.T,
        position=tube.position @ laid.T,
        velocity=tube.velocity @ laid.T,
        rounds=tuple(replace(data, axis=(0.0, 1.0, 0.0)) for data in tube.rounds),
    )
    other = break_up(turned, seed=1).directions[0]
    np.testing.assert_allclose(found.azimuth_cells, other.azimuth_cells, atol=2e-3)
    np.testing.assert_allclose(found.polar_cells, other.polar_cells, atol=2e-3)
    assert found.azimuth_cells.max() > 3.0 * found.azimuth_cells.min()


# --- The M107 from its meridian and from hexahedra, with one analytic velocity field: the same fragments

COUNT = 40
ANGLES = np.arange(60.0, 121.0, 10.0)


def rows(prepared, count):
    """Statistics of each realisation (count, k), with the mean speed less that of the points it was made from."""
    found = []
    for number in range(count):
        result = prepared.realisation(7, number)
        fragments, (points, _) = result.fragments, joined(result)
        speed = np.linalg.norm(fragments.velocity, axis=1)
        of_points = points.mass @ np.linalg.norm(points.velocity, axis=1) / points.mass.sum()
        polar = np.degrees(np.arccos(fragments.velocity[:, 2] / speed))
        share = fragments.mass / fragments.mass.sum()
        found.append(
            [
                share @ speed - of_points, of_points, len(speed), (fragments.mass > 1e-2).sum(),
                *np.quantile(fragments.mass, [0.1, 0.25, 0.5, 0.75, 0.9, 0.99]),
                *np.quantile(speed, [0.1, 0.5, 0.9, 0.99]),
                *(share[polar < angle].sum() for angle in ANGLES),
                *((polar < angle).mean() for angle in ANGLES),
            ]
        )  # fmt: skip
    return np.array(found)


@pytest.fixture(scope="module")
def both():
    profile = load_profile("m107")
    settings = BreakUpSettings(direction_scatter=0.0)
    return tuple(BreakUp(make(profile, 8e-3), settings) for make in (meridian_snapshot, hexahedral_snapshot))


def test_fragments_are_statistically_the_same(both):
    rings, hexahedra = (rows(prepared, COUNT) for prepared in both)
    speed = rings[:, 1].mean(), hexahedra[:, 1].mean()
    assert speed[0] == pytest.approx(speed[1], rel=2e-3)  # the field itself, on cells of 8 mm
    # Those drawn are as many as the laws expect: each segment's are rounded up or down at random.
    numbers = [sum(law.n0 for law in prepared.laws) for prepared in both]
    for found, expected in zip((rings, hexahedra), numbers, strict=True):
        drawn = found[:, 2]
        assert abs(drawn.mean() - expected) < 4.0 * drawn.std(ddof=1) / np.sqrt(COUNT), (drawn.mean(), expected)
        assert np.abs(drawn - expected).max() < len(both[0].laws)
    assert numbers[0] == pytest.approx(numbers[1], rel=5e-3)
    rings, hexahedra = (np.delete(found, [1, 2], axis=1) for found in (rings, hexahedra))
    error = np.sqrt((rings.var(axis=0, ddof=1) + hexahedra.var(axis=0, ddof=1)) / COUNT)
    deviation = (rings.mean(axis=0) - hexahedra.mean(axis=0)) / error
    assert np.abs(deviation).max() < norm.ppf(1.0 - 0.005 / deviation.size), deviation
    # A number of fragments above 10 g that is 1 % off would be found.
    assert error[1] < 0.01 * rings[:, 1].mean() / 3.0


def test_what_is_handed_over_is_the_same(both):
    rings, hexahedra = (prepared.realisation(3).ledger for prepared in both)
    assert rings.casing_mass == pytest.approx(hexahedra.casing_mass, rel=1e-5)
    assert rings.casing_energy == pytest.approx(hexahedra.casing_energy, rel=5e-3)
    assert rings.casing_momentum[2] == pytest.approx(hexahedra.casing_momentum[2], abs=2e-4 * 34.5 * 830.0)
    assert rings.momentum_error < 1e-12
