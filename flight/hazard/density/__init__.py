"""Expected density of hazardous fragments over azimuth and distance, and the distance that follows from it."""
