"""The explicit step and what it acts on: fields, solver, local time stepping, detonation, initiation, energy ledger."""
