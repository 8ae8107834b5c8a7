"""`fragfield.run_limit`: the largest number of rounds that still meets a case's criteria."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fragfield.errors import InputError
from fragfield.interface.case import setting_of, study_folder, written_case
from fragfield.interface.tables import table_of_rows

if TYPE_CHECKING:
    import os
    from collections.abc import Mapping, Sequence

    from fragfield.interface.case import Case
    from fragfield.interface.tables import Table


@dataclass(frozen=True, repr=False)
class Limit:
    """The largest number of rounds, and what was computed to find it.

    Attributes
    ----------
    path : Path
        Holds a run directory for each run, limit.csv and limit.json.
    found : dict
        As `fragfield limit --json` prints it: `key`, `criteria`, `limit`, `first_not_met`, `words`, `exit_code` and
        `runs`.
    """

    path: Path
    found: dict[str, Any]

    @property
    def rounds(self) -> int:
        """Largest number of rounds up to which all that was computed meets the criteria; 0 where none does."""
        return 0 if self.found["limit"] is None else int(self.found["limit"]["rounds"])

    @property
    def explosive(self) -> float:
        """Net explosive quantity (kg) at the limit; 0 where not even the smallest is allowed."""
        return 0.0 if self.found["limit"] is None else float(self.found["limit"]["explosive"])

    @property
    def remarks(self) -> list[str]:
        """What is to be known of the limit: gaps, quantities that do not rise, larger prescribed distances."""
        return list(self.found["words"])

    @property
    def table(self) -> Table:
        """A row a run computed: value, rounds, net explosive quantity (kg), distances (m), `met` and reasons."""
        key = self.found["key"]
        names = ("rounds", "explosive", "recommended", "standard_error", "to_apply")
        return table_of_rows(
            "limit",
            [
                {key: str(row["values"][key]), **{name: row[name] for name in names},
                 "met": "yes" if row["met"] else "no", "reasons": "; ".join(row["reasons"])}
                for row in self.found["runs"]
            ],
        )  # fmt: skip

    def __repr__(self) -> str:
        return f"<fragfield.Limit {str(self.path)!r}: {self.rounds} rounds, {len(self.found['runs'])} runs>"

    def __str__(self) -> str:
        from fragfield.studies.limit.results import limit_words

        return "\n".join([limit_words(self.found), *(f"  {words}" for words in self.remarks)])


def run_limit(
    case: Case | str | os.PathLike[str],
    values: Mapping[str, Any] | str,
    *,
    distance: str | None = None,
    every: bool = False,
    out: str | os.PathLike[str] | None = None,
    threads: int | None = None,
    jobs: int | None = None,
    resume: bool = False,
    overwrite: bool = False,
    progress: bool = True,
) -> Limit:
    """Find the largest number of rounds for which a case still meets its criteria.

    Every exposed site must meet its criterion, and, where `distance` is given, the distance to apply for storage and
    handling (the largest of the recommended, the official and the prescribed ones) must not exceed it. The smallest and
    the largest number are computed first, then the interval between met and not met is halved.

    Parameters
    ----------
    case : Case or path
        A case file, or a case, which is written beside `out` first.
    values : mapping from one key to a range or sequence, or str
        `{"stack.count": range(1, 21)}`, `{"stack.counts": [[1, 1, 1], [2, 1, 1]]}`, or a text as the command line takes
        it, "stack.count=1..20"; the number of rounds must rise.
    distance : str, optional
        With its unit, such as "300 m".
    every : bool
        Compute every number, not by bisection.
    out : path, optional
        Folder of the runs; left out: runs/NAME_limit. A case made in Python needs one.
    threads, jobs : int, optional
        Threads of a run (default 1), and runs at one time (default: all cores).
    resume, overwrite : bool
        Keep finished runs and continue unfinished ones; replace runs of another case.
    progress : bool
        Lines on stderr while runs begin.

    Raises
    ------
    InputError
        A key or a value is not allowed, there is nothing to meet, or the folder holds runs of another case.
    """
    from fragfield.studies import limit
    from fragfield.studies.sweep import SweepOptions

    setting = values if isinstance(values, str) else _setting_of_one(values)
    folder, file = study_folder(case, out, "limit")
    plan = limit.plan_limit(written_case(case, file), setting)
    criteria = limit.LimitCriteria.of(plan.runs[0].case, distance)
    options = SweepOptions(folder, "run", threads, resume, overwrite, not progress, jobs)
    return Limit(folder, limit.find_limit(plan, criteria, options, every=every))


def _setting_of_one(values: Mapping[str, Sequence[Any]]) -> str:
    """Values of the one key as the command line takes them."""
    if len(values) != 1:
        raise InputError(f"values: found {len(values)} keys; allowed: one, such as {{'stack.count': range(1, 21)}}")
    ((key, each),) = values.items()
    return setting_of(key, list(each) if isinstance(each, range) else each)
