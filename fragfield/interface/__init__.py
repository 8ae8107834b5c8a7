"""What a Python program calls, and the command line with it: a case, a run, and what a run directory holds.

The names are those of `fragfield` itself: `fragfield.Case`, `fragfield.check`, `fragfield.run`, `fragfield.open`,
`fragfield.run_sweep`, `fragfield.run_limit`, `fragfield.compare_runs` and `fragfield.run_uncertainty`. Each is loaded
when it is first asked for, so that `import fragfield` costs nothing.
"""

from __future__ import annotations
