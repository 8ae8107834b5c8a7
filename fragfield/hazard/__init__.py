"""Hazard of a run on its site: exposed places, published rules, maps, and how well the distance is known."""
