"""Files of unknown origin, read with a limit on size and no devices or pipes; XML without entities that grow."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from xml.etree import ElementTree as ET
from xml.parsers import expat

MOST_TEXT = 1 << 31
"""Bytes of a table or map of heights; what is read needs several times as much memory."""


def read_text(path: Path, error: type[Exception], *, most: int = MOST_TEXT, advice: str = "") -> str:
    """Text of a UTF-8 file, a byte-order mark left out.

    Raises `error`, with one message that ends in `advice`, where it is missing, no regular file, larger than `most`
    bytes, or not UTF-8.
    """
    try:
        return read_bytes(path, error, most=most, advice=advice).decode("utf-8-sig")
    except UnicodeDecodeError as fault:
        end = f"; {advice}" if advice else ""
        raise error(f"{path}: not text in UTF-8 ({fault.reason} at byte {fault.start}){end}") from None


def read_bytes(path: Path, error: type[Exception], *, most: int = MOST_TEXT, advice: str = "") -> bytes:
    """Content of a regular file; parameters as of `read_text`."""
    end = f"; {advice}" if advice else ""
    try:
        # Not waiting: to open a pipe would last until somebody writes to it.
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
        with os.fdopen(descriptor, "rb") as stream:
            found = os.fstat(descriptor)
            if stat.S_ISDIR(found.st_mode):
                raise error(f"{path}: a directory; a file is needed{end}")
            if not stat.S_ISREG(found.st_mode):
                raise error(f"{path}: not a regular file{end}")
            if found.st_size > most:
                raise error(f"{path}: {found.st_size} bytes; allowed: at most {most}{end}")
            return stream.read(most + 1)
    except FileNotFoundError:
        raise error(f"{path}: no such file{end}") from None
    except OSError as fault:
        raise error(f"{path}: cannot be read ({fault.strerror or fault}){end}") from None


_LONGEST = 1000  # characters of an entity's text: names of namespaces, as Illustrator writes them


def parsed_xml(data: bytes, where: str, error: type[Exception]) -> ET.Element:
    """The outermost element of a document, in the encoding that it names.

    Raises `error` where it is not well-formed, or declares an entity that is in another file, refers to another or is
    long.
    """
    parser = expat.ParserCreate()

    def declared(
        name: str, parameter: bool, value: str | None, _base: str | None, system: str | None, *_: object
    ) -> None:
        if parameter or value is None or system is not None or "&" in value or "%" in value or len(value) > _LONGEST:
            raise error(f"{where}: found the XML entity {name!r} of another file or of other entities; allowed: none")

    parser.EntityDeclHandler = declared
    try:
        parser.Parse(data, True)
        return ET.fromstring(data)  # - entities are refused above, and expat loads no other file
    except (expat.ExpatError, ET.ParseError, LookupError, ValueError) as fault:
        raise error(f"{where}: not well-formed XML ({fault})") from None
