"""The chain from a case to a run directory: its stages, realisations over the ranks, and grid convergence."""
