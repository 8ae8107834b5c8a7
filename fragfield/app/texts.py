"""Texts of the pages, from one file, in English and German."""

from __future__ import annotations

import tomllib
from functools import cache
from importlib import resources

__all__ = ["LANGUAGES", "Texts", "texts_in"]

LANGUAGES = {"en": "English", "de": "Deutsch"}


class Texts:
    """Texts in one language; a text that it lacks is shown in English, a name that no language has is a fault."""

    def __init__(self, language: str) -> None:
        self.language = language
        self._texts = {name: words.get(language, words["en"]) for name, words in _all().items()}

    def __call__(self, name: str, /, **values: object) -> str:
        """A text with its places filled in."""
        return self._texts[name].format(**values) if values else self._texts[name]

    def label(self, key: str) -> str:
        """Label of a key of the case file: its translation, else the key in words."""
        return self._texts.get(f"key.{key}", key.replace("_", " "))


@cache
def texts_in(language: str) -> Texts:
    """Texts in a language, English where it is not shipped."""
    return Texts(language if language in LANGUAGES else "en")


@cache
def _all() -> dict[str, dict[str, str]]:
    source = resources.files("fragfield.app") / "texts.toml"
    tables = tomllib.loads(source.read_text(encoding="utf-8"))
    return {f"{group}.{name}": words for group, table in tables.items() for name, words in table.items()}
