"""`fragfield uncertainty`: samples of uncertain inputs, what they do to the distance, and one budget."""

from __future__ import annotations

from fragfield.studies.uncertainty.study import StudyOptions, run_study

__all__ = ["StudyOptions", "run_study"]
