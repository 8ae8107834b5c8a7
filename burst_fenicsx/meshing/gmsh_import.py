"""A user's own hexahedral mesh (gmsh .msh): read, checked, placed in the world and cut into segments."""

from __future__ import annotations

import io
import zipfile
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from burst_fenicsx.data import LENGTH_UNITS, nearest_name
from burst_fenicsx.errors import InputError
from burst_fenicsx.geometry.segments import Segment, SegmentKind, check_segments
from burst_fenicsx.meshing.mesh import HexahedralMesh, cell_centres, cell_volumes
from burst_fenicsx.meshing.placement import place, to_local
from burst_fenicsx.meshing.quality import scaled_jacobians
from burst_fenicsx.problem import Part
from fragfield_base.own_process import run_script

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

__all__ = ["GROUPS", "WALL_PIECES", "read_gmsh"]

GROUPS = {"casing": Part.CASING, "charge": Part.CHARGE, "fuze": Part.FUZE}
REQUIRED = ("casing", "charge")
WALL_PIECES = 4  # automatic segments along the charge
LARGEST_OFFSET = 0.05  # of the casing's centre from the axis, over the largest radius
_SMALLEST, _LARGEST = 1e-3, 20.0  # m
_MOST_CELLS = 50_000_000
_MOST_BYTES = 1 << 34


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
    path : str or Path
        A .msh file of gmsh (format 2.2 or 4.1).
    unit : str
        Unit of the file's lengths: "m", "cm", "mm" or "in".
    file_position, file_axis : sequence of float
        Centre of the base plane and direction from base to nose in the file's coordinates (in `unit`). By default the
        axis is +z through x = y = 0 and the base is the lowest node along it.
    position, axis : sequence of float
        Where the round shall stand in the world (m), as for `Round`.
    segments : sequence, optional
        Stations between segments (m, from the nose end), or the segments themselves. By default what lies before the
        charge is the nose, what lies behind it the base, and the casing around it is cut into four equal lengths.
    round_index : int
        Index to write into the mesh.

    Returns
    -------
    HexahedralMesh
        In world coordinates (m).

    Raises
    ------
    InputError
        Unreadable file; cells that are not linear hexahedra; a missing, empty or unknown physical group; cells in no
        group; inverted cells; parts that do not share nodes or fall apart; a round off its axis; segments that do not
        fit.
    """
    path = Path(path)
    if unit not in LENGTH_UNITS:
        raise InputError(f"{path}: unit = '{unit}'; {nearest_name(unit, LENGTH_UNITS)}")
    points, cells, part = _read(path)
    _check_numbers(points, cells, path, unit)
    used, flat = np.unique(cells, return_inverse=True)
    cells = flat.reshape(cells.shape).astype(np.int64)
    points = points[used]

    base = (0.0, 0.0, 0.0) if file_position is None else file_position
    local = to_local(points, base, file_axis) * LENGTH_UNITS[unit]
    lowest = local[:, 2].min()
    if file_position is None:
        local[:, 2] -= lowest
    length = float(local[:, 2].max())
    mesh = HexahedralMesh(
        nodes=local,
        cells=cells,
        part=part,
        round=np.full(len(cells), round_index, dtype=np.int32),
        segment=np.full(len(cells), -1, dtype=np.int32),
        station=np.zeros(len(cells)),
    )
    _check_cells(mesh, path)
    _check_connection(mesh, path)
    _check_axis(mesh, path, unit)

    station = length - cell_centres(mesh)[:, 2]
    pieces = _segments(mesh, length, segments, path)
    ends = np.array([piece.end for piece in pieces[:-1]])
    segment = np.where(part == Part.CASING, np.searchsorted(ends, station), -1).astype(np.int32)
    for index, piece in enumerate(pieces):
        if not np.any(segment == index):
            raise InputError(
                f"{path}: segment '{piece.name}' holds no casing cell; fewer or longer segments are needed"
            )
    return HexahedralMesh(
        nodes=place(local, position, axis),
        cells=cells,
        part=part,
        round=mesh.round,
        segment=segment,
        station=station,
        segments=(pieces,),
        lengths=(length,),
    )


def _read(path: Path) -> tuple[NDArray[np.float64], NDArray[np.int64], NDArray[np.int32]]:
    """Return points, hexahedra and their parts, in the file's order and unit."""
    content = _parse(path)
    names = dict(zip(content["tags"].tolist(), content["names"].tolist(), strict=True))
    for name in names.values():
        if name not in GROUPS:
            raise InputError(f"{path}: physical volume '{name}' is unknown; {nearest_name(name, GROUPS)}")
    cells = [np.zeros((0, 8), dtype=np.int64)]
    parts = [np.zeros(0, dtype=np.int32)]
    for key in [key for key in content if key.startswith("kind_")]:
        kind, number = str(content[key]), key.removeprefix("kind_")
        block, group = content[f"cells_{number}"], content[f"groups_{number}"]
        groups = sorted({names.get(value, "none") for value in np.unique(group).tolist()})
        if kind != "hexahedron":
            raise InputError(
                f"{path}: {len(block)} cells of type '{kind}' in group '{', '.join(groups)}'; "
                "only linear hexahedra (8 nodes) are allowed"
            )
        if "none" in groups:
            raise InputError(
                f"{path}: {len(block)} hexahedra hold cells of no physical volume; "
                f"every cell must belong to one of {', '.join(GROUPS)}"
            )
        cells.append(block)
        parts.append(np.array([GROUPS[names[value]] for value in group.tolist()], dtype=np.int32))
    part = np.concatenate(parts)
    for name in REQUIRED:
        if not np.any(part == GROUPS[name]):
            present = ", ".join(f"'{other}'" for other in names.values()) or "none"
            raise InputError(
                f"{path}: no hexahedra in a physical volume '{name}'; found {present}; needed: casing and charge"
            )
    return content["points"], np.concatenate(cells), part


