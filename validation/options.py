"""What the command line of the validation asks for."""

from __future__ import annotations

import argparse
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

__all__ = ["Options", "read_options"]


FULL_REALISATIONS, QUICK_REALISATIONS = 200, 100


@dataclass(frozen=True)
class Options:
    """See `python -m validation --help`."""

    names: tuple[str, ...] = ()
    quick: bool = False
    json: bool = False
    readme: bool = False
    record: bool = False
    replace: bool = False
    resume: bool = False
    threads: int | None = None
    ranks: int = 1
    out: Path | None = None
    cell_size: str | None = None
    realisations: int = FULL_REALISATIONS
    run: Path | None = None
    single: Path | None = None
    pair: Path | None = None
    mirrored: Path | None = None
    sensitivities: bool = False
    scaling: bool = False


def read_options(arguments: Sequence[str] | None, cases: Iterable[str], description: str | None) -> Options:
    """Read the command line (None: of this process); argparse ends the process where it is at fault."""
    parser = argparse.ArgumentParser(prog="python -m validation", description=description)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(cases)}; all by default")
    parser.add_argument("--quick", action="store_true", help="coarse cells only")
    parser.add_argument("--cell-size", metavar='"6 mm"', help="this cell size only")
    parser.add_argument("--json", action="store_true", help="rows as JSON on stdout")
    parser.add_argument("--readme", action="store_true", help="write the README's tables and pictures from the runs")
    parser.add_argument("--record", action="store_true", help="keep the rows where the report finds them")
    fewer = "with --record or --readme: also by coarse cells or fewer rows than the record has"
    parser.add_argument("--replace", action="store_true", help=fewer)
    parser.add_argument(
        "--resume", action="store_true", help="keep finished runs of the same case, continue the others"
    )
    parser.add_argument("--threads", type=int, metavar="N", help="threads of each rank of a run")
    parser.add_argument("--ranks", type=int, default=1, metavar="N", help="MPI ranks of a run")
    parser.add_argument("--out", type=Path, metavar="DIR", help="make the runs here; default runs/validation")
    parser.add_argument("--run", type=Path, metavar="DIR", help="paper_3_1: compare this run instead of making one")
    stack = parser.add_argument_group("paper_3_2")
    stack.add_argument("--single", type=Path, metavar="DIR", help="take this run of the single round")
    stack.add_argument("--pair", type=Path, metavar="DIR", help="take this run of the pair")
    stack.add_argument("--mirrored", type=Path, metavar="DIR", help="take this run of one round before a plane")
    number = f"of every ensemble; default {FULL_REALISATIONS}, with --quick {QUICK_REALISATIONS}"
    stack.add_argument("--realisations", type=int, metavar="N", help=number)
    stack.add_argument("--sensitivities", action="store_true", help="only: what moves the ratios, at a coarser size")
    stack.add_argument("--scaling", action="store_true", help="only: time and memory a round, up to a pallet of eight")
    values = vars(parser.parse_args(arguments))
    if values["realisations"] is None:
        values["realisations"] = QUICK_REALISATIONS if values["quick"] else FULL_REALISATIONS
    if values["realisations"] < 2:
        parser.error(f"--realisations: found {values['realisations']}; a standard error needs 2 or more")
    return Options(**{**values, "names": tuple(values["names"])})
