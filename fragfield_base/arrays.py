"""Checks of arrays before they are taken: HDF5's by kind, shape, range and finite values; counts by group of mass."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    import h5py


_KINDS = {"numbers": "fiub", "whole numbers": "iub"}


def group_of(file: h5py.Group, name: str) -> h5py.Group | None:
    """A group by its name; None where there is none, or something else of that name."""
    found = file.get(name)
    return found if hasattr(found, "keys") else None


def numbers(
    file: h5py.Group,
    name: str,
    error: type[Exception],
    where: str,
    *,
    kind: str = "numbers",
    shape: tuple[int | None, ...] | None = None,
    finite: bool = False,
    minimum: float | None = None,
    maximum: float | None = None,
) -> NDArray[Any]:
    """Read an array of numbers.

    Raises `error` with `where` (the file), the name, what was found and what is needed, unless its type is of `kind`
    ("numbers" or "whole numbers"), its axes are as long as in `shape` (None: any), it is `finite` where that is asked
    for, and within `minimum` and `maximum`, inclusive.
    """
    full = f"{file.name.rstrip('/')}/{name}"
    data = file.get(name)
    if data is None:
        raise error(f"{where}: {full} missing; the file is cut off")
    if not hasattr(data, "shape") or data.shape is None:
        raise error(f"{where}: {full} is no array; needed: {kind}")
    if data.dtype.kind not in _KINDS[kind]:
        raise error(f"{where}: {full} holds {data.dtype}; needed: {kind}")
    if shape is not None and (
        len(shape) != len(data.shape)
        or any(need not in (None, found) for need, found in zip(shape, data.shape, strict=True))
    ):
        raise error(f"{where}: {full} has shape {data.shape}; needed: {tuple('n' if n is None else n for n in shape)}")
    values = data[()]
    if finite and values.size and not np.isfinite(values).all():
        raise error(f"{where}: {full} holds a value that is not finite")
    if values.size and (
        (minimum is not None and values.min() < minimum) or (maximum is not None and values.max() > maximum)
    ):
        found, bounds = (values.min(), values.max()), (minimum, maximum)
        raise error(
            f"{where}: {full} holds values from {found[0]:g} to {found[1]:g}; allowed: {bounds[0]} to {bounds[1]}"
        )
    return np.asarray(values)


def texts(file: h5py.Group, name: str, error: type[Exception], where: str) -> list[str]:
    """Read a list of texts."""
    data = file[name]
    if not hasattr(data, "shape") or data.dtype.kind not in "OS" or len(data.shape) != 1:
        raise error(f"{where}: {data.name} is no list of texts")
    return [text_of(one) for one in data[()].tolist()]


def text_of(value: object) -> str:
    """A text as h5py gives it."""
    return value.decode("utf-8", errors="replace") if isinstance(value, bytes) else str(value)


def number_of(value: object) -> float:
    """A number of an attribute; NaN where it is none."""
    try:
        return float(np.asarray(value).item())  # type: ignore[arg-type,unused-ignore]
    except (TypeError, ValueError):
        return float("nan")


_ROUNDING = 1e-3  # of a mass as a test's table prints it


def group_outside(number: ArrayLike, mass: ArrayLike, low: ArrayLike, high: ArrayLike) -> int | None:
    """First group whose pieces together are lighter or heavier than its ends allow; None where all fit.

    All (k,): pieces of each group, what they weigh together (kg), and its ends (kg), of which `high` may be infinite.
    """
    number, mass, low, high = (np.asarray(one, dtype=np.float64) for one in (number, mass, low, high))
    most = np.where(number > 0.0, np.where(number > 0.0, number, 1.0) * high, 0.0)
    bad = (mass < (1.0 - _ROUNDING) * number * low) | (mass > (1.0 + _ROUNDING) * most)
    return int(np.argmax(bad)) if bad.any() else None
