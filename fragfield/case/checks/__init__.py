"""Checks of a case: bounds of single values, and faults that no single key shows."""
