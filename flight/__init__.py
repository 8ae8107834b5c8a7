"""Flight of fragments through air to the ground, and the hazard they make."""

from __future__ import annotations

from flight.errors import FlightWarning, InputError
from flight.fragments import Fragments

__all__ = ["FlightWarning", "Fragments", "InputError"]
