"""Files that the checks read: published values beside a module, and snapshots of bursts."""

from __future__ import annotations

import tomllib
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import h5py

from validation.runs import StudyError

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["reference_beside", "snapshot_of"]


def reference_beside(module: str) -> dict[str, Any]:
    """The published values in reference.toml beside a module, given its `__file__`."""
    return tomllib.loads((Path(module).parent / "reference.toml").read_text(encoding="utf-8"))


@contextmanager
def snapshot_of(path: Path) -> Iterator[h5py.File]:
    """A burst's snapshot, open for reading.

    Raises
    ------
    StudyError
        The file is no snapshot, or the block does not find in it what it looks for.
    """
    try:
        with h5py.File(path, "r") as file:
            yield file
    except (OSError, KeyError) as error:
        raise StudyError(f"{path}: no snapshot of a burst: {error}") from None
