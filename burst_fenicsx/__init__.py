"""The burst stage: detonation, expansion and acceleration of cased charges by explicit finite elements.

`simulate` needs dolfinx and MPI and is imported on first use; geometry, meshing, materials and the
problem's data types need neither.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

from burst_fenicsx.errors import InputError, NumericalStop

if TYPE_CHECKING:
    from burst_fenicsx.run_burst import simulate
    from burst_fenicsx.simulation import BurstProgress, BurstResult

__all__ = ["BurstProgress", "BurstResult", "InputError", "NumericalStop", "simulate"]

_LAZY = {"BurstProgress": "simulation", "BurstResult": "simulation", "simulate": "run_burst"}


def __getattr__(name: str) -> Any:
    if name in _LAZY:
        return getattr(import_module(f"burst_fenicsx.{_LAZY[name]}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
