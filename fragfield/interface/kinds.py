"""Kinds of arguments of public functions, and how the command line reads and names them."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple, TypeAlias

if TYPE_CHECKING:
    from fragfield.interface.case import Case
    from fragfield.terminal.progress import Progress


class Kind(NamedTuple):
    """How the command line reads an argument."""

    read: type
    """`list`: an option that is repeated, or several arguments; `dict`: a repeated option NAME=VALUE."""
    metavar: str
    option: str = ""
    """Its name there, where that is not the parameter's."""
    minimum: int | None = None


PathName = str | os.PathLike[str]
File = Annotated[PathName, Kind(Path, "FILE")]
Folder = Annotated[PathName, Kind(Path, "DIR")]
Stage = Annotated[str, Kind(str, "run|burst")]
RunFolder = Annotated[PathName, Kind(Path, "RUN")]
Settings = Annotated[Sequence[str] | Mapping[str, Any], Kind(list, "KEY=VALUE")]
Values = Annotated[Mapping[str, Sequence[Any]] | Sequence[str], Kind(list, "KEY=VALUE,...")]
Steps = Annotated[Mapping[str, Sequence[Any]] | str, Kind(str, "KEY=LOW..HIGH")]
Length = Annotated[str, Kind(str, "LENGTH")]
Every = Annotated[bool, Kind(bool, "", "--all")]
Samples = Annotated[int, Kind(int, "N", minimum=8)]
Seed = Annotated[int, Kind(int, "N", minimum=0)]
Count = Annotated[int, Kind(int, "N", minimum=1)]
Address = Annotated[str, Kind(str, "ADDRESS")]
if TYPE_CHECKING:
    CaseFile: TypeAlias = Case | PathName
    CaseOrRun: TypeAlias = Case | PathName
    Follow: TypeAlias = bool | Callable[[Progress], object]
else:  # neither is loaded for the options of a command
    CaseFile, CaseOrRun = (Annotated[PathName, Kind(Path, metavar)] for metavar in ("CASE", "CASE_OR_RUN"))
    Follow = Annotated[bool | Callable[..., object], Kind(Path, "FILE", "--progress-file")]
