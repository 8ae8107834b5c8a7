"""Short vectors of many cells or nodes turned into rows over the lanes, and back: in registers where that compiles.

`transposition_vectors` writes the instructions itself; where this numba's compiler refuses them, or they do not do what
they should, `transposition_plain` takes their place, slower and to the same bits. Which it is is settled once, by a
trial. FRAGFIELD_TRANSPOSITION = "plain" or "vectors" settles it without one.
"""

from __future__ import annotations

import logging
import os
from typing import TYPE_CHECKING, Any

import numpy as np

from burst_fenicsx.kernels.lanes import LANES
from burst_fenicsx.kernels.vectors import transposition_plain, transposition_vectors
from burst_fenicsx.kernels.vectors.transposition_vectors import WIDTH, address, later, places

if TYPE_CHECKING:
    from types import ModuleType

__all__ = ["WIDTH", "add_triples", "address", "later", "load_triples", "places", "prefetch", "store_triples"]

_log = logging.getLogger(__name__)
_CHOICES: dict[str, ModuleType] = {"plain": transposition_plain, "vectors": transposition_vectors}


def works(module: Any) -> bool:
    """Whether the functions of a module compile here and do what they should."""
    field, rows, other = np.arange(27.0).reshape(9, 3), np.zeros(3 * LANES), np.zeros((9, 3))
    try:
        module.trial(field, rows, other)
    except Exception as error:  # noqa: BLE001 - compilers raise what they like
        _log.warning("vectors are transposed number by number, which is slower: %s", str(error).splitlines()[:1])
        return False
    wanted = 2.0 * field
    wanted[7] = 0.0
    return bool(np.array_equal(other, wanted))


def _chosen() -> ModuleType:
    name = os.environ.get("FRAGFIELD_TRANSPOSITION", "")
    if name in _CHOICES:
        return _CHOICES[name]
    return transposition_vectors if works(transposition_vectors) else transposition_plain


_CHOSEN = _chosen()
add_triples, load_triples = _CHOSEN.add_triples, _CHOSEN.load_triples
prefetch, store_triples = _CHOSEN.prefetch, _CHOSEN.store_triples
