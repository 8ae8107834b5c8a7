"""Section 3.1 of the paper: one 155 mm round with TNT, its speeds, its diameter, and the numbers of its fragments."""
