"""Two M107 side by side: the symmetric parts beside the whole, the focus over cell sizes, and the paper's reading."""

from __future__ import annotations
