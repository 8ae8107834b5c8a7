"""What a node of the charge and the casing do to each other: one law on the slide surface and on the slide line.

Products press with the pressure with which their cells act on their nodes, that of the vented products, corrected by a
spring for what is left of the gap (Nitsche's method): the gap then stays a small part of what a spring alone would
need. The correction is bounded by a multiple of that pressure, and products never pull: what would pull is apart. They
leave the casing for good over an edge of it alone. Unreacted explosive is bonded: springs with tensile strength,
cohesion and friction, which fade as it burns (Eqs. 12-15).
"""

from __future__ import annotations

from typing import NamedTuple

from burst_fenicsx.kernels.constants import BENT, ENTRY, MOST_CORRECTION
from burst_fenicsx.kernels.lanes import lane_function

__all__ = ["SlideLaw", "attach", "has_left"]


class SlideLaw(NamedTuple):
    """What holds for all contacts in this step."""

    max_squared_frequency: float  # bound on that of the springs (1/s2)
    step: float  # s
    tensile_strength: float  # Pa, of the unreacted charge's bond
    cohesion: float  # Pa
    friction: float  # tangent of the friction angle


@lane_function
def attach(
    law: SlideLaw,
    bonded: bool,
    off: bool,
    burnt: float,
    pressure: float,
    strength: float,
    area: float,
    gap: float,
    stiffness: float,
) -> tuple[bool, bool, float, float, float]:
    """Normal part of the law.

    Parameters
    ----------
    bonded, off : whether the bond has held until now; whether the node has left its surface.
    burnt : fraction of the explosive around the node. pressure : of the vented products there (Pa).
    strength : shear strength of the unreacted explosive (Pa).
    area : of the charge's surface that belongs to the contact (m2). gap : m, negative where it lies inside the casing.
    stiffness : of the spring, as much as the step bears (N/m).

    Returns
    -------
    Whether the two are apart; whether the bond holds in tension; the gas's own force and the spring's stiffness
    (N, N/m), zero where they are apart; and the largest tangential force (N).
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
    return apart, whole & (not apart), 0.0 if apart else gas, 0.0 if apart else stiffness, limit


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
