"""What a run's summary says of the certainty of its distances, in words."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from flight.distances import DISTANCES, FEWEST

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["not_converged"]


def not_converged(flight: Mapping[str, Any]) -> str:
    """Which distances of summary.json's part "flight" the ensemble does not fix; empty where it fixes all.

    Parameters
    ----------
    flight : mapping
        The part; of a run that knows no ensembles, nothing is said.
    """
    names, bands = flight.get("not_converged") or [], flight.get("bands") or {}
    number = int(flight.get("realisations") or 1)
    if not names or not bands:
        return ""
    if number == 1:
        return (
            "one realisation of the break-up was flown: distances carry no band, and those of narrow sectors scatter "
            "widely; set break_up.realisations"
        )
    if number < FEWEST:
        return (
            f"{number} realisations are too few for a band of 5 to 95 %, {FEWEST} are the least; "
            "set break_up.realisations"
        )
    told = "; ".join(DISTANCES[name] for name in names)
    needed = [bands[name]["needed"] for name in names]
    known = [one for one in needed if one is not None]
    ask = f"about {_rounded(max(known))} are needed" if len(known) == len(needed) else "many more are needed"
    return (
        f"{number} realisations do not fix these distances to {100 * flight.get('tolerance', 0.05):g} % "
        f"(standard error): {told}; {ask} (break_up.realisations)"
    )


def _rounded(number: int) -> int:
    """A number of realisations, up to two digits."""
    unit = 10 ** max(0, len(str(number)) - 2)
    return -(-number // unit) * unit
