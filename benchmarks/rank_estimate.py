"""Ranks by simulation: balance from recorded levels, halos counted in partitions of real meshes, time and memory."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.spatial import cKDTree

from burst_fenicsx.contact.near_faces import box_around
from burst_fenicsx.contact.surfaces import contact_surfaces
from burst_fenicsx.meshing import cell_centres, merge, mesh_round
from burst_fenicsx.meshing.partition import partition
from burst_fenicsx.meshing.split import split_charges
from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from collections.abc import Sequence

    from burst_fenicsx.meshing import HexahedralMesh
    from burst_fenicsx.problem import Round

__all__ = ["History", "Measured", "balance", "cost_of", "estimate", "mesh_of", "shared_nodes", "sides", "slabs"]

_PALLET = (4, 4)  # rounds in a layer of a pallet, in whose order rounds are shared out

LATENCY, BAND_WIDTH = 2e-6, 10e9  # s and B/s: of a common network, for each rank
_OF_NODE = 24  # bytes of a vector
_OF_NEAR = 88  # bytes of another rank's surface node in contact's exchange: place, velocity, load; force and load back
_OF_SEARCHED = 28  # bytes of another rank's surface node in a search: place and number of a face
_REACH = 1.5  # of the cell size: how far a search looks around a face


@dataclass(frozen=True, eq=False)
class History:
    """Choices of the cells' steps over a burst, as one rank has made them.

    Attributes
    ----------
    mesh : whose cells these are. rounds : in order.
    duration : (choices,) s for which each was kept. step : (choices,) s, the longest steps. level : (choices, cells).
    """

    mesh: HexahedralMesh
    rounds: tuple[Round, ...]
    duration: np.ndarray
    step: np.ndarray
    level: np.ndarray

    def on(self, finer: HexahedralMesh) -> np.ndarray:
        """Levels (choices, cells) of a finer mesh of the first rounds: those of the nearest cell of the same part."""
        nearest = np.empty(len(finer.cells), dtype=np.int64)
        places, finer_places = cell_centres(self.mesh), cell_centres(finer)
        for index in np.unique(finer.round):
            for part in Part:
                here = np.flatnonzero((self.mesh.round == index) & (self.mesh.part == part))
                there = np.flatnonzero((finer.round == index) & (finer.part == part))
                if len(there):
                    nearest[there] = here[cKDTree(places[here]).query(finer_places[there])[1]]
        return self.level[:, nearest]


@dataclass(frozen=True)
class Measured:
    """What one rank and two have measured with the history's mesh, by whose cell size (m) it is scaled.

    Attributes
    ----------
    cells : of it. cell_size : m. seconds_per_cell_step : without searches. cell_steps, exchanges, contacts, searches :
        over the burst; exchanges of nodes, steps and searches of contact.
    seconds_per_search : on one rank.
    near, searched : surface nodes that a round needs of a round beside it, and that a search is sent of it, over the
        burst: at the start they stand apart.
    bytes_per_own_cell, bytes_per_cell : memory of a rank, for each of its cells and for each of all cells.
    base_bytes : memory of a rank without cells.
    """

    cells: int
    cell_size: float
    seconds_per_cell_step: float
    cell_steps: float
    exchanges: float
    contacts: float
    searches: float
    seconds_per_search: float
    near: float
    searched: float
    bytes_per_own_cell: float
    bytes_per_cell: float
    base_bytes: float


def mesh_of(rounds: Sequence[Round], cell_size: float) -> HexahedralMesh:
    """The rounds' mesh as a burst has it, charges split from their casings."""
    return split_charges(merge([mesh_round(item, cell_size, index) for index, item in enumerate(rounds)]))


def slabs(mesh: HexahedralMesh, ranks: int) -> np.ndarray:
    """Ranks of cells in runs of equal number, which are slabs across the axes: what was done before sectors."""
    return np.arange(len(mesh.cells), dtype=np.int64) * ranks // len(mesh.cells)


