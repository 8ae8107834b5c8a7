"""Names and units of columns as tests have them, in English, German and French, and the quantities that they mean."""

from __future__ import annotations

import re
import tomllib
import unicodedata
from functools import lru_cache
from importlib import resources
from typing import NamedTuple

from fragfield.importing.sheet import QuestionError
from fragfield_base.units import Measure, UnitError, read_measure

__all__ = ["GROUPS", "QUANTITIES", "SIDES", "Head", "Quantity", "is_unit", "plain", "read_head", "unit_of"]

GROUPS = {"kg": "mass", "m/s": "speed", "rad": "angle", "m": "length", "kg/m^3": "density"}
"""What `--unit GROUP=...` calls all quantities of one dimension."""
SIDES = frozenset(("from", "to", "von", "bis", "de", "a", "min", "max", "lower", "upper", "unten", "oben"))
"""Names of columns that mean something only with that of their group."""
_LIKELY = {"kg": ("g", "kg", "grain"), "m/s": ("m/s", "ft/s"), "rad": ("deg", "rad"), "m": ("m", "mm", "ft")}


class Quantity(NamedTuple):
    """A quantity of our tables.

    Attributes
    ----------
    unit : str
        SI unit, empty of a number.
    names : tuple of str
        Plain names that mean it.
    """

    unit: str
    names: tuple[str, ...]

    @property
    def likely(self) -> tuple[str, ...]:
        """Units to choose from in a question."""
        return _LIKELY.get(self.unit, (self.unit,))


@lru_cache(maxsize=4096)
def plain(text: str) -> str:
    """A name in lower case without accents, signs and double spaces: "Stück / Zone" is "stueck zone"."""
    text = text.casefold()
    for letter, letters in (("ä", "ae"), ("ö", "oe"), ("ü", "ue"), ("ß", "ss"), ("ø", "oe"), ("θ", "theta"),
                            ("ϑ", "theta"), ("φ", "phi"), ("ϕ", "phi"), ("α", "alpha"), ("σ", "summe "),
                            ("∑", "summe "), ("º", " "), ("№", "number")):  # fmt: skip
        text = text.replace(letter, letters)
    text = "".join(one for one in unicodedata.normalize("NFKD", text) if not unicodedata.combining(one))
    return " ".join(re.sub(r"[^a-z0-9<>]+", " ", text).split())


def _quantities() -> dict[str, Quantity]:
    text = (resources.files("fragfield") / "data" / "table_names.toml").read_text(encoding="utf-8")
    return {name: Quantity(one["unit"], tuple(one["names"])) for name, one in tomllib.loads(text).items()}


QUANTITIES = _quantities()
"""Quantities that columns may hold, by the names of `--column`."""

_UNIT_WORDS = {
    "°": "deg", "grad": "grad?", "degre": "deg", "degres": "deg", "winkelgrad": "deg", "gr": "gr?", "mgr": "mg?",
    "gramm": "g", "gramme": "g", "grammes": "g", "kilogramm": "kg", "kilogramme": "kg", "grs": "grain", "gon": "gon",
    "ftps": "ft/s", "m s-1": "m/s", "m.s-1": "m/s", "m·s-1": "m/s", "m s⁻¹": "m/s", "m·s⁻¹": "m/s", "kmh": "km/h",
    "metres": "m", "zoll": "in", "pouces": "in", "radiant": "rad", "ounces": "oz", "lbm": "lb",
}  # fmt: skip
"""Units as units.py does not have them; those with a question mark have the meanings of `_ASKED`."""
_ASKED = {"grad?": ("deg", "gon"), "gr?": ("g", "grain"), "mg?": ("mg", "g")}


@lru_cache(maxsize=4096)
def _measure(unit: str) -> Measure | None:
    try:
        found = read_measure(f"1 {unit}")
    except UnitError:
        return None
    return found if any(found.powers) else None


def is_unit(text: str) -> bool:
    """Whether a text is a unit as a header may have it, ambiguous ones included."""
    return bool(text) and (
        text.casefold() in _UNIT_WORDS or _measure(text) is not None or _measure(text.lower()) is not None
    )


def unit_of(text: str, quantity: Quantity, place: str, name: str) -> float | None:
    """Factor from a unit to SI for a quantity; None where it is of another dimension.

    Raises
    ------
    QuestionError
        The unit has two meanings: "gr" is gram or grain, German "Grad" degree or gon, "Mg" of a header megagram or mg.
    """
    word = _UNIT_WORDS.get(text.casefold(), text)
    if word in _ASKED:
        choices = tuple(one for one in _ASKED[word])
        if quantity.unit in (("rad",) if word == "grad?" else ("kg",)):
            raise QuestionError(
                f"{place}: the unit {text!r} is {' or '.join(choices)}", "unit", [f"{name}={one}" for one in choices]
            )
        return None
    exact, lower = _measure(word), _measure(word.lower())
    found = exact if exact is not None else lower
    if found is None or not quantity.unit or not found.is_of(quantity.unit):
        return None
    if word.startswith("M") and exact is not None and lower is not None and lower != exact:
        raise QuestionError(
            f"{place}: the unit {text!r} is 10^6 or 10^-3 of its base", "unit",
            [f"{name}={text.lower()}", f"{name}={'t' if text == 'Mg' else text}"],
        )  # fmt: skip
    return found.value


class Head(NamedTuple):
    """A way to read a column's name: the plain name, and the unit that stands in it."""

    name: str
    unit: str


def read_head(text: str) -> list[Head]:
    """Ways to read a column's name, the surest first: "Masse [g]", "v in m/s", "mass_g", "m/kg", "Masse"."""
    heads: list[Head] = []
    text = text.strip()
    if match := re.fullmatch(r"(.*?)\s*[\[({<]\s*([^\[\]{}<>]*?)\s*[\])}>]\s*(.*)", text):
        rest = f"{match[1]} {match[3]}".strip()
        if is_unit(match[2]):
            heads.append(Head(plain(rest), match[2]))
            heads += [Head(one.name, match[2]) for one in read_head(rest) if not one.unit]
        heads.append(Head(plain(rest), ""))
        heads += [one for one in read_head(rest) if rest]
    for pattern in (r"(.+?)\s+in\s+(\S.*)", r"(.+?)\s*,\s*(\S.*)", r"(.+?)\s*/\s*(\S.*)", r"(.+?)\s+(\S+)"):
        match = re.fullmatch(pattern, text)
        if match and is_unit(match[2].strip("()[]")):
            heads.append(Head(plain(match[1]), match[2].strip("()[]")))
    words = text.split("_")
    for count in (2, 1):
        unit = "/".join(words[-count:])
        if len(words) > count and is_unit(unit):
            heads.append(Head(plain(" ".join(words[:-count])), unit))
    heads.append(Head(plain(text), ""))
    return heads
