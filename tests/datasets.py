"""What HDF5 files hold, and whether two of them, or two folders of them, hold the same to the last bit."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import h5py
import numpy as np

if TYPE_CHECKING:
    from pathlib import Path

__all__ = ["datasets", "differing", "same_data"]


def datasets(path: Path) -> dict[str, Any]:
    """Every data set of a file, tables column by column; of a folder those of all its files, by file."""
    if path.is_dir():
        return {f"{file.name}/{key}": item for file in sorted(path.iterdir()) for key, item in datasets(file).items()}
    found: dict[str, Any] = {}

    def take(name: str, item: Any) -> None:
        if isinstance(item, h5py.Dataset):
            values = item[()]
            columns = values.dtype.names if isinstance(values, np.ndarray | np.void) else None
            found.update({f"{name} {column}": values[column] for column in columns} if columns else {name: values})

    with h5py.File(path, "r") as file:
        file.visititems(take)
    return found


def differing(ours: Path, theirs: Path) -> list[str]:
    """Names of data sets that one file or folder lacks, or in which the two differ; NaN equals NaN."""
    one, other = datasets(ours), datasets(theirs)

    def same(name: str) -> bool:
        a, b = np.asarray(one[name]), np.asarray(other[name])
        return a.dtype == b.dtype and np.array_equal(a, b, equal_nan=a.dtype.kind == "f")

    return sorted(set(one) ^ set(other)) + [name for name in sorted(set(one) & set(other)) if not same(name)]


def same_data(ours: Path, theirs: Path) -> int:
    """Assert that two files or folders hold the same; give the number of their data sets."""
    assert differing(ours, theirs) == [], ours.name
    return len(datasets(ours))
