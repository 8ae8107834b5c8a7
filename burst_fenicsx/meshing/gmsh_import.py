"""A user's own hexahedral mesh (gmsh .msh): read, checked, placed in the world and cut into segments."""

from __future__ import annotations

import re
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np

from burst_fenicsx.data import LENGTH_UNITS, nearest_name
from burst_fenicsx.errors import InputError
from burst_fenicsx.geometry.segments import Segment, SegmentKind, check_segments
from burst_fenicsx.kernels.geometry.faces import reordered
from burst_fenicsx.meshing.mesh import HexahedralMesh, cell_centres, cell_volumes
from burst_fenicsx.meshing.placement import place, to_local
from burst_fenicsx.meshing.quality import scaled_jacobians
from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from numpy.typing import NDArray


GROUPS = {"casing": Part.CASING, "charge": Part.CHARGE, "fuze": Part.FUZE}
WALL_PIECES = 4  # automatic segments along the charge
LARGEST_OFFSET = 0.05  # of the casing's centre from the axis, over the largest radius
_SMALLEST, _LARGEST = 1e-3, 20.0  # m
_USUAL = 0.02, 5.0  # m: of rounds, to guess a unit
_MOST_CELLS = 50_000_000
_MOST_BYTES = 1 << 34
_FLAT = ("vertex", "line", "triangle", "quad")
# The reader allocates what a file declares. Numbers of fewer digits take little memory, and coordinates have no more.
_LONG_NUMBER = re.compile(rb"(?<![\w.+-])\d{8,}(?![\w.+-])")


def read_gmsh(
    path: str | Path,
    *,
    unit: str = "m",
    file_position: Sequence[float] | None = None,
    file_axis: Sequence[float] = (0.0, 0.0, 1.0),
    position: Sequence[float] = (0.0, 0.0, 0.0),
    axis: Sequence[float] = (0.0, 0.0, 1.0),
    segments: Sequence[float] | Sequence[Segment] | None = None,
    round_index: int = 0,
) -> HexahedralMesh:
    """Read linear hexahedra in the physical volumes "casing", "charge" and, if there is one, "fuze".

    Cells keep the file's order; nodes that no cell uses are dropped.

    Parameters
    ----------
    path : A .msh file of gmsh (format 2.2 or 4.1).
    unit : unit of the file's lengths: "m", "cm", "mm" or "in".
    file_position, file_axis : centre of the base plane and direction from base to nose in the file's coordinates (in
        `unit`). By default the axis is +z through x = y = 0 and the base is the lowest node along it.
    position, axis : where the round shall stand in the world (m), as for `Round`.
    segments : sequence, optional
        Stations between segments (m, from the nose end), or the segments themselves. By default what lies before the
        charge is the nose, what lies behind it the base, and the casing around it is cut into four equal lengths.
    round_index : index to write into the mesh.

    Returns
    -------
    HexahedralMesh
        In world coordinates (m).

    Raises
    ------
    InputError
        Unreadable file; cells that are not linear hexahedra; a missing, empty or unknown physical group; cells in no
        group or in two; inverted cells; parts that do not share nodes or fall apart; a round off its axis; segments
        that do not fit.
    """
    path = Path(path)
    if unit not in LENGTH_UNITS:
        raise InputError(f"{path}: unit = '{unit}'; {nearest_name(unit, LENGTH_UNITS)}")
    try:
        points, cells, part = _hexahedra(_parsed(path))
        _check_numbers(points, cells, part, unit)
        used, flat = np.unique(cells, return_inverse=True)
        base = (0.0, 0.0, 0.0) if file_position is None else file_position
        local = to_local(points[used], base, file_axis) * LENGTH_UNITS[unit]
        if file_position is None:
            local[:, 2] -= local[:, 2].min()
        mesh = HexahedralMesh(
            nodes=local,
            cells=reordered(flat.reshape(cells.shape).astype(np.int64)),
            part=part,
            round=np.full(len(cells), round_index, dtype=np.int32),
            segment=np.full(len(cells), -1, dtype=np.int32),
            station=np.zeros(len(cells)),
        )
        _check_cells(mesh)
        _check_connection(mesh)
        _check_axis(mesh, unit)
        length = float(local[:, 2].max())
        station = length - cell_centres(mesh)[:, 2]
        pieces = _segments(mesh, length, segments)
        segment = np.searchsorted([piece.end for piece in pieces[:-1]], station)
        segment = np.where(part == Part.CASING, segment, -1).astype(np.int32)
        for index, piece in enumerate(pieces):
            if not np.any(segment == index):
                raise InputError(f"segment '{piece.name}' holds no casing cell; fewer or longer segments are needed")
    except InputError as error:
        raise InputError(f"{path}: {error}") from error.__cause__
    return HexahedralMesh(
        nodes=place(local, position, axis),
        cells=mesh.cells,
        part=part,
        round=mesh.round,
        segment=segment,
        station=station,
        segments=(pieces,),
        lengths=(length,),
    )


