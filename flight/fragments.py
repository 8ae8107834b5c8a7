"""Fragments: the data that any source of fragments hands to the flight."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.arguments import real_array
from flight.errors import InputError
from flight.files.hdf5 import open_checked, put_texts, write_attributes
from flight.files.text_tables import import_hint, in_columns_of, read_columns, write_columns
from flight.shape import DEFAULT_SHAPE_FACTOR, Shape
from fragfield_base.arrays import group_of, numbers, texts
from fragfield_base.errors import names_allowed, nearest_name
from fragfield_base.hdf5_files import creating

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import ArrayLike, NDArray


# what can be, in a file or an array; some of the rest would never land
_POSSIBLE = {"mass": (1e-15, 1e6), "shape_factor": (1e-3, 1e9), "position": (-1e7, 1e7), "velocity": (-5e4, 5e4)}
_FORMAT = "fragfield fragments"
_FORMAT_VERSION = 1
ARRAYS = ("mass", "position", "velocity", "shape_factor", "round", "segment")

REQUIRED_COLUMNS = ("mass_kg", "vx_m_s", "vy_m_s", "vz_m_s")
CSV_COLUMNS = (
    "id", "round", "segment", "mass_kg", "x_m", "y_m", "z_m", "vx_m_s", "vy_m_s", "vz_m_s", "speed_m_s",
    "shape_factor_kg_m3",
)  # fmt: skip
_UNITS = {"mass": "kg", "position": "m", "velocity": "m/s", "shape_factor": "kg/m3"}


@dataclass(frozen=True, eq=False, repr=False, init=False)
class Fragments:
    """Fragments at launch.

    Attributes
    ----------
    mass : (n,) float64
        Mass (kg), above zero.
    position : (n, 3) float64
        Place (m), z up.
    velocity : (n, 3) float64
        Velocity (m/s).
    shape_factor : (n,) float64
        k in the presented area A = (m/k)^(2/3) (kg/m3), above zero; see `flight.shape`.
    round, segment : (n,) int32
        The round and its segment a fragment comes from (-1: unknown).
    round_names : tuple of str
        Names of the rounds by their number; empty where they are not known.

    Raises
    ------
    InputError
        On shapes that do not fit, or a value that cannot be: a wrong unit, or not a finite number.
    """

    mass: NDArray[np.float64]
    position: NDArray[np.float64]
    velocity: NDArray[np.float64]
    shape_factor: NDArray[np.float64]
    round: NDArray[np.int32]
    segment: NDArray[np.int32]
    round_names: tuple[str, ...] = ()

    def __init__(
        self,
        mass: ArrayLike,
        position: ArrayLike,
        velocity: ArrayLike,
        shape_factor: ArrayLike = DEFAULT_SHAPE_FACTOR,
        round: ArrayLike = 0,  # noqa: A002 - the field's own word
        segment: ArrayLike = 0,
        round_names: Sequence[str] = (),
    ) -> None:
        """Fragments from anything NumPy can read; scalars and one (3,) vector stand for all of them.

        The number of fragments is the length of the first array that is not single, in the order mass, velocity,
        position and the rest. Arrays of the kinds above are taken as they are, not copied.
        """
        given = {"mass": mass, "velocity": velocity, "position": position, "shape_factor": shape_factor}
        given |= {"round": round, "segment": segment}
        arrays = {name: _as_array(name, value) for name, value in given.items()}
        full = {name: 2 if name in ("position", "velocity") else 1 for name in arrays}
        lengths = [len(array) for name, array in arrays.items() if array.ndim == full[name] and len(array) != 1]
        number = lengths[0] if lengths else 1
        for name, array in arrays.items():
            shape = (number, 3) if name in ("position", "velocity") else (number,)
            try:
                object.__setattr__(self, name, _spread(array, shape))
            except ValueError:
                raise InputError(
                    f"fragments: {name} has shape {array.shape}, but {number} fragments need {shape}"
                ) from None
        object.__setattr__(self, "round_names", tuple(round_names))
        _check(self)

    def __len__(self) -> int:
        return int(self.mass.size)

    def __repr__(self) -> str:
        if not len(self):
            return "<flight.Fragments: none>"
        low, high = float(self.speed.min()), float(self.speed.max())
        return f"<flight.Fragments: {len(self)}, {self.total_mass:.4g} kg, {low:.4g} to {high:.4g} m/s>"

    @property
    def speed(self) -> NDArray[np.float64]:
        """Speeds (n,) in m/s."""
        return np.asarray(np.sqrt(np.einsum("ij,ij->i", self.velocity, self.velocity)))

    @property
    def presented_area(self) -> NDArray[np.float64]:
        """Mean presented areas A = (m/k)^(2/3), (n,) in m2."""
        return np.asarray((self.mass / self.shape_factor) ** (2.0 / 3.0))

    @property
    def total_mass(self) -> float:
        """Mass of all fragments (kg)."""
        return float(self.mass.sum())

    @property
    def momentum(self) -> NDArray[np.float64]:
        """Momentum of all fragments (3,) in kg m/s."""
        return np.asarray(self.mass @ self.velocity)

    @property
    def kinetic_energy(self) -> float:
        """Kinetic energy of all fragments (J)."""
        return float(0.5 * self.mass @ self.speed**2)

    def select(self, which: ArrayLike | slice) -> Fragments:
        """Return the fragments named by a mask, a slice or by indices, in that order."""
        chosen = which if isinstance(which, slice) else np.asarray(which)
        if isinstance(chosen, np.ndarray) and chosen.size == 0:
            chosen = chosen.astype(np.int64)
        arrays = {name: np.ascontiguousarray(getattr(self, name)[chosen]) for name in ARRAYS}
        return Fragments(**arrays, round_names=self.round_names)

    def translated(self, shift: ArrayLike) -> Fragments:
        """The same fragments moved by a vector (3,) in m."""
        return replace(self, position=self.position + real_array("fragments", "shift", shift, "m"))

    def rotated(self, axis: ArrayLike, angle_deg: float, about: ArrayLike = (0.0, 0.0, 0.0)) -> Fragments:
        """The same fragments turned about a direction (3,), right-handed by degrees, through the point `about` (m)."""
        along, point = real_array("fragments", "axis", axis, "", (3,)), real_array("fragments", "about", about, "m")
        if not along.any():
            raise InputError("fragments: axis is [0, 0, 0], needed: a direction")
        x, y, z = along / np.linalg.norm(along)
        cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        angle = np.radians(angle_deg)
        turn = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * (cross @ cross)
        return replace(self, position=(self.position - point) @ turn.T + point, velocity=self.velocity @ turn.T)

    @classmethod
    def concatenate(cls, parts: Sequence[Fragments]) -> Fragments:
        """All fragments of several sets, one set after the other; names of rounds stay where no set names others."""
        if not parts:
            raise InputError("fragments: nothing to concatenate, the sequence is empty")
        arrays = {name: np.concatenate([getattr(part, name) for part in parts]) for name in ARRAYS}
        names = max((part.round_names for part in parts), key=len)
        agree = all(part.round_names == names[: len(part.round_names)] for part in parts)
        return cls(**arrays, round_names=names if agree else ())

    def write(self, path: str | Path, provenance: Mapping[str, str] | None = None) -> Path:
        """Write fragments.h5 (or .csv, by the ending); `provenance` goes into the attributes of the former."""
        path, arrays = Path(path), {name: getattr(self, name) for name in ARRAYS}
        if path.suffix.lower() == ".csv":
            return write_columns(path, fragment_columns(arrays))
        with creating(path, InputError) as file:
            write_attributes(file, _FORMAT, _FORMAT_VERSION, provenance or {})
            for name, values in arrays.items():
                file.create_dataset(f"fragments/{name}", data=values)
            if self.round_names:
                put_texts(file, "round_names", self.round_names)
        return path

    @classmethod
    def read(cls, path: str | Path) -> Fragments:
        """Read what `write` wrote, or a CSV file of one's own with at least mass_kg, vx_m_s, vy_m_s, vz_m_s.

        Raises
        ------
        InputError
            The file is missing, foreign, cut off, of a newer version, or holds what cannot be flown.
        """
        path = Path(path)
        arrays, names = (_read_csv(path), []) if path.suffix.lower() == ".csv" else _read_hdf5(path)
        try:
            return cls(**arrays, round_names=names)
        except InputError as error:
            raise InputError(f"{path}: {error}") from None


def _read_hdf5(path: Path) -> tuple[dict[str, NDArray[np.float64]], list[str]]:
    import h5py

    if path.suffix.lower() not in (".h5", ".hdf5") and path.is_file() and not h5py.is_hdf5(path):
        raise InputError(f"{path}: neither fragments in HDF5 (.h5) nor a .csv file{import_hint(path)}")
    with open_checked(path, _FORMAT, _FORMAT_VERSION) as file:
        group = group_of(file, "fragments")
        missing = [f"/fragments/{name}" for name in ARRAYS if group is None or name not in group]
        if missing:
            raise InputError(f"{path}: {', '.join(missing)} missing; the file is cut off or not a fragments file")
        arrays = {name: numbers(group, name, InputError, str(path)) for name in ARRAYS}
        names = texts(file, "round_names", InputError, str(path)) if "round_names" in file else []
    return arrays, names


def fragment_columns(arrays: Mapping[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Columns of fragments.csv by their names, which hold the units, from the `ARRAYS` of fragments."""
    velocity = arrays["velocity"]
    columns = [
        np.arange(len(arrays["mass"])),
        arrays["round"],
        arrays["segment"],
        arrays["mass"],
        *arrays["position"].T,
        *velocity.T,
        np.sqrt(np.einsum("ij,ij->i", velocity, velocity)),
        arrays["shape_factor"],
    ]
    return dict(zip(CSV_COLUMNS, columns, strict=True))


