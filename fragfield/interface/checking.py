"""`fragfield.check`: quantities that follow from a case before anything is computed."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from fragfield.checking import check as checking
from fragfield.interface.case import Case, case_of

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
        `warnings`, `official`, `contents`, `rules`; numbers in SI.
    """

    case: Case
    found: dict[str, Any]

    @property
    def warnings(self) -> list[str]:
        """What looks doubtful in the case."""
        return list(self.found["warnings"])

    def __repr__(self) -> str:
        cells, warnings = self.found["mesh"]["cells"], len(self.warnings)
        return f"<fragfield.CheckResult {self.case.title!r}: {cells} cells, {warnings} warnings>"

    def __str__(self) -> str:
        from fragfield.checking.show import check_text

        return check_text(self.found)


def check(
    case: Case | str | os.PathLike[str],
    *,
    set: Sequence[str] | Mapping[str, Any] = (),  # noqa: A002 - as `--set`
    cell_size: str | None = None,
) -> CheckResult:
    """Masses, speeds, mesh and cost that follow from a case, and warnings.

    Parameters
    ----------
    case : Case or path
        A case, a case file or a run directory.
    set, cell_size
        Values that replace those of the case, see `Case.from_toml`.

    Raises
    ------
    InputError
        The case is at fault, or its mesh cannot be made.
    """
    found = case_of(case, set=set, cell_size=cell_size)
    return CheckResult(found, checking.check_report(found.values))
