"""Checks of arguments in SI units: a string such as "7 m" is refused, and the message names the unit needed.

The flight is a library of numbers; units are read by the case file of fragfield alone.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flight.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["real_array", "require_number", "require_numbers"]

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


def require_numbers(owner: str, found: object, units: dict[str, str]) -> None:
    """Refuse attributes that are not numbers.

    Parameters
    ----------
    owner : str
        What has the attributes, in messages: "witness ring".
    found : object
        The object with the attributes.
    units : dict
        The unit of every attribute by its name: "m", "kg/m3", or "" for a plain number.

    Raises
    ------
    InputError
        With owner, name, what was found and what is needed.
    """
    for name, unit in units.items():
        require_number(owner, name, getattr(found, name), unit)


def require_number(owner: str, name: str, value: object, unit: str) -> None:
    """Refuse one value that is not a number; as `require_numbers`."""
    single = np.ndim(value) == 0 if isinstance(value, np.ndarray | np.generic) else True
    kind = np.asarray(value).dtype.kind if isinstance(value, int | float | np.ndarray | np.generic) else ""
    if not single or isinstance(value, bool | np.bool_) or kind not in ("i", "u", "f"):
        raise InputError(f"{owner}: {name} is {_shown(value)}; needed: {_UNITS[unit]}")


def real_array(owner: str, name: str, value: object, unit: str) -> NDArray[np.float64]:
    """Values of any shape as float64; texts among them are refused, also those that NumPy would read as numbers.

    Raises
    ------
    InputError
        Texts, or what NumPy cannot read as numbers.
    """
    try:
        found = np.asarray(value)
        if found.dtype.kind in "SU" or (
            found.dtype.kind == "O" and any(isinstance(one, str | bytes) for one in found.ravel().tolist())
        ):
            needed = _UNITS[unit].replace("a number", "numbers").replace("a plain number", "plain numbers")
            raise InputError(f"{owner}: {name} is {_shown(value)}; needed: {needed}")
        return np.asarray(found, dtype=np.float64)
    except (TypeError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{owner}: {name} cannot be read as numbers ({error})") from None


def _shown(value: object) -> str:
    text = repr(value)
    short = text if len(text) <= _MOST_SHOWN else f"{text[: _MOST_SHOWN - 3]}..."
    return f"the text {short}" if isinstance(value, str) else short
