"""What the report reads from a run directory."""
