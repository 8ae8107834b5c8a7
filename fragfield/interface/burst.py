"""The burst of a run in arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping

    import numpy as np
    from numpy.typing import NDArray

    from fragfield.report.reading.run_files import RoundTables, RunFiles

__all__ = ["Burst"]


class Burst:
    """The end of a burst, from burst_snapshot.h5, and what led to it.

    Parameters
    ----------
    files : RunFiles
        The run's files.
    summary : mapping
        The part "burst" of summary.json.

    Attributes
    ----------
    summary : dict
        That part: cells, steps, masses, speeds, energy and momentum errors.
    """

    def __init__(self, files: RunFiles, summary: Mapping[str, Any]) -> None:
        self._files = files
        self.summary = dict(summary)

    @property
    def time(self) -> float:
        """Time at its end (s)."""
        return float(self._files.burst_time or 0.0)

    @property
    def nodes(self) -> dict[str, NDArray[np.float64]]:
        """`reference` and `position` (m), `velocity` (m/s) of the casings' nodes, (n, 3), or (n, 2) of a meridian."""
        return self._files.nodes

    @property
    def cells(self) -> dict[str, NDArray[Any]]:
        """Of the casings' cells (c,): `nodes` (c, 8), or (c, 4) of a meridian, and their state."""
        return self._files.cells

    @property
    def history(self) -> dict[str, NDArray[np.float64]]:
        """Over `time` (s): `mean_casing_speed` (m/s), `outer_diameter` (m), energies (J) and `energy_error`."""
        return self._files.history

    @property
    def rounds(self) -> list[RoundTables]:
        """By round: `name`, `attributes`, and `segments` and `along` as structured arrays."""
        return self._files.rounds

    @property
    def is_axisymmetric(self) -> bool:
        """Whether the cells are those of a meridian."""
        return self._files.is_axisymmetric

    def __repr__(self) -> str:
        return f"<fragfield.Burst to {self.time * 1e6:.4g} us: {self.summary.get('cells', 0)} cells>"

    def __str__(self) -> str:
        found = self.summary
        names = ", ".join(one.name for one in self.rounds)
        return (
            f"burst of {names} to {self.time * 1e6:.4g} us: {found['cells']} cells, {found['steps']} steps\n"
            f"  mean initial speed of the casing {found['mean_initial_speed']:.0f} m/s, energy error "
            f"{100.0 * found['energy_error']:.2g} %"
        )