def _read_csv(path: Path) -> dict[str, NDArray[np.float64]]:
    columns = in_columns_of(path, read_columns(path), CSV_COLUMNS)
    missing = [name for name in REQUIRED_COLUMNS if name not in columns]
    if len(missing) == len(REQUIRED_COLUMNS) and not any(nearest_name(name, REQUIRED_COLUMNS) for name in columns):
        raise InputError(
            f"{path}: found the columns {', '.join(columns)}; needed: of fragments one by one "
            f"{', '.join(REQUIRED_COLUMNS)}, of an arena table zone_from_deg, zone_to_deg and others"
            f"{import_hint(path)}"
        )
    for name in columns:
        if name not in CSV_COLUMNS:
            raise InputError(f"{path}: unknown column {name!r}{names_allowed(name, CSV_COLUMNS)}")
    if missing:
        raise InputError(f"{path}: column {', '.join(missing)} missing; found {', '.join(columns)}")
    zero = np.zeros_like(columns["mass_kg"])
    arrays = {
        "mass": columns["mass_kg"],
        "position": np.stack([columns.get(name, zero) for name in ("x_m", "y_m", "z_m")], axis=1),
        "velocity": np.stack([columns[name] for name in ("vx_m_s", "vy_m_s", "vz_m_s")], axis=1),
    }
    for name, column in (("shape_factor", "shape_factor_kg_m3"), ("round", "round"), ("segment", "segment")):
        if column in columns:
            arrays[name] = columns[column]
    return arrays


