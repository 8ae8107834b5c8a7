"""Cases whose rounds come from drawings and mesh files: the same case as by hand, units that show, and `convert`."""

from __future__ import annotations

import json
import tomllib

import meshio
import numpy as np
import pytest

import fragfield
from burst_fenicsx.geometry import profile_from_table
from burst_fenicsx.geometry.files import PROFILES
from burst_fenicsx.meshing import mesh_profile
from burst_fenicsx.problem import Part
from fragfield.case.load import case_from_document, read_document
from fragfield.errors import InputError
from tests.fragfield.drawn_shells import CHARGE, SHELL, write_dxf
from tests.fragfield.short_run import invoke

EXPECTED = {"casing": "11.81 kg", "charge": "2.195 kg"}


def case_of(folder, **entry):
    round_ = {"name": "shell", "explosive": "tnt", "casing": "steel_m107", "position": ["0 m", "0 m", "1 m"], **entry}
    return case_from_document({"burst": {"cell_size": "12 mm"}, "round": [round_]}, source="case.toml", folder=folder)


def test_a_round_from_a_drawing_is_the_round_of_the_same_profile(tmp_path):
    """Chords of 0.01 mm: masses within a thousandth, the same nose and base; the resolved case needs no drawing."""
    write_dxf(tmp_path / "shell.dxf")
    tables = read_document(PROFILES / "m1_105.toml")
    by_hand = case_of(tmp_path, profile={key: value for key, value in tables.items() if key != "segment"})
    drawn = case_of(tmp_path, contour={"file": "shell.dxf", **CHARGE}, expected=EXPECTED)
    assert drawn.round[0].contour is None
    one, other = (profile_from_table(case.round[0].profile, where="a") for case in (by_hand, drawn))
    assert other.casing_volume == pytest.approx(one.casing_volume, rel=1e-3)
    assert other.charge_volume == pytest.approx(one.charge_volume, rel=1e-3)
    ends = [(s.kind, round(s.start, 6), round(s.end, 6)) for s in (one.segments[0], one.segments[-1])]
    assert [(s.kind, round(s.start, 6), round(s.end, 6)) for s in (other.segments[0], other.segments[-1])] == ends


def test_a_contour_by_its_name_alone_and_masses_that_do_not_fit(tmp_path):
    write_dxf(tmp_path / "shell.dxf")
    assert case_of(tmp_path, contour="shell.dxf").round[0].profile["charge"] == {"front": 0.0}
    with pytest.raises(InputError, match=r"round\[1\].expected.charge: found 2.195 kg, .* give 2.297 kg, 4.7 % more"):
        case_of(tmp_path, contour="shell.dxf", expected=EXPECTED)
    with pytest.raises(InputError, match=r"round\[1\].profile: found profile and contour; allowed: one of the three"):
        case_of(tmp_path, contour="shell.dxf", profile="m107")
    with pytest.raises(InputError, match=r"case.toml: round\[1\].contour: .*none.dxf: no such file"):
        case_of(tmp_path, contour="none.dxf")


@pytest.mark.parametrize(
    ("units", "options", "message"),
    [
        (
            1,
            {},
            r"contour: the casing has 193.5 t; the numbers of the file look like mm \(11.81 kg\); .*give contour.unit",
        ),
        (5, {}, r"the casing has 11.81 t; the numbers of the file look like mm \(11.81 kg\)"),
        (4, {"unit": "in"}, r"193.5 t; the numbers of the file look like mm \(11.81 kg\)"),
        (14, {}, "drawing is 38.34 m large with a unit of 100 mm"),
    ],
)
def test_a_drawing_in_another_unit_than_its_header_says(tmp_path, units, options, message):
    write_dxf(tmp_path / "shell.dxf", units=units)
    with pytest.raises(InputError, match=message):
        case_of(tmp_path, contour={"file": "shell.dxf", **CHARGE, **options})


def test_the_unit_that_is_asked_for_wins_over_the_header_and_is_said(tmp_path):
    write_dxf(tmp_path / "shell.dxf", units=1)
    case = case_of(tmp_path, contour={"file": "shell.dxf", "unit": "mm", **CHARGE}, expected=EXPECTED)
    assert "unit 1 mm as asked for, though $INSUNITS says inches" in case.round[0].profile["source"]


@pytest.fixture(scope="module")
def mesh_files(tmp_path_factory):
    """The shell as hexahedra, with numbers in metres, centimetres, millimetres and inches."""
    folder = tmp_path_factory.mktemp("meshes")
    mesh = mesh_profile(SHELL, 0.014)
    groups = {Part.CASING: 1, Part.CHARGE: 2, Part.FUZE: 3}
    tags = np.array([groups[Part(int(part))] for part in mesh.part])
    for name, scale in {"m": 1.0, "cm": 1e2, "mm": 1e3, "in": 1.0 / 0.0254}.items():
        meshio.write(
            folder / f"{name}.msh",
            meshio.Mesh(
                mesh.nodes * scale, [("hexahedron", mesh.cells[:, [0, 1, 3, 2, 4, 5, 7, 6]])],
                cell_data={"gmsh:physical": [tags], "gmsh:geometrical": [tags]},
                field_data={name: np.array([tag, 3]) for name, tag in (("casing", 1), ("charge", 2), ("fuze", 3))},
            ),
            file_format="gmsh22", binary=False,
        )  # fmt: skip
    return folder


