"""What one started application holds: its folder, its open cases, its language and its jobs."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fragfield.app.document import CaseDocument
from fragfield.app.texts import LANGUAGES

if TYPE_CHECKING:
    from fragfield.app.workspace import Workspace

__all__ = ["Session"]

_MOST_OPEN = 20


class Session:
    """State of the application that is in no file; everything else is read from the folder each time.

    Parameters
    ----------
    space : Workspace
        The folder.
    language : str
        Of the pages; empty: as chosen before, else English.
    """

    def __init__(self, space: Workspace, language: str = "") -> None:
        self.space = space
        self.language = language or str(space.settings().get("language", ""))
        if self.language not in LANGUAGES:
            self.language = "en"
        self._open: dict[str, CaseDocument] = {}

    def speak(self, language: str) -> None:
        """Change the language of the pages, and keep it."""
        self.language = language if language in LANGUAGES else "en"
        self.space.keep(language=self.language)

    def open(self, name: str) -> CaseDocument:
        """The case of that name, the same for all pages; raises InputError where it cannot be read."""
        path = self.space.inside(name)
        key = self.space.name_of(path)
        if key not in self._open:
            self._open[key] = CaseDocument(self.space, key)
            while len(self._open) > _MOST_OPEN:
                self._open.pop(next(iter(self._open)))
        elif not self._open[key].is_draft and self._open[key].changed_on_disk:
            self._open[key].reload()
        return self._open[key]
