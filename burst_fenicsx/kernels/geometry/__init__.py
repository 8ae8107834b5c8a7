"""Points, faces and hexahedra: bounds and boxes, closest points, volumes, what lies inside of what."""
