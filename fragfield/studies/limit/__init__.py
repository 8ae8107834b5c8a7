"""`fragfield limit`: the largest number of rounds for which a case still meets its criteria."""

from __future__ import annotations

from fragfield.studies.limit.criteria import LimitCriteria
from fragfield.studies.limit.plan import plan_limit
from fragfield.studies.limit.results import print_limit
from fragfield.studies.limit.search import find_limit

__all__ = ["LimitCriteria", "find_limit", "plan_limit", "print_limit"]
