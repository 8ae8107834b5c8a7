"""Output on the terminal and in run.log: results, progress, warnings."""
