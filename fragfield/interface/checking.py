"""`fragfield.check`: quantities that follow from a case before anything is computed."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fragfield.case.write import plain
from fragfield.checking import check as checking
from fragfield.checking.check import fragments_report
from fragfield.errors import InputError
from fragfield.interface.case import Case, case_of
from fragfield_base.paths import absolute

if TYPE_CHECKING:
    import os
    from collections.abc import Mapping, Sequence

__all__ = ["CheckResult", "check"]


@dataclass(frozen=True, repr=False)
class CheckResult:
    """What a case was found to be; `print` shows it as `fragfield check` does, without the case itself.

    Attributes
    ----------
    case : Case
        The case.
    found : dict
        As `fragfield check --json` prints it: `rounds`, `arrangement`, `geometry`, `mesh`, `symmetry`, `expected`,
        `warnings`, `official`, `contents`, `rules`, and `fragments` where such were given; numbers in SI. Of a case
        without a burst `case`, `fragments` and `warnings` alone.
    """

    case: Case
    found: dict[str, Any]

    @property
    def warnings(self) -> list[str]:
        """What looks doubtful in the case."""
        return list(self.found["warnings"])

    def draw(self, path: str | os.PathLike[str]) -> list[Path]:
        """Write the dimensioned drawing of the round (.svg or .png), of different rounds one each; their paths.

        Raises
        ------
        InputError
            Another ending, no round, a round from a mesh file, or no right to write.
        """
        from fragfield.checking.drawing import write_drawings

        return write_drawings(self.case.values, absolute(path, InputError))

    def __repr__(self) -> str:
        what = f"{self.found['mesh']['cells']} cells" if "mesh" in self.found else "no burst"
        return f"<fragfield.CheckResult {self.case.title!r}: {what}, {len(self.warnings)} warnings>"

    def __str__(self) -> str:
        from fragfield.checking.show import check_text

        return check_text(self.found)


def check(
    case: Case | str | os.PathLike[str],
    *,
    set: Sequence[str] | Mapping[str, Any] = (),  # noqa: A002 - as `--set`
    cell_size: str | None = None,
    fragments: str | os.PathLike[str] | None = None,
) -> CheckResult:
    """Masses, speeds, mesh and cost that follow from a case, and warnings.

    Parameters
    ----------
    case : Case or path
        A case, a case file or a run directory.
    set, cell_size
        Values that replace those of the case, see `Case.from_toml`.
    fragments : path, optional
        Fragments or an arena table that are to be flown instead of the run's own: `found["fragments"]` says what of the
        casing they hold. The case then needs no burst, and without one nothing is said of it.

    Raises
    ------
    InputError
        The case is at fault, its mesh cannot be made, or the fragments do not fit it.
    """
    found = case_of(case, set=set, cell_size=cell_size, burst=fragments is None)
    given = None if fragments is None else fragments_report(found.values, absolute(fragments, InputError))
    if found.values.burst is None and given is not None:
        return CheckResult(found, {"case": plain(found.values), **given})
    report = checking.check_report(found.values)
    if given is not None:
        report |= {"fragments": given["fragments"], "warnings": [*report["warnings"], *given["warnings"]]}
    return CheckResult(found, report)
