"""Case 3.1 of Wang et al.: a single 155 mm round with 8 kg of TNT."""

from __future__ import annotations
