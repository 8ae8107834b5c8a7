"""Import of hexahedral gmsh meshes: round trip, a mesh that gmsh made, segments, placement, and every refusal."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from burst_fenicsx.errors import InputError
from burst_fenicsx.geometry import Segment, load_profile
from burst_fenicsx.kernels.geometry.faces import reordered
from burst_fenicsx.materials.library import load_casing, load_explosive
from burst_fenicsx.meshing import cell_volumes, mesh_profile, mesh_round, read_gmsh
from burst_fenicsx.problem import Part, Round
from tests.memory import peak_since_reset, reset_peak

meshio = pytest.importorskip("meshio")

NAMES = {"casing": 1, "charge": 2, "fuze": 3}


def write(path, points, blocks, names=None, version="gmsh22"):
    """Write blocks of (cell type, cells, physical tags) as a .msh file."""
    names = {name: np.array([tag, 3]) for name, tag in (NAMES if names is None else names).items()}
    tags = [np.asarray(tag, dtype=np.int32) for _, _, tag in blocks]
    meshio.Mesh(
        points,
        [(kind, reordered(np.asarray(cells))) for kind, cells, _ in blocks],
        cell_data={"gmsh:physical": tags, "gmsh:geometrical": tags},
        field_data=names,
    ).write(path, file_format=version, binary=False)
    return path


@pytest.fixture(scope="module")
def m107():
    return mesh_profile(load_profile("m107"), 12e-3)


@pytest.fixture(scope="module")
def tube():
    return mesh_profile(load_profile("tube"), 20e-3)


def parts_of(mesh):
    return [
        ("hexahedron", mesh.cells[mesh.part == part], np.full((mesh.part == part).sum(), part + 1)) for part in Part
    ]


def write_mesh(path, mesh, **options):
    return write(path, mesh.nodes, [block for block in parts_of(mesh) if len(block[1])], **options)


def test_round_trip_keeps_cells_and_names(tmp_path, m107):
    path = write(tmp_path / "m107.msh", m107.nodes, [("hexahedron", m107.cells, m107.part + 1)])
    back = read_gmsh(path, segments=load_profile("m107").segments)
    np.testing.assert_array_equal(back.cells, m107.cells)
    np.testing.assert_allclose(back.nodes, m107.nodes, atol=1e-12)
    np.testing.assert_array_equal(back.part, m107.part)
    np.testing.assert_array_equal(back.segment, m107.segment)
    np.testing.assert_allclose(back.station, m107.station, atol=1e-9)
    assert back.segments == m107.segments
    assert back.lengths[0] == pytest.approx(m107.lengths[0], rel=1e-9)


def test_automatic_segments_distinguish_nose_wall_and_base(tmp_path, m107):
    profile = load_profile("m107")
    back = read_gmsh(write_mesh(tmp_path / "m107.msh", m107))
    pieces = back.segments[0]
    assert [piece.kind for piece in pieces] == ["nose", *["wall"] * 4, "base"]
    assert pieces[0].end == pytest.approx(profile.charge_front, abs=1e-9)
    assert pieces[-1].start == pytest.approx(profile.charge_end, abs=1e-9)
    lengths = [piece.end - piece.start for piece in pieces[1:-1]]
    assert lengths == pytest.approx([lengths[0]] * 4, rel=1e-6)
    for index, piece in enumerate(pieces):
        stations = back.station[back.segment == index]
        assert piece.start < stations.min()
        assert stations.max() < piece.end


def test_given_stations_cut_the_casing(tmp_path, tube):
    path = write_mesh(tmp_path / "tube.msh", tube)
    assert [(piece.start, piece.end) for piece in read_gmsh(path, segments=[0.1]).segments[0]] == [
        (0.0, 0.1),
        (0.1, pytest.approx(0.3)),
    ]
    with pytest.raises(InputError, match=r"segments = \[0.2, 0.1\] m; stations increasing between 0 and 0.3 m"):
        read_gmsh(path, segments=[0.2, 0.1])
    with pytest.raises(InputError, match="segment 'wall 2' holds no casing cell"):
        read_gmsh(path, segments=[0.1, 0.1001])
    with pytest.raises(InputError, match="the segments end at 100 mm, the round at 300 mm"):
        read_gmsh(path, segments=[Segment("all", 0.0, 0.1, "wall")])


def test_unit_and_frames_carry_the_file_to_its_place(tmp_path, m107):
    # The file: millimetres, base at (10, 0, 5), nose along -x.
    file_axis, file_base = (-1.0, 0.0, 0.0), (10.0, 0.0, 5.0)
    drawn = mesh_profile(load_profile("m107"), 12e-3, axis=file_axis)
    points = drawn.nodes * 1e3 + file_base
    path = write(tmp_path / "m107.msh", points, [("hexahedron", drawn.cells, drawn.part + 1)])
    position, axis = (1.0, 2.0, 3.0), (0.0, 1.0, 1.0)
    back = read_gmsh(
        path, unit="mm", file_position=file_base, file_axis=file_axis, position=position, axis=axis, round_index=2
    )
    wanted = mesh_profile(load_profile("m107"), 12e-3, position=position, axis=axis)
    np.testing.assert_allclose(back.nodes, wanted.nodes, atol=1e-9)
    assert np.all(back.round == 2)
    with pytest.raises(
        InputError, match=r"the casing's centre lies .* mm from the round's axis; file_position and file_axis"
    ):
        read_gmsh(path, unit="mm")
    with pytest.raises(InputError, match=r"nodes lie 5\d\d.* mm behind the base plane"):
        read_gmsh(path, unit="mm", file_position=(-500.0, 0.0, 5.0), file_axis=file_axis)
    with pytest.raises(InputError, match="unit = 'inch'; did you mean 'in'"):
        read_gmsh(path, unit="inch")


def test_a_round_may_be_a_mesh_file(tmp_path, tube):
    path = write_mesh(tmp_path / "tube.msh", tube)
    given = Round("own", load_explosive("tnt"), load_casing("steel_paper"), mesh_file=path, position=(0.0, 0.0, 4.0))
    mesh = mesh_round(given, 5e-3, 1)
    assert mesh.nodes[:, 2].min() == pytest.approx(4.0)
    assert np.all(mesh.round == 1)


def write_by_gmsh(path, version, groups, view=None):
    """A square bar in 8 layers, its core charge and its rim casing, with the physical volumes `groups`.

    `view`: "alone" or "appended", as gmsh saves what it shows.
    """
    gmsh = pytest.importorskip("gmsh")
    gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.MshFileVersion", version)
        geo = gmsh.model.geo
        rings = [[geo.addPoint(r * x, r * y, 0) for x, y in ((1, 1), (-1, 1), (-1, -1), (1, -1))] for r in (0.03, 0.05)]
        sides = [[geo.addLine(ring[k], ring[(k + 1) % 4]) for k in range(4)] for ring in rings]
        spokes = [geo.addLine(rings[0][k], rings[1][k]) for k in range(4)]
        loops = [sides[0]] + [[spokes[k], sides[1][k], -spokes[(k + 1) % 4], -sides[0][k]] for k in range(4)]
        surfaces = [geo.addPlaneSurface([geo.addCurveLoop(loop)]) for loop in loops]
        for line in [*sides[0], *sides[1]]:
            geo.mesh.setTransfiniteCurve(line, 5)
        for line in spokes:
            geo.mesh.setTransfiniteCurve(line, 3)
        volumes = []
        for surface in surfaces:
            geo.mesh.setTransfiniteSurface(surface)
            geo.mesh.setRecombine(2, surface)
            made = geo.extrude([(2, surface)], 0, 0, 0.2, numElements=[8], recombine=True)
            volumes += [tag for dimension, tag in made if dimension == 3]
        geo.synchronize()
        for name, chosen in groups:
            gmsh.model.addPhysicalGroup(3, volumes[chosen], name=name)
        gmsh.model.mesh.generate(3)
        gmsh.write(str(path))
        if view:
            shown = gmsh.view.add("size")
            gmsh.view.addModelData(shown, 0, gmsh.model.getCurrent(), "NodeData", [1], [[1.0]])
            gmsh.view.write(shown, str(path), append=view == "appended")
    finally:
        gmsh.finalize()
    return path


CORE, RIM = slice(0, 1), slice(1, None)


@pytest.mark.parametrize("version", [2.2, 4.1])
def test_a_mesh_made_by_gmsh_is_read(tmp_path, version):
    mesh = read_gmsh(write_by_gmsh(tmp_path / "box.msh", version, [("charge", CORE), ("casing", RIM)]))
    volume = cell_volumes(mesh)
    assert len(mesh.cells) == 8 * (16 + 4 * 8)
    assert volume[mesh.part == Part.CHARGE].sum() == pytest.approx(0.06**2 * 0.2)
    assert volume[mesh.part == Part.CASING].sum() == pytest.approx((0.1**2 - 0.06**2) * 0.2)


@pytest.mark.parametrize("version", [2.2, 4.1])
@pytest.mark.parametrize("order", [("casing", "fuze"), ("fuze", "casing")])
def test_a_volume_in_two_physical_groups_is_refused_by_both_names(tmp_path, version, order):
    """Of which format 2.2 writes the cells twice, and of format 4.1 the reader's cell data hold the first group."""
    groups = [("charge", CORE), *((name, RIM if name == "casing" else slice(1, 2)) for name in order)]
    path = write_by_gmsh(tmp_path / "box.msh", version, groups)
    both = "('casing' and 'fuze'|'fuze' and 'casing')"
    with pytest.raises(InputError, match=rf"box\.msh: 64 hexahedra belong to the physical volumes {both}; every cell"):
        read_gmsh(path)


