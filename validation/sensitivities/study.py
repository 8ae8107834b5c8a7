"""What moves the distance: one input at a time about the M107 with TNT, whole chains in the meridian."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from validation.runs import reference_beside

if TYPE_CHECKING:
    from collections.abc import Callable

    from validation.rows import Rows
    from validation.runs import Runs

__all__ = ["REFERENCE", "changes_of", "study"]

REFERENCE = reference_beside(__file__)
_SUBJECTS = ("burst", "break_up", "flight")


def study(runs: Runs, rows: Rows) -> None:
    """Run the base and every variation; the expected distance and its standard error stand beside the base's."""
    size = REFERENCE["quick_size" if rows.quick else "size"]
    base = _hazard(runs, "base", size, {})
    _row(rows, "base: expected distance", base, None)
    without = base["without_ricochet"]
    _row(rows, "no ricochet: expected distance", without, base["expected"])
    for name, parameter in REFERENCE["parameters"].items():
        for value in parameter["values"][:1] if rows.quick else parameter["values"]:
            found = _hazard(runs, f"{name}_{value:g}".replace(".", "_"), size, changes_of(name, value))
            _row(rows, f"{parameter['words']} {value:g} ({parameter['base']:g}): expected distance", found,
                 base["expected"])  # fmt: skip


def _hazard(runs: Runs, name: str, size: str, changes: dict[str, Any]) -> dict[str, Any]:
    return runs.hazard(f"sensitivities_{name}", REFERENCE["case"], size, REFERENCE["fixed"] | changes)


def _row(rows: Rows, quantity: str, hazard: dict[str, Any], base: float | None) -> None:
    rows.trend(quantity, hazard["expected"], base, "the base", "m", *_SUBJECTS, standard_error=hazard["standard_error"])


def changes_of(name: str, value: float) -> dict[str, Any]:
    """Changes of the case that give a parameter its value, as `validation.runs.changed_case` takes them."""
    parameter = REFERENCE["parameters"][name]
    change: float | str | Callable[[float | str], float | str] = value
    if parameter.get("unit"):
        change = f"{value:g} {parameter['unit']}"
    if parameter.get("relative"):

        def change(old: float | str) -> float | str:
            number, *unit = str(old).split(maxsplit=1)
            scaled = value * float(number)
            return f"{scaled!r} {unit[0]}" if unit else scaled

    return dict.fromkeys(parameter["keys"], change)
