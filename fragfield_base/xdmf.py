"""XDMF files with a checksum, looked at before VTK reads them: it trusts the sizes that they declare."""

from __future__ import annotations

import hashlib
import re
from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

from fragfield_base.reading import read_text

if TYPE_CHECKING:
    from pathlib import Path

__all__ = ["check_xdmf", "stamped_xdmf"]

_STAMP = re.compile(r"<!-- checksum of the above: ([0-9a-f]{32}) -->\n\Z")
_MOST = 1 << 28


def stamped_xdmf(text: str) -> str:
    """The text with its checksum in a comment at its end."""
    return f"{text}<!-- checksum of the above: {_digest(text)} -->\n"


def check_xdmf(path: Path, error: type[Exception], advice: str = "") -> None:
    """Refuse an XDMF file that is damaged, or that takes data from another file than the HDF5 file of its name."""
    end = f"; {advice}" if advice else ""
    text = read_text(path, error, most=_MOST, advice=advice)
    found = _STAMP.search(text)
    if found is not None and found[1] != _digest(text[: found.start()]):
        raise error(f"{path}: damaged or edited (its checksum does not fit){end}")
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise error(f"{path}: declares entities, which are not read{end}")
    try:
        items = [item.text or "" for item in ET.fromstring(text).iter("DataItem")]
    except ET.ParseError as fault:
        raise error(f"{path}: cut off, or not XML ({fault}){end}") from None
    own = f"{path.with_suffix('.h5').name}:/"
    if other := next((item for item in items if not item.strip().startswith(own)), None):
        raise error(f"{path}: takes data from {other.strip()[:60]!r}; allowed: {own}...{end}")


def _digest(text: str) -> str:
    return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()
