"""Cased charges as profiles of revolution: contours, parts, segments, exact volumes, and the files that hold them."""

from __future__ import annotations

from burst_fenicsx.geometry.contour import Contour
from burst_fenicsx.geometry.files import load_profile, profile_from_table, profile_names
from burst_fenicsx.geometry.profile import CrossSection, Fuze, PartVolumes, Profile
from burst_fenicsx.geometry.segments import Segment, SegmentKind, automatic_segments

__all__ = [
    "Contour",
    "Fuze",
    "PartVolumes",
    "Profile",
    "CrossSection",
    "Segment",
    "SegmentKind",
    "automatic_segments",
    "load_profile",
    "profile_from_table",
    "profile_names",
]
