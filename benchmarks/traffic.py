"""Bytes that the element forces move for a cell in a step: the arrays that the kernels read and write, counted.

Each array counts once for reading and once for writing, as if nodes that cells share stayed in cache between them, and
a line that is written is read before. Scratch stays in cache and does not count.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from burst_fenicsx.kernels.lanes import LANES

if TYPE_CHECKING:
    from burst_fenicsx.mechanics.fields import BurstFields

__all__ = ["STILL", "TRAFFIC", "Moved", "bytes_per_cell", "uncounted"]

Kind = Literal["solid", "charge"]


@dataclass(frozen=True)
class Moved:
    """An array of the kernels.

    Attributes
    ----------
    group, name : where it is: an attribute of `BurstFields` and of that.
    of : what has an entry: "nodes", "cells", "slots" or "blocks".
    times : how often each entry crosses to or from memory: 1 read, 2 read and written.
    kinds : of the cells that use it.
    """

    group: str
    name: str
    of: Literal["nodes", "cells", "slots", "blocks"]
    times: int
    kinds: tuple[Kind, ...] = ("solid", "charge")

    def bytes_of(self, fields: BurstFields) -> float:
        """Bytes a cell."""
        array: np.ndarray = getattr(getattr(fields, self.group), self.name)
        each = array.nbytes / max(len(array), 1)
        if self.of == "nodes":
            each *= len(fields.nodes.position) / len(fields.grid.dofmap)
        elif self.of == "blocks":
            each /= LANES
        return self.times * each


_SOLID: tuple[Kind, ...] = ("solid",)
_CHARGE: tuple[Kind, ...] = ("charge",)

TRAFFIC = (
    Moved("nodes", "position", "nodes", 1),
    Moved("nodes", "velocity", "nodes", 1),
    Moved("nodes", "force", "nodes", 4),  # cleared, then added to
    Moved("grid", "dofmap", "cells", 1),
    Moved("grid", "cells", "blocks", 1),
    Moved("grid", "filled", "blocks", 1),
    Moved("grid", "material", "blocks", 1),
    Moved("grid", "level", "blocks", 1),
    Moved("grid", "mixed", "blocks", 1),
    Moved("grid", "mass", "slots", 1),
    Moved("grid", "volume", "slots", 2),
    Moved("grid", "viscous", "slots", 2),
    Moved("grid", "stable", "slots", 2),
    Moved("solid", "stress", "cells", 2, _SOLID),  # of the charge as well until it is burnt
    Moved("solid", "shear_strain", "cells", 2, _SOLID),
    Moved("solid", "volume_strain", "cells", 2, _SOLID),
    Moved("solid", "hourglass", "blocks", 2, _SOLID),
    Moved("solid", "softening_scale", "slots", 1, _SOLID),
    Moved("solid", "eroded", "slots", 1, _SOLID),
    Moved("charge", "pressure", "cells", 2, _CHARGE),
    Moved("charge", "burn_fraction", "cells", 2, _CHARGE),
    Moved("charge", "energy", "cells", 2, _CHARGE),
    Moved("charge", "ignition_time", "cells", 1, _CHARGE),
    Moved("charge", "burn_rate", "cells", 1, _CHARGE),
    Moved("charge", "compression_from", "cells", 1, _CHARGE),
    Moved("charge", "axial_part", "cells", 1, _CHARGE),
)
STILL = {
    ("solid", "parameters"),
    ("charge", "parameters"),
    ("charge", "leakage"),
    ("charge", "stress"),
    ("nodes", "finest"),
    ("nodes", "mean"),
}
"""Arrays that stay in cache, the charge's view of the stresses, which burnt cells leave alone, and what only cells read
whose nodes take shorter steps than they do."""


def bytes_per_cell(fields: BurstFields, kind: Kind) -> dict[str, float]:
    """Bytes of each array that a cell of this kind moves in a step."""
    return {f"{one.group}.{one.name}": one.bytes_of(fields) for one in TRAFFIC if kind in one.kinds}


def uncounted(fields: BurstFields) -> set[tuple[str, str]]:
    """Arrays of the kernels of which nothing is said here; empty unless the kernels have changed."""
    said = {(one.group, one.name) for one in TRAFFIC} | STILL
    return {
        (group, name)
        for group in ("nodes", "grid", "solid", "charge")
        for name, array in getattr(fields, group)._asdict().items()
        if isinstance(array, np.ndarray) and (group, name) not in said
    }
