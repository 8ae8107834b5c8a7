"""The burst as one time series for ParaView: XDMF beside HDF5, all fields on the moving mesh.

dolfinx writes one temporal collection a function and averages some cell fields to the nodes; this writer keeps
every field of a time in one grid. It needs neither dolfinx nor MPI: arrays are handed over gathered, on one rank.
"""

from __future__ import annotations

from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from burst_fenicsx.errors import InputError
from fragfield_base.hdf5_files import creating, reading
from fragfield_base.writing import described, flush_folder, replacing
from fragfield_base.xdmf import quoted, stamped_xdmf

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    import h5py
    from numpy.typing import ArrayLike, NDArray


FORMAT = "fragfield burst series"
SIX_COMPONENTS = ("xx", "yy", "zz", "xy", "yz", "zx")
"""Order in which a symmetric tensor of six columns is understood."""

_TO_MATRIX = (0, 3, 5, 3, 1, 4, 5, 4, 2)  # columns of SIX_COMPONENTS, row by row of the 3x3 matrix
_TOPOLOGY = {8: "Hexahedron", 4: "Quadrilateral"}
_AGAIN = "delete checkpoint.h5 to compute the burst again from its start"
_REAL = np.dtype(np.float32)  # of fields; times and positions keep 8 bytes
_KIND = {1: "Scalar", 3: "Vector", 9: "Tensor"}


