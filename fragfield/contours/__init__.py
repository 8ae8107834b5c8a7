"""Contours of rounds from drawings (DXF) and tables of diameters, as the tables of a profile.

`dxf` reads curves in the plane of the sheet, `section` joins them and takes outer contour and cavity from them; `table`
reads a table of diameters; `read` finds axis and nose, and is the way from a file to a profile.
"""
