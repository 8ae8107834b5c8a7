"""The burst stage: detonation, expansion and acceleration of cased charges by explicit finite elements.

`simulate` needs dolfinx and MPI and is imported on first use; geometry, meshing, materials and the
problem's data types need neither.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from burst_fenicsx.errors import InputError, NumericalStop
from fragfield_base.lazy_names import lazy_names

if TYPE_CHECKING:
    from burst_fenicsx.run_burst import simulate
    from burst_fenicsx.simulation import BurstProgress, BurstResult

__all__ = ["BurstProgress", "BurstResult", "InputError", "NumericalStop", "simulate"]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "burst_fenicsx.run_burst": "simulate",
        "burst_fenicsx.simulation": "BurstProgress BurstResult",
    },
)
