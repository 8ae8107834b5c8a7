from __future__ import annotations
def content(page, run=""):
    pass