@pytest.mark.parametrize("version", [2.2, 4.1])
@pytest.mark.parametrize("view", ["alone", "appended"])
def test_a_file_with_a_view_is_refused_in_plain_words(tmp_path, version, view):
    path = write_by_gmsh(tmp_path / "box.msh", version, [("charge", CORE), ("casing", RIM)], view)
    with pytest.raises(InputError, match=r"view.*: save the mesh without its views") as refused:
        read_gmsh(path)
    assert "Error" not in str(refused.value)


def test_other_cells_are_refused_with_type_and_group(tmp_path, tube):
    blocks = parts_of(tube)[:2]
    tetra = [[0, 1, 2, 40], [1, 2, 3, 41]]
    path = write(tmp_path / "a.msh", tube.nodes, [*blocks, ("tetra", tetra, [2, 2])])
    with pytest.raises(
        InputError, match=r"2 cells of type 'tetra' in group 'charge'; only linear hexahedra \(8 nodes\)"
    ):
        read_gmsh(path)
    path = write(tmp_path / "b.msh", tube.nodes, [*blocks, ("wedge", [[0, 1, 2, 40, 41, 42]], [1])])
    with pytest.raises(InputError, match="1 cells of type 'wedge' in group 'casing'"):
        read_gmsh(path)
    quadratic = np.arange(20)[None, :]
    path = write(tmp_path / "c.msh", tube.nodes, [*blocks, ("hexahedron20", quadratic, [1])])
    with pytest.raises(InputError, match="1 cells of type 'hexahedron20' in group 'casing'"):
        read_gmsh(path)


