"""Schema of burst_snapshot.h5, shared by the burst that writes it and by break-up and report that read it."""

from __future__ import annotations

from dataclasses import dataclass

import h5py
import numpy as np

FORMAT = "fragfield burst snapshot"
FORMAT_VERSION = 1
GEOMETRIES = {"3d": 8, "axisymmetric": 4}
"""Nodes of a cell by geometry of the burst."""
NODE_ARRAYS = ("reference", "position", "velocity")
"""Datasets of /nodes, (n, 3) each: before the burst and now (m), and m/s."""
CASING, CHARGE, FUZE = 0, 1, 2
"""Values of /cells/part."""
SEGMENT_KINDS = ("nose", "wall", "base")
ROUND_ATTRIBUTES = (
    "name", "length", "casing_density", "casing_yield", "casing_mass", "charge_mass", "fuze_mass", "explosive",
    "explosive_density", "detonation_velocity", "gurney_velocity", "position", "axis",
)  # fmt: skip
"""Attributes of /rounds/<i>, SI; `position` is the centre of the base plane."""
ALONG_COLUMNS = ("station", "mean_speed", "max_speed", "outer_diameter", "casing_mass")
"""Columns of /rounds/<i>/along, by axial station."""


@dataclass(frozen=True)
class SegmentRecord:
    """A segment of a casing: stations from the nose end (m), initial volume-mean radii and wall (m), masses (kg).

    `speed` (m/s) is the mass-weighted one at the end of the burst.
    """

    name: str
    kind: str
    start: float
    end: float
    outer_radius: float
    wall_thickness: float
    charge_radius: float
    casing_mass: float
    charge_mass: float
    speed: float


SEGMENT_COLUMNS = tuple(SegmentRecord.__dataclass_fields__)
"""Columns of /rounds/<i>/segments; the first two are texts."""
_TEXT = h5py.string_dtype()
SEGMENTS = np.dtype([(name, _TEXT if name in ("name", "kind") else np.float64) for name in SEGMENT_COLUMNS])
ALONG = np.dtype([(name, np.float64) for name in ALONG_COLUMNS])
