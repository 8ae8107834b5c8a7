"""XDMF files with a checksum, and where they keep the arrays of each time."""

from __future__ import annotations

import hashlib
import re
from html import escape
from pathlib import Path
from xml.etree import ElementTree as ET

from fragfield_base.hdf5_files import reading
from fragfield_base.reading import read_text

_STAMP = re.compile(r"<!-- checksum of the above: ([0-9a-f]{32}) -->\n\Z")
_MOST = 1 << 28


def stamped_xdmf(text: str) -> str:
    """The text with its checksum in a comment at its end."""
    return f"{text}<!-- checksum of the above: {_digest(text)} -->\n"


def times_of_xdmf(path: Path, error: type[Exception], advice: str = "") -> dict[float, dict[str, str]]:
    """By time (s) where its arrays are, as FILE:DATASET, by the last part of the dataset's name.

    Raises `error`: the file is damaged, takes data from others than its own HDF5 files, which are the one of its name
    and those in the folder of its name, or one of these lacks an array or has it in another shape.
    """
    end = f"; {advice}" if advice else ""
    text = read_text(path, error, most=_MOST, advice=advice)
    found = _STAMP.search(text)
    if found is not None and found[1] != _digest(text[: found.start()]):
        raise error(f"{path}: damaged or edited (its checksum does not fit){end}")
    try:
        root = ET.fromstring(text)
    except ET.ParseError as fault:
        raise error(f"{path}: cut off, or not XML ({fault}){end}") from None
    items = [((item.text or "").strip(), item.get("Dimensions", "")) for item in root.iter("DataItem")]
    own = re.compile(rf"{re.escape(path.stem)}(/[0-9]+)?\.h5:/")
    if other := next((position for position, _ in items if not own.match(position)), None):
        raise error(
            f"{path}: takes data from {other[:60]!r}; allowed: {path.stem}.h5:/, {path.stem}/0000.h5:/ ...{end}"
        )
    _check_shapes(path, set(items), error, advice)
    return {
        float(time.get("Value", "nan")): {
            position.rpartition("/")[2]: position
            for position in ((item.text or "").strip() for item in grid.iter("DataItem"))
        }
        for grid in root.iter("Grid") if (time := grid.find("Time")) is not None
    }  # fmt: skip


def _check_shapes(path: Path, items: set[tuple[str, str]], error: type[Exception], advice: str) -> None:
    """Refuse HDF5 files that lack an array, or have it in another shape."""
    wanted: dict[str, list[tuple[str, str]]] = {}
    for position, size in sorted(items):
        name, _, dataset = position.partition(":")
        wanted.setdefault(name, []).append((dataset, size))
    for name, arrays in wanted.items():
        with reading(path.parent / name, error, advice) as file:
            for dataset, size in arrays:
                shape = getattr(file.get(dataset), "shape", None)
                if shape is None or " ".join(map(str, shape)) != size.strip():
                    raise error(
                        f"{path.parent / name}: damaged, or of another run: {dataset} has the shape {shape}, "
                        f"{path.name} says ({size}); {advice}"
                    )


def _digest(text: str) -> str:
    return hashlib.blake2b(text.encode(), digest_size=16).hexdigest()


def quoted(text: str) -> str:
    """A text as the value of an attribute, in quotes (xml.sax.saxutils would load the program's access to the web)."""
    safe = escape(text).replace("\n", "&#10;").replace("\r", "&#13;").replace("\t", "&#9;")
    return f'"{safe}"'
