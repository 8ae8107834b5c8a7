"""The command line: results on stdout, progress and messages on stderr, exit codes 0, 2, 3, 4 and 130.

The commands stand on the Python interface (`fragfield.interface`). Nothing heavy is imported here: each command imports
what it needs, so `fragfield fly` works without dolfinx.
"""

from __future__ import annotations

import os
import signal
import sys

from fragfield.cli import computing, looking, studies
from fragfield.cli.application import app
from fragfield.errors import EXIT_INTERRUPTED, exit_code_of, interrupt

__all__ = ["app", "computing", "looking", "main", "studies"]


def main() -> None:
    """Entry point of the command `fragfield`."""
    # A batch system ends a job by SIGTERM: treated like Ctrl-C, the burst leaves a checkpoint.
    # While it steps or writes a file, `fragfield_base.interruption` defers both to where they do no harm.
    signal.signal(signal.SIGTERM, interrupt)
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # not ignored, as in the background
        signal.signal(signal.SIGINT, interrupt)
    try:
        try:
            app()
        finally:
            sys.stdout.flush()
    except KeyboardInterrupt:  # before or after the guarded part
        sys.exit(EXIT_INTERRUPTED)
    except OSError as error:  # standard output: on a full disk, or `fragfield info RUN | head`
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        if not isinstance(error, BrokenPipeError):
            sys.stderr.write(f"fragfield: standard output: {error.strerror or error}\n")
        sys.exit(exit_code_of(error))
    finally:
        # All is done: what comes while libraries and Python itself are closed has nothing to interrupt any more.
        for number in (signal.SIGTERM, signal.SIGINT):
            if signal.getsignal(number) is interrupt:
                signal.signal(number, signal.SIG_IGN)