def test_flat_cells_are_passed_over(tmp_path, tube):
    path = write(tmp_path / "a.msh", tube.nodes, [("quad", [[0, 1, 2, 3]], [1]), *parts_of(tube)[:2]])
    assert len(read_gmsh(path).cells) == len(tube.cells)


def test_inverted_cell_is_refused_by_number_and_group(tmp_path, tube):
    cells = tube.cells.copy()
    charge = np.flatnonzero(tube.part == Part.CHARGE)[5]
    cells[charge] = cells[charge][[4, 5, 6, 7, 0, 1, 2, 3]]
    path = write(tmp_path / "a.msh", tube.nodes, [("hexahedron", cells, tube.part + 1)])
    with pytest.raises(
        InputError,
        match=rf"1 inverted or flat hexahedra; the first is hexahedron {charge + 1} in file order, in group 'charge'",
    ):
        read_gmsh(path)


def test_missing_and_unknown_groups_are_refused(tmp_path, tube):
    everything = [("hexahedron", tube.cells, np.full(len(tube.cells), 1))]
    path = write(tmp_path / "a.msh", tube.nodes, everything, names={"casing": 1})
    with pytest.raises(
        InputError, match="no hexahedra in a physical volume 'charge'; found 'casing'; needed: casing and charge"
    ):
        read_gmsh(path)
    path = write(tmp_path / "b.msh", tube.nodes, parts_of(tube)[:2], names={"casing": 1, "chrage": 2})
    with pytest.raises(InputError, match="physical volume 'chrage' is unknown; did you mean 'charge'"):
        read_gmsh(path)
    path = write(tmp_path / "c.msh", tube.nodes, parts_of(tube)[:2], names={"casing": 1})
    with pytest.raises(
        InputError, match="hold cells of no physical volume; every cell must belong to one of casing, charge, fuze"
    ):
        read_gmsh(path)
    path = tmp_path / "d.msh"
    meshio.Mesh(tube.nodes, [("hexahedron", tube.cells)]).write(path, file_format="gmsh22", binary=False)
    with pytest.raises(InputError, match="of no physical volume"):
        read_gmsh(path)


