"""Single rounds in their meridian: orders and limits over cell sizes, and the meridian beside three dimensions."""
