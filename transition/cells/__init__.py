"""Material points from the cells of the burst: hexahedra, or quadrilaterals of a meridian."""