def _parse(path: Path) -> dict[str, NDArray[Any]]:
    """What a file holds, as `gmsh_parse` gives it."""
    if not path.is_file():
        raise InputError(f"{path}: there is no such mesh file")
    if path.stat().st_size > _MOST_BYTES:
        raise InputError(f"{path}: {path.stat().st_size} bytes; at most {_MOST_BYTES} are allowed")
    if path.suffix.lower() != ".msh":
        raise InputError(f"{path}: '{path.suffix}' is not a gmsh mesh; a file that ends in .msh is expected")
    done = run_script(Path(__file__).with_name("gmsh_parse.py"), str(path))
    words = done.stderr.decode("utf-8", "replace").strip().splitlines()
    why = f"its reader ended: {words[-1]}" if words else "it takes longer to read than a file of its size may"
    try:
        with np.load(io.BytesIO(done.stdout), allow_pickle=False) as archive:
            content = {name: archive[name] for name in archive.files}
    except (ValueError, OSError, zipfile.BadZipFile):
        content = {"fault": np.array(why)}
    if "fault" in content:
        raise InputError(f"{path}: not a readable gmsh mesh ({content['fault']})")
    return content


def _check_numbers(points: NDArray[np.float64], cells: NDArray[np.int64], path: Path, unit: str) -> None:
    """Refuse nodes at infinity, meshes of no round's size, node numbers that do not exist, and cells given twice."""
    if len(cells) > _MOST_CELLS:
        raise InputError(f"{path}: {len(cells)} hexahedra; at most {_MOST_CELLS} are allowed")
    if cells.min() < 0 or cells.max() >= len(points):
        raise InputError(f"{path}: hexahedra name nodes outside of the {len(points)} of the file")
    used = points[np.unique(cells)]
    if not np.isfinite(used).all():
        raise InputError(f"{path}: {int((~np.isfinite(used)).any(axis=1).sum())} nodes are not at finite places")
    extent = float(np.ptp(used, axis=0).max()) * LENGTH_UNITS[unit]
    if not _SMALLEST <= extent <= _LARGEST:
        raise InputError(
            f"{path}: the mesh is {extent:.3g} m large in the unit '{unit}'; allowed: {_SMALLEST:g} to {_LARGEST:g} m"
        )
    each = np.sort(cells, axis=1)
    _, first, count = np.unique(each, axis=0, return_index=True, return_counts=True)
    if (count > 1).any():
        raise InputError(
            f"{path}: {int((count > 1).sum())} hexahedra are there more than once; the first of them is hexahedron "
            f"{int(first[count > 1].min()) + 1} in file order (in gmsh: Coherence Mesh removes doubles)"
        )


def _group(part: int) -> str:
    return next(name for name, value in GROUPS.items() if value == part)


def _check_cells(mesh: HexahedralMesh, path: Path) -> None:
    scaled = scaled_jacobians(mesh)
    bad = np.flatnonzero(scaled <= 0.0)
    if len(bad):
        first = int(bad[0])
        raise InputError(
            f"{path}: {len(bad)} inverted or flat hexahedra; the first is hexahedron {first + 1} in file order, "
            f"in group '{_group(int(mesh.part[first]))}', scaled Jacobian {scaled[first]:.3g}; it must be positive"
        )


