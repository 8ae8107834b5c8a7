"""`python -m fragfield` is the command `fragfield`."""

from __future__ import annotations

from fragfield.cli import main

__all__: list[str] = []

if __name__ == "__main__":
    main()
