"""The M107 of 1944: counted fragments, their speeds and the distance of the acceptable density."""

from __future__ import annotations
