"""Fragments: the data that any source of fragments hands to the flight."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.arguments import real_array
from flight.errors import InputError
from flight.files import fragments as files
from flight.shape import DEFAULT_SHAPE_FACTOR, Shape

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import ArrayLike, NDArray


# what can be, in a file or an array; some of the rest would never land
_POSSIBLE = {"mass": (1e-15, 1e6), "shape_factor": (1e-3, 1e9), "position": (-1e7, 1e7), "velocity": (-5e4, 5e4)}
ARRAYS = files.ARRAYS
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
        arrays = {name: getattr(self, name) for name in ARRAYS}
        return files.write(arrays, self.round_names, Path(path), provenance or {})

    @classmethod
    def read(cls, path: str | Path) -> Fragments:
        """Read what `write` wrote, or a CSV file of one's own with at least mass_kg, vx_m_s, vy_m_s, vz_m_s.

        Raises
        ------
        InputError
            The file is missing, foreign, cut off, of a newer version, or holds what cannot be flown.
        """
        arrays, names = files.read(Path(path))
        try:
            found = cls(**arrays, round_names=names)
        except InputError as error:
            raise InputError(f"{path}: {error}") from None
        return found


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
    source, number = "fragments", len(fragments)
    if fragments.round_names and number and int(fragments.round.max()) >= len(fragments.round_names):
        raise InputError(
            f"{source}: round {int(fragments.round.max())} has no name; there are {len(fragments.round_names)} names"
        )
    for name, (low, high) in _POSSIBLE.items():
        value = getattr(fragments, name)
        each = value.reshape(len(value), value.size // max(len(value), 1))
        _refuse(
            source, name, value, ~((each >= low) & (each <= high)).all(axis=1),
            f"from {low:g} to {high:g} {_UNITS[name]}",
        )  # fmt: skip


def shaped(fragments: Fragments, shape: Shape, seed: int = 0) -> Fragments:
    """Fragments with the shape factors that a model gives them; `seed` of what is drawn.

    Raises InputError: the shape is no model.
    """
    if not isinstance(shape, Shape):
        raise InputError(f"shape is {shape!r}, allowed: flight.shape.Mean, Lognormal or Box")
    return replace(fragments, shape_factor=shape.factors(np.stack([fragments.round, fragments.segment], axis=1), seed))


def _refuse(source: str, name: str, value: NDArray[Any], bad: NDArray[np.bool_], needed: str) -> None:
    if bad.any():
        first = int(np.argmax(bad))
        more = f", and {int(bad.sum()) - 1} more" if bad.sum() > 1 else ""
        raise InputError(f"{source}: {name} of fragment {first} is {value[first]}{more}; needed: {needed}")
