"""Drag coefficient over Mach number: built-in tables, a user's table, or a constant."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import lru_cache
from importlib import resources
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from flight.arguments import require_number
from flight.errors import InputError
from flight.files.text_tables import import_hint, line_of_row, read_columns
from flight.scene.tables import evaluate_pieces, monotone_pieces
from fragfield_base.errors import names_allowed
from fragfield_base.reading import read_text

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray


BUILT_IN = {
    "shell_fragment": "shell_fragment_tp12.csv",
    "sphere": "sphere_gs.csv",
    "cube_face_on": "cube_face_on_hoerner.csv",
    "cube_corner_on": "cube_corner_on_hoerner.csv",
}
MOST_BINS = 1_000_000  # of the look-up grid
MOST_MACH, MOST_COEFFICIENT = 100.0, 100.0


@dataclass(frozen=True, eq=False, repr=False)
class Drag:
    """Drag coefficient over Mach number, referred to the presented area A = (m/k)^(2/3).

    Between entries a cubic that never overshoots (PCHIP); below the first and above the last entry the coefficient is
    constant, and `fly` counts the fragments that went there.

    Attributes
    ----------
    mach, coefficient : (n,) float64
        Entries, Mach rising. A single entry is a constant coefficient.
    name, source : str
        For reports.
    """

    mach: NDArray[np.float64]
    coefficient: NDArray[np.float64]
    name: str = "table"
    source: str = field(default="", repr=False)

    def __post_init__(self) -> None:
        """Refuse a table that cannot be read."""
        mach, coefficient = self.mach, self.coefficient
        if mach.ndim != 1 or mach.size == 0 or coefficient.shape != mach.shape:
            raise InputError(f"drag {self.name}: {mach.shape} Mach numbers and {coefficient.shape} coefficients")
        fault = _fault(mach, coefficient)
        if fault is not None:
            row, found = fault
            raise InputError(f"drag {self.name}: entry {row}: {found}")

    def __repr__(self) -> str:
        return f"<flight.Drag {self.name!r}: {self.mach.size} entries to Mach {self.mach[-1]:.4g}>"

    def scaled(self, factor: float) -> Drag:
        """The same table with every coefficient multiplied by a positive factor; raises InputError otherwise."""
        if factor == 1.0:
            return self
        require_number("drag", "factor", factor, "", above=0.0)
        source = f"{self.source} (times {factor:g})" if self.source else ""
        return Drag(self.mach, self.coefficient * factor, f"{self.name} times {factor:g}", source)

    @classmethod
    def constant(cls, coefficient: float) -> Drag:
        """One coefficient at every Mach number."""
        require_number("drag", "constant coefficient", coefficient, "", low=0.0)
        return cls(np.zeros(1), np.array([float(coefficient)]), "constant")

    @classmethod
    def named(cls, name: str) -> Drag:
        """Return a built-in table: shell_fragment, sphere, cube_face_on or cube_corner_on."""
        if name not in BUILT_IN:
            raise InputError(f"drag: unknown table {name!r}{names_allowed(name, BUILT_IN)}, or give a .csv file")
        return _built_in(name)

    @classmethod
    def read(cls, path: str | Path) -> Drag:
        """Read a table of one's own: CSV with the columns mach, cd; lines that start with # say the source."""
        return cls._from_file(Path(path), str(path))

    @classmethod
    def of(cls, value: Drag | str | Path | float) -> Drag:
        """Return the drag that a user means by a Drag, a built-in name, a .csv file or a number."""
        if isinstance(value, Drag):
            return value
        if isinstance(value, int | float):
            return cls.constant(float(value))
        if isinstance(value, Path) or str(value).lower().endswith(".csv"):
            return cls.read(value)
        return cls.named(str(value))

    @classmethod
    def _from_file(cls, path: Path, name: str) -> Drag:
        columns = read_columns(path, "drag")
        if set(columns) != {"mach", "cd"}:
            names = ", ".join(columns)
            raise InputError(f"{path}: columns are {names}; a drag table has mach, cd{import_hint(path, 'drag')}")
        lines = read_text(path, InputError).splitlines()
        fault = _fault(columns["mach"], columns["cd"])
        if fault is not None:
            raise InputError(f"{path}, line {line_of_row(path, fault[0])}: {fault[1]}")
        source = " ".join(line.lstrip("# ").strip() for line in lines if line.startswith("#"))
        return cls(columns["mach"], columns["cd"], name, source)

    @property
    def lowest_mach(self) -> float:
        """Mach number below which the coefficient is extrapolated (0 for a constant)."""
        return float(self.mach[0]) if self.mach.size > 1 else 0.0

    @property
    def highest_mach(self) -> float:
        """Mach number above which the coefficient is extrapolated (infinite for a constant)."""
        return float(self.mach[-1]) if self.mach.size > 1 else math.inf

    def at(self, mach: ArrayLike) -> NDArray[np.float64]:
        """Drag coefficient at Mach numbers."""
        values = np.asarray(mach, dtype=np.float64)
        return evaluate_pieces(self.mach, monotone_pieces(self.mach, self.coefficient), values)

    def table(self) -> tuple[NDArray[np.float64], NDArray[np.int64], float]:
        """Rows for the kernels (n+1, 6), the row of each bin's lower end, and bins per Mach.

        A row holds its lower Mach, four coefficients in powers of the Mach above it, and the next row's lower Mach.
        The first row stands for all below the first entry, the last for all above the last; no bin holds more than
        one entry.
        """
        size = self.mach.size
        rows = np.zeros((size + 1, 6))
        rows[0, 0], rows[0, 1] = self.mach[0], self.coefficient[0]
        rows[1:, 0] = self.mach
        rows[-1, 1] = self.coefficient[-1]
        if size > 1:
            rows[1:-1, 1:5] = monotone_pieces(self.mach, self.coefficient)
        rows[:-1, 5], rows[-1, 5] = self.mach, np.inf
        # a little under the smallest gap, so that rounding never puts two entries into one bin
        width = 0.999 * float(np.diff(self.mach).min()) if size > 1 else 1.0
        if not float(self.mach[-1]) < (MOST_BINS - 1) * width:
            raise InputError(f"drag {self.name}: two Mach numbers are only {width:.1e} apart; thin the table out")
        bins = math.ceil(float(self.mach[-1]) / width) + 1
        # the lower edge as the kernel's rounding may see it; the entry in the bin is found by comparison
        lower = (np.arange(bins) - 1e-9) * width
        return rows, np.searchsorted(self.mach, lower, side="right").astype(np.int64), 1.0 / width


