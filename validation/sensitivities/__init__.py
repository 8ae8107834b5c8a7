"""What moves the distance: one input at a time about the M107 with TNT, whole chains in the meridian."""
