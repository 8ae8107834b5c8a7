"""Hazard of a run on its site: exposed sites, published rules, maps, and how well the distance is known."""
