"""Evidence: every step of the program against theory, tests or other codes. `python -m validation --help`."""

from __future__ import annotations
