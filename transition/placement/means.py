"""Mean state of the metal that a fragment about a point is made of, without drawing it.

What realisations draw are runs of a curve (`transition.placement.placing`). Here a fragment of mass m about a point is
the metal within an ellipsoid about it: a sphere in the units of the curve. It holds m, and is then stretched to the
second moment that runs have. The means are by weights that are scaled, as by Sinkhorn, until every piece of metal
counts alike, so that mass and momentum of a segment are kept at its edges too, and energy but for the spread within.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from transition.placement.placing import Sheet

    Array = NDArray[np.float64]


SPREAD = 1.7
"""Second moment of a run of the curve over that of a sphere of its mass: 1.6 to 1.8 in segments of an M107."""
_LEVELS = 2.0 ** -np.arange(15.0)[::-1]  # masses over the segment's: from less than a gram of one of 10 kg
_REACHES, _ROUNDS = 20, 12


def mean_states(sheet: Sheet, reference: Array, share: Array, state: Array) -> tuple[Array, Array]:
    """Masses (l,) over the segment's, ascending, and states (l, k, 4) of fragments of these masses about the nodes.

    `reference` (k, 2): radius and height of the nodes before the burst (m), `share` (k,): of the segment's mass,
    `state` (k, 4): radius and height, radial and axial velocity.
    """
    plane, per_radian = sheet.meridian(reference)
    axial, radial = _weights(plane.tobytes(), share.tobytes(), per_radian)
    states = np.empty((len(_LEVELS), *state.shape))
    for weights, columns in ((radial, [0, 2]), (axial, [1, 3])):
        states[..., columns] = (weights.reshape(-1, len(state)) @ state[:, columns]).reshape(*states.shape[:2], 2)
    return _LEVELS, states


@lru_cache(maxsize=24)
def _weights(plane: bytes, share: bytes, per_radian: float | None) -> tuple[Array, Array]:
    """Weights (l, k, k) of the nodes' metal in the means of axial and radial components: the same for all bursts."""
    first, second = np.frombuffer(plane).reshape(-1, 2).T
    mass = np.frombuffer(share)
    gap = np.subtract.outer(second, second) ** 2
    if per_radian is None:  # about the axis: chords
        gap += np.add.outer(first**2, first**2)
        product = 2.0 * np.outer(first, first)
        farthest = math.sqrt(float((gap + product).max()))
    else:
        gap += np.subtract.outer(first, first) ** 2
        farthest = math.sqrt(float(gap.max()) + (math.pi * per_radian) ** 2)

    def angles(squared: Array | float) -> Array:
        """Half of the arc of each ring that lies within these squared distances."""
        if per_radian is None:
            return np.arccos(np.clip((gap - squared) / product, -1.0, 1.0))
        return np.minimum(np.sqrt(np.maximum(squared - gap, 0.0)) / per_radian, math.pi)

    reach = farthest * np.geomspace(3e-3, 1.01, _REACHES)
    held = np.maximum.accumulate([angles(one**2) @ mass / math.pi for one in reach])
    axial, radial = np.empty((2, len(_LEVELS), len(mass), len(mass)))
    for number, level in enumerate(_LEVELS):
        if level == 1.0:
            angle = np.full_like(gap, math.pi)
        else:
            logarithms = [np.interp(math.log(level), np.log(one), np.log(reach)) for one in held.T]
            squared = SPREAD * np.exp(2.0 * np.array(logarithms))
            angle = angles(0.5 * np.add.outer(squared, squared))
        weight = angle * mass
        scale = np.ones(len(mass))
        for _ in range(_ROUNDS):
            scale = np.sqrt(scale / (weight @ scale))
        weight *= scale
        weight /= weight.sum(axis=1, keepdims=True)
        axial[number], radial[number] = weight, weight * np.sinc(angle / math.pi)
    return axial, radial
