"""The files of a run directory: names, checksums, provenance, and what they contain."""
