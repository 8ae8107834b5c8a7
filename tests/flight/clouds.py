"""Clouds of fragments for the tests."""

from __future__ import annotations

import numpy as np

from flight import Fragments

GRAVITY = 9.80665
"""Written here on its own: the tests' closed forms do not take it from the program."""


def cloud(number: int, seed: int = 0, height: float = 1.5) -> Fragments:
    """0.1 g to 0.5 kg, 300 to 2000 m/s, all directions."""
    generator = np.random.default_rng(seed)
    mass = 10.0 ** generator.uniform(-4.0, np.log10(0.5), number)
    direction = generator.normal(size=(number, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    speed = generator.uniform(300.0, 2000.0, number)
    return Fragments(mass, (0.0, 0.0, height), direction * speed[:, None])
