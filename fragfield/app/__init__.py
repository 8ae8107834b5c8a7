"""`fragfield app`: local pages over the case file. They add no physics and no second set of facts.

Fields, bounds, units and meanings come from the schema of the case; messages from its loader; what is computed is
computed by the command line, as a process of its own.
"""

from __future__ import annotations

__all__: list[str] = []
