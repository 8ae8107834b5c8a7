"""Directions of natural fragments: the panel test of the 75 mm M48 by polar zone, and the scatter of directions."""
