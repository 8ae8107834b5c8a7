"""The laws of the mean fragment mass against published counts and weighings of fragments of shells and cylinders."""

from __future__ import annotations