def test_parts_that_do_not_share_nodes_are_refused(tmp_path, tube):
    casing, charge = (tube.cells[tube.part == part] for part in (Part.CASING, Part.CHARGE))
    points = np.concatenate([tube.nodes, tube.nodes])
    apart = charge + len(tube.nodes)
    tags = [np.full(len(casing), 1), np.full(len(charge), 2)]
    path = write(tmp_path / "a.msh", points, [("hexahedron", casing, tags[0]), ("hexahedron", apart, tags[1])])
    with pytest.raises(
        InputError, match="group 'charge' shares no nodes with group 'casing'; parts that touch must share"
    ):
        read_gmsh(path)


def test_a_part_in_pieces_is_refused(tmp_path, tube):
    gap = (tube.part != Part.CASING) | (tube.station < 0.12) | (tube.station > 0.18)
    kept = tube.cells[gap]
    path = write(tmp_path / "a.msh", tube.nodes, [("hexahedron", kept, tube.part[gap] + 1)])
    with pytest.raises(
        InputError, match=r"group 'casing' falls into 2 pieces that share no nodes \(hexahedron \d+ in file order"
    ):
        read_gmsh(path)


def test_unreadable_files_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"none\.msh: there is no such mesh file"):
        read_gmsh(tmp_path / "none.msh")
    other = tmp_path / "mesh.vtk"
    other.write_text("x")
    with pytest.raises(InputError, match=r"'\.vtk' is not a gmsh mesh; a file that ends in \.msh is expected"):
        read_gmsh(other)
    broken = tmp_path / "broken.msh"
    broken.write_text("$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n3\n1 0 0\n")
    with pytest.raises(InputError, match=r"broken\.msh: not a readable gmsh mesh"):
        read_gmsh(broken)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (
            lambda nodes: np.where(np.arange(len(nodes))[:, None] == 5, np.inf, nodes),
            "1 nodes are not at finite places",
        ),
        (lambda nodes: nodes * 1e-30, "the mesh is .*e-31 m large in the unit 'm'; allowed: 0.001 to 20 m"),
        (lambda nodes: nodes * 1e4, r"the mesh is 3e\+03 m large in the unit 'm'; allowed: 0.001 to 20 m"),
    ],
)
def test_nodes_that_cannot_be_of_a_round_are_refused(tmp_path, tube, change, words):
    path = write(tmp_path / "tube.msh", change(tube.nodes), [b for b in parts_of(tube) if len(b[1])])
    with pytest.raises(InputError, match=rf"tube.msh: {words}"):
        read_gmsh(path)


