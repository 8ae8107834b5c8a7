"""Which rows of the validation bear on a run: a row has subjects, and a run has each of them or has not.

A row bears on a run that has all of its subjects. A subject that is not known here is of every run: evidence is left
out only where it is known to be of something else.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fragfield_base.substances import substance_key

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from fragfield.report.reading.run_files import RunFiles


def _has_burst(run: RunFiles) -> bool:
    return "burst" in run.stages


def _has_several_rounds(run: RunFiles) -> bool:
    """Whether there is more than one round, images behind planes of symmetry among them; unknown without the case."""
    if run.case is None:
        return _has_burst(run)
    images = any(plane.kind == "symmetry" for plane in run.case.plane)
    return _has_burst(run) and (len(run.case.round) > 1 or images)


def _collides(run: RunFiles) -> bool:
    """Whether a casing can meet another one or a plane."""
    return _has_several_rounds(run) or (_has_burst(run) and run.case is not None and bool(run.case.plane))


_WHOLE: dict[str, Callable[[RunFiles], bool]] = {
    "burst": _has_burst,
    "break_up": _has_burst,
    "three dimensions": lambda run: _has_burst(run) and run.geometry == "3d",
    "meridian": lambda run: _has_burst(run) and run.is_axisymmetric,
    "collision": _collides,
    "stack": _has_several_rounds,
}
"""Subjects of one word. "flight" is of every run, and so is what is not named."""


def _has_products(run: RunFiles, law: str) -> bool:
    burst = run.case.burst if run.case is not None else None
    return _has_burst(run) and (burst is None or burst.products == law)


def _has_profile(run: RunFiles, name: str) -> bool:
    """Whether a round of the case has this profile; of a run without its case that is not known."""
    profiles = run.case.round if run.case is not None else ()
    named = [item.profile.get("name") if isinstance(item.profile, dict) else item.profile for item in profiles]
    return _has_burst(run) and (run.case is None or name in named)


def _has_explosive(run: RunFiles, name: str) -> bool:
    """The same of an explosive, however its name is written."""
    rounds = run.case.round if run.case is not None else ()
    names = [item.explosive if isinstance(item.explosive, str) else item.explosive.name for item in rounds]
    named = [substance_key(one) for one in names]
    return _has_burst(run) and (run.case is None or substance_key(name) in named)


_NAMED = {"profile": _has_profile, "explosive": _has_explosive, "products": _has_products}
"""Subjects of two words, such as "explosive:comp_b"."""


def bears_on(row: Mapping[str, Any], run: RunFiles) -> bool:
    """Whether a row, as the record has it, says something of a run."""
    return all(_has(subject, run) for subject in row.get("subjects", ()))


def _has(subject: str, run: RunFiles) -> bool:
    kind, colon, name = subject.partition(":")
    if colon:
        return kind not in _NAMED or _NAMED[kind](run, name)
    return subject not in _WHOLE or _WHOLE[subject](run)
