"""Cells of casing, fuze and charge: strain rates, stress, pressure, hourglass control, nodal forces."""
