"""Files that show whether they were changed: case.toml and summary.json by a checksum, a signed run by its hashes.

The checksum stands in the file itself: as the last line of the TOML file, a comment, and as the last key of the JSON
file. While a run directory has a signature, no command writes into it.
"""

from __future__ import annotations

import datetime as dt
import hashlib
import json
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fragfield.errors import InputError
from fragfield_base.reading import read_text
from fragfield_base.writing import write_text

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path


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
    """NumPy's numbers and arrays as JSON has them."""
    if hasattr(value, "tolist"):
        return value.tolist()
    message = f"{type(value).__name__} has no place in a summary"
    raise TypeError(message)


SIGNATURE = "signature.json"
_SIGNED = ("report.html", "summary.json", "case.toml")


@dataclass(frozen=True)
class Signature:
    """Who signed a run and when (UTC), and the SHA-256 of each signed file; empty where its file is damaged."""

    who: str = ""
    when: str = ""
    sha256: dict[str, str] | None = None

    def changed(self, folder: Path) -> list[str]:
        """Signed files that are no longer as they were signed."""
        return [name for name in _SIGNED if _hash(folder / name) != (self.sha256 or {}).get(name)]


def sign(folder: Path, who: str) -> Signature:
    """Sign the report of a run; raises InputError where it has none, is signed already, or no name is given."""
    refuse_signed(folder)
    if missing := [name for name in _SIGNED if not (folder / name).is_file()]:
        raise InputError(f"{folder}: has no {missing[0]} to sign; run `fragfield report {folder}` first")
    if not who.strip():
        raise InputError("document.prepared_by: missing; allowed: the name of who signs")
    when = dt.datetime.now(dt.UTC).strftime("%Y-%m-%d %H:%M UTC")
    signature = Signature(who.strip(), when, {name: _hash(folder / name) for name in _SIGNED})
    write_text(folder / SIGNATURE, json.dumps(vars(signature), indent=1, ensure_ascii=False) + "\n", InputError)
    return signature


def read_signature(folder: Path) -> Signature | None:
    """The signature of a run; None where it is not signed."""
    try:
        found = json.loads((folder / SIGNATURE).read_text(encoding="utf-8"))
        return Signature(str(found["who"]), str(found["when"]), dict(found["sha256"]))
    except (FileNotFoundError, NotADirectoryError):
        return None
    except (OSError, ValueError, KeyError, TypeError):
        return Signature()


def refuse_signed(folder: Path) -> None:
    """Raise InputError where a run is signed: nothing in it may be replaced."""
    signature = read_signature(folder)
    if signature is not None:
        by = f" by {signature.who} on {signature.when}" if signature.who else ""
        raise InputError(
            f"{folder}: was signed{by} and is kept as it is; allowed: another --out, or withdraw the signature by "
            f"removing its {SIGNATURE}"
        )


def _hash(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else ""
