"""Contact: bonded charge and casing (face-face), colliding surfaces (point-face), rigid planes."""

from __future__ import annotations

from burst_fenicsx.contact.forces import ContactForces

__all__ = ["ContactForces"]
