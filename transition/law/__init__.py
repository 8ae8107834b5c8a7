"""How a segment of casing breaks: segments, mean mass, Mott's law, samplers."""
