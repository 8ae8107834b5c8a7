"""Texts of the pages, and what the fields of a case mean, in English and German."""

from __future__ import annotations

import re
import tomllib
from functools import cache
from importlib import resources
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from fragfield.app.fields import Field

__all__ = ["LANGUAGES", "Texts", "texts_in"]

LANGUAGES = {"en": "English", "de": "Deutsch"}


class Texts:
    """Texts in one language; what it lacks is shown in English, a name that no language has is a fault.

    In English the words for fields are those of the inputs' metadata; other languages have a table of them.
    """

    def __init__(self, language: str) -> None:
        self.language = language
        groups = _read("texts").items()
        self._texts = {f"{group}.{name}": words.get(language, words["en"])
                       for group, table in groups for name, words in table.items()}  # fmt: skip
        self._words = _read(f"fields_{language}")

    def __call__(self, name: str, /, **values: object) -> str:
        """A text with its places filled in."""
        return self._texts[name].format(**values) if values else self._texts[name]

    def _field(self, key: str) -> list[str] | None:
        known = self._words.get("fields", {})
        return known.get(key) or known.get(re.sub(r"\[\w+\]", "", key))

    def label(self, key: str) -> str:
        """Label of a field by its key, as `Field.key` has it."""
        name = key.rpartition(".")[2]
        return (self._field(key) or [self._texts.get(f"key.{name}", name.replace("_", " "))])[0]

    def meaning(self, entry: Field) -> str:
        """What a field means."""
        return (self._field(entry.key) or ["", entry.meaning])[1]

    def help(self, entry: Field) -> str:
        """Everything that is known of a field, in sentences."""
        allowed, bounds, why = entry.allowed, entry.bounds, self._words.get("reasons", {}).get(entry.why, entry.why)
        for phrase, own in self._words.get("phrases", {}).items():
            allowed, bounds = allowed.replace(phrase, own), bounds.replace(phrase, own)
        parts = [self.meaning(entry)]
        if allowed:
            parts.append(f"{self('form.allowed')}: {allowed}.")
        if bounds:
            parts.append(f"{self('form.bounds')}: {bounds} ({why})." if why else f"{self('form.bounds')}: {bounds}.")
        return " ".join(part for part in parts if part)


@cache
def texts_in(language: str) -> Texts:
    """Texts in a language, English where it is not shipped."""
    return Texts(language if language in LANGUAGES else "en")


def _read(name: str) -> dict[str, dict[str, Any]]:
    file = resources.files("fragfield.app") / f"{name}.toml"
    return tomllib.loads(file.read_text(encoding="utf-8")) if file.is_file() else {}
