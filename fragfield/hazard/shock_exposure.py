"""Statements on the shock loading of rounds without ignition points."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

__all__ = ["exposed_rounds", "exposure_words"]

_VERDICT = {
    "below": "below the published critical energies",
    "within": "within the scatter of the published critical energies",
    "above": "above the published critical energies: initiation is to be expected",
    "no critical energy": "no critical energy is known for this explosive",
}


def exposed_rounds(burst: Mapping[str, Any]) -> Iterator[tuple[str, dict[str, Any], bool]]:
    """Name and exposure of every round without ignition points, and whether a shock initiated it.

    `burst` is the burst's part of summary.json.
    """
    for entry in burst.get("rounds") or []:
        if entry.get("exposure"):
            yield str(entry.get("name")), entry["exposure"], bool(entry.get("ignition"))


def exposure_words(found: Mapping[str, Any]) -> str:
    """An exposure in one sentence, with what must be known to read it."""
    if not found["energy"] > 0.0:
        return (
            f"largest pressure {found['peak_pressure'] / 1e9:.3g} GPa, never above the threshold of "
            f"{found['floor'] / 1e9:.3g} GPa from which a pulse is counted"
        )
    words = (
        f"largest pressure {found['peak_pressure'] / 1e9:.3g} GPa; strongest pulse {found['pulse_pressure'] / 1e9:.3g} "
        f"GPa held for {found['held_time'] * 1e6:.3g} us, {found['energy'] / 1e6:.3g} MJ/m2"
    )
    if found["critical_energy"]:
        low, high = (value / 1e6 for value in found["critical_energy"])
        words += f" against {low:.3g} to {high:.3g} MJ/m2 (ratio {found['ratio'][1]:.2g} to {found['ratio'][0]:.2g})"
    words += f": {_VERDICT[found['verdict']]}"
    if not found["resolved"]:
        words += (
            f"; the cells are too coarse to resolve this pulse, which needs {found['resolved_cell'] * 1e3:.2g} mm or "
            "less: pressure and energy increase with smaller cells"
        )
    return words
