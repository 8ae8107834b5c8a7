"""Checks of arguments in SI units: a string such as "7 m" is refused, and the message names the unit needed.

The flight is a library of numbers; units are read by the case file of fragfield alone.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Annotated

import numpy as np

from flight.errors import InputError
from fragfield_base.bounds import Bounds
from fragfield_base.inputs import PositiveLength

if TYPE_CHECKING:
    from collections.abc import Iterable

    from numpy.typing import NDArray

_STANDING = "obstacles, panels and buildings are smaller than 10 km and larger than 1 mm"
Size = Annotated[PositiveLength, Bounds(1e-3, 1e4, _STANDING)]
Thickness = Annotated[PositiveLength, Bounds(1e-3, 1e3, _STANDING)]

_UNITS = {
    "": "a plain number",
    "m": "metres as a number",
    "m2": "square metres as a number",
    "m/s": "metres per second as a number",
    "m/s2": "metres per second squared as a number",
    "kg": "kilograms as a number",
    "kg/m3": "kilograms per cubic metre as a number",
    "1/m2": "a number per square metre",
    "s": "seconds as a number",
    "J": "joules as a number",
    "Pa": "pascals as a number",
    "degrees": "degrees as a number",
}
_MOST_SHOWN = 60  # letters of a value in a message


def require_numbers(
    owner: str, found: object, units: dict[str, str], *, above: float | None = None, low: float | None = None
) -> None:
    """Refuse attributes of an object that are not numbers, or beyond bounds; `units` by their names."""
    for name, unit in units.items():
        require_number(owner, name, getattr(found, name), unit, above=above, low=low)


def require_number(
    owner: str, name: str, value: object, unit: str, *, above: float | None = None, low: float | None = None,
    high: float | None = None, below: float | None = None, finite: bool = False,
) -> None:  # fmt: skip
    """Refuse a value that is not a number, or beyond its bounds: InputError with what was found and what is needed.

    `owner` has the value and `name` is what it is called, in messages: "witness ring", "radius"; `unit` is "" for a
    plain number. Of the bounds `above` and `below` are exclusive; with any of them, or `finite`, the value must be
    finite.
    """
    single = np.ndim(value) == 0 if isinstance(value, np.ndarray | np.generic) else True
    kind = np.asarray(value).dtype.kind if isinstance(value, int | float | np.ndarray | np.generic) else ""
    if not single or isinstance(value, bool | np.bool_) or kind not in ("i", "u", "f"):
        raise InputError(f"{owner}: {name} is {_shown(value)}; needed: {_UNITS[unit]}")
    number = float(value)  # type: ignore[arg-type]
    bounds = (above, low, high, below)
    if not finite and bounds == (None,) * 4:
        return
    inside = (above is None or number > above) and (low is None or number >= low)
    inside = inside and (high is None or number <= high) and (below is None or number < below)
    if not (math.isfinite(number) and inside):
        raise InputError(f"{owner}: {name} is {f'{value} {unit}'.rstrip()}, {_allowed(*bounds)}")


def _allowed(above: float | None, low: float | None, high: float | None, below: float | None) -> str:
    if high is None and below is None:
        if above is None and low is None:
            return "needed: a finite number"
        bound = above if low is None else low
        word = "zero" if bound == 0.0 else f"{bound:g}"
        return f"needed: above {word}" if low is None else f"needed: {word} or more"
    lower = f"above {above:g}" if low is None else f"{low:g}"
    return f"allowed: {lower} to {high:g}" if below is None else f"allowed: {lower} to below {below:g}"


def number_of_parts(owner: str, name: str, width: float, whole: float) -> int:
    """How many parts of a width (degrees) make up a whole; raises InputError where it is no whole fraction of it."""
    require_number(owner, name, width, "degrees")
    count = round(whole / width) if width > 0.0 else 0
    if count < 1 or abs(count * width - whole) > 1e-9:
        raise InputError(f"{owner}: {name} is {width} degrees, needed: a whole fraction of {whole:g}, such as 5")
    return count


def real_array(
    owner: str, name: str, value: object, unit: str, shape: Iterable[int] | None = None
) -> NDArray[np.float64]:
    """Values as float64; texts among them are refused, also those that NumPy would read as numbers.

    With a `shape` they must have it and be finite. Raises InputError: texts, what NumPy cannot read as numbers, another
    shape, or a value that is not finite.
    """
    try:
        found = np.asarray(value)
        if found.dtype.kind in "SU" or (
            found.dtype.kind == "O" and any(isinstance(one, str | bytes) for one in found.ravel().tolist())
        ):
            needed = _UNITS[unit].replace("a number", "numbers").replace("a plain number", "plain numbers")
            raise InputError(f"{owner}: {name} is {_shown(value)}; needed: {needed}")
        found = np.asarray(found, dtype=np.float64)
    except (TypeError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{owner}: {name} cannot be read as numbers ({error})") from None
    if shape is not None and (found.shape != tuple(shape) or not np.isfinite(found).all()):
        words = " by ".join(str(size) for size in shape)
        raise InputError(f"{owner}: {name} is {_shown(value)}, needed: {words} finite numbers ({unit or 'no unit'})")
    return found


def _shown(value: object) -> str:
    text = repr(value)
    short = text if len(text) <= _MOST_SHOWN else f"{text[: _MOST_SHOWN - 3]}..."
    return f"the text {short}" if isinstance(value, str) else short
