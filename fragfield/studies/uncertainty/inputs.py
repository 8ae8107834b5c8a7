"""The uncertain inputs of a case: its own, and the default set for built-in rounds."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from fragfield.case.checks.uncertain_inputs import parameters_of
from fragfield.case.keys import unit_of_key
from fragfield.errors import InputError
from fragfield.studies.uncertainty.defaults import default_inputs
from fragfield.studies.uncertainty.distributions import Distribution
from fragfield_base.inputs import with_unit

if TYPE_CHECKING:
    from fragfield.case import CaseTable
    from fragfield.case.schema import UncertainInputTable


_BURST = ("burst", "round", "plane", "stack")


@dataclass(frozen=True)
class UncertainInput:
    """An uncertain input, ready to be sampled."""

    name: str
    """For tables and figures."""
    keys: tuple[str, ...]
    """Dotted keys of the resolved case; all get the same draw."""
    applies: str
    """"value", "factor" or "shift": what the draw is to a key."""
    distribution: Distribution
    """In `unit`."""
    unit: str
    """SI unit of the draw; empty for pure numbers, factors and words."""
    source: str
    """Where the distribution comes from."""
    judgement: bool
    """Whether it is a judgement."""
    is_default: bool
    """Whether it comes from the default set."""

    @property
    def in_burst(self) -> bool:
        """Whether the burst depends on it; what does not is sampled over the break-up and the flight alone."""
        return any(key.partition(".")[0] in _BURST for key in self.keys)

    def changes(self, draw: Any) -> dict[str, Any]:  # noqa: ANN401 - a number or a word
        """Changes of a resolved case for one draw, as `fragfield.case.changed_document` takes them."""
        if self.applies == "value":
            written = with_unit(draw, self.unit) if self.unit and not isinstance(draw, str) else draw
            return dict.fromkeys(self.keys, written)

        def moved(old: object) -> object:
            return _moved(old, float(draw), factor=self.applies == "factor")

        return dict.fromkeys(self.keys, moved)

    def described(self) -> dict[str, Any]:
        """As uncertainty.json has it."""
        return {
            "name": self.name,
            "keys": list(self.keys),
            "applies": self.applies,
            "distribution": self.distribution.kind,
            "parameters": dict(self.distribution.parameters),
            "unit": self.unit,
            "words": self.distribution.words() + (f" {self.unit}" if self.unit else ""),
            "source": self.source,
            "judgement": self.judgement,
            "is_default": self.is_default,
        }


def _moved(old: object, draw: float, *, factor: bool) -> object:
    """A value of a resolved case, a number or a text "number unit", times a factor or with a shift added."""
    if isinstance(old, str):
        number, _, unit = old.partition(" ")
        return f"{_moved(float(number), draw, factor=factor)!r} {unit}"
    if isinstance(old, bool) or not isinstance(old, (int, float)):
        raise InputError(f"holds {old!r}, which is not a number: no factor and no shift applies to it")
    return float(old) * draw if factor else float(old) + draw


def inputs_of(case: CaseTable) -> list[UncertainInput]:
    """The uncertain inputs of a resolved case: its own first, then those of the default set that it does not replace.

    Raises InputError: there are none.
    """
    table = case.uncertainty
    own = [_input(entry, is_default=False) for entry in table.input] if table is not None else []
    names = {entry.name for entry in own}
    keys = {key for entry in own for key in entry.keys}
    found = list(own)
    if table is None or table.defaults:
        found.extend(
            _input(entry, is_default=True)
            for entry in default_inputs(case)
            if entry.name not in names and not keys.intersection(entry.keys)
        )
    if not found:
        raise InputError(
            "uncertainty: found no input; allowed: tables [[uncertainty.input]], or defaults = true for the default set"
        )
    return found


def _input(entry: UncertainInputTable, *, is_default: bool) -> UncertainInput:
    unit = "" if entry.applies == "factor" else unit_of_key(entry.keys[0]) or ""
    return UncertainInput(
        entry.name, tuple(entry.keys), entry.applies, Distribution(entry.distribution, parameters_of(entry)), unit,
        entry.source, entry.judgement, is_default,
    )  # fmt: skip
