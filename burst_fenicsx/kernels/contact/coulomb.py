"""Coulomb's friction of a tangential spring, for all contacts: the spring holds up to the limit, beyond it slips."""

from __future__ import annotations

from burst_fenicsx.kernels.lanes import lane_function

__all__ = ["coulomb_slip"]


@lane_function
def coulomb_slip(trial: float, limit: float, stiffness: float, old_stiffness: float, old: float) -> tuple[float, float]:
    """Displacement that a tangential spring keeps (m), and the heat of what slips (J), Eqs. 13-14.

    Parameters
    ----------
    trial : size of the displacement if nothing slipped (m). limit : largest force (N). stiffness : N/m, now.
    old_stiffness, old : those of the last step (N/m, m): the slip's force is the mean of both ends.
    """
    kept = limit / stiffness if stiffness * trial > limit else trial
    heat = 0.5 * (old_stiffness * old + limit) * (trial - kept) if stiffness * trial > limit else 0.0
    return kept, heat
