"""Plan of a limit: the case with each of the values of one key, in the order of the number of rounds."""

from __future__ import annotations

import re
from itertools import pairwise
from typing import TYPE_CHECKING

from fragfield.errors import InputError
from fragfield.hazard.contents import with_images
from fragfield.studies.sweep.plan import SweepPlan, plan_sweep

if TYPE_CHECKING:
    from pathlib import Path

    from fragfield.case import CaseTable


MOST_VALUES = 200
_RANGE = re.compile(r"(?P<low>\d+)\s*\.\.\s*(?P<high>\d+)")
_EXAMPLE = 'stack.count=1..20, or stack.counts="[1,1,1],[2,1,1],[2,2,1]"'


def plan_limit(case_file: Path, setting: str) -> SweepPlan:
    """Read the values of a key and resolve the case of each.

    `case_file`: the case that is varied; `setting`: KEY=LOW..HIGH for all whole numbers from one to the other, or
    KEY=VALUE,VALUE,... as a sweep takes them; the number of rounds must rise from each value to the next. Raises
    InputError: the setting cannot be read, a case is at fault, or the number of rounds does not rise.
    """
    plan = plan_sweep(case_file, [listed_values(setting)])
    if len(plan.runs) < 2:
        raise InputError(f"found {setting!r}, a single value; needed: two or more, for example {_EXAMPLE}")
    for before, after in pairwise(plan.runs):
        counts = round_count(before.case), round_count(after.case)
        if not counts[1] > counts[0]:
            key = plan.keys[0]
            raise InputError(
                f"{key} = {before.values[key]} makes {_rounds(counts[0])}, {key} = {after.values[key]} makes "
                f"{_rounds(counts[1])}; needed: values whose number of rounds rises, for example {_EXAMPLE}"
            )
    return plan


def round_count(case: CaseTable) -> int:
    """Number of rounds of a resolved case, images behind planes of symmetry among them."""
    return len(with_images(case)) if case.round else 0


def listed_values(setting: str) -> str:
    """The setting with a range written as the list of its numbers."""
    key, equals, text = (part.strip() for part in setting.partition("="))
    if not (key and equals and text):
        raise InputError(f"found {setting!r}; needed: KEY=LOW..HIGH or KEY=VALUE,VALUE,..., for example {_EXAMPLE}")
    match = _RANGE.fullmatch(text.strip("\"'"))
    if match is None:
        if ".." in text:
            raise InputError(f"found {setting!r}; needed: whole numbers, for example {_EXAMPLE}")
        return setting
    low, high = int(match["low"]), int(match["high"])
    if not low < high:
        raise InputError(f"found {setting!r}; needed: a range that rises, for example {_EXAMPLE}")
    if high - low >= MOST_VALUES:
        raise InputError(f"found {setting!r}, {high - low + 1} values; allowed: at most {MOST_VALUES}")
    return f"{key}={','.join(str(number) for number in range(low, high + 1))}"


def _rounds(number: int) -> str:
    return f"{number} round{'' if number == 1 else 's'}"