def _as_array(name: str, value: object) -> NDArray[Any]:
    array = real_array("fragments", name, value, _UNITS.get(name, ""))
    if name not in ("round", "segment"):
        return array
    with np.errstate(invalid="ignore"):
        whole = array.astype(np.int32)
    if not np.array_equal(whole, array):
        raise InputError(f"fragments: {name} must hold whole numbers of 32 bits")
    return whole


def _spread(array: NDArray[Any], shape: tuple[int, ...]) -> NDArray[Any]:
    """An array of its own, or the same where it has the shape already."""
    return np.ascontiguousarray(array) if array.shape == shape else np.array(np.broadcast_to(array, shape), order="C")


def _check(fragments: Fragments) -> None:
    if fragments.round_names and len(fragments) and int(fragments.round.max()) >= len(fragments.round_names):
        raise InputError(
            f"fragments: round {int(fragments.round.max())} has no name; there are {len(fragments.round_names)} names"
        )
    for name, (low, high) in _POSSIBLE.items():
        value = getattr(fragments, name)
        each = value.reshape(len(value), value.size // max(len(value), 1))
        bad = ~((each >= low) & (each <= high)).all(axis=1)
        if bad.any():
            first = int(np.argmax(bad))
            more = f", and {int(bad.sum()) - 1} more" if bad.sum() > 1 else ""
            raise InputError(
                f"fragments: {name} of fragment {first} is {value[first]}{more}; needed: from {low:g} to {high:g} "
                f"{_UNITS[name]}"
            )


def shaped(fragments: Fragments, shape: Shape, seed: int = 0) -> Fragments:
    """Fragments with the shape factors that a model gives them; `seed` of what is drawn.

    Raises InputError: the shape is no model.
    """
    if not isinstance(shape, Shape):
        raise InputError(f"shape is {shape!r}, allowed: flight.shape.Mean, Lognormal or Box")
    return replace(fragments, shape_factor=shape.factors(np.stack([fragments.round, fragments.segment], axis=1), seed))
