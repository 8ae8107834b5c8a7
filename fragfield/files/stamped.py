"""case.toml and summary.json with a checksum: an edited or cut file is refused.

The checksum stands in the file itself: as the last line of the TOML file, a comment, and as the last key of the JSON
file. Files of earlier versions have none: of those a case is taken if summary.json holds the same.
"""

from __future__ import annotations

import hashlib
import json
import re
import tomllib
from typing import TYPE_CHECKING, Any

from fragfield.errors import InputError
from fragfield.files.file_sizes import MOST_CASE
from fragfield_base.reading import read_text

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

__all__ = ["read_stamped_json", "stamped_json", "stamped_toml", "stored_case_text"]

_MOST_SUMMARY = 1 << 29
_KEY = "checksum"
_LINE = re.compile(r"\n# checksum of the lines above: ([0-9a-f]{32})\n\Z")


def stamped_toml(text: str) -> str:
    """A case with its checksum as the last line."""
    return f"{text}\n# checksum of the lines above: {_digest(text)}\n"


def stored_case_text(path: Path, summary: Mapping[str, Any], *, alone: bool = False) -> str:
    """Text of the case that a run directory holds, as the program has written it.

    Parameters
    ----------
    path : Path
        case.toml of the run directory.
    summary : mapping
        Its summary.json; empty where there is none.
    alone : bool
        Only to be shown: a file without checksum is taken if it has the tables of the summary's case, if that is there.

    Raises
    ------
    InputError
        The file is empty, cut off or edited.
    """
    text = read_text(path, InputError, most=MOST_CASE)
    found = _LINE.search(text)
    if found is not None:
        if found[1] == _digest(text[: found.start()]):
            return text
        raise InputError(
            f"{path}: was edited or damaged after the run wrote it (its checksum does not fit); allowed: the file as "
            "it was; an edited case is a case file of its own, outside of the run directory, with --out for its results"
        )
    stored = summary.get("case")
    stored = stored if isinstance(stored, dict) else None
    if alone and (stored is None or _has_tables(text, stored)):
        return text
    if stored is None or not _says(path, stored):
        raise InputError(
            f"{path}: empty, cut off, or not written by this program: its last line, the checksum, is missing"
            f"{'' if stored is None else ', and it is not the case of summary.json'}; give the case file again with "
            "--overwrite to compute the run again"
        )
    return text


def _has_tables(text: str, stored: Mapping[str, Any]) -> bool:
    """Whether a text has every table and entry of a case, whatever stands in them."""
    try:
        document = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError):
        return False
    return all(
        key in document and (not isinstance(value, list) or len(document[key]) == len(value))
        for key, value in stored.items()
        if value or not isinstance(value, (list, dict))  # empty ones are not written
    )


def _says(path: Path, stored: Mapping[str, Any]) -> bool:
    """Whether a file of an earlier version is the case of the summary; keys that are new since then do not count."""
    from fragfield.case import read_resolved
    from fragfield.case.write import plain

    now = json.loads(json.dumps(plain(read_resolved(path)), default=_plain_number))
    return _contains(now, stored)


def _contains(now: object, stored: object) -> bool:
    if isinstance(stored, dict) and isinstance(now, dict):
        return all(key in now and _contains(now[key], value) for key, value in stored.items())
    if isinstance(stored, list) and isinstance(now, list):
        return len(now) == len(stored) and all(_contains(*pair) for pair in zip(now, stored, strict=True))
    return now == stored


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
    """NumPy's numbers and arrays as JSON has them."""
    if hasattr(value, "tolist"):
        return value.tolist()
    message = f"{type(value).__name__} has no place in a summary"
    raise TypeError(message)
