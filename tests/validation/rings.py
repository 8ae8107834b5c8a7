"""Ensembles on a ring made by hand: hits by a known law of the azimuth."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flight import HITS
from flight.hazard.density.ring_counts import count_by_azimuth
from validation.ensembles import RING_HITS, RingEnsemble

if TYPE_CHECKING:
    from collections.abc import Callable

LOBE = 20.0  # degrees on either side of the focus


def in_lobe(azimuth: np.ndarray) -> np.ndarray:
    """Whether within 20 degrees of 90 or 270."""
    return np.abs(azimuth % 180.0 - 90.0) < LOBE


def ring(
    seed: int,
    fragments: int,
    share: float = 1.0,
    speed: Callable[[np.ndarray], np.ndarray] = lambda azimuth: np.full(azimuth.size, 1000.0),
    realisations: int = 60,
    missed: int = 0,
) -> RingEnsemble:
    """An ensemble whose lobes hold `share` times the hits of a uniform ring, the rest of the hits elsewhere.

    Speeds are those of the law `speed` at the azimuth, spread by 10 %; every second hit is on the band.
    """
    generator = np.random.default_rng(seed)
    hitting = fragments - missed
    rows = np.zeros(realisations * hitting, dtype=HITS)
    lobes = generator.random(rows.size) < share * 4.0 * LOBE / 360.0
    azimuth = generator.uniform(0.0, 360.0, rows.size)
    while (wrong := in_lobe(azimuth) != lobes).any():
        azimuth[wrong] = generator.uniform(0.0, 360.0, int(wrong.sum()))
    rows["azimuth"], rows["direction"] = azimuth, 1
    rows["initial_speed"] = speed(azimuth) * generator.uniform(0.9, 1.1, rows.size)
    rows["speed"] = 0.7 * rows["initial_speed"]
    owner = np.repeat(np.arange(realisations), hitting)
    half = np.arange(rows.size) % 2 == 0
    every, band = count_by_azimuth(rows, owner, realisations), count_by_azimuth(rows[half], owner[half], realisations)
    off_band = fragments - np.bincount(owner[half], minlength=realisations)
    hits = np.zeros(rows.size, dtype=RING_HITS)
    hits["realisation"], hits["mass"] = owner, 0.01
    hits["azimuth"], hits["initial_speed"] = azimuth, rows["initial_speed"]
    misses = {"every_height": np.full(realisations, missed), "band": off_band}
    return RingEnsemble(np.full(realisations, fragments), every, band, misses, hits)
