"""The command line: results on stdout, progress and messages on stderr, exit codes 0, 2, 3, 4 and 130.

The commands stand on the Python interface (`fragfield.interface`). Nothing heavy is imported here: each command imports
what it needs, so `fragfield fly` works without dolfinx.
"""

from __future__ import annotations

import os
import signal
import sys
from contextlib import suppress

from fragfield.cli.application import app
from fragfield.cli.guard import finish_messages, prepare_process, silence
from fragfield.errors import EXIT_INPUT, EXIT_INTERRUPTED, InputError, exit_code_of, interrupt, interrupt_again
from fragfield_base.interruption import SIGNALS

__all__ = ["app", "main"]


_COMPLETE = "_FRAGFIELD_COMPLETE"


def main() -> None:
    """Entry point of the command `fragfield`."""
    # A batch system ends a job by SIGTERM, a lost connection by SIGHUP: treated like Ctrl-C, the burst leaves a
    # checkpoint. While it steps or writes a file, `fragfield_base.interruption` defers all to where they do no harm.
    signal.signal(signal.SIGTERM, interrupt)
    for number in SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:  # as in the background, or by nohup
            signal.signal(number, interrupt)
    sys.unraisablehook = interrupt_again
    try:
        try:
            # A shell that completes a word asks by variables, which are not for a command.
            app([] if _COMPLETE in os.environ else prepare_process(), prog_name=app.info.name)
        finally:
            sys.stdout.flush()
    except KeyboardInterrupt:  # before or after the guarded part
        sys.exit(EXIT_INTERRUPTED)
    except SystemExit as ended:
        if ended.code == 1:  # of typer and rich, where the reader of the output is gone
            sys.exit(EXIT_INPUT)
        raise
    except InputError as error:  # before the guarded part
        with suppress(OSError):
            sys.stderr.write(f"fragfield: {error}\n")
        sys.exit(exit_code_of(error))
    except OSError as error:  # standard output: on a full disk, or `fragfield info RUN | head`
        silence()
        if not isinstance(error, BrokenPipeError):
            with suppress(OSError):
                sys.stderr.write(f"fragfield: standard output: {error.strerror or error}\n")
        sys.exit(exit_code_of(error))
    finally:
        # All is done: what comes while libraries and Python itself are closed has nothing to interrupt any more.
        for number in SIGNALS:
            if signal.getsignal(number) is interrupt:
                signal.signal(number, signal.SIG_IGN)
        finish_messages()
