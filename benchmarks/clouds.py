"""Clouds of fragments that the benchmarks of the flight share."""

from __future__ import annotations

import math

import numpy as np

from flight import Fragments

__all__ = ["burst_cloud", "two_tubes"]


def burst_cloud(number: int, seed: int = 0) -> Fragments:
    """0.1 g to 0.5 kg (uniform in the logarithm), 300 to 2000 m/s, all directions, up and down, from 1 m height."""
    generator = np.random.default_rng(seed)
    mass = np.exp(generator.uniform(math.log(1e-4), math.log(0.5), number))
    direction = generator.normal(size=(number, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    return Fragments(
        mass, (0.0, 0.0, 1.0), direction * generator.uniform(300.0, 2000.0, number)[:, None]
    )  # fmt: skip


def two_tubes(number: int, seed: int = 0) -> Fragments:
    """The fragments of two casings of 32 kg that burst side by side, by Mott's law, at 800 to 1200 m/s."""
    generator = np.random.default_rng(seed)
    mass = generator.exponential(size=number) ** 2
    azimuth = generator.uniform(0.0, 2.0 * np.pi, number)
    outward = np.stack([np.cos(azimuth), np.sin(azimuth), np.zeros(number)], axis=1)
    side = np.where(np.arange(number) % 2, 0.2, -0.2)
    position = 0.13 * outward + np.stack([side, 0.0 * side, generator.uniform(1.2, 1.8, number)], axis=1)
    velocity = outward * generator.uniform(800.0, 1200.0, number)[:, None]
    velocity[:, 2] = generator.normal(0.0, 60.0, number)
    return Fragments(mass * (64.0 / mass.sum()), position, velocity)
