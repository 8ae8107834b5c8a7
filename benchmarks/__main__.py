"""Measure the speed of the burst and of the flight and print it beside its targets.

Everything that is compared is measured within this run on this machine. With --json every figure is in SI units.
"""

from __future__ import annotations

import importlib
import json
import sys
import time
from typing import TYPE_CHECKING, Any

from benchmarks.history import compare, remember
from benchmarks.options import read_options
from benchmarks.table import print_figures
from fragfield.errors import EXIT_DONE, EXIT_INPUT, EXIT_NUMERICAL, exit_code_of, nearest

if TYPE_CHECKING:
    from collections.abc import Sequence

    from benchmarks.options import Options

# Module and function of each, and what it measures; those in BY_NAME take long and run only when they are asked for.
BENCHMARKS = {
    "step": ("step.step", "whole step, beside plain FEniCSx and LULESH, and on two threads"),
    "flight": ("flight.flight", "100,000 fragments beside scipy, crossings, contact"),
    "whole": ("whole.whole", "whole bursts, single and pair, over the plain step"),
    "ranks": ("ranks.ranks", "one rank against two, and beside an independent one"),
    "compile": ("compile.compilation", "the first commands with empty caches, and again"),
}
BY_NAME = ("whole", "ranks", "compile")

_DISTURBED = 0.1  # cores that others may keep busy before it is said


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmarks that are named, or all but the long ones, and return the exit code."""
    about = {name: text for name, (_, text) in BENCHMARKS.items()}
    options = read_options(arguments, about, BY_NAME, __doc__)
    for name in options.names:
        if name not in BENCHMARKS:
            hint = nearest(name, BENCHMARKS)
            print(f"benchmarks: none is named '{name}'{hint}; there are {', '.join(BENCHMARKS)}", file=sys.stderr)
            return EXIT_INPUT
    if options.lulesh is not None and not options.lulesh.is_file():
        print(f"benchmarks: there is no file {options.lulesh}; --lulesh names LULESH's binary", file=sys.stderr)
        return EXIT_INPUT
    if options.compare is not None:
        return _compared(options)
    names = options.names or tuple(name for name in BENCHMARKS if options.readme or name not in BY_NAME)
    found = _measured(names, options)
    if options.json:
        print(json.dumps(found, indent=1))
    else:
        print_figures(found)
    if options.history or options.readme:
        for words in remember(found):
            print(f"benchmarks: moved: {words}", file=sys.stderr)
    if options.readme:
        from benchmarks.readme import write_targets

        write_targets(BENCHMARKS)
    return EXIT_DONE if all(name in found for name in names) else EXIT_NUMERICAL


def _compared(options: Options) -> int:
    """Print the figures of a revision beside those of the working tree."""
    if not options.names:
        print("benchmarks: --compare needs the names of benchmarks, such as: step whole", file=sys.stderr)
        return EXIT_INPUT
    sizes = ("--cell-size", f"{1e3 * options.cell_size:g}", "--fine-cell-size", f"{1e3 * options.fine_cell_size:g}")
    try:
        found = {"compared": compare(str(options.compare), options.names, sizes)}
    except ValueError as error:
        print(f"benchmarks: {error}", file=sys.stderr)
        return EXIT_INPUT
    if options.json:
        print(json.dumps(found, indent=1))
    else:
        print_figures(found)
    return EXIT_DONE


def _measured(names: Sequence[str], options: Options) -> dict[str, dict[str, Any]]:
    """The figures of each benchmark, and what they were taken on; the time that each takes goes to stderr.

    One whose run stops, with an untried cell size, is reported and left out.
    """
    from benchmarks.machine import Others, machine
    from benchmarks.readme import write_tables

    found: dict[str, dict[str, Any]] = {}
    for name in names:
        began, others = time.perf_counter(), Others()
        module, function = BENCHMARKS[name][0].split(".")
        try:
            found[name] = getattr(importlib.import_module(f"benchmarks.{module}"), function)(options)
        except RuntimeError as error:
            if exit_code_of(error) != EXIT_NUMERICAL:
                raise
            print(f"benchmarks: {name} stopped: {error}", file=sys.stderr)
            continue
        print(f"benchmarks: {name} took {time.perf_counter() - began:.0f} s", file=sys.stderr)
        cores = others.cores
        if cores is not None:
            found[name]["cores_busy_elsewhere"] = cores
            if cores > _DISTURBED:
                print(f"benchmarks: meanwhile other processes kept {cores:.1f} cores busy", file=sys.stderr)
        if options.readme:
            write_tables({name: found[name], "machine": machine()})
    return {**found, "machine": machine()}


if __name__ == "__main__":
    sys.exit(main())
