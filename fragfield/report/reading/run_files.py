"""The content of a run directory, read from its files alone."""

from __future__ import annotations

from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.errors import InputError
from fragfield.files.stamped import read_stamped_json, stored_case_text
from fragfield.results.summary import Summary, read_summary
from fragfield.results.uncertainty import UncertaintyResult
from fragfield_base.arrays import numbers
from fragfield_base.burst_snapshot import FUZE, GEOMETRIES, NODE_ARRAYS
from fragfield_base.hdf5_files import reading

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from contextlib import AbstractContextManager

    import h5py
    from numpy.typing import NDArray

    from burst_fenicsx.files.revolve import Revolution
    from flight.hazard.ensemble import EnsembleHazard
    from fragfield.case import CaseTable
    from fragfield.case.tables.flight import HazardTable
    from fragfield.case.tables.site import DocumentTable
    from fragfield.results.site import Witness
    from transition.placement.mirroring import SymmetryPlane


STAGE_FILES = {
    "burst": "burst_snapshot.h5",
    "break-up": "fragments.h5",
    "flight": "landing.h5",
}
"""File that shows that a stage has been run."""

_LANDED = 1  # of flight's Status
_PROVENANCE_SKIPPED = ("format", "format_version", "time", "geometry")


@dataclass(frozen=True, repr=False)
class RoundTables:
    """One round at the end of the burst: attributes, and its tables as structured arrays (SI)."""

    attributes: dict[str, Any]
    segments: NDArray[Any]
    along: NDArray[Any]

    @property
    def name(self) -> str:
        """Name of the round."""
        return str(self.attributes.get("name", ""))

    def __repr__(self) -> str:
        return f"<RoundTables {self.name!r}: {len(self.segments)} segments, {len(self.along)} stations>"


@dataclass
class RunFiles:
    """All that the report and the pictures show of a run. Anything not yet computed is empty or None."""

    folder: Path
    case: CaseTable | None = None
    """As resolved; None where the directory holds none."""
    case_text: str = ""
    summary: Summary = field(default_factory=Summary)
    study: UncertaintyResult | None = None
    """Of a study of this run."""
    provenance: dict[str, str] = field(default_factory=dict)
    burst_time: float | None = None
    geometry: str = "3d"
    """Of the burst: "3d" or "axisymmetric"."""
    rounds: list[RoundTables] = field(default_factory=list)
    planes: list[SymmetryPlane] = field(default_factory=list)
    """Planes of symmetry, behind which mirrored rounds stand."""
    history: dict[str, NDArray[np.float64]] = field(default_factory=dict)
    nodes: dict[str, NDArray[np.float64]] = field(default_factory=dict)
    cells: dict[str, NDArray[Any]] = field(default_factory=dict)
    fragments: dict[str, NDArray[Any]] = field(default_factory=dict)
    landing: NDArray[Any] | None = None
    ensemble: EnsembleHazard | None = None
    witness_ensemble: dict[str, NDArray[Any]] = field(default_factory=dict)
    """Hits by realisation and sector, by the name of the witness surface."""
    revolution: Revolution | None = None
    """How the meridian of an axisymmetric burst is revolved; made when it is first drawn."""

    @property
    def is_axisymmetric(self) -> bool:
        """Whether the burst's cells are quadrilaterals of a meridian."""
        return self.geometry == "axisymmetric"

    @property
    def missing(self) -> list[str]:
        """Stages that have not been run."""
        present = {"burst": bool(self.nodes), "break-up": bool(self.fragments), "flight": self.landing is not None}
        return [stage for stage in self.stages if not present[stage]]

    @property
    def stages(self) -> list[str]:
        """Stages that this directory is to hold: the flight alone where the fragments are from a file."""
        return ["flight"] if self.fragments_file is not None else list(STAGE_FILES)

    @property
    def witnesses(self) -> Sequence[Witness]:
        """The witness surfaces' part of the summary."""
        return self.summary.witness or ()

    @property
    def title(self) -> str:
        """Title of the case, else the folder's name."""
        own = self.case.title if self.case is not None else ""
        return own or self.summary.title or self.folder.resolve().name

    @property
    def criteria(self) -> HazardTable:
        """What counts as hazardous; the schema's defaults where the directory holds no case."""
        from fragfield.case.tables.flight import HazardTable

        return self.case.hazard if self.case is not None else HazardTable()

    @property
    def landed(self) -> NDArray[Any]:
        """Rows of the landings that reached the ground; none while the flight has not been run."""
        return np.empty(0) if self.landing is None else self.landing[self.landing["status"] == _LANDED]

    @property
    def document(self) -> DocumentTable:
        """Number, revision and names; empty texts where the directory holds no case."""
        from fragfield.case.tables.site import DocumentTable

        return self.case.document if self.case is not None else DocumentTable()

    @property
    def cell_size(self) -> float | None:
        """Target edge length of the cells (m); None where no burst is described."""
        return self.case.burst.cell_size if self.case is not None and self.case.burst is not None else None

    @property
    def fragments_file(self) -> str | None:
        """Name of the file whose fragments were flown instead of those of a burst; None of a run with its own."""
        return (self.summary.flight and self.summary.flight.fragments_file) or None


