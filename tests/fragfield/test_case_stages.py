"""What of a case reaches the stages."""

from __future__ import annotations

import numpy as np
import pytest

import flight as flight_library
from burst_fenicsx.geometry import load_profile
from burst_fenicsx.kernels.geometry.faces import reordered
from burst_fenicsx.meshing import mesh_profile
from fragfield.case import load_case, read_resolved, to_toml
from fragfield.case.conversion.rounds import burst_rounds
from fragfield.case.load import case_from_document
from fragfield.case.problem import break_up_settings, burst_settings, flight_arguments, hazard_criteria
from fragfield.errors import InputError
from tests.fragfield.case_documents import CASE, FULL, a_round, changed, write_case


def test_the_case_reaches_every_setting_of_the_burst(tmp_path):
    case = load_case(write_case(tmp_path, FULL))
    settings = burst_settings(case)
    assert (settings.cell_size, settings.quadrature, settings.products, settings.burn) == (0.009, "full", "jwl", "time")
    assert settings.end_time is None
    assert settings.acceleration_left == 0.05
    assert (settings.time_step.cfl, settings.time_step.fixed) == (0.7, 10e-9)
    assert not settings.leakage.enabled
    assert settings.viscosity.linear == 0.1
    assert settings.hourglass.casing_stiffness == 0.05
    assert settings.output_interval == 5e-6
    assert settings.nodal_stress
    left, right = burst_rounds(case)
    assert left.explosive.jwl is not None
    assert left.casing.shear_softening_strain is None
    assert [(point.station, point.offset, point.delay) for point in left.ignition] == [
        (pytest.approx(0.15), (0.005, 0.0), 0.0),
        (pytest.approx(0.3), (0.0, 0.0), 3e-6),
    ]
    assert [point.station for point in right.ignition] == [pytest.approx(0.142518)]
    assert right.axis == (0.0, 0.1, 1.0)


def test_the_case_reaches_break_up_and_flight(tmp_path):
    case = load_case(write_case(tmp_path, FULL))
    settings = break_up_settings(case)
    assert (settings.dimension, settings.mixed_fraction, settings.mean_mass) == ("mixed", 0.3, 0.0149)
    assert (settings.prefactor, settings.sampler, settings.graded_m0) == ("paper", "graded", 5e-5)
    assert settings.segments == (0.1, 0.2)
    assert settings.shape_factor == 2600.0
    arguments = flight_arguments(case)
    assert float(arguments["air"].density(0.0)) == 0.9
    assert float(arguments["drag"].at(2.0)) == 1.2
    assert arguments["integrator"].step == 1e-4
    assert arguments["wind"].at(100.0) == pytest.approx([9 * 0.8660254037844387, 4.5])
    assert [surface.name for surface in arguments["witnesses"]] == ["ring", "wall", "roof"]
    assert arguments["witnesses"][0].radius == 7.62
    assert case.hazard.energy == pytest.approx(78.6374, rel=1e-5)


def test_shape_and_collisions_reach_the_flight(tmp_path):
    import flight

    given = {"shape": {"model": "box", "ratios": [4.0, 2.0, 1.0]}, "collisions": {"distance": "7 m"}}
    case = case_from_document(changed(flight=given), source="my.toml", folder=tmp_path)
    arguments = flight_arguments(case)
    assert arguments["shape"] == flight.shape.Box((4.0, 2.0, 1.0))
    assert arguments["contact"] == flight.Contact(distance=7.0, between="rounds")
    assert read_resolved(write_case(tmp_path, to_toml(case))) == case
    drawn = changed(flight={"shape_factor": "2600 kg/m3", "shape": {"model": "lognormal", "spread": 0.2}})
    arguments = flight_arguments(case_from_document(drawn, source="my.toml", folder=tmp_path))
    assert arguments["shape"] == flight.shape.Lognormal(0.2, 2600.0)
    arguments = flight_arguments(case_from_document(CASE, source="my.toml", folder=tmp_path))
    assert (arguments["shape"], arguments["contact"]) == (None, flight.Contact(between="rounds"))
    off = changed(flight={"collisions": "none"})
    assert flight_arguments(case_from_document(off, source="my.toml", folder=tmp_path))["contact"] is None


