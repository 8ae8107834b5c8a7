"""The casing's solid against closed forms: waves, thick-walled tubes, a rod's impact, softening."""

from __future__ import annotations