class TimeSeries:
    """Writer of `<path>.xdmf` and `<path>/0000.h5`, `0001.h5`, ...: one temporal collection of grids, a file a state.

    The grids are of hexahedra, or of quadrilaterals; the first file holds the cells too. Every file is written once and
    whole, then the XDMF file is replaced in one move. A run that is interrupted, killed or finds the disk full
    therefore keeps everything written before.

    Parameters
    ----------
    path : where to write, without suffix, for example `run/burst`.
    cells : array (m, 8) or (m, 4) of int
        Nodes of each hexahedron or quadrilateral, in VTK order.
    provenance : optional, written as attributes of the first file.
    resume_at : float, optional
        Continue the files of an earlier run from this time (s): outputs after it are dropped, none before it.

    Raises
    ------
    InputError
        The folder cannot be written, the cells have another shape, or the files to continue hold another mesh.
    """

    def __init__(
        self,
        path: Path | str,
        cells: ArrayLike,
        provenance: Mapping[str, str] | None = None,
        *,
        resume_at: float | None = None,
    ) -> None:
        base = Path(path)
        self.xdmf_path = base.with_name(base.name + ".xdmf")
        self.folder = base
        self._cells = _checked_cells(cells)
        self._nodes: int | None = None
        self._names: tuple[tuple[str, ...], tuple[str, ...]] | None = None
        self._grids: list[str] = []
        self._times: list[float] = []
        self._provenance = dict(provenance or {})
        if resume_at is not None:
            self._continue(resume_at)
        self._write_xdmf()

    @property
    def times(self) -> tuple[float, ...]:
        """Times written so far (s)."""
        return tuple(self._times)

    def rounded(self, fields: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
        """Fields in the precision in which they are stored; what is done to them afterwards costs half as much."""
        return {
            name: values.astype(_REAL, copy=False) if name != "position" and values.dtype.kind == "f" else values
            for name, values in fields.items()
        }

    def write(
        self,
        time: float,
        positions: ArrayLike,
        point_data: Mapping[str, ArrayLike] | None = None,
        cell_data: Mapping[str, ArrayLike] | None = None,
    ) -> None:
        """Add one output.

        Parameters
        ----------
        time : simulated time (s), later than the one before.
        positions : array (n, 3)
            Nodes now (m).
        point_data, cell_data : optional, fields of n or m rows: scalars (n,), vectors (n, 3), tensors (n, 3, 3), (n, 9)
            or, symmetric, (n, 6) in the order of `SIX_COMPONENTS`. Every output carries the same names.

        Raises
        ------
        InputError
            Time does not grow, an array has the wrong shape or name, or the files cannot be written; the series is as
            it was then.
        """
        if not np.isfinite(time) or (self._times and time <= self._times[-1]):
            before = f", the output before is at {self._times[-1]:g} s" if self._times else ""
            raise InputError(f"{self.xdmf_path.name}: output at {time:g} s{before}; times must be finite and grow")
        places = self._checked_positions(positions)
        points = {name: self._field("point", name, data, len(places)) for name, data in (point_data or {}).items()}
        fields = {name: self._field("cell", name, data, len(self._cells)) for name, data in (cell_data or {}).items()}
        names = (tuple(sorted(points)), tuple(sorted(fields)))
        if self._names is not None and names != self._names:
            changed = sorted(set(names[0]) ^ set(self._names[0])) + sorted(set(names[1]) ^ set(self._names[1]))
            raise InputError(f"{self.xdmf_path.name}: every output carries the same fields; differing: {changed}")

        arrays = {
            "position": places,
            **{f"point/{name}": points[name] for name in sorted(points)},  # as HDF5 gives them back
            **{f"cell/{name}": fields[name] for name in sorted(fields)},
        }
        self._save(len(self._times), float(time), arrays)
        self._names = names
        self._nodes = len(places)
        self._grids.append(self._grid(len(self._times), float(time), arrays))
        self._times.append(float(time))
        self._write_xdmf()

    def flush(self) -> None:
        """Make what is written survive a failure of the machine: before a checkpoint, from which a run goes on."""
        for folder in (self.folder, self.xdmf_path.parent):
            flush_folder(folder)

    def _file(self, number: int) -> Path:
        return self.folder / f"{number:04d}.h5"

    def _save(self, number: int, time: float, arrays: Mapping[str, NDArray[Any]]) -> None:
        try:
            self.folder.mkdir(exist_ok=True)
        except OSError as found:
            raise InputError(described(self.folder, found)) from None
        with creating(self._file(number), InputError, durable=False) as file:
            file.attrs["format"] = FORMAT
            file.attrs["format_version"] = 2
            file.attrs["time"] = time
            if number == 0:
                for name, text in self._provenance.items():
                    file.attrs[name] = str(text)
                file["cells"] = self._cells
            for key, data in arrays.items():
                file[key] = data

    def _continue(self, resume_at: float) -> None:
        """Take up the states up to a time, and drop the later ones."""
        if not self._file(0).is_file():
            raise InputError(f"cannot continue {self.folder}: there is no such series")
        number = 0
        while self._file(number).is_file():
            with reading(self._file(number), InputError, _AGAIN) as file:
                time = float(file.attrs["time"])
                if time > resume_at * (1 + 1e-12):
                    break
                if number == 0 and not np.array_equal(file["cells"], self._cells):
                    raise InputError(f"cannot continue {self.folder}: it is not the time series of this mesh")
                point, cell = (sorted(file.get(where, ())) for where in ("point", "cell"))
                keys = [*(f"point/{name}" for name in point), *(f"cell/{name}" for name in cell)]
                self._names = (tuple(point), tuple(cell))
                self._nodes = len(file["position"])
                self._grids.append(self._grid(number, time, {key: file[key] for key in ("position", *keys)}))
                self._times.append(time)
            number += 1
        while self._file(number).is_file():
            self._file(number).unlink()
            number += 1

    def _checked_positions(self, positions: ArrayLike) -> NDArray[np.float64]:
        places = np.ascontiguousarray(positions, dtype=np.float64)
        if places.ndim != 2 or places.shape[1] != 3:
            raise InputError(f"{self.xdmf_path.name}: positions have shape {places.shape}, expected (nodes, 3)")
        if self._cells.size and self._cells.max() >= len(places):
            raise InputError(
                f"{self.xdmf_path.name}: the cells name node {self._cells.max()}, but there are {len(places)} positions"
            )
        if self._nodes is not None and len(places) != self._nodes:
            raise InputError(f"{self.xdmf_path.name}: {len(places)} positions, the outputs before have {self._nodes}")
        return places

    def _field(self, centre: str, name: str, values: ArrayLike, rows: int) -> NDArray[Any]:
        data = np.asarray(values)
        if not name or "/" in name:
            raise InputError(f"{self.xdmf_path.name}: {name!r} cannot name a field; use a word without '/'")
        if data.ndim == 0 or len(data) != rows or data[:1].size not in (1, 3, 6, 9) or data.dtype.kind not in "buif":
            raise InputError(
                f"{self.xdmf_path.name}: {centre} field {name!r} has shape {data.shape} and type {data.dtype}; "
                f"expected numbers in ({rows},), ({rows}, 3), ({rows}, 6), ({rows}, 9) or ({rows}, 3, 3)"
            )
        kind = _REAL if data.dtype.kind == "f" else np.dtype(np.int32)
        data = data.reshape(rows, -1).astype(kind, order="C", copy=False)
        if data.shape[1] == 6:
            data = np.take(data, _TO_MATRIX, axis=1)
        return data[:, 0] if data.shape[1] == 1 else data

    def _grid(self, number: int, time: float, arrays: Mapping[str, NDArray[Any] | h5py.Dataset]) -> str:
        kind = _TOPOLOGY[self._cells.shape[1]]
        lines = [
            f'      <Grid Name="burst" GridType="Uniform"><Time Value="{time!r}"/>',
            f'        <Topology TopologyType="{kind}" NumberOfElements="{len(self._cells)}">',
            f"          {self._item(0, 'cells', self._cells)}</Topology>",
        ]
        for key, data in arrays.items():
            item = self._item(number, key, data)
            if key == "position":
                lines.append(f'        <Geometry GeometryType="XYZ">{item}</Geometry>')
                continue
            centre, name = key.split("/", 1)
            columns = data.shape[1] if len(data.shape) > 1 else 1
            lines.append(
                f'        <Attribute Name={quoted(name)} AttributeType="{_KIND[columns]}" '
                f'Center="{"Node" if centre == "point" else "Cell"}">{item}</Attribute>'
            )
        return "\n".join([*lines, "      </Grid>"])

    def _item(self, number: int, key: str, data: NDArray[Any] | h5py.Dataset) -> str:
        size = " ".join(str(length) for length in data.shape)
        kind = "Float" if data.dtype.kind == "f" else "Int"
        place = quoted(f"{self.folder.name}/{self._file(number).name}:/{key}")[1:-1]
        return (
            f'<DataItem Dimensions="{size}" NumberType="{kind}" Precision="{data.dtype.itemsize}" Format="HDF">'
            f"{place}</DataItem>"
        )

    def _write_xdmf(self) -> None:
        text = "\n".join(
            [
                '<?xml version="1.0" encoding="utf-8"?>',
                '<Xdmf Version="3.0">',
                "  <Domain>",
                '    <Grid Name="burst" GridType="Collection" CollectionType="Temporal">',
                *self._grids,
                "    </Grid>",
                "  </Domain>",
                "</Xdmf>",
                "",
            ]
        )
        with replacing(self.xdmf_path, InputError, durable=False) as stream:
            stream.write(stamped_xdmf(text).encode())


def _checked_cells(cells: ArrayLike) -> NDArray[np.int64]:
    found = np.asarray(cells)
    if found.ndim != 2 or found.shape[1] not in _TOPOLOGY or found.dtype.kind not in "ui":
        raise InputError(
            f"cells have shape {found.shape} and type {found.dtype}; "
            "expected whole numbers of shape (cells, 8) or (cells, 4)"
        )
    return np.ascontiguousarray(found, dtype=np.int64)


class Background:
    """A thread that does what it is given, in order, with at most so many pieces waiting or under way.

    The work may use nothing that changes meanwhile, and no kernel that shares its loop among threads.
    """

    def __init__(self, most: int = 1) -> None:
        self._pool = ThreadPoolExecutor(1, thread_name_prefix="files")
        self._pending: list[Future[None]] = []
        self._most = most

    def begin(self, work: Callable[[], None]) -> None:
        """Give it a piece of work; raises what an earlier one raised."""
        self.make_room()
        self._pending.append(self._pool.submit(work))

    def make_room(self) -> None:
        """Wait until it can take another piece; raises what one raised, once."""
        while len(self._pending) >= self._most:
            self._pending.pop(0).result()

    def wait(self) -> None:
        """Wait until all is done; raises what a piece raised, once."""
        while self._pending:
            self._pending.pop(0).result()

    def close(self) -> None:
        """End the thread when it is done; what it raised without anyone waiting is lost."""
        self._pool.shutdown()
