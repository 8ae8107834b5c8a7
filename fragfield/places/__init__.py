"""Sites from maps: people, roads, areas, buildings and obstacles of GeoJSON and KML files as tables of the case.

`features` reads named features in longitude and latitude; `polygons` turns outlines into convex areas and boxes;
`tables` maps kinds and properties and makes the tables.
"""