def test_cells_that_are_there_twice_are_refused(tmp_path, tube):
    twice = [(kind, np.concatenate([c, c]), np.concatenate([t, t])) for kind, c, t in parts_of(tube) if len(c)]
    path = write(tmp_path / "tube.msh", tube.nodes, twice)
    with pytest.raises(InputError, match=rf"tube.msh: {len(tube.cells)} hexahedra are there more than once"):
        read_gmsh(path)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("$Nodes\n{nodes}\n", "$Nodes\n200000000\n"),
        ("$Nodes\n{nodes}\n", "$Nodes\n99999999999999999999\n"),
        ("$Elements\n{cells}\n", "$Elements\n-5\n"),
        ("$PhysicalNames\n3\n", "$PhysicalNames\n1000000000\n"),
        ("{nodes} ", "2000000000 "),  # the reader makes a table as long as the largest number of a node
        ("\n1 ", "\n1e300 "),  # as a whole number of 32 bits it is the largest
        ("\n1 ", "\nnan "),
        ("$EndElements\n", '$EndElements\n$NodeData\n1\n"x"\n999999999999999\n'),
    ],
)
def test_numbers_that_a_file_cannot_hold_are_refused_before_they_are_believed(tmp_path, tube, old, new):
    path = write_mesh(tmp_path / "tube.msh", tube)
    text = path.read_text()
    old = old.format(nodes=len(tube.nodes), cells=len(tube.cells))
    assert old in text
    path.write_text(text.replace(old, new, 1))
    reset_peak()
    before = peak_since_reset()
    too_much = r"not a readable gmsh mesh \(it declares more than a file of its size can h"
    if new.startswith("\n"):
        too_much = "as a node's number; allowed: whole numbers"
    with pytest.raises(InputError, match="no hexahedra in a physical volume 'casing'" if "-5" in new else too_much):
        read_gmsh(path)
    assert peak_since_reset() - before < 1 << 28, "bytes"


@pytest.fixture(scope="module")
def lines(tmp_path_factory):
    """Lines of a small mesh's file."""
    mesh = mesh_profile(load_profile("tube"), 60e-3)
    return write_mesh(tmp_path_factory.mktemp("lines") / "tube.msh", mesh).read_text().splitlines()


@settings(max_examples=25, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))
@given(
    changes=st.lists(
        st.tuples(
            st.floats(0.0, 1.0, exclude_max=True),
            st.integers(0, 8),
            st.sampled_from(["nan", "inf", "-2", "0", "1e300", "", "x", "99999999999999999999", "$Nodes", "5", "é"]),
        ),
        min_size=1,
        max_size=3,
    ),
    head=st.booleans(),
)
def test_a_mesh_from_elsewhere_is_finite_or_refused(tmp_path_factory, lines, changes, head):
    path, lines = tmp_path_factory.mktemp("mesh") / "tube.msh", list(lines)
    for place, word, new in changes:
        number = int(place * (14 if head else len(lines)))
        words = lines[number].split() or [""]
        words[word % len(words)] = new
        lines[number] = " ".join(words)
    path.write_text("\n".join(lines), encoding="utf-8")
    said = ""
    try:
        assert np.isfinite(read_gmsh(path).nodes).all()
    except InputError as error:
        said = str(error)
    assert said == "" or said.startswith(f"{path}: ")
