"""What a node of the charge and the casing do to each other: one law on the slide surface and on the slide line.

Products press with the pressure with which their cells act on their nodes, that of the vented products, corrected by a
spring for what is left of the gap (Nitsche's method): the gap then stays a small part of what a spring alone would
need. The correction is bounded by a multiple of that pressure, and products never pull: what would pull is apart. They
leave the casing for good over an edge of it alone. Unreacted explosive is bonded: springs with tensile strength,
cohesion and friction, which fade as it burns (Eqs. 12-15).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from burst_fenicsx.kernels.cells.erosion import WHOLE
from burst_fenicsx.kernels.constants import BENT, ENTRY, MOST_CORRECTION
from burst_fenicsx.kernels.contact.coulomb import coulomb_slip
from burst_fenicsx.kernels.lanes import block_kernel, lane_function
from burst_fenicsx.kernels.state import ChargeState
from burst_fenicsx.kernels.vectors.exact import quantise

__all__ = ["SlideLaw", "around", "has_left", "slide"]


class SlideLaw(NamedTuple):
    """What holds for all contacts in this step."""

    max_squared_frequency: float  # bound on that of the springs (1/s2)
    step: float  # s
    tensile_strength: float  # Pa, of the unreacted charge's bond
    cohesion: float  # Pa
    friction: float  # tangent of the friction angle


@block_kernel
def around(
    cells: np.ndarray,
    charge: ChargeState,
    eroded: np.ndarray,
    slot: np.ndarray,
    burnt_rounding: float,
    pressure_rounding: float,
) -> tuple[float, float, float]:
    """Sums over the charge's `cells` (k,) around a node, rounded by `quantise` with these constants.

    Returns the sums of the burn fractions and of the pressures (Pa) after leakage, and the number of cells that have
    not been eroded, by `eroded` (slots,) and the `slot` of each cell.
    """
    burnt, pressure, whole = 0.0, 0.0, 0.0
    for cell in cells:
        vented = charge.leakage[charge.axial_slice[cell]] * charge.pressure[cell]
        burnt += quantise(charge.burn_fraction[cell], burnt_rounding)
        pressure += quantise(vented, pressure_rounding)
        whole += 1.0 if eroded[slot[cell]] == WHOLE else 0.0
    return burnt, pressure, whole


@lane_function
def slide(
    law: SlideLaw,
    bonded: bool,
    off: bool,
    burnt: float,
    pressure: float,
    strength: float,
    area: float,
    gap: float,
    stiffness: float,
    trial: float,
    old_stiffness: float,
    old_slip: float,
) -> tuple[bool, float, float, float, float, float, float]:
    """Force, state and energies of one contact after a step.

    Parameters
    ----------
    bonded, off : whether the bond has held until now; whether the node has left its surface.
    burnt : fraction of the explosive around the node. pressure : of the vented products there (Pa).
    strength : shear strength of the unreacted explosive (Pa).
    area : of the charge's surface that belongs to the contact (m2). gap : m, negative where it lies inside the casing.
    stiffness : of the spring, as much as the step bears (N/m).
    trial : size of the tangential displacement if nothing slipped (m).
    old_stiffness, old_slip : of the last step (N/m, m).

    Returns
    -------
    Whether the bond holds; the gas's own force (N); stiffness of the spring (N/m) and the size of the tangential
    displacement that it keeps (m); its energy and friction in this step (J); and how deep the node lies (m). Force,
    stiffness, displacement and depth are zero where the two are apart.
    """
    unreacted = 1.0 - burnt
    whole = bonded & (unreacted > 0.0)
    gas = burnt * max(pressure, 0.0) * area
    most = MOST_CORRECTION * gas
    size = abs(gap)
    stiffness = most / size if (unreacted == 0.0) & (stiffness * size > most) else stiffness
    press = gas - stiffness * gap
    bond = law.tensile_strength * unreacted * area if whole else 0.0
    apart = off | (press <= -bond)
    # Where friction would hold more than the explosive bears, it is the explosive that yields.
    limit = max((law.cohesion * area if whole else 0.0) + press * law.friction, 0.0)
    limit = unreacted * min(limit, strength * area)
    gas, stiffness = 0.0 if apart else gas, 0.0 if apart else stiffness
    kept, heat = coulomb_slip(trial, limit, stiffness, old_stiffness, old_slip)
    whole = whole & (not apart) & (not kept < trial)
    # What the spring held is lost where the two part.
    kept, heat = 0.0 if apart else kept, 0.5 * old_stiffness * old_slip * old_slip if apart else heat
    stored = 0.5 * stiffness * (gap * gap + kept * kept)
    return whole, gas, stiffness, kept, stored, heat, 0.0 if apart else max(-gap, 0.0)


@lane_function
def has_left(beyond: float, gap: float, reach: float, moved: float, met: bool) -> bool:
    """Whether a node has left its surface, for good: it may come back behind it, through its rim.

    Parameters
    ----------
    beyond : how far it lies beyond the rim (m). gap : m. reach : largest of both that a node may have (m).
    moved : how far it has come relative to the surface in this step (m). met : whether it touched before: else it is
        met no deeper than it can have come in, and a little more, since the surface bends.
    """
    entered = ENTRY * moved + BENT * reach
    return (beyond > reach) | (gap < -reach) | ((not met) & (gap < -entered))