def cost_of(mesh: HexahedralMesh) -> np.ndarray:
    """Cost of a step of each cell (cells,), 1 for those of casings."""
    return np.where(mesh.part == Part.CHARGE, 0.8, 1.0)


def balance(
    history: tuple[np.ndarray, np.ndarray], level: np.ndarray, owner: np.ndarray, ranks: int, cost: np.ndarray
) -> float:
    """Time with a partition over that with equal work in every step: all wait for the slowest in each of them.

    `history` is how long each choice was kept and its macro step (choices,) s; `level` (choices, cells), `owner` and
    `cost` (cells,).
    """
    slowest = mean = 0.0
    for duration, step, levels in zip(*history, level, strict=True):
        for min_level in range(int(levels.max()) + 1):
            active = np.bincount(owner, weights=np.where(levels >= min_level, cost, 0.0), minlength=ranks)
            steps = 2 ** max(min_level - 1, 0) * duration / step
            slowest += steps * active.max()
            mean += steps * active.mean()
    return slowest / mean


def shared_nodes(mesh: HexahedralMesh, owner: np.ndarray, ranks: int) -> tuple[int, int]:
    """Most nodes that a rank shares with others, and most neighbours that a rank has."""
    # Twins count as one place: where one is on a rank, so is the other.
    pairs = np.unique(mesh.places[mesh.cells].ravel() * ranks + np.repeat(owner, 8))
    node, rank = pairs // ranks, pairs % ranks
    several = np.bincount(node)[node] > 1
    node, rank = node[several], rank[several]
    most = int(np.bincount(rank, minlength=ranks).max(initial=0))
    # Pairs lie by node: those of one node follow each other.
    neighbours: set[tuple[int, int]] = set()
    for apart in range(1, int(np.bincount(node).max(initial=1))):
        same = node[apart:] == node[:-apart]
        neighbours |= set(zip(rank[:-apart][same].tolist(), rank[apart:][same].tolist(), strict=True))
    of_rank = np.bincount(np.array(list(neighbours), dtype=np.int64).ravel(), minlength=ranks)
    return most, int(of_rank.max(initial=0))


def searched_nodes(pair: HexahedralMesh, owner: np.ndarray, ranks: int, cell_size: float) -> tuple[int, int, int]:
    """Surface nodes of other ranks in the box around a rank's own: most in its own round, most in the other round.

    The third is how many surface nodes there are in a round; before, every rank was sent those of all rounds. `pair`
    are two rounds, of which the first is cut for `ranks` by `owner` (its cells,).
    """
    surfaces = contact_surfaces(pair)
    place, of_round = pair.nodes[surfaces.node], surfaces.node_round
    first = len(owner)
    rank_of_node = np.full(len(pair.nodes), -1, dtype=np.int64)
    rank_of_node[pair.cells[:first]] = owner[:, None]
    rank = np.where(of_round == 0, rank_of_node[surfaces.node], ranks)
    own = other = 0
    for index in range(ranks):
        mine = place[(rank == index) & ~surfaces.interior]
        box = box_around(mine, mine) + _REACH * cell_size * np.array([-1.0, -1.0, -1.0, 1.0, 1.0, 1.0])
        near = (place >= box[:3]).all(axis=1) & (place <= box[3:]).all(axis=1) & (rank != index)
        own = max(own, int(np.count_nonzero(near & (of_round == 0))))
        other = max(other, int(np.count_nonzero(near & (of_round == 1))))
    return own, other, int(np.count_nonzero(of_round == 0))


def sides(rounds: int, ranks: int) -> int:
    """Most pairs of a rank's rounds and rounds beside them, above or below, that other ranks have."""
    place = np.array(np.unravel_index(np.arange(rounds), (rounds, *_PALLET))).T
    owner = np.arange(rounds) * min(ranks, rounds) // rounds
    beside = np.abs(place[:, None] - place[None, :]).sum(axis=2) == 1
    return int(np.bincount(owner, weights=(beside & (owner[:, None] != owner)).sum(axis=1)).max())


