"""Reference of a package's public names, printed from their signatures and docstrings (numpydoc sections)."""

from __future__ import annotations

import importlib
import inspect
import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["api_reference"]

_SECTIONS = ("Parameters", "Attributes", "Returns", "Yields", "Raises", "Notes", "Examples", "See Also", "References")
_TABLES = {"Parameters", "Attributes", "Returns", "Yields", "Raises"}


def api_reference(package: str) -> str:
    """Every name of `package.__all__` that has a docstring of its own, as Markdown, in alphabetical order."""
    module = importlib.import_module(package)
    names = sorted(module.__all__, key=str.lower)
    return "\n\n".join("\n".join(_entry(name, getattr(module, name))) for name in names if _documented(module, name))


def _documented(module: object, name: str) -> bool:
    found = getattr(module, name)
    return bool((inspect.isclass(found) or callable(found)) and inspect.getdoc(found))


def _entry(name: str, found: object) -> Iterator[str]:
    kind = "class" if inspect.isclass(found) else "function"
    yield f"## {name}"
    yield ""
    yield f"```python\n{'class ' if kind == 'class' else ''}{name}{_signature(found)}\n```"
    yield ""
    yield from _docstring(inspect.getdoc(found) or "")
    if inspect.isclass(found) and not issubclass(found, BaseException):
        for member, value in _members(found):
            yield ""
            yield f"### {name}.{member}"
            yield ""
            if callable(value):
                yield f"```python\n{member}{_signature(value)}\n```"
                yield ""
            yield from _docstring(inspect.getdoc(value) or "")


def _members(found: type) -> Iterator[tuple[str, object]]:
    """Public methods and properties of the class itself, each with a docstring."""
    for member, value in vars(found).items():
        if member.startswith("_"):
            continue
        plain = getattr(found, member) if isinstance(value, (classmethod, staticmethod)) else value
        if (callable(plain) or isinstance(plain, property)) and getattr(plain, "__doc__", None):
            yield member, plain


class _Bare(str):
    """An annotation as it is written in the source, which shows without quotes."""

    __slots__ = ()

    def __repr__(self) -> str:
        return str(self)

    @classmethod
    def of(cls, annotation: object) -> object:
        """The annotation, without quotes where it is a text."""
        return cls(annotation) if isinstance(annotation, str) else annotation


def _signature(found: object) -> str:
    """The signature, one parameter a line where it is long."""
    try:
        signature = inspect.signature(found)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        return ""
    signature = signature.replace(
        parameters=[one.replace(annotation=_Bare.of(one.annotation)) for one in signature.parameters.values()],
        return_annotation=_Bare.of(signature.return_annotation),
    )
    text = str(signature)
    if len(text) <= 80:
        return text
    parts, star = [], False
    for parameter in signature.parameters.values():
        if parameter.kind is parameter.KEYWORD_ONLY and not star:
            parts.append("*")
            star = True
        star = star or parameter.kind is parameter.VAR_POSITIONAL
        parts.append(str(parameter))
    back = text.rpartition(")")[2]
    return "(\n" + "".join(f"    {part},\n" for part in parts) + ")" + back


def _docstring(text: str) -> Iterator[str]:
    """A numpydoc docstring as Markdown: parameters, attributes, results and errors as tables."""
    for title, body in _parts(text):
        if title:
            yield f"**{title}**"
            yield ""
        if title in _TABLES:
            yield "| | |\n|---|---|"
            yield from _rows(body)
        elif title == "Examples" or body.lstrip().startswith(">>>"):
            yield f"```python\n{body.strip()}\n```"
        else:
            yield _prose(body)
        yield ""


def _parts(text: str) -> Iterator[tuple[str, str]]:
    title, lines = "", []
    found = text.splitlines()
    skip = False
    for number, line in enumerate(found):
        if skip:
            skip = False
            continue
        below = found[number + 1].strip() if number + 1 < len(found) else ""
        if line.strip() in _SECTIONS and re.fullmatch("-{3,}", below):
            if "\n".join(lines).strip():
                yield title, "\n".join(lines)
            title, lines, skip = line.strip(), [], True
        else:
            lines.append(line)
    if "\n".join(lines).strip():
        yield title, "\n".join(lines)


def _rows(body: str) -> Iterator[str]:
    """Entries `name : type` with their indented text, as rows of a table."""
    name, words = "", []
    for line in [*body.splitlines(), "end"]:
        if line and not line.startswith(" "):
            if name:
                yield f"| {_cell(name)} | {' '.join(words)} |"
            name, words = line.strip(), []
        elif line.strip():
            words.append(_escaped(line.strip()))


def _cell(head: str) -> str:
    name, colon, kind = head.partition(" : ")
    return f"`{name}`" + (f"<br>{_escaped(kind)}" if colon else "")


def _escaped(text: str) -> str:
    """A text for a table: no bar splits it; angle brackets outside of code are shown."""
    parts = text.split("`")
    shown = [part if i % 2 else part.replace("<", "&lt;") for i, part in enumerate(parts)]
    return "`".join(shown).replace("|", "\\|").replace("$", "&#36;")


def _prose(body: str) -> str:
    return "\n".join(_escaped(line).replace("\\|", "|") for line in inspect.cleandoc(body).splitlines())
