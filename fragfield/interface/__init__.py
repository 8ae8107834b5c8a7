"""What a Python program calls, and the command line with it: a case, a run, and what a run directory holds.

The names are those of `fragfield` itself; each is loaded when it is first asked for. The arguments of `run`, `check`
and `convert`, and what is said of them, are those of the commands (`fragfield.cli.declare`).
"""
