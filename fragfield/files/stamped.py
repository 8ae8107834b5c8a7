"""Files that show whether they were changed: case.toml and summary.json, by a checksum.

It stands in the file itself: as the last line of the TOML file, a comment, and as the last key of the JSON file.
"""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from fragfield.errors import InputError
from fragfield_base.reading import read_text

MOST_CASE = 1 << 26
"""Largest size (bytes) of a case file: 64 MB hold ten thousand rounds of inline points."""
_MOST_SUMMARY = 1 << 29
_KEY = "checksum"
_LINE = re.compile(r"\n# checksum of the lines above: ([0-9a-f]{32})\n\Z")


def stamped_toml(text: str) -> str:
    """A case with its checksum as the last line."""
    return f"{text}\n# checksum of the lines above: {_digest(text)}\n"


def stored_case_text(path: Path) -> str:
    """Text of the case that a run directory holds, as the program has written it.

    Raises InputError: the file is empty, cut off or edited.
    """
    text = read_text(path, InputError, most=MOST_CASE)
    found = _LINE.search(text)
    if found is None:
        raise InputError(
            f"{path}: empty, cut off, or not written by this program: its last line, the checksum, is missing; give "
            "the case file again with --overwrite to compute the run again"
        )
    if found[1] != _digest(text[: found.start()]):
        raise InputError(
            f"{path}: was edited or damaged after the run wrote it (its checksum does not fit); allowed: the file as "
            "it was; an edited case is a case file of its own, outside of the run directory, with --out for its results"
        )
    return text


def stamped_json(summary: Mapping[str, Any]) -> str:
    """A summary with its checksum as the last key; raises ValueError for numbers that JSON does not have."""
    text = json.dumps(summary, indent=1, default=_plain_number, allow_nan=False)
    whole = json.loads(text)
    whole.pop(_KEY, None)
    whole[_KEY] = _digest(_canonical(whole))
    return json.dumps(whole, indent=1) + "\n"


def read_stamped_json(path: Path) -> dict[str, Any]:
    """Read summary.json, without its checksum; raises InputError where it is damaged."""
    advice = "run the stages again"
    text = read_text(path, InputError, most=_MOST_SUMMARY, advice=advice)
    try:
        found = json.loads(text)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{path}: damaged ({error}); {advice}") from None
    if not isinstance(found, dict):
        raise InputError(f"{path}: damaged (not a table); {advice}")
    stamp = found.pop(_KEY, None)
    if stamp is not None and stamp != _digest(_canonical(found)):
        raise InputError(f"{path}: damaged or edited (its checksum does not fit); {advice}")
    return found


def _canonical(found: Mapping[str, Any]) -> str:
    return json.dumps(found, sort_keys=True, separators=(",", ":"))


def _digest(text: str) -> str:
    return hashlib.blake2b(text.encode("utf-8", errors="surrogatepass"), digest_size=16).hexdigest()


def _plain_number(value: object) -> object:
    if hasattr(value, "tolist"):
        return value.tolist()
    message = f"{type(value).__name__} has no place in a summary"
    raise TypeError(message)