def read_run(folder: Path | str, *, flown: bool = True, case: bool = True) -> RunFiles:
    """Read a run directory.

    Parameters
    ----------
    folder : Path
        Directory written by `fragfield run`, or by some of its stages.
    flown, case : bool
        Whether to read the flight, and the case: a picture needs neither, and is drawn while the fragments still fly.

    Returns
    -------
    RunFiles
        Stages that have not been run are left empty.

    Raises
    ------
    InputError
        There is no such directory, it holds nothing of a run, or a file is damaged.
    """
    root = Path(folder)
    if not root.is_dir():
        raise InputError(f"{root}: no such run directory; give a directory written by `fragfield run`")
    run = RunFiles(root)
    known = ["case.toml", "summary.json", *STAGE_FILES.values()]
    if not any((root / name).is_file() for name in known):
        raise InputError(f"{root}: not a run directory, it contains none of the files ({', '.join(known)})")
    _read_texts(run, case=case)
    _read_snapshot(run)
    _read_fragments(run)
    if flown:
        _read_landing(run)
    return run


def _read_texts(run: RunFiles, *, case: bool) -> None:
    if (path := run.folder / "summary.json").is_file():
        run.summary = read_summary(read_stamped_json(path), path)
    if (path := run.folder / "uncertainty.json").is_file():
        try:
            run.study = UncertaintyResult.of_stage(read_stamped_json(path))
        except InputError as error:
            raise InputError(f"{path}: another version wrote it ({error}); run `fragfield uncertainty` again") from None
    if case and (path := run.folder / "case.toml").is_file():
        from fragfield.case import read_resolved

        run.case_text = stored_case_text(path)
        run.case = read_resolved(path)


def _open(path: Path) -> AbstractContextManager[h5py.File]:
    return reading(path, InputError, "run the stage that writes it again")


def _note_provenance(run: RunFiles, attributes: Mapping[str, object]) -> None:
    for key, value in attributes.items():
        if key not in _PROVENANCE_SKIPPED:
            run.provenance.setdefault(key, value.decode() if isinstance(value, bytes) else str(value))


def _read_snapshot(run: RunFiles) -> None:
    with _stage_file(run, "burst", "burst snapshot") as file:
        if file is None:
            return
        run.burst_time = float(file.attrs["time"])
        run.geometry = str(_plain(file.attrs.get("geometry", "3d")))
        run.nodes, run.cells = _mesh(file, str(run.folder / STAGE_FILES["burst"]), GEOMETRIES.get(run.geometry, 4))
        run.history = {name: data[()] for name, data in file.get("history", {}).items()}
        for name in sorted(file["rounds"], key=int):
            group = file["rounds"][name]
            attributes = {key: _plain(value) for key, value in group.attrs.items()}
            run.rounds.append(RoundTables(attributes, _strings(group["segments"][()]), group["along"][()]))
        run.planes = [_plane(group) for group in file.get("planes", {}).values()]