@pytest.mark.parametrize("unit", ["m", "cm", "mm", "in"])
def test_a_mesh_in_the_unit_that_is_asked_for(mesh_files, unit):
    case = case_of(mesh_files, mesh=f"{unit}.msh", mesh_unit=unit, expected={"casing": "11.81 kg"})
    assert case.round[0].mesh_unit == unit


@pytest.mark.parametrize(
    ("name", "unit", "message"),
    [
        ("mm", {}, r"383 m large in the unit 'm'.*: the numbers of the file look like cm \(3.83 m\) or mm \(0.383 m\)"),
        (
            "in",
            {},
            r"the casing has 72\d(\.\d)? t; the numbers of the file look like cm \(72\d(\.\d)? g\) or in \(11.8\d? kg\)",  # noqa: E501
        ),
        ("in", {"mesh_unit": "mm"}, r"the casing has 72\d mg; the numbers of the file look like .*in \(11.8\d? kg\)"),
        (
            "mm",
            {"mesh_unit": "in"},
            r"the casing has 19\d(\.\d)? t; the numbers of the file look like mm \(11.8\d? kg\)",
        ),
        ("cm", {"mesh_unit": "mm"}, r"the casing has 11.8 g; the numbers of the file look like cm"),
        ("m", {"mesh_unit": "inch"}, r'mesh_unit: found "inch" .did you mean "in"'),
    ],
)
def test_a_mesh_in_another_unit_is_refused_with_the_guess(mesh_files, name, unit, message):
    with pytest.raises(InputError, match=message):
        case_of(mesh_files, mesh=f"{name}.msh", **unit)


def test_a_small_casing_that_its_drawing_confirms(mesh_files):
    """11.8 g in millimetres, were it not 11.8 kg in centimetres: its expected mass decides."""
    assert case_of(mesh_files, mesh="cm.msh", mesh_unit="mm", expected={"casing": "11.81 g"}).round[0].mesh_unit == "mm"


def test_check_says_how_a_contour_was_read_and_what_its_masses_differ_by(tmp_path):
    write_dxf(tmp_path / "shell.dxf")
    keys = ", ".join(f'{key} = "{value}"' for key, value in CHARGE.items())
    (tmp_path / "case.toml").write_text(
        '[burst]\ncell_size = "20 mm"\n[[round]]\nname = "a"\nexplosive = "tnt"\ncasing = "steel_m107"\n'
        'position = ["0 m", "0 m", "1 m"]\nexpected = { casing = "11.8 kg" }\n'
        f'contour = {{ file = "shell.dxf", {keys} }}\n'
    )
    found = fragfield.check(tmp_path / "case.toml")
    assert found.found.rounds[0].drawing["casing"].deviation == pytest.approx(
        11.81 / 11.8 - 1.0, abs=1.5e-4
    )  # chords within 0.01 mm hold 1.1e-4 less
    shown = str(found)
    assert "unit millimetres, by $INSUNITS; axis y = 0, a centre line; nose left" in shown.replace("\n", " ")
    assert "casing mass, contours against drawing" in shown
    deviation = found.found.rounds[0].drawing["casing"].deviation
    assert f"{100 * deviation:+.2f}" in shown


def test_convert_writes_a_profile_and_tables_of_places(tmp_path):
    write_dxf(tmp_path / "shell.dxf")
    out = tmp_path / "shell.toml"
    done = invoke(
        "convert", tmp_path / "shell.dxf", "--set", "charge_front=50 mm", "--set", "fuze=0.192 kg", "--out", out
    )
    assert done.exit_code == 0, done.output
    case = case_of(tmp_path, profile="shell.toml", expected=EXPECTED)
    assert case.round[0].profile["name"] == "shell"
    assert "is there already" in invoke("convert", tmp_path / "shell.dxf", "--out", out).output
    place = {
        "type": "Feature",
        "properties": {"kind": "person"},
        "geometry": {"type": "Point", "coordinates": [7, 51.5]},
    }
    (tmp_path / "a.geojson").write_text(json.dumps(place))
    sited = ["--set", "latitude=51.5 deg", "--set", "longitude=7.001 deg", "--set", "bearing=90 deg"]
    tables = tomllib.loads(invoke("convert", tmp_path / "a.geojson", *sited).output)
    assert tables["exposed"][0]["position"][0] == "-69.441 m"


@pytest.mark.parametrize(
    ("name", "arguments", "message"),
    [
        ("shell.dxf", ["--set", "uni=mm"], 'uni: unknown key (did you mean "unit"?); allowed here: axis'),
        ("a.geojson", [], "latitude: missing"),
        ("a.pdf", [], "ends in .pdf; allowed: .dxf, .csv"),
        ("shell.dxf", ["--out", "shell.dat"], "ends in .dat; allowed: .toml"),
    ],
)
def test_convert_refuses_in_one_message(tmp_path, name, arguments, message):
    write_dxf(tmp_path / "shell.dxf")
    done = invoke("convert", tmp_path / name, *arguments)
    assert done.exit_code == 2
    assert message in " ".join(done.output.split())