def _parsed(path: Path) -> Any:  # noqa: ANN401 - meshio's class
    import meshio

    if not path.is_file():
        raise InputError("there is no such mesh file")
    size = path.stat().st_size
    if size > _MOST_BYTES:
        raise InputError(f"{size} bytes; at most {_MOST_BYTES} are allowed")
    if path.suffix.lower() != ".msh":
        raise InputError(f"'{path.suffix}' is not a gmsh mesh; a file that ends in .msh is expected")
    with path.open("rb") as file:
        has_view = _check_lines(file, size)
    try:
        with redirect_stdout(StringIO()), redirect_stderr(StringIO()):  # meshio reports to the console
            mesh = meshio.read(path, file_format="gmsh")
        mesh.points = np.asarray(mesh.points, dtype=np.float64).reshape(-1, 3)
    except (Exception, SystemExit) as error:  # meshio leaves the program on some faults
        why = f"{type(error).__name__}: {' '.join(str(error).split())[:300]}"
        if has_view:
            why = "it holds a view of gmsh, which is no part of a mesh: save the mesh without its views"
        raise InputError(f"not a readable gmsh mesh ({why})") from error
    return mesh


def _check_lines(file: Iterable[bytes], size: int) -> bool:
    """Refuse what makes meshio reserve more memory than a file of `size` bytes needs; whether there is a view."""
    section, is_text_2, has_view, meshes = b"", False, False, 0
    for line in file:
        if any(int(number) > size for number in _LONG_NUMBER.findall(line)):
            raise InputError("not a readable gmsh mesh (it declares more than a file of its size can hold)")
        if line.startswith(b"$"):
            section = line.strip()
            meshes += section == b"$MeshFormat"
            has_view |= section in (b"$NodeData", b"$ElementData", b"$ElementNodeData")
        elif section == b"$MeshFormat":
            is_text_2 = line.split()[:2] in ([b"2.2", b"0"], [b"2", b"0"], [b"2.1", b"0"])
        elif is_text_2 and section == b"$Nodes" and not b"".join(line.split()[:1]).isdigit():
            # 1e300, inf and nan would become the largest number of a node there is.
            shown = line[:40].decode(errors="replace").split()[:1]
            raise InputError(f"not a readable gmsh mesh (found {shown} as a node's number; allowed: whole numbers)")
    if not meshes:
        raise InputError("not a readable gmsh mesh (found no $MeshFormat)")
    if meshes > 1:
        words = ", as gmsh appends a view: save the mesh without its views" if has_view else ""
        raise InputError(f"{meshes} meshes in one file{words}; allowed: one")
    return has_view