@contextmanager
def _stage_file(run: RunFiles, stage: str, what: str) -> Iterator[h5py.File | None]:
    """The file of a stage, open for reading, or None where there is none; notes its provenance.

    Raises InputError: the block does not find all that it looks for in the file.
    """
    path = run.folder / STAGE_FILES[stage]
    if not path.is_file():
        yield None
        return
    with _open(path) as file:
        try:
            _note_provenance(run, file.attrs)
            yield file
        except (KeyError, OSError) as error:
            raise InputError(f"{path}: not a complete {what}: {error}; run `fragfield {stage}` again") from error


def _mesh(file: h5py.File, where: str, corners: int) -> tuple[dict[str, Any], dict[str, Any]]:
    """Arrays of nodes and of cells: one length each, and no cell that names a node, part or round that is not there."""
    for name in (*(f"nodes/{name}" for name in NODE_ARRAYS), "cells/nodes", "rounds"):
        if name not in file:
            raise KeyError(f"{name} is missing")
    first = numbers(file, f"nodes/{NODE_ARRAYS[0]}", InputError, where, shape=(None, 3), finite=True)
    nodes = {NODE_ARRAYS[0]: first}
    for name in NODE_ARRAYS[1:]:
        nodes[name] = numbers(file, f"nodes/{name}", InputError, where, shape=first.shape, finite=True)
    most = {"nodes": len(first) - 1, "part": FUZE, "round": len(file["rounds"]) - 1}
    shape = (None, corners)
    found = numbers(
        file, "cells/nodes", InputError, where, kind="whole numbers", shape=shape, minimum=0, maximum=most["nodes"]
    )
    cells = {"nodes": found}
    for name, data in file["cells"].items():
        if name in ("part", "round"):
            cells[name] = numbers(
                file, f"cells/{name}", InputError, where, kind="whole numbers", shape=(len(found),), minimum=0,
                maximum=most[name],
            )  # fmt: skip
        elif name != "nodes":
            if getattr(data, "shape", ())[:1] != (len(found),):
                raise InputError(f"{where}: /cells/{name} has not one value for each of {len(found)} cells")
            cells[name] = data[()]
    return nodes, cells


def _plane(group: h5py.Group) -> SymmetryPlane:
    from transition.placement.mirroring import SymmetryPlane

    x, y, z = np.asarray(group.attrs["point"], dtype=float).tolist()
    normal = np.asarray(group.attrs["normal"], dtype=float)
    along_x, along_y, along_z = (normal / np.linalg.norm(normal)).tolist()
    return SymmetryPlane(str(_plain(group.attrs["name"])), (x, y, z), (along_x, along_y, along_z))


def _read_fragments(run: RunFiles) -> None:
    with _stage_file(run, "break-up", "fragment file") as file:
        if file is None:
            return
        where = str(run.folder / STAGE_FILES["break-up"])
        number = len(numbers(file, "fragments/mass", InputError, where, shape=(None,), finite=True))
        run.fragments = {
            name: numbers(file, f"fragments/{name}", InputError, where, shape=(number, *more), finite=True)
            for name, more in (
                ("mass", ()), ("position", (3,)), ("velocity", (3,)), ("shape_factor", ()), ("round", ()),
                ("segment", ()),
            )
        }  # fmt: skip


def _read_landing(run: RunFiles) -> None:
    path = run.folder / STAGE_FILES["flight"]
    if not path.is_file():
        return
    from flight.files.hdf5 import read_table

    run.landing = read_table(path, "landing")[0]
    with _open(path) as file:
        _note_provenance(run, file.attrs)
    if (path := run.folder / "ensemble.h5").is_file():
        from flight.files.ensemble import read_ensemble

        run.ensemble, run.witness_ensemble = read_ensemble(path)


def _plain(value: object) -> object:
    if isinstance(value, bytes):
        return value.decode()
    return value.item() if isinstance(value, np.generic) else value


def _strings(table: NDArray[Any]) -> NDArray[Any]:
    """Decode the variable-length strings that h5py returns as bytes."""
    for name in table.dtype.names or ():
        if table.dtype[name].kind == "O":
            table[name] = [item.decode() if isinstance(item, bytes) else item for item in table[name]]
    return table
