"""What was computed by symmetry, in words; of plain data, so that the report needs no mesh."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    import numpy as np
    from numpy.typing import NDArray

__all__ = ["plane_equation", "symmetry_words"]


def symmetry_words(found: Mapping[str, Any]) -> list[str]:
    """Lines in words on a summary of `SymmetricPart.summary`, for log, check and report.

    Empty where every round is computed in full and no plane was refused.
    """
    lines = []
    if found["planes"]:
        computed = [
            f"{_share(one['share'])} of {one['name']}" if one["share"] < 1.0 else one["name"]
            for one in found["computed_rounds"]
        ]
        planes = [_plane_words(one) for one in found["planes"]]
        lines.append(
            f"symmetry: {_share(found['share'])} of the arrangement is computed ({_listed(computed)}), bounded by "
            f"{_listed(planes)}; the rest are its images, joined to whole rounds before the break-up"
        )
    lines += [f"no symmetry about the plane normal to {_direction(one['normal'])}: {one['reason']}"
              for one in found["not_used"]]  # fmt: skip
    return lines


def plane_equation(normal: Sequence[float] | NDArray[np.float64], point: Sequence[float] | NDArray[np.float64]) -> str:
    """For example "x = 0 mm", or the normal where it is along no axis."""
    along = [index for index in range(3) if abs(abs(normal[index]) - 1.0) < 1e-9]
    if along:
        return f"{'xyz'[along[0]]} = {1e3 * point[along[0]] + 0.0:.6g} mm"
    return f"normal {_direction(normal)}"


def _direction(normal: Sequence[float] | NDArray[np.float64]) -> str:
    for index in range(3):
        if abs(abs(normal[index]) - 1.0) < 1e-9:
            return "xyz"[index]
    return "(" + ", ".join(f"{value:.3g}" for value in normal) + ")"


def _plane_words(plane: Mapping[str, Any]) -> str:
    through = plane["through_rounds"]
    where = f"through {_listed(through)}" if through else "between rounds"
    return f"{plane_equation(plane['normal'], plane['point'])} ({where})"


def _share(value: float) -> str:
    return {1.0: "all", 0.5: "a half", 0.25: "a quarter", 0.125: "an eighth"}[value]


def _listed(words: Sequence[str]) -> str:
    if len(words) > 4:
        return f"{words[0]}, {words[1]}, ... {words[-1]} ({len(words)})"
    return " and ".join([", ".join(words[:-1]), words[-1]]) if len(words) > 1 else words[0]
