"""What the laws of the mean mass need of a casing, from its file, where the case leaves it out."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fragfield.errors import InputError
from fragfield_base.inputs import show

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fragfield.case.tables.break_up import BreakUpTable
    from fragfield_base.substances import Substance

__all__ = ["with_casing_data"]

_FILE = "a file of fragments that a test of it counted"
_NEEDED: dict[str, tuple[str, ...]] = {
    "mott": ("critical_strain", "fracture_energy"),
    "mott_1947": ("critical_strain", "fracture_stress", "fracture_gamma"),
    _FILE: ("critical_strain",),
}
"""By law: its inputs that are the casing's own."""


def with_casing_data(break_up: BreakUpTable, casings: list[Substance], source: str) -> BreakUpTable:
    """The table [break_up] with what its law needs of the casings, as far as the case leaves it out.

    `source` is the case's file, for messages.

    Raises
    ------
    InputError
        A casing's file lacks it, or two casings differ in it; the message names the laws that remain.
    """
    law = _FILE if break_up.mean_mass_is_file else break_up.mean_mass
    needed = _NEEDED.get(law, ()) if isinstance(law, str) else ()
    values = {key: _of_casings(key, casings, source) for key in needed if key not in break_up.model_fields_set}
    lacking = [key for key, value in values.items() if value is None]
    if casings and lacking:
        raise InputError(f"{source}: {_refusal(break_up, law, lacking, casings)}")
    changes = {key: value for key, value in values.items() if casings and value != getattr(break_up, key)}
    return break_up.model_copy(update=changes) if changes else break_up


def _refusal(break_up: BreakUpTable, law: object, lacking: list[str], casings: list[Substance]) -> str:
    names = [show(one.name) for one in casings if any(one.value("break_up", key) is None for key in lacking)]
    given = break_up.model_fields_set
    remaining = [f"break_up.mean_mass = {show(one)}" for one in _remaining(casings, given) if one != law]
    keys = " and ".join([f"break_up.{key}" for key in lacking])
    return (
        f"break_up.mean_mass: {show(law) if law != _FILE else law} needs {' and '.join(lacking)}, of which the casing "
        f"{' and '.join(names)} has no data; allowed: {' or '.join([f'with {keys} given', *remaining])}, or the mean "
        'mass itself from a test, for example "14.9 g"'
    )


def _remaining(casings: list[Substance], given: set[str]) -> Iterator[str]:
    """Laws for which all is given or known."""
    for law in ("mott", "mott_1947"):
        keys = [key for key in _NEEDED[law] if key not in given]
        if all(one.value("break_up", key) is not None for one in casings for key in keys):
            yield law


def _of_casings(key: str, casings: list[Substance], source: str) -> float | None:
    """The one value of all casings; None where one of them has none."""
    values = {one.name: one.value("break_up", key) for one in casings}
    if None in values.values():
        return None
    if len(set(values.values())) > 1:
        listed = ", ".join(f"{value:g} of {name}" for name, value in values.items())
        raise InputError(
            f"{source}: break_up.{key}: missing, and the casings differ in it: {listed}; give one for all rounds"
        )
    return next(iter(values.values()), None)
