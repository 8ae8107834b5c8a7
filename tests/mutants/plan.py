"""A plugin of pytest for one trial: tests in a given order, each with its processor time, until one fails.

MUTANTS_PLAN names a JSON file: `order` (seconds by test; quick ones come first), `only` (whether other tests are left
out), `limit` (processor seconds a test may take; 0 for any), `decisive` (whether only failed assertions and errors of
the program's own end the trial) and `record`, a file to which a line for every test is added.
"""

from __future__ import annotations

import ctypes
import json
import math
import os
import resource
import signal
import threading
import time
from collections import defaultdict
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from collections.abc import Iterator

_PLAN = json.loads(Path(os.environ["MUTANTS_PLAN"]).read_text())
_ORDER: dict[str, float] = _PLAN["order"]
_OWN = ("burst_fenicsx.", "transition.", "flight.", "fragfield.", "fragfield_base.")


class _TooLongError(BaseException):
    """A test has used up its time; not an Exception, which the program might catch."""


def _seconds() -> float:
    used = [resource.getrusage(whose) for whose in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(one.ru_utime + one.ru_stime for one in used)


def _is_shared(item: pytest.Item) -> bool:
    """Whether a test asks for what is made once for its file or class."""
    found = item._fixtureinfo.name2fixturedefs.values()
    return any(definitions[-1].scope in ("module", "class", "package") for definitions in found)


@pytest.hookimpl(trylast=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Quick tests first; those that share something with others of their file stay together, behind the others."""
    if _PLAN["only"]:
        left_out = [item for item in items if item.nodeid not in _ORDER]
        config.hook.pytest_deselected(items=left_out)
        items[:] = [item for item in items if item.nodeid in _ORDER]
    of_file: dict[Path, float] = defaultdict(float)
    for item in items:
        of_file[item.path] += _ORDER.get(item.nodeid, 0.0)

    def key(item: pytest.Item) -> tuple[bool, float, str, float]:
        own = _ORDER.get(item.nodeid, 0.0)
        return (True, of_file[item.path], str(item.path), own) if _is_shared(item) else (False, own, "", own)

    items.sort(key=key)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Iterator[None]:
    """Stop a test that takes too long, and record what it took."""
    item.config.stash[_FOUND] = found = {"test": item.nodeid, "state": "passed", "error": ""}
    begin = _seconds()
    if _PLAN["limit"]:
        signal.signal(signal.SIGPROF, _stop)
        if not _WATCH.is_alive():
            _WATCH.start()
        _WATCH.end = time.process_time() + _PLAN["limit"]
    try:
        return (yield)
    finally:
        _WATCH.end = _WATCH.hung = math.inf
        with Path(_PLAN["record"]).open("a") as file:
            file.write(json.dumps({**found, "seconds": round(_seconds() - begin, 3)}) + "\n")


_FOUND = pytest.StashKey[dict[str, str]]()


def _stop(signum: int, frame: Any) -> None:
    raise _TooLongError


class _Watch(threading.Thread):
    """Ends a test that takes too long in all threads.

    Whoever has started a thread waits for it, and plain kernels take their time there; a timer's signal may reach such
    a thread, and then leaves the main one waiting.
    """

    def __init__(self) -> None:
        super().__init__(daemon=True)
        self.end = math.inf  # of the process's time (s)
        self.hung = math.inf  # on the clock (s), once a test has been stopped

    def run(self) -> None:
        """Look again and again."""
        while True:
            time.sleep(0.02)
            if time.monotonic() > self.hung:
                os._exit(1)
            if time.process_time() < self.end:
                continue
            self.end, self.hung = math.inf, time.monotonic() + _PLAN["hung"]
            main = threading.main_thread()
            for thread in threading.enumerate():
                if thread not in (main, self) and thread.ident is not None:
                    ctypes.pythonapi.PyThreadState_SetAsyncExc(
                        ctypes.c_ulong(thread.ident), ctypes.py_object(_TooLongError)
                    )
            signal.pthread_kill(main.ident or 0, signal.SIGPROF)


_WATCH = _Watch()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item, call: pytest.CallInfo) -> Iterator[pytest.TestReport]:
    """Note what a test has failed by, and end the trial if that decides it."""
    report = yield
    if report.skipped:
        item.config.stash[_FOUND]["state"] = "skipped"
    if report.failed:
        error = call.excinfo.type
        decisive = issubclass(error, (AssertionError, pytest.fail.Exception)) or error.__module__.startswith(_OWN)
        item.config.stash[_FOUND] |= {"state": "failed" if decisive else "error", "error": error.__name__}
        if _PLAN["decisive"] is not None and (decisive or not _PLAN["decisive"]):
            item.session.shouldstop = "a test has failed"
    return report