def _hexahedra(mesh: Any) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.int32]]:  # noqa: ANN401
    """Points, hexahedra and their parts, in the file's order and unit."""
    names = {int(tag): str(name) for name, (tag, dimension) in mesh.field_data.items() if dimension == 3}
    for name in names.values():
        if name not in GROUPS:
            raise InputError(f"physical volume '{name}' is unknown; {nearest_name(name, GROUPS)}")
    _check_groups(mesh, names.values())
    cells, parts = [np.zeros((0, 8), dtype=np.int64)], [np.zeros(0, dtype=np.int32)]
    for block, tags in zip(mesh.cells, mesh.cell_data.get("gmsh:physical", [None] * len(mesh.cells)), strict=True):
        if block.type.rstrip("0123456789") in _FLAT:
            continue
        tag, row = np.unique(np.full(len(block.data), -1) if tags is None else tags, return_inverse=True)
        groups = [names.get(value, "none") for value in tag.tolist()]
        if block.type != "hexahedron":
            raise InputError(
                f"{len(block.data)} cells of type '{block.type}' in group '{', '.join(sorted(set(groups)))}'; "
                "only linear hexahedra (8 nodes) are allowed"
            )
        if "none" in groups:
            raise InputError(
                f"{len(block.data)} hexahedra hold cells of no physical volume; "
                f"every cell must belong to one of {', '.join(GROUPS)}"
            )
        cells.append(np.asarray(block.data, dtype=np.int64))
        parts.append(np.array([GROUPS[name] for name in groups], dtype=np.int32)[row])
    part = np.concatenate(parts)
    for name in ("casing", "charge"):
        if not np.any(part == GROUPS[name]):
            present = ", ".join(f"'{other}'" for other in names.values()) or "none"
            raise InputError(f"no hexahedra in a physical volume '{name}'; found {present}; needed: casing and charge")
    return mesh.points, np.concatenate(cells), part


def _check_groups(mesh: Any, names: Iterable[str]) -> None:  # noqa: ANN401
    """Refuse blocks of format 4.1 in two physical volumes, of which the reader's cell data keep the first."""
    sets = {name: mesh.cell_sets[name] for name in names if name in mesh.cell_sets}
    for block in range(len(mesh.cells)):
        groups = [name for name, members in sets.items() if len(members[block])]
        if len(groups) > 1:
            _refuse_two_groups(len(mesh.cells[block].data), groups)


def _refuse_two_groups(number: int, groups: Sequence[str]) -> NoReturn:
    words = " and ".join(f"'{name}'" for name in groups)
    raise InputError(f"{number} hexahedra belong to the physical volumes {words}; every cell must belong to one")


def _check_numbers(points: NDArray[np.float64], cells: NDArray[np.int64], part: NDArray[np.int32], unit: str) -> None:
    """Refuse nodes at infinity, meshes of no round's size, node numbers that do not exist, and cells given twice."""
    if len(cells) > _MOST_CELLS:
        raise InputError(f"{len(cells)} hexahedra; at most {_MOST_CELLS} are allowed")
    if cells.min() < 0 or cells.max() >= len(points):
        raise InputError(f"hexahedra name nodes outside of the {len(points)} of the file")
    used = points[np.unique(cells)]
    if not np.isfinite(used).all():
        raise InputError(f"{int((~np.isfinite(used)).any(axis=1).sum())} nodes are not at finite places")
    extent = float(np.ptp(used, axis=0).max()) * LENGTH_UNITS[unit]
    if not _SMALLEST <= extent <= _LARGEST:
        sizes = {other: extent * scale / LENGTH_UNITS[unit] for other, scale in LENGTH_UNITS.items()}
        likely = " or ".join(
            f"{other} ({size:.3g} m)" for other, size in sizes.items() if _USUAL[0] <= size <= _USUAL[1]
        )
        raise InputError(
            f"the mesh is {extent:.3g} m large in the unit '{unit}'; allowed: {_SMALLEST:g} to {_LARGEST:g} m"
            f"{f': the numbers of the file look like {likely}' if likely else ''}"
        )
    _, first, same, count = np.unique(
        np.sort(cells, axis=1), axis=0, return_index=True, return_inverse=True, return_counts=True
    )
    if (count > 1).any():
        # Format 2.2 has a cell of two groups twice, once for each.
        same = same.ravel()  # in numpy 2.0 of two dimensions
        others = np.flatnonzero(part != part[first[same]])
        if len(others):
            _refuse_two_groups(
                len(others), [Part(int(part[at])).name.lower() for at in (first[same[others[0]]], others[0])]
            )
        raise InputError(
            f"{int((count > 1).sum())} hexahedra are there more than once; the first of them is hexahedron "
            f"{int(first[count > 1].min()) + 1} in file order (in gmsh: Coherence Mesh removes doubles)"
        )


