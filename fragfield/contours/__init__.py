"""Contours of rounds from drawings (DXF, SVG) and tables of diameters, as the tables of a profile.

`dxf`, `svg` read curves in the plane of the sheet, `curves` joins them, `section` takes outer contour and cavity from
them, `pieces` turns points into lines and arcs; `table` reads a table of diameters; `read` finds axis and nose, and is
the way from a file to a profile.
"""
