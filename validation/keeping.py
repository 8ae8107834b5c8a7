"""What the ladder leaves behind: the record and the tables of the READMEs, which only whole results may replace.

A result is whole if its study came to an end and every row has a number. It replaces a recorded one only if it has as
many rows at least, and is not of coarse cells where the record is of full ones: a burst that stops, or whose soundness
fails, leaves comparisons out. Any other result is kept in a file of its own beside the record (`partial_path`), and the
record and the tables stay as they are.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from validation.readme import LADDER, README, insert_tables
from validation.record import RECORD, entry, overview, read_record, write_record
from validation.rows import rows_table

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from validation.options import Options
    from validation.record import Outcome

__all__ = ["incomplete", "keep", "partial_path"]

_NAMED = 3  # rows in a message


def partial_path(record: Path) -> Path:
    """Where the results lie that did not replace those of a record; a file of the same format."""
    return record.with_name(f"{record.stem}.partial{record.suffix}")


def incomplete(outcome: Outcome, recorded: Mapping[str, Any] | None, options: Options) -> str:
    """Why a result may not replace the recorded one, in words; empty if it may.

    Parameters
    ----------
    outcome : Outcome
        What the case gave now.
    recorded : mapping, optional
        The entry of the record; None if there is none.
    options : Options
        Of this call; with `replace` a whole result may have fewer rows, or coarse cells.
    """
    if outcome.stopped is not None:
        return f"stopped: {outcome.stopped}"
    if not outcome.rows:
        return "there are no rows"
    empty = [row.quantity for row in outcome.rows if not row.has_numbers]
    if empty:
        return f"rows without a number: {_some(empty)}"
    if recorded is None or options.replace:
        return ""
    if options.quick and not recorded["quick"]:
        return "these are coarse cells (--quick), the record is of full ones; --replace allows it"
    names = {row.quantity for row in outcome.rows}
    if len(outcome.rows) < len(recorded["rows"]):
        missing = [row["quantity"] for row in recorded["rows"] if row["quantity"] not in names]
        return (
            f"{len(outcome.rows)} rows, the record has {len(recorded['rows'])}, among them {_some(missing)}; "
            "--replace allows it, if the study is to have fewer"
        )
    return ""


def keep(outcomes: Mapping[str, Outcome], options: Options, order: Sequence[str], in_full: Sequence[str]) -> str:
    """Write the results of some cases into the record and into the READMEs' tables, as far as they are whole.

    Parameters
    ----------
    outcomes : mapping
        Results by case.
    options : Options
        Of this call: `record`, `readme`, `quick`, `replace`; a part of a case is no case and is not kept.
    order, in_full : sequence of str
        All cases as the tables list them; those whose rows stand in full in the ladder's README.

    Returns
    -------
    str
        What was not replaced and why, a line a case, and where it lies instead; empty if all was whole.
    """
    if options.sensitivities or options.scaling:
        return ""
    known = read_record(RECORD)
    reasons = {name: incomplete(outcome, known.get(name), options) for name, outcome in outcomes.items()}
    whole = {name: outcome for name, outcome in outcomes.items() if not reasons[name]}
    partial = {name: outcome for name, outcome in outcomes.items() if reasons[name]}
    known |= {name: entry(outcome, quick=options.quick) for name, outcome in whole.items()}
    ordered = {name: known[name] for name in order if name in known}
    where = ""
    if options.record:
        if whole:
            write_record(ordered, RECORD)
        where = f"; the result is in {_set_aside(partial, whole, options)}"
    if options.readme and whole:
        insert_tables({"validation": overview(ordered, tuple(order))}, README)
        insert_tables({name: rows_table(outcome.rows) for name, outcome in whole.items() if name in in_full}, LADDER)
    what = "record and tables" if options.record and options.readme else "the record" if options.record else "tables"
    return "\n".join(f"{name}: {what} not replaced: {why}{where}" for name, why in reasons.items() if why)


def _set_aside(partial: Mapping[str, Outcome], whole: Mapping[str, Outcome], options: Options) -> Path:
    """Add results to the file beside the record; those of cases that are whole now leave it. Its path."""
    path = partial_path(RECORD)
    kept = {name: one for name, one in read_record(path).items() if name not in whole}
    kept |= {name: entry(outcome, quick=options.quick) for name, outcome in partial.items()}
    if kept:
        write_record(kept, path)
    else:
        path.unlink(missing_ok=True)
    return path


def _some(names: Sequence[str]) -> str:
    more = [f"{len(names) - _NAMED} more"] if len(names) > _NAMED else []
    return ", ".join([*names[:_NAMED], *more])
