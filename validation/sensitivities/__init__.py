"""Sensitivities: what moves the speeds, the number of fragments and the hazardous fragment distance of a round."""

from __future__ import annotations
