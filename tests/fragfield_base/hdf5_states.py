"""A file of states: what the tests of HDF5 files create and read."""

from __future__ import annotations

import numpy as np

from fragfield_base.hdf5_files import creating, reading
from fragfield_base.writing import DRAFT

__all__ = ["RefusedError", "create", "no_leftovers", "state", "states"]


class RefusedError(Exception):
    """The error class that the calls below are given."""


def state(number):
    return np.arange(1000.0) + 1e3 * number


def create(path, number=1):
    with creating(path, RefusedError) as file:
        file.attrs["title"] = "states"
        file["cells"] = np.arange(5000)
        for one in range(number):
            file[f"steps/{one}/data"] = state(one)


def states(path):
    with reading(path, RefusedError) as file:
        assert np.array_equal(file["cells"], np.arange(5000))
        for name, step in file["steps"].items():
            assert np.array_equal(step["data"], state(int(name)))
        return len(file["steps"])


def no_leftovers(folder, path):
    assert [entry.name for entry in folder.iterdir() if entry.name.endswith(DRAFT)] == []
    assert path.is_file()
