"""Vectors, tensors and rows of one lane or of many: turned into each other, gathered, summed exactly."""
