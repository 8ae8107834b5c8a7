"""What `check` says of the explosives and casings of a case: how firm their values are, and where that matters."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fragfield_base.substances import graded, substance, substance_names

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from burst_fenicsx.problem import CasingMaterial, Explosive, Round

__all__ = ["substances_of", "waiting_on_estimates", "yield_stress"]


def substances_of(entry: Round) -> dict[str, dict[str, str]]:
    """Name of a round's explosive and casing, with the grades of their values; of the user's own values none."""
    materials: dict[str, CasingMaterial | Explosive] = {"explosive": entry.explosive, "casing": entry.casing}
    return {kind: {"name": one.name, "grades": graded(one.source)} for kind, one in materials.items()}


def waiting_on_estimates(rounds: Sequence[Round]) -> Iterator[str]:
    """Explosives that wait for a neighbour's shock, of which only estimates say how shocks run in them."""
    waiting = {entry.explosive.name: entry.explosive for entry in rounds if not entry.ignition}
    for name, explosive in waiting.items():
        if "Unreacted estimate" in graded(explosive.source):
            yield (
                f'explosive "{name}": sound_speed and hugoniot_slope are estimates; what a neighbour\'s shock does to '
                "the charge follows from them (the speed of its casing hardly)"
            )


def yield_stress(casing: CasingMaterial) -> float:
    """Yield stress (Pa) of a tensile test: of a built-in casing whose strength is its flow stress, that at 1 /s."""
    if graded(casing.source) and casing.name in substance_names("casing"):
        initial = substance("casing", casing.name).value("johnson_cook", "A")
        if initial is not None:
            return float(initial)
    return 2.0 * casing.shear_strength  # Tresca
