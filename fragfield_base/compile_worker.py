"""A process that compiles kernels for the cache: `python compile_worker.py`, driven by `kernel_workers`.

It reads one JSON object a line, first {"path": places of modules}, then kernels of a list (see `kernel_lists`), and
answers each kernel with a line: empty, or why it could not be compiled. It ends with its input.
"""

from __future__ import annotations

import gc
import json
import os
import signal
import sys

__all__ = ["NOT_KEPT", "main"]

NOT_KEPT = "the cache cannot be written: "


def main() -> None:
    """Compile what comes in."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # Ctrl-C reaches the whole group: who started us ends us
    gc.disable()  # nothing that is made here is thrown away before the end; looking for it takes a tenth of the time
    answers = os.fdopen(os.dup(1), "w", encoding="utf-8")
    os.dup2(2, 1)  # whatever a module prints is no answer
    sys.path[:] = json.loads(sys.stdin.readline())["path"]
    from fragfield_base.kernel_lists import as_type, find_kernel

    for line in sys.stdin:
        wanted, fault = json.loads(line), ""
        try:
            kernel = find_kernel(wanted["kernel"])
            for arguments in wanted["arguments"]:
                kernel.compile(tuple(as_type(text) for text in arguments))
        except OSError as error:
            fault = f"{NOT_KEPT}{error}"
        except Exception as error:  # noqa: BLE001 - whatever it is, the kernel is compiled where it is needed
            fault = f"{type(error).__name__}: {error}".splitlines()[0]
        answers.write(fault + "\n")
        answers.flush()


if __name__ == "__main__":
    main()