def _check_connection(mesh: HexahedralMesh, path: Path) -> None:
    nodes = {name: np.unique(mesh.cells[mesh.part == part]) for name, part in GROUPS.items()}
    for name in ("charge", "fuze"):
        if len(nodes[name]) and not np.intersect1d(nodes[name], nodes["casing"], assume_unique=True).size:
            raise InputError(
                f"{path}: group '{name}' shares no nodes with group 'casing'; parts that touch must share "
                "their nodes (in gmsh: BooleanFragments, or Coherence for transfinite volumes, before meshing)"
            )
    for name, part in GROUPS.items():
        if not len(nodes[name]):
            continue
        pieces, label = _components(mesh.cells[mesh.part == part], len(mesh.nodes))
        if pieces > 1:
            smallest = int(np.argmin(np.bincount(label)))
            first = int(np.flatnonzero(mesh.part == part)[np.flatnonzero(label == smallest)[0]])
            raise InputError(
                f"{path}: group '{name}' falls into {pieces} pieces that share no nodes (hexahedron {first + 1} "
                "in file order belongs to the smallest); each part must be one piece"
            )


def _components(cells: NDArray[np.int64], node_count: int) -> tuple[int, NDArray[np.int64]]:
    """Number of pieces that share no node, and the piece of each cell."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    rows = np.repeat(cells[:, 0], 7)
    columns = cells[:, 1:].ravel()
    graph = coo_matrix((np.ones(len(rows), dtype=np.int8), (rows, columns)), shape=(node_count, node_count))
    _, label = connected_components(graph, directed=False)
    values, piece = np.unique(label[cells[:, 0]], return_inverse=True)
    return len(values), piece.astype(np.int64)


def _check_axis(mesh: HexahedralMesh, path: Path, unit: str) -> None:
    casing = mesh.part == Part.CASING
    weights = cell_volumes(mesh)[casing]
    centre = (cell_centres(mesh)[casing] * weights[:, None]).sum(axis=0) / weights.sum()
    offset = float(np.hypot(centre[0], centre[1]))
    largest = float(np.hypot(mesh.nodes[:, 0], mesh.nodes[:, 1]).max())
    scale = 1.0 / LENGTH_UNITS[unit]
    if offset > LARGEST_OFFSET * largest:
        raise InputError(
            f"{path}: the casing's centre lies {offset * scale:.4g} {unit} from the round's axis; "
            "file_position and file_axis must give the centre of the base and the direction to the nose in the file's "
            "coordinates"
        )
    if mesh.nodes[:, 2].min() < -1e-6 * (np.ptp(mesh.nodes[:, 2])):
        raise InputError(
            f"{path}: nodes lie {-mesh.nodes[:, 2].min() * scale:.4g} {unit} behind the base plane "
            "given by file_position and file_axis"
        )


def _segments(
    mesh: HexahedralMesh, length: float, wanted: Sequence[float] | Sequence[Segment] | None, path: Path
) -> tuple[Segment, ...]:
    charge = length - mesh.nodes[np.unique(mesh.cells[mesh.part == Part.CHARGE]), 2]
    front, back = float(charge.min()), float(charge.max())
    slack = 1e-6 * length
    if wanted is not None and any(isinstance(entry, Segment) for entry in wanted):
        given = [entry for entry in wanted if isinstance(entry, Segment)]
        return check_segments(given, length, f"{path}: segments")
    if wanted is not None:
        cuts = [float(entry) for entry in wanted if not isinstance(entry, Segment)]
        if any(not 0.0 < cut < length for cut in cuts) or any(b <= a for a, b in pairwise(cuts)):
            raise InputError(
                f"{path}: segments = {cuts} m; stations increasing between 0 and {length:.6g} m are expected"
            )
    else:
        cuts = [float(cut) for cut in np.linspace(front, back, WALL_PIECES + 1)]
        cuts = [cut for cut in cuts if slack < cut < length - slack]
    stations = [0.0, *cuts, length]
    pieces = []
    for number, (low, high) in enumerate(pairwise(stations), start=1):
        kind: SegmentKind = "nose" if high <= front + slack else "base" if low >= back - slack else "wall"
        pieces.append(Segment(f"{kind} {number}" if kind == "wall" else kind, low, high, kind))
    return check_segments(pieces, length, f"{path}: segments")
