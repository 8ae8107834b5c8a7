"""Density along a direction of a finished run, from the densities that its flight keeps (ensemble.h5)."""

from __future__ import annotations

from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING

import numpy as np

from fragfield.app.plan import round_length
from fragfield.hazard.certainty import metres
from fragfield.numbers import number

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from flight.hazard.density.distance import ExpectedDistance
    from flight.hazard.ensemble import EnsembleHazard
    from fragfield.app.texts import Texts

__all__ = ["Directions"]

_WIDTH, _HEIGHT, _LEFT, _FOOT = 560.0, 340.0, 56.0, 64.0
_DECADES = (-3, 3)  # of the density over the acceptable one
_BESIDE = 1.6  # of the distance, up to which the curves are shown


@dataclass(frozen=True)
class Directions:
    """The hazard of a run by direction."""

    hazard: EnsembleHazard

    @classmethod
    def of(cls, folder: Path) -> Directions | None:
        """That of a run; None where it was not flown, or has no fragment that counts. Raises InputError if damaged."""
        from flight.files.ensemble import read_ensemble

        file = folder / "ensemble.h5"
        found = read_ensemble(file)[0] if file.is_file() else None
        return cls(found) if found is not None and found.expected.density.any() else None

    @property
    def expected(self) -> ExpectedDistance:
        """The expected distance, its directions and densities."""
        return self.hazard.expected

    @property
    def differ(self) -> bool:
        """Whether the run has a density for every direction; else one holds for all, or it is of an earlier version."""
        return self.expected.density_by_direction.size > 0

    @property
    def deciding(self) -> float:
        """Azimuth of the direction that decides (degrees)."""
        return self.expected.direction or 0.0

    def _index(self, azimuth: float) -> int:
        known = self.expected.azimuth
        return round(azimuth / 360.0 * len(known)) % len(known)

    def densities(self, azimuth: float) -> NDArray[np.float64]:
        """Expected densities on the ground and normal to the paths (2, j) over the acceptable one."""
        expected = self.expected
        there = expected.density_by_direction[:, self._index(azimuth)] if self.differ else expected.density
        return np.asarray(there, dtype=np.float64) / self.hazard.criteria.density

    def facts(self, azimuth: float, texts: Texts) -> list[tuple[str, str]]:
        """Distance, bound, throw and numbers of fragments in a direction."""
        expected, at = self.expected, self._index(azimuth)
        sector = round(azimuth / 360.0 * len(self.hazard.azimuth)) % len(self.hazard.azimuth)
        known, counts = not self.hazard.undetermined, self.hazard.by_sector
        width = 360.0 / len(self.hazard.azimuth)
        rows = {
            "shown_direction": f"{expected.azimuth[at]:g}°" if self.differ else "",
            "expected": metres(expected.by_direction[at]) if known else "",
            "upper": metres(expected.upper_by_direction[at]) if known and expected.upper is not None else "",
            "throw": f"{metres(counts['max_throw'].median[sector])} ({width:g}°)",
            "fragments": f"{number(counts['fragments'].pooled[sector], 3)} ({width:g}°)",
            "hazardous": f"{number(counts['hazardous'].pooled[sector], 3)} ({width:g}°)",
        }
        return [(texts(f"direction.{name}"), words) for name, words in rows.items() if words]

    def svg(self, azimuth: float, texts: Texts) -> str:
        """Both densities over distance on a logarithmic axis, with the criterion and the distance in this direction."""
        expected, (low, high) = self.expected, _DECADES
        reach = float(expected.by_direction[self._index(azimuth)])
        last = float(expected.radius[expected.density.any(axis=0)].max())
        end = min(last, _BESIDE * max(reach, expected.distance)) if expected.distance > 0.0 else last

        def x(distance: float) -> float:
            return _LEFT + (_WIDTH - _LEFT - 12.0) * distance / end

        def y(decade: float) -> float:
            return 12.0 + (_HEIGHT - 12.0 - _FOOT) * (high - decade) / (high - low)

        parts = []
        for decade in range(low, high + 1):
            parts.append(f'<path class="extension" d="M{_LEFT} {y(decade):.1f}H{_WIDTH - 12}"/>')
            parts.append(f'<text class="small end" x="{_LEFT - 5}" y="{y(decade) + 4:.1f}">{10.0**decade:g}</text>')
        step = round_length(end / 3.0)
        parts += [f'<text class="small" x="{x(tick):.1f}" y="{y(low) + 15:.1f}">{tick:g}</text>'
                  for tick in np.arange(0.0, end, step)]  # fmt: skip
        shown = (expected.radius <= end) & (expected.radius > 0.0)
        for kind, curve in zip(("ground-curve", "normal-curve"), self.densities(azimuth), strict=True):
            height = np.log10(np.clip(curve[shown], 10.0**low, 10.0**high))
            points = " ".join(f"{x(r):.1f},{y(h):.1f}" for r, h in zip(expected.radius[shown], height, strict=True))
            parts.append(f'<polyline class="{kind}" points="{points}"/>')
        parts.append(f'<path class="criterion" d="M{_LEFT} {y(0):.1f}H{_WIDTH - 12}"/>')
        if reach > 0.0 and not self.hazard.undetermined:
            parts.append(f'<path class="axis" d="M{x(reach):.1f} 12V{y(low):.1f}"/>')
            parts.append(f'<text class="small start halo" x="{x(reach) + 4:.1f}" y="22">{escape(metres(reach))}</text>')
        area = f"{1.0 / self.hazard.criteria.density:.1f} m²"
        words = texts("direction.curve", area=area)
        legend = "".join(
            f'<path class="{kind}" d="M{at} {_HEIGHT - 12}h24"/>'
            f'<text class="small start" x="{at + 29}" y="{_HEIGHT - 8}">{escape(texts(f"direction.{name}"))}</text>'
            for at, kind, name in (
                (20, "ground-curve", "ground"), (190, "normal-curve", "normal"), (370, "criterion", "criterion"),
            )
        )  # fmt: skip
        title = f'<text class="small" x="{0.5 * _WIDTH}" y="{y(low) + 31:.1f}">{escape(words)}</text>'
        box = f'viewBox="0 0 {_WIDTH:g} {_HEIGHT:g}" role="img" aria-label="{escape(words)}"'
        return f"<svg {box}>{''.join(parts)}{title}{legend}</svg>"
