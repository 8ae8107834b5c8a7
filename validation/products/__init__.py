"""The detonation products by themselves: energy, effective Gurney velocity, work in a progressive detonation."""

from __future__ import annotations