def test_a_round_from_a_mesh_file_is_initiated_within_its_charge(tmp_path):
    meshio = pytest.importorskip("meshio")
    mesh = mesh_profile(load_profile("tube"), 0.02)
    names = {"casing": np.array([1, 3]), "charge": np.array([2, 3])}
    tags = [mesh.part + 1]
    meshio.Mesh(
        mesh.nodes, [("hexahedron", reordered(mesh.cells))], field_data=names,
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
    ).write(tmp_path / "tube.msh", file_format="gmsh22", binary=False)  # fmt: skip
    entry = {"name": "a", "mesh": "tube.msh", "explosive": "tnt", "casing": "copper"}
    case = case_from_document(changed(round=[entry]), source="my.toml", folder=tmp_path)
    assert case.round[0].mesh == str(tmp_path / "tube.msh")
    assert [point.station for point in case.round[0].ignition] == [pytest.approx(0.0, abs=1e-9)]
    assert read_resolved(write_case(tmp_path, to_toml(case))) == case
    at_base = {**entry, "ignition": [{"station": "base", "delay": "1 us"}]}
    case = case_from_document(changed(round=[at_base]), source="my.toml", folder=tmp_path)
    assert burst_rounds(case)[0].ignition[0].station == pytest.approx(0.3)
    outside = {**entry, "ignition": [{"station": "301 mm"}]}
    with pytest.raises(InputError, match=r"ignition\[1\].station: found 301 mm, outside the charge"):
        case_from_document(changed(round=[outside]), source="my.toml", folder=tmp_path)
    (tmp_path / "tube.msh").write_text("nonsense")
    with pytest.raises(InputError, match=r"my.toml: round\[1\].mesh: .*tube.msh"):
        case_from_document(changed(round=[entry]), source="my.toml", folder=tmp_path)


@pytest.fixture
def reached(tmp_path):
    """The case of the shortest file with other tables."""
    return lambda **tables: case_from_document(changed(**tables), source="my.toml", folder=tmp_path)


def test_what_a_person_is_reaches_the_hazard(reached):
    given = {"energy": "120 J", "density": "0.02 1/m2", "person_area": "0.5 m2", "person_height": "1.7 m"}
    found = hazard_criteria(reached(hazard=given))
    assert (found.energy, found.density) == (pytest.approx(120.0), pytest.approx(0.02))
    assert (found.person_area, found.person_height) == (pytest.approx(0.5), pytest.approx(1.7))


def test_a_power_law_of_wind_counts_from_the_ground(reached):
    """At the reference height above ground that lies 50 m up the given speed blows, and none on the ground itself."""
    drifts = []
    wind = {"model": "power_law", "speed": "8 m/s", "towards": "90 deg", "reference_height": "10 m", "exponent": 0.25}
    for height in (0.0, 50.0):
        flight = {"wind": wind, "ground": {"height": f"{height} m"}}
        case = reached(flight=flight, round=[a_round(position=["0 m", "0 m", f"{height + 1.0} m"])])
        arguments = flight_arguments(case)
        found = arguments["wind"]
        assert found.at(10.0) == pytest.approx([0.0, 8.0], abs=1e-6)
        assert found.at(1.6) == pytest.approx([0.0, 8.0 * 0.16**0.25], rel=0.01, abs=1e-6)
        assert np.hypot(*found.at(0.0)) < 0.5 * 8.0
        shot = flight_library.Fragments(0.01, (0.0, 0.0, height + 1.0), (300.0, 0.0, 200.0))
        drifts.append(float(flight_library.fly(shot, **{**arguments, "air": 1.2}).landing["position"][0, 1]))
    assert drifts[0] > 1.0
    assert drifts[1] == pytest.approx(drifts[0], rel=1e-6)


def test_the_altitude_of_the_site_reaches_the_air(reached):
    """US Standard Atmosphere 1976, table I: 1.2250, 1.1117 and 0.90925 kg/m3 at 0, 1 and 3 km."""
    for altitude, density in ((0.0, 1.2250), (1000.0, 1.1117), (3000.0, 0.90925)):
        air = {"model": "standard", "altitude": f"{altitude} m"}
        assert flight_arguments(reached(flight={"air": air}))["air"].density(0.0) == pytest.approx(density, rel=1e-4)


def test_damping_and_tolerance_reach_the_burst(tmp_path):
    text = FULL.replace('cell_size = "9 mm"', 'cell_size = "9 mm"\ndamping = "250 1/s"\nenergy_tolerance = 0.031')
    settings = burst_settings(load_case(write_case(tmp_path, text)))
    assert (settings.damping, settings.energy_tolerance) == (250.0, 0.031)
