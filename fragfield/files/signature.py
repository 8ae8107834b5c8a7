"""The signature of a run: who signed its report, when, and the hashes of what was signed.

It is a file in the run directory. While it is there, no command writes into that directory.
"""

from __future__ import annotations

import datetime as dt
import hashlib
import json
from dataclasses import dataclass
from pathlib import Path

from fragfield.errors import InputError
from fragfield_base.writing import write_text

__all__ = ["SIGNATURE", "Signature", "read_signature", "refuse_signed", "sign"]

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