def _check_cells(mesh: HexahedralMesh) -> None:
    scaled = scaled_jacobians(mesh)
    bad = np.flatnonzero(scaled <= 0.0)
    if len(bad):
        group = Part(int(mesh.part[bad[0]])).name.lower()
        raise InputError(
            f"{len(bad)} inverted or flat hexahedra; the first is hexahedron {bad[0] + 1} in file order, "
            f"in group '{group}', scaled Jacobian {scaled[bad[0]]:.3g}; it must be positive"
        )


def _check_connection(mesh: HexahedralMesh) -> None:
    """Refuse parts that share no nodes with the casing, or fall into pieces that share none."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    casing = np.unique(mesh.cells[mesh.part == Part.CASING])
    for name, part in GROUPS.items():
        own = np.flatnonzero(mesh.part == part)
        if not len(own):
            continue
        cells = mesh.cells[own]
        if not np.isin(cells, casing).any():
            raise InputError(
                f"group '{name}' shares no nodes with group 'casing'; parts that touch must share "
                "their nodes (in gmsh: BooleanFragments, or Coherence for transfinite volumes, before meshing)"
            )
        edges = np.repeat(cells[:, 0], 7), cells[:, 1:].ravel()
        graph = coo_matrix((np.ones(len(edges[0]), dtype=np.int8), edges), shape=(len(mesh.nodes),) * 2)
        _, piece = np.unique(connected_components(graph, directed=False)[1][cells[:, 0]], return_inverse=True)
        count = np.bincount(piece)
        if len(count) > 1:
            first = own[np.flatnonzero(piece == np.argmin(count))[0]]
            raise InputError(
                f"group '{name}' falls into {len(count)} pieces that share no nodes (hexahedron {first + 1} "
                "in file order belongs to the smallest); each part must be one piece"
            )


def _check_axis(mesh: HexahedralMesh, unit: str) -> None:
    weights = np.where(mesh.part == Part.CASING, cell_volumes(mesh), 0.0)
    offset = float(np.hypot(*(weights @ cell_centres(mesh)[:, :2] / weights.sum())))
    scale = 1.0 / LENGTH_UNITS[unit]
    if offset > LARGEST_OFFSET * float(np.hypot(mesh.nodes[:, 0], mesh.nodes[:, 1]).max()):
        raise InputError(
            f"the casing's centre lies {offset * scale:.4g} {unit} from the round's axis; "
            "file_position and file_axis must give the centre of the base and the direction to the nose in the file's "
            "coordinates"
        )
    lowest = mesh.nodes[:, 2].min()
    if lowest < -1e-6 * np.ptp(mesh.nodes[:, 2]):
        raise InputError(
            f"nodes lie {-lowest * scale:.4g} {unit} behind the base plane given by file_position and file_axis"
        )


def _segments(
    mesh: HexahedralMesh, length: float, wanted: Sequence[float] | Sequence[Segment] | None
) -> tuple[Segment, ...]:
    """The segments given, or those between the stations given, or the automatic ones."""
    charge = length - mesh.nodes[mesh.cells[mesh.part == Part.CHARGE], 2]
    front, back = float(charge.min()), float(charge.max())
    slack = 1e-6 * length
    given = [entry for entry in wanted or () if isinstance(entry, Segment)]
    if given:
        return check_segments(given, length, "segments")
    if wanted is not None:
        cuts = [float(entry) for entry in wanted if not isinstance(entry, Segment)]
        if any(not 0.0 < cut < length for cut in cuts) or any(b <= a for a, b in pairwise(cuts)):
            raise InputError(f"segments = {cuts} m; stations increasing between 0 and {length:.6g} m are expected")
    else:
        cuts = [float(cut) for cut in np.linspace(front, back, WALL_PIECES + 1)]
        cuts = [cut for cut in cuts if slack < cut < length - slack]
    pieces = []
    for number, (low, high) in enumerate(pairwise([0.0, *cuts, length]), start=1):
        kind: SegmentKind = "nose" if high <= front + slack else "base" if low >= back - slack else "wall"
        pieces.append(Segment(f"{kind} {number}" if kind == "wall" else kind, low, high, kind))
    return check_segments(pieces, length, "segments")
