"""Warnings of a stage as records of summary.json: stage, code, severity and text."""

from __future__ import annotations

import logging
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from fragfield.terminal.logs import LOGGERS, concerns_the_user, words_of

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fragfield.pipeline.job import Job

__all__ = ["recorded_warnings"]


class _Records(logging.Handler):
    """Keeps every warning of our own once."""

    def __init__(self, stage: str) -> None:
        super().__init__(logging.WARNING)
        self.stage = stage
        self.found: list[dict[str, Any]] = []
        self.addFilter(concerns_the_user)

    def emit(self, record: logging.LogRecord) -> None:
        """Keep a record: `code` and the words are those given with it, the severity is its level."""
        entry = {
            "stage": self.stage,
            "code": getattr(record, "code", "other"),
            "severity": record.levelname.lower(),
            "text": words_of(record),
        }
        if entry not in self.found:
            self.found.append(entry)


@contextmanager
def recorded_warnings(job: Job, stage: str) -> Iterator[None]:
    """Put what the packages warn of during a stage into summary.json, part "findings", instead of earlier ones of it.

    The part is there, empty, where nothing was warned of.
    Nothing is recorded of a stage that ends with an exception, or on ranks other than the first.
    """
    records = _Records(stage)
    for name in LOGGERS:
        logging.getLogger(name).addHandler(records)
    try:
        yield
    finally:
        for name in LOGGERS:
            logging.getLogger(name).removeHandler(records)
    if not job.team.first:
        return
    before = job.source.summary().get("findings")
    now = [*(one for one in before or [] if one["stage"] != stage), *records.found]
    if now != before and (now or stage != "report"):  # a report adds its page, and no key to a run of an older version
        job.note({"findings": now})
