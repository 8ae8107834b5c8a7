"""What is varied, one parameter at a time, and how a case says it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from validation.files import reference_beside

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

__all__ = ["NAME", "REFERENCE", "Parameter", "Variation", "base", "parameters"]

NAME = "sensitivities"
REFERENCE = reference_beside(__file__)

_HOURGLASS = ("charge_viscous", "casing_viscous", "casing_stiffness")
_SOFTENING = ("shear_softening_strain", "tensile_softening_strain")


@dataclass(frozen=True)
class Variation:
    """The base with at most one parameter changed.

    Attributes
    ----------
    parameter : str
        Name of the parameter; "base" for the base itself.
    value : float
        That it takes.
    label : str
        What rows call the variation.
    size : str
        Cell size with its unit.
    changes : dict
        As `validation.runs.changed_case` takes them, without those that all bursts have.
    burst : bool
        Whether the burst changes with it; else it is that of the base.
    """

    parameter: str
    value: float
    label: str
    size: str
    changes: dict[str, Any] = field(default_factory=dict)
    burst: bool = True

    @property
    def name(self) -> str:
        """Of its run directory."""
        return (
            f"{NAME}_{self.parameter}_{self.value:g}".replace(".", "_") if self.parameter != "base" else f"{NAME}_base"
        )

    @property
    def all_changes(self) -> dict[str, Any]:
        """Its own changes, and those that all bursts have."""
        return REFERENCE["fixed"] | self.changes


@dataclass(frozen=True)
class Parameter:
    """A parameter with its value in the base and its variations.

    Attributes
    ----------
    name, words, axis : str
        Of its runs, in rows, and at the axis of its figure.
    base : float
        Value in the base.
    unit : str
        Of its values.
    variations : tuple of Variation
        In the order of the reference.
    """

    name: str
    words: str
    axis: str
    base: float
    unit: str
    variations: tuple[Variation, ...]


def _leakage(value: float) -> dict[str, Any]:
    return {"burst.leakage.radius_ratio": value}


def _quadrature(value: float) -> dict[str, Any]:
    return {"burst.quadrature": "one_point" if value == 1 else "full"}


def _hourglass(value: float) -> dict[str, Any]:
    return {f"burst.hourglass.{kind}": lambda old: value * old for kind in _HOURGLASS}


def _softening(value: float) -> dict[str, Any]:
    return {f"round.*.casing.{kind}": value for kind in _SOFTENING}


def _heat(value: float) -> dict[str, Any]:
    def scaled(old: str) -> str:
        number, unit = old.split(maxsplit=1)
        return f"{value * float(number)!r} {unit}"

    return {"round.*.explosive.heat_of_detonation": scaled}


def _prefactor(value: float) -> dict[str, Any]:
    return {"break_up.prefactor": value}


def _cell_size(_: float) -> dict[str, Any]:
    return {}  # the command line gives it


_CHANGES: dict[str, Callable[[float], dict[str, Any]]] = {
    "leakage": _leakage,
    "cell_size": _cell_size,
    "quadrature": _quadrature,
    "hourglass": _hourglass,
    "softening": _softening,
    "heat": _heat,
    "prefactor": _prefactor,
}
_AFTER_THE_BURST = ("prefactor",)


def base(*, quick: bool = False, size: str | None = None) -> Variation:
    """The base; `size` in place of its cell size."""
    return Variation("base", 0.0, "base", size or _size(_base_size(quick=quick)))


def parameters(*, quick: bool = False, size: str | None = None) -> tuple[Parameter, ...]:
    """All parameters with their variations; those of another cell size fall away with a given `size`."""
    return tuple(
        _parameter(name, table, quick=quick, size=size)
        for name, table in REFERENCE["parameters"].items()
        if size is None or name != "cell_size"
    )


def _parameter(name: str, table: Mapping[str, Any], *, quick: bool, size: str | None) -> Parameter:
    unit = table.get("unit", "")
    of_base = size or _size(_base_size(quick=quick))

    def variation(value: float) -> Variation:
        label = f"{table['words']} {value:g}{f' {unit}' if unit else ''}"
        own_size = _size(value) if name == "cell_size" else of_base
        return Variation(name, value, label, own_size, _CHANGES[name](value), name not in _AFTER_THE_BURST)

    value = _base_size(quick=quick) if name == "cell_size" else table["base"]
    variations = tuple(variation(one) for one in table["quick" if quick else "values"])
    return Parameter(name, table["words"], table["axis"], value, unit, variations)


def _base_size(*, quick: bool) -> float:
    table = REFERENCE["parameters"]["cell_size"]
    return float(table["quick_base" if quick else "base"])


def _size(value: float) -> str:
    return f"{value:g} mm"
