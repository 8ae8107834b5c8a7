"""Samples of uncertain inputs, what they do to the distance, and one budget."""
