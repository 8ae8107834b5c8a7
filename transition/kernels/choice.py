"""Choosing fragments with given probabilities, balanced on number and mass."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from transition.kernels.compiling import kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["balanced_choice"]


@kernel
def balanced_choice(
    mass: NDArray[np.float64], probability: NDArray[np.float64], total: float, uniform: NDArray[np.float64]
) -> NDArray[np.bool_]:
    """Choose candidates with given probabilities so that their number and their mass keep to the expectation.

    From heavy to light, the undecided candidate meets the next one and probability moves between the two until one
    is decided (the pivotal method of Deville and Tille 1998): the number among the heaviest is never off by one.
    After every such step the probabilities of all lighter candidates are multiplied by the mass still to be given
    over the mass they would give. That factor is a martingale, so every candidate keeps its probability in
    expectation, and a heavy fragment that happens to come is paid for by all lighter ones. Once so little mass is
    left that a probability would leave 0 to 1, the factor stays as it is; only the very lightest candidates, worth
    less than one fragment together, come a little too rarely for that.

    Parameters
    ----------
    mass : (k,) float64
        Masses of the candidates (kg), falling.
    probability : (k,) float64
        Probability of each, above 0, at most 1.
    total : float
        Mass to be given (kg).
    uniform : (k,) float64
        Uniform random numbers in [0, 1).

    Returns
    -------
    (k,) bool
        Which candidates are chosen.
    """
    number = mass.size
    chosen = np.zeros(number, dtype=np.bool_)
    lighter = np.zeros(number)  # mass that the candidates after this one would give
    for index in range(number - 2, -1, -1):
        lighter[index] = lighter[index + 1] + probability[index + 1] * mass[index + 1]
    highest = probability.max()
    held, p_held = 0, probability[0]
    given = 0.0
    factor, free = 1.0, True
    for other in range(1, number):
        p_other = factor * probability[other]
        together = p_held + p_other
        if together <= 1.0:
            if uniform[other] * together < p_other:
                held = other
            p_held = together
        elif uniform[other] * (2.0 - together) < 1.0 - p_other:
            chosen[held] = True
            given += mass[held]
            held, p_held = other, together - 1.0
        else:
            chosen[other] = True
            given += mass[other]
            p_held = together - 1.0
        if free and lighter[other] > 0.0:
            wanted = (total - given - p_held * mass[held]) / lighter[other]
            free = wanted * highest <= 1.0
            factor = max(wanted, 0.0) if free else factor
    chosen[held] = uniform[0] < p_held
    return chosen
