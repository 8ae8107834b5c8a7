"""`python -m benchmarks [NAME...] [--json]`: measure and print; times in seconds, ratios within this run."""

from __future__ import annotations

import argparse
import json
import sys
from typing import TYPE_CHECKING

from benchmarks.burst import step, threads

if TYPE_CHECKING:
    from collections.abc import Sequence

BENCHMARKS = {"step": step, "threads": threads}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the benchmarks that are named, or all, and return the exit code."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(BENCHMARKS)}; all by default")
    parser.add_argument("--json", action="store_true", help="one object on stdout")
    options = parser.parse_args(arguments)
    unknown = [name for name in options.names if name not in BENCHMARKS]
    if unknown:
        print(f"benchmarks: none is named {unknown[0]!r}; there are {', '.join(BENCHMARKS)}", file=sys.stderr)
        return 2
    found = {name: BENCHMARKS[name]() for name in options.names or BENCHMARKS}
    if options.json:
        print(json.dumps(found, indent=1))
        return 0
    for name, figures in found.items():
        print(name)
        for key, value in figures.items():
            print(f"  {key:24s} {value:.4g}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
