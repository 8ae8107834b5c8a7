"""Two steel tubes that burst side by side: how much metal flies along the plane between them, against another code."""
