"""Single rounds in their meridian: convergence over cell sizes, and the meridian beside three dimensions."""
