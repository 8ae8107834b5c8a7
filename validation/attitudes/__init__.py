"""Distances of a single M107 over cell sizes and over its attitude: with scatter of directions neither decides."""
