"""Numbers of the model that are no input: what each bounds, and why it has this value."""

from __future__ import annotations

import numpy as np

__all__ = [
    "BENT",
    "CRUSHED",
    "ENTRY",
    "EVEN_SHARING",
    "FOLDED_VOLUME",
    "FRONT_SOUND",
    "MOST_CORRECTION",
    "MOST_DAMPED",
    "MOST_STIFF",
    "NOTHING_LEFT",
    "OFF_EDGE",
    "SMOOTH",
]

# Element erosion: volumes over the initial one.

FOLDED_VOLUME = 2.0
"""From here on folded metal without strength is eroded: half of the cell is void (measured: docs/theory/contact.md)."""
NOTHING_LEFT = 0.1
"""Below, metal without strength is eroded: no pressure of a burst compresses it so far."""
CRUSHED = 0.3
"""Below, products are eroded: with gamma 3 they have 37 times their pressure at the charge's volume there; the front is
reflected by a rigid wall to 0.57."""

# Charge on casing.

MOST_CORRECTION = 30.0
"""Force of the spring over the gas's own: beyond, a node suddenly far from a wall that has folded would be shot off."""
ENTRY = 1.5
"""Steps in which a node newly met can have come in: the last one, and half of one besides."""
BENT = 0.1
"""What it may have come in besides, of the distance below: the surface bends under it."""
OFF_EDGE = 0.5
"""Of a face's size or an edge's length: a node farther beyond the rim, or deeper, has left: half a cell is its own."""
SMOOTH = float(np.cos(np.radians(45.0)))
"""Cosine between normals above which faces or edges are one smooth surface: half of a right-angled corner."""

# Contact of surfaces.

EVEN_SHARING = 1.6
"""Smallest sum of the reduced masses of a node's contacts over its own mass: that of two equal grids that meet."""

# Cells.

MOST_DAMPED = 1.0
"""Fraction of an hourglass rate that viscosity may take away in one step: beyond, the rate would change its sign."""
MOST_STIFF = 0.25
"""Square of the hourglass springs' frequency times the step: a sixteenth of what is stable, 4."""
FRONT_SOUND = 0.75
"""Sound speed of products at the front over the detonation velocity: gamma / (gamma + 1) with gamma 3."""
