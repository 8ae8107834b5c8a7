"""Sums over the cells or nodes of all ranks that are the same to the last bit on any number of ranks and threads."""

from __future__ import annotations

import numpy as np
from mpi4py import MPI

from burst_fenicsx.kernels.vectors.exact import add_exactly, column_sizes, two_constants

__all__ = ["exact_sum", "exact_sums"]

_LARGEST = 1e280  # so that sums of any number of terms are finite


def exact_sums(comm: MPI.Comm, values: np.ndarray, bins: np.ndarray | None = None, number: int = 1) -> np.ndarray:
    """Sums of rows by their bins over all ranks, (number, k); to about the precision of doubles; collective.

    Parameters
    ----------
    comm : communicator.
    values : (n, k) this rank's rows; a column with a NaN, or with values beyond 1e280, sums to NaN.
    bins : (n,) bin of each row, below `number`; left out: all rows are of one bin.
    """
    values = np.ascontiguousarray(values, dtype=float)
    rows, columns = values.shape
    largest = column_sizes(values)
    count = rows
    if comm.size > 1:
        comm.Allreduce(MPI.IN_PLACE, largest, op=MPI.MAX)
        count = comm.allreduce(rows)
    finite = largest < _LARGEST
    constants = [two_constants(value, max(count, 1)) for value in np.where(finite, largest, 1.0)]
    coarse, fine = np.array(constants).reshape(columns, 2).T.copy()
    of_rows = np.zeros(0, dtype=np.int32) if bins is None else np.asarray(bins, dtype=np.int32)
    sums = np.zeros((2, number, columns))
    add_exactly(values, of_rows, coarse, fine, sums)
    if comm.size > 1:
        comm.Allreduce(MPI.IN_PLACE, sums)
    total: np.ndarray = np.where(finite, sums[0] + sums[1], np.nan)
    return total


def exact_sum(comm: MPI.Comm, values: np.ndarray) -> float:
    """Sum of the values (n,) of all ranks, as `exact_sums`; collective."""
    return float(exact_sums(comm, np.asarray(values)[:, None])[0, 0])