def estimate(history: History, measured: Measured, rounds: int, ranks: int, cell_size: float) -> dict[str, Any]:
    """A pallet of so many rounds on so many ranks: sizes, seconds of each part, memory, efficiency.

    Rounds are alike and shared out evenly: whole ones, or each to several ranks in sectors. Steps, exchanges and
    searches go with one over the cell size, surfaces with the square of that. The efficiency is what one rank would
    take over all ranks' time.
    """
    per_round = max(ranks // rounds, 1)
    pair, one, level = _finer(history, cell_size)
    cells = len(one.cells)
    owner = partition(one, history.rounds[:1], per_round)
    times = history.duration, history.step
    cost = cost_of(one)
    nodes, neighbours = shared_nodes(one, owner, per_round)
    own_near, other_near, of_round = searched_nodes(pair, owner, per_round, cell_size)
    finer = measured.cell_size / cell_size
    uneven = balance(times, level, owner, per_round, cost)

    of_rank = rounds / ranks  # rounds of a rank, or its share of one
    all_cells = rounds * cells
    cell_steps = measured.cell_steps * finer * all_cells / measured.cells
    beside = sides(rounds, ranks)
    # A round that is cut is near as many ranks of a neighbour as look at it: a quarter of them.
    partners = neighbours + beside * max(per_round // 4, 1)
    near = beside * measured.near * finer**2 / per_round
    searched = own_near + beside * max(other_near, int(measured.searched * finer**2 / per_round))
    # Measured for two rounds. A rank looks at its own surface and at what it is sent.
    search = 0.5 * measured.seconds_per_search * finer**2
    parts = {
        "seconds_of_cells": measured.seconds_per_cell_step * cell_steps / ranks * uneven,
        "seconds_of_nodes": measured.exchanges * finer * (neighbours * LATENCY + _OF_NODE * nodes / BAND_WIDTH),
        "seconds_of_contact": measured.contacts
        * finer
        * (2.0 * math.log2(ranks) * LATENCY + 4.0 * partners * LATENCY + _OF_NEAR * near / BAND_WIDTH),
        "seconds_of_searches": measured.searches
        * finer
        * (
            search * (of_rank + searched / of_round)
            + 2.0 * math.log2(ranks) * LATENCY
            + partners * LATENCY
            + _OF_SEARCHED * searched / BAND_WIDTH
        ),
    }
    alone = measured.seconds_per_cell_step * cell_steps / ranks + measured.searches * finer * search * of_rank
    return {
        "ranks": ranks,
        "rounds": rounds,
        "cell_size": cell_size,
        "cells": int(all_cells / ranks),
        "balance": uneven,
        "balance_of_slabs": balance(times, level, slabs(one, per_round), per_round, cost),
        "shared_nodes": nodes,
        "neighbours": neighbours,
        "searched_nodes": searched,
        "all_surface_nodes": rounds * of_round,
        "memory_bytes": measured.base_bytes
        + measured.bytes_per_own_cell * all_cells / ranks
        + measured.bytes_per_cell * all_cells,
        **parts,
        "efficiency": alone / sum(parts.values()),
    }


@lru_cache(maxsize=1)
def _finer(history: History, cell_size: float) -> tuple[HexahedralMesh, HexahedralMesh, np.ndarray]:
    """The history's first two rounds with other cells, the first of them alone, and that one's levels."""
    pair = mesh_of(history.rounds[:2], cell_size)
    one = _first_round(pair)
    return pair, one, history.on(one)


def _first_round(pair: HexahedralMesh) -> HexahedralMesh:
    """The first round of a mesh of several; its cells and nodes come first."""
    cells = int(np.count_nonzero(pair.round == 0))
    last = int(pair.cells[:cells].max()) + 1
    return replace(
        pair,
        nodes=pair.nodes[:last],
        cells=pair.cells[:cells],
        part=pair.part[:cells],
        round=pair.round[:cells],
        segment=pair.segment[:cells],
        station=pair.station[:cells],
        segments=pair.segments[:1],
        lengths=pair.lengths[:1],
        twins=pair.twins[(pair.twins < last).all(axis=1)],
    )
