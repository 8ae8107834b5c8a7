"""What the command line of the benchmarks asks for."""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

__all__ = ["Options", "read_options"]


@dataclass(frozen=True)
class Options:
    """See `python -m benchmarks --help`.

    Attributes
    ----------
    cell_size, fine_cell_size : m, of the round whose step is timed, and of the whole bursts.
    """

    names: tuple[str, ...] = ()
    json: bool = False
    readme: bool = False
    quick: bool = False
    lulesh: Path | None = None
    history: bool = False
    compare: str | None = None
    cell_size: float = 5e-3
    fine_cell_size: float = 3e-3


def read_options(
    arguments: Sequence[str] | None, about: Mapping[str, str], by_name: Sequence[str], description: str | None
) -> Options:
    """Read the command line (None: of this process); argparse ends the process where it is at fault.

    `about` says of each benchmark what it measures; those in `by_name` take long and run only when named.
    """
    listed = "\n".join(f"  {name:14s} {text}{' (only by name)' * (name in by_name)}" for name, text in about.items())
    parser = argparse.ArgumentParser(
        prog="python -m benchmarks",
        description=description,
        epilog=f"benchmarks:\n{listed}",
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("names", nargs="*", metavar="NAME", help="which; left out: all but the long ones")
    parser.add_argument("--json", action="store_true", help="one object on stdout, in SI units")
    parser.add_argument(
        "--readme", action="store_true", help="write the tables of benchmarks/README.md again; a line in history/"
    )
    parser.add_argument("--history", action="store_true", help="add a line to benchmarks/history/, say what has moved")
    parser.add_argument("--compare", metavar="REV", help="the named ones on a revision of git and here, in turns")
    parser.add_argument("--quick", action="store_true", help="flight and ranks: fewer fragments and repeats")
    parser.add_argument("--lulesh", type=Path, metavar="PATH", help="binary of LULESH 2.0 to compare the step with")
    size = "cells of {} in mm, {:g} by default"
    parser.add_argument("--cell-size", type=_millimetres, metavar="MM", help=size.format("the timed round", 5))
    parser.add_argument("--fine-cell-size", type=_millimetres, metavar="MM", help=size.format("whole bursts", 3))
    given: dict[str, Any] = vars(parser.parse_args(arguments))
    given["names"] = tuple(given["names"])
    return Options(**{key: value for key, value in given.items() if value is not None})


def _millimetres(text: str) -> float:
    """A length in mm as one in m."""
    value = float(text)
    if not 1.0 <= value <= 20.0:
        raise ValueError(text)
    return 1e-3 * value
