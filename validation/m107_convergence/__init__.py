"""The single M107 over cell sizes: the distance that is signed, and the axial speed through the wall."""

from __future__ import annotations