@lru_cache(maxsize=len(BUILT_IN))
def _built_in(name: str) -> Drag:
    with resources.as_file(resources.files("flight") / "data" / "drag" / BUILT_IN[name]) as path:
        return Drag._from_file(path, name)


def _fault(mach: NDArray[np.float64], coefficient: NDArray[np.float64]) -> tuple[int, str] | None:
    """First row that cannot stand in a table, with what was found and what is needed."""
    bad = ~(np.isfinite(mach) & (mach >= 0.0) & np.isfinite(coefficient) & (coefficient >= 0.0))
    if bad.any():
        row = int(np.argmax(bad))
        return row, f"Mach {mach[row]}, coefficient {coefficient[row]}; needed: both finite and not negative"
    far = (mach > MOST_MACH) | (coefficient > MOST_COEFFICIENT)
    if far.any():
        row = int(np.argmax(far))
        most = f"at most Mach {MOST_MACH:g} and a coefficient of {MOST_COEFFICIENT:g}"
        return row, f"Mach {mach[row]:g}, coefficient {coefficient[row]:g}; needed: {most}"
    falling = np.diff(mach) <= 0.0
    if falling.any():
        row = int(np.argmax(falling)) + 1
        return row, f"Mach {mach[row]} follows {mach[row - 1]}; needed: a table sorted by rising Mach, each once"
    return None
