"""What all stages share and none of them owns: files that are written whole or not at all, and caches that are safe.

It contains nothing about rounds or fragments. `flight`, `transition`, `burst_fenicsx` and `fragfield` import it; it
imports none of them, and h5py only where an HDF5 file is opened. Every function that meets a file takes the error class
of its caller, so that each package raises its own.
"""

from __future__ import annotations
