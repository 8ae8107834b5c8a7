"""Words that this project does not use, and what it uses in their place: `python -m tests.vocabulary` finds them.

The field has standard terms; a word that a reader must first translate is a fault as a wrong unit is. Looked at is all
text under version control: code with its identifiers, comments and messages, documents, templates, case files. The
table is a glossary in reverse; docs/glossary.md has the terms themselves. `python -m tests.vocabulary --count` counts.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

__all__ = ["TERMS", "Finding", "Term", "faults_in", "faults_of", "texts"]

ROOT = Path(__file__).resolve().parent.parent
_NOT_TEXT = re.compile(r"\.(png|csv|asc)$")
_OWN = ("tests/vocabulary.py", "tests/test_vocabulary.py")
_SUFFIXES = {".py", ".md", ".toml", ".html", ".css", ".yml", ".sh", ".tsv"}
_NOT_OURS = {".venv", ".git", "runs", "build"}


@dataclass(frozen=True)
class Term:
    """A word that is not used.

    Attributes
    ----------
    words : regular expression; letters on both sides end a word, an underscore does not: identifiers are read too.
    instead : what is used.
    allowed : regular expression of uses within a line that are no dialect; empty: none.
    """

    words: str
    instead: str
    allowed: str = ""

    @property
    def pattern(self) -> re.Pattern[str]:
        """The word, in any case of its letters."""
        return re.compile(rf"(?<![a-z])(?:{self.words})(?![a-z])", re.IGNORECASE)


@dataclass(frozen=True)
class Finding:
    """A word in a line of a text, counted from 1."""

    where: str
    line: int
    word: str
    instead: str

    def __str__(self) -> str:
        return f'{self.where}:{self.line}: "{self.word}" is not used here; use {self.instead} (tests/vocabulary.py)'


TERMS = (
    Term("(un)?lit", "initiated (a round), ignited or burnt (a cell), unreacted"),
    Term("lights|lighting", "initiates, ignites; ignition"),
    Term("told|tells|telling", "reported, recorded, shows, rejected, distinguished"),
    Term("_?tell", "report, show, distinguish, broadcast", allowed=r"def tell\(self\) -> int:"),  # a file's method
    Term("let(s|ting)?[ _]go", "released, breaks, launched"),
    Term("released bonds?", "broken bond, debonded"),
    Term("(hang|hangs|hung|hanging)[ _]on", "depends on"),
    Term("anew", "again"),
    Term("kick(s|ed|ing)?", "velocity update, velocity_step"),
    Term("booked|bookings?|_book|(what|to|they|it) books?", "accumulated, energies, accounting"),
    Term("longest steps? of (its|their) parts|steps of (the cells'|cells') own", "local time stepping, macro step"),
    Term("partings?", "subdivision, separation"),
    Term("meetings?", "first contact, collision"),
    Term("warps?|warping", "hourglass mode, offset", allowed=r"Warp By Vector|rasterio\.warp"),  # ParaView, rasterio
    Term("coming", "next_dt, next"),
    Term("bearable", "coefficient limit"),
    Term("crowd(s|ed|ing)?", "share, stiffness sharing, dense"),
    Term("free of dimensions?", "dimensionless"),
    Term("thrown back", "reflected"),
    Term("no number", "NaN, not a number"),
    Term("chances?", "randomness, random generator, statistical error, p-value"),
    Term("for the eyes?", "for visualisation"),
    Term("rooms|rooms? and rules", "folders, architecture"),
    Term("front doors?", "command line, interface"),
    Term("grenades?", "projectile, shell", allowed=r"grenade_155|grenade, hence the file's name"),
    Term("(go|goes|going) on with", "continue"),
    Term("exposed[ _]places?", "exposed site"),
    Term("from elsewhere", "from another source, of unknown origin"),
    Term("by (twos|fours)", "in groups of two, of four"),
    Term("anybody|nobody", "no one, or a sentence without persons"),
    Term("knows? (nothing|neither|none)", "is independent of, does not cover"),
    Term("wants", "needs"),
    Term("(?<!at_)least_[a-z_]+|(?<!at)_least", "min_..., minimum", allowed=r"least_squares"),
)
"""Kept in the order of the glossary."""

_FORMER = r"before `\w+`"  # of a key or a name that has changed, as the changelog has it
_ANY = re.compile("|".join(f"(?:{term.pattern.pattern})" for term in TERMS), re.IGNORECASE)
"""Quick: whether a line needs a closer look."""


def faults_in(text: str, where: str = "") -> list[Finding]:
    """Words of a text that are not used, in order of lines."""
    return [
        Finding(where, number, match[0], term.instead)
        for number, line in enumerate(text.splitlines(), start=1)
        if _ANY.search(line)
        for term in TERMS
        for match in term.pattern.finditer(line)
        if not _is_allowed(line, match.start(), term)
    ]


def _is_allowed(line: str, column: int, term: Term) -> bool:
    """Whether the word that begins in this column stands within an allowed use, or is a former name that is quoted."""
    allowed = f"(?:{term.allowed})|{_FORMER}" if term.allowed else _FORMER
    return any(use.start() <= column < use.end() for use in re.finditer(allowed, line))


def faults_of(path: Path, root: Path = ROOT) -> list[Finding]:
    """Those of a file, and of its name."""
    name = str(path.relative_to(root))
    return faults_in(name, name) + faults_in(path.read_text(encoding="utf-8"), name)


def texts(root: Path = ROOT) -> list[Path]:
    """All files under version control that are text, but for this list and its test; without git all files."""
    command = ["git", "ls-files"]
    known = (
        shutil.which("git") and subprocess.run(command, cwd=root, capture_output=True, text=True, check=False).stdout
    )
    listed = known.split("\n") if known else []
    if not listed:
        listed = [str(path.relative_to(root)) for path in sorted(root.rglob("*")) if path.suffix in _SUFFIXES]
    return [
        root / name
        for name in listed
        if name not in _OWN
        and not _NOT_TEXT.search(name)
        and _NOT_OURS.isdisjoint(Path(name).parts)
        and (root / name).is_file()
    ]


def main() -> int:
    """Print every word with file and line, or with `--count` their numbers; 1 if there is one."""
    found = [fault for path in texts() for fault in faults_of(path)]
    if "--count" in sys.argv[1:]:
        for word, number in Counter(fault.word.lower() for fault in found).most_common():
            print(f"{number:6d}  {word}")
    else:
        for fault in found:
            print(fault)
    print(f"vocabulary: {len(found)} words to replace in {len(texts())} files")
    return 1 if found else 0


if __name__ == "__main__":
    raise SystemExit(main())
