"""Values with units: read from strings, converted to SI, written with everyday units."""
