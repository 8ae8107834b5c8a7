"""Two M107 in a plane section: the focus over cell sizes down to 0.5 mm, and how gap, delay and friction move it."""

from __future__ import annotations
