"""The grammar of a value with its unit, checked before the units library evaluates it.

    value  = [sign] product
    product = factor { ("*" | "/" | " ") factor }
    factor = number | unit [ ("^" | "**") exponent ] | "(" product ")"

Only units have powers, and whole ones from -9 to 9: pint would evaluate "9**9**9**9 m", which never ends.
"""

from __future__ import annotations

import re

__all__ = ["MOST_CHARACTERS", "grammar_fault"]

MOST_CHARACTERS = 120
_TOKEN = re.compile(
    r"\s*(?:(?P<number>(?:\d{1,40}(?:\.\d{0,40})?|\.\d{1,40})(?:[eE][-+]?\d{1,4})?)(?![\d.])"
    r"|(?P<name>[^\W\d]\w{0,39}%?|%|°\w?)"
    r"|(?P<sign>\*\*|\^|\*|/|\(|\)|\+|-))"
)
_EXPONENT = re.compile(r"\s*(?:[-+]?\d|\(\s*[-+]?\d\s*\))(?![\d.eE])")


def grammar_fault(text: str) -> str | None:
    """Why a text is no value with a unit by the grammar, in words that follow "which"; None if it is one."""
    if len(text) > MOST_CHARACTERS:
        return f"has {len(text)} characters, more than any value needs ({MOST_CHARACTERS})"
    at, depth, before = 0, 0, ""
    while at < len(text.rstrip()):
        token = _TOKEN.match(text, at)
        if token is None:
            return "is not a number with a unit"
        at = token.end()
        kind, found = token.lastgroup or "", token.group(token.lastgroup or 0)
        if kind == "sign" and found in ("^", "**"):
            if before != "name":
                return "takes a power of a number; only units have powers"
            power = _EXPONENT.match(text, at)
            if power is None:
                return "has a unit with a power that is no whole number from -9 to 9"
            at = power.end()
            before = "power"
            continue
        if found == "-" or found == "+":
            if before:
                return "is a sum; a value is one number with its unit"
            continue
        depth += {"(": 1, ")": -1}.get(found, 0)
        if depth < 0 or depth > 4:
            return "has parentheses that do not fit"
        before = kind if kind != "sign" else found
    return "has parentheses that do not fit" if depth else None
