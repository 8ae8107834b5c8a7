"""XML of unknown origin: no entity that grows, refers to another or lies in another file."""

from __future__ import annotations

from xml.etree import ElementTree as ET
from xml.parsers import expat

from fragfield.errors import InputError

__all__ = ["parsed_xml"]

_LONGEST = 1000  # characters of an entity's text: names of namespaces, as Illustrator writes them


def parsed_xml(data: bytes, where: str) -> ET.Element:
    """The outermost element of a document, in the encoding that it names.

    Raises
    ------
    InputError
        Not well-formed, or an entity is declared that is in another file, refers to another or is long.
    """
    parser = expat.ParserCreate()

    def declared(
        name: str, parameter: bool, value: str | None, _base: str | None, system: str | None, *_: object
    ) -> None:
        if parameter or value is None or system is not None or "&" in value or "%" in value or len(value) > _LONGEST:
            raise InputError(
                f"{where}: found the XML entity {name!r} of another file or of other entities; allowed: none"
            )

    parser.EntityDeclHandler = declared
    try:
        parser.Parse(data, True)
        return ET.fromstring(data)  # - entities are refused above, and expat loads no other file
    except (expat.ExpatError, ET.ParseError, LookupError, ValueError) as fault:
        raise InputError(f"{where}: not well-formed XML ({fault})") from None
