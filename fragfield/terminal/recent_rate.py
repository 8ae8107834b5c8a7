"""Recent rate of progress, for the remaining time."""

from __future__ import annotations

from collections import deque

__all__ = ["RecentRate"]


class RecentRate:
    """Rate of an amount over the last seconds.

    A pause longer than the window (kernels being compiled) leaves no trace: after it the rate is unknown for a moment,
    and then that of the work itself.

    Parameters
    ----------
    window : float
        Seconds that are looked back on.
    minimum : float
        Seconds that must have been seen before a rate is given.
    """

    def __init__(self, window: float = 20.0, minimum: float = 1.0) -> None:
        self._window = window
        self._minimum = minimum
        self._seen: deque[tuple[float, float]] = deque()

    def restart(self) -> None:
        """Forget what was seen."""
        self._seen.clear()

    def add(self, now: float, amount: float) -> float | None:
        """Note that `amount` was reached at `now` (s); the rate, or None where it is not known yet."""
        self._seen.append((now, amount))
        while now - self._seen[0][0] > self._window:
            self._seen.popleft()
        began, first = self._seen[0]
        if now - began < self._minimum or not amount > first:
            return None
        return (amount - first) / (now - began)
