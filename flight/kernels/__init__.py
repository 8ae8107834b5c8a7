"""Compiled inner loops. Imported only when something is flown, so that `import flight` stays quick."""

from __future__ import annotations

__all__: list[str] = []
