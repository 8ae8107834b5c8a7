"""The end of a burst as burst_snapshot.h5 holds it: checked arrays of the casings, rounds, histories."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.errors import InputError
from fragfield_base.hdf5_files import reading

if TYPE_CHECKING:
    from pathlib import Path

    import h5py
    from numpy.typing import NDArray

    from fragfield.results.burst import Burst as BurstPart
    from transition.snapshot import Snapshot


@dataclass(frozen=True, kw_only=True)
class RoundTables:
    """One round at the end of the burst: what it is, and its tables as structured arrays (SI).

    `attributes` holds all that the file says of it.
    """

    name: str
    length: float
    position: NDArray[np.float64]
    axis: NDArray[np.float64]
    casing_mass: float
    charge_mass: float
    explosive: str
    profile: str
    segments: NDArray[Any]
    along: NDArray[Any]
    attributes: dict[str, Any]


@dataclass(frozen=True, repr=False, kw_only=True)
class Burst:
    """The end of a burst, from burst_snapshot.h5, and what led to it.

    Attributes
    ----------
    mesh : transition.Snapshot
        Time (s), nodes and cells of the casings, planes of symmetry.
    history : dict
        Over `time` (s): `mean_casing_speed` (m/s), `outer_diameter` (m), energies (J) and `energy_error`.
    rounds : list of RoundTables
        By round: `name`, `attributes`, and `segments` and `along` as structured arrays.
    """

    part: BurstPart | None
    mesh: Snapshot
    history: dict[str, NDArray[np.float64]]
    rounds: list[RoundTables]

    @property
    def summary(self) -> BurstPart:
        """The part of the summary: cells, steps, masses, speeds, energy and momentum errors."""
        if self.part is None:
            raise InputError("summary.json has no burst; run `fragfield burst` again")
        return self.part

    def __repr__(self) -> str:
        return f"<fragfield.Burst to {self.mesh.time * 1e6:.4g} us: {self.summary.cells} cells>"


def read_burst(path: Path, summary: BurstPart | None) -> Burst:
    """Read burst_snapshot.h5; raises InputError where it is damaged or incomplete."""
    from transition.errors import InputError as NotASnapshot
    from transition.snapshot import Snapshot

    with reading(path, InputError, "run the stage that writes it again") as file:
        try:
            groups = [file["rounds"][name] for name in sorted(file["rounds"], key=int)]
            return Burst(
                part=summary,
                mesh=Snapshot.read(path),
                history={name: data[()] for name, data in file.get("history", {}).items()},
                rounds=[_round(group) for group in groups],
            )
        except NotASnapshot as error:
            raise InputError(f"{error}; run `fragfield burst` again") from None
        except (KeyError, OSError) as error:
            raise InputError(f"{path}: not a complete burst snapshot: {error}; run `fragfield burst` again") from error


def _round(group: h5py.Group) -> RoundTables:
    of = {key: _plain(value) for key, value in group.attrs.items()}
    length, casing, charge = (float(of[key]) for key in ("length", "casing_mass", "charge_mass"))
    return RoundTables(
        name=str(of.get("name", "")), length=length, position=np.asarray(of["position"], dtype=np.float64),
        axis=np.asarray(of["axis"], dtype=np.float64), casing_mass=casing, charge_mass=charge,
        explosive=str(of["explosive"]), profile=str(of.get("profile") or ""),
        segments=_strings(group["segments"][()]), along=group["along"][()], attributes=of,
    )  # fmt: skip


def _plain(value: object) -> Any:  # noqa: ANN401 - of HDF5
    if isinstance(value, bytes):
        return value.decode()
    return value.item() if isinstance(value, np.generic) else value


def _strings(table: NDArray[Any]) -> NDArray[Any]:
    for name in table.dtype.names or ():
        if table.dtype[name].kind == "O":
            table[name] = [item.decode() if isinstance(item, bytes) else item for item in table[name]]
    return table
