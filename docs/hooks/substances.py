"""Tables of the explosives and casings, made from their files: what each serves for, every value with its source."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from burst_fenicsx.materials.library import load_explosive
from docs.hooks.reference import cell, rows
from fragfield_base.substances import GRADES, GROUPS, substance, substance_names

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fragfield_base.substances import Group, Kind, Substance

__all__ = ["substance_form", "substance_grades", "substance_overview", "substance_values"]

_SCALES = {"Pa": ((1e9, "GPa"), (1e6, "MPa")), "J/kg": ((1e6, "MJ/kg"),), "J/m2": ((1e6, "MJ/m2"), (1e3, "kJ/m2")),
           "J/m3": ((1e9, "GJ/m3"),)}  # fmt: skip


def substance_overview(kind: Kind) -> str:
    """A line for each substance: names, and which models have the data they need."""
    body = []
    for name in substance_names(kind):
        one = substance(kind, name)
        serves = _explosive_serves(one) if kind == "explosive" else _casing_serves(one)
        also = ", ".join(one.aliases)
        body.append((f"[`{name}`](#{name})", cell(one.title), cell(also), cell("; ".join(serves) or "-")))
    return rows("name, substance, also found as, data for", body)


def _explosive_serves(one: Substance) -> Iterator[str]:
    models = load_explosive(one.name).models
    if models:
        yield "burst (" + ", ".join(f"`{model}`" for model in models) + ")"
    for key, words in (("gurney", "Gurney's speed"), ("tnt_equivalent", "TNT equivalent"),
                       ("critical_energy", "critical energy"), ("fragmentation", "`gurney_sarmousakis`")):  # fmt: skip
        if key in one.groups:
            yield words


def _casing_serves(one: Substance) -> Iterator[str]:
    yield "burst"
    for law, keys in (("mott", ("critical_strain", "fracture_energy")),
                      ("mott_1947", ("critical_strain", "fracture_stress", "fracture_gamma"))):  # fmt: skip
        if all(one.value("break_up", key) is not None for key in keys):
            yield f"`{law}`"


def substance_values(kind: Kind) -> str:
    """A section for each substance: composition, and a line for each group with values, grade, source and checks."""
    return "\n\n".join(_section(substance(kind, name), kind) for name in substance_names(kind))


def _section(one: Substance, kind: Kind) -> str:
    body = [
        (f"`{name}`", cell(", ".join(_values(group, GROUPS[kind][name]))), group.grade,
         cell(" ".join(filter(None, [group.source, group.checked and f"*Checked:* {group.checked}"]))))
        for name, group in one.groups.items()
    ]  # fmt: skip
    note = f"\n\n{one.note}" if one.note else ""
    head = f"### {one.name}\n\n**{one.title}**: {one.composition}.{note}"
    return f"{head}\n\n{rows('group, values, grade, source', body)}"


def _values(group: Group, units: dict[str, str]) -> Iterator[str]:
    for key, value in group.values.items():
        yield f"`{key}` {_shown(value, units[key])}"


def _shown(value: Any, unit: str) -> str:  # noqa: ANN401 - a number, a pair or a word
    if isinstance(value, str):
        return value
    if isinstance(value, list):
        low, high = (_shown(one, unit) for one in value)
        return low if low == high else f"{low} to {high}"
    factor, shown = next(((by, name) for by, name in _SCALES.get(unit, ()) if abs(value) >= by), (1.0, unit))
    return f"{value / factor:.6g} {shown}".strip()


def substance_form(kind: Kind) -> str:
    """The groups of a file with their keys and units."""
    body = [
        (f"`[{name}]`", cell(", ".join(f"`{key}` ({unit})" if unit else f"`{key}`" for key, unit in keys.items())))
        for name, keys in GROUPS[kind].items()
    ]
    return rows("group, keys", body)


def substance_grades() -> str:
    """What each grade means."""
    return rows("grade, meaning", [(grade, cell(words)) for grade, words in GRADES.items()])
