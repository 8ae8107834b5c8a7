"""Which of the validation's checks bear on a run: a check has subjects, and a run has each subject or has not.

A check bears on a run that has all of its subjects. One of a study that is not listed here bears on every run: evidence
is left out only where it is known to be of something else.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from fragfield.report.reading.run_files import RunFiles

__all__ = ["STUDIES", "SUBJECTS", "bears_on"]


def _has_burst(run: RunFiles) -> bool:
    return "burst" in run.stages


def _collides(run: RunFiles) -> bool:
    """Whether a casing can meet another one or a plane; of a run without its case that is not known."""
    return _has_several_rounds(run) or (_has_burst(run) and run.case is not None and bool(run.case.plane))


def _has_several_rounds(run: RunFiles) -> bool:
    """Whether there is more than one round, images behind planes of symmetry among them; alike."""
    if run.case is None:
        return _has_burst(run)
    images = any(plane.kind == "symmetry" for plane in run.case.plane)
    return _has_burst(run) and (len(run.case.round) > 1 or images)


def _products(law: str) -> Callable[[RunFiles], bool]:
    def has(run: RunFiles) -> bool:
        burst = run.case.burst if run.case is not None else None
        return _has_burst(run) and (burst is None or burst.products == law)

    return has


SUBJECTS: dict[str, Callable[[RunFiles], bool]] = {
    "burst": _has_burst,
    "three dimensions": lambda run: _has_burst(run) and run.geometry == "3d",
    "meridian": lambda run: _has_burst(run) and run.is_axisymmetric,
    "casings that collide": _collides,
    "several rounds": _has_several_rounds,
    "landau": _products("landau"),
    "landau_cj": _products("landau_cj"),
    "jwl": _products("jwl"),
}
"""What a run may have: kinds of burst, laws of the products."""

_STACKS = ("several rounds", "three dimensions")

STUDIES: dict[str, tuple[str, ...]] = {
    "products": ("burst",),
    "solid": ("burst",),
    "axisymmetric": ("meridian",),
    "copper_cylinder": ("burst",),
    "steel_tubes": ("burst",),
    "colliding_tubes": ("casings that collide",),
    "stack_trends": _STACKS,
    "mean_mass": ("burst",),
    "polar_zones": ("burst",),
    "attitudes": ("burst",),
    "paper_3_1": ("burst",),
    "paper_3_2": _STACKS,
    "m107_1944": ("burst",),
    "m107_convergence": ("burst",),
    "m107_pair": _STACKS,
    "sensitivities": ("burst",),
}
"""Subjects of the checks of each study."""

_CHECKS = (
    # The same rounds in both geometries: whichever is nearer the truth, the difference is a matter of both.
    ("axisymmetric", r"against three dimensions|the farthest apart$", ("burst",)),
    ("m107_1944", r"^law prescribed", ()),  # of the flight, which every run has
)
"""Checks, by a pattern of their quantity, whose subjects are not those of their study."""

_LAWS_COMPARED = ("products", "axisymmetric", "copper_cylinder")
"""Studies whose checks name a law of the products where they are of that law alone."""


def bears_on(check: Mapping[str, Any], run: RunFiles) -> bool:
    """Whether a check, as the record has it, says something of a run."""
    study, quantity = check["case"], check["quantity"]
    others = [found for name, pattern, found in _CHECKS if name == study and re.search(pattern, quantity)]
    subjects = others[0] if others else STUDIES.get(study, ())
    law = re.search(r"\b(landau_cj|landau|jwl)\b", quantity) if study in _LAWS_COMPARED else None
    return all(SUBJECTS[subject](run) for subject in (*subjects, *([law[1]] if law else [])))
