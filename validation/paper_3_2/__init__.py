"""Section 3.2 of the paper: two M107 side by side against one, on a witness ring."""

from __future__ import annotations
