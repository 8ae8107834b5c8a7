"""The list of words that are not used: what it finds and lets pass; `setup.sh lint` looks through all texts."""

from __future__ import annotations

import pytest

from tests import vocabulary


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("The charge is lit at the nose; cells unlit.", ["lit", "unlit"]),
        ("def never_lit(run): _LIT = 1", ["lit", "LIT"]),
        ("split, quality, little, polite", []),
        ("An error is told; Team.tell; a Teller, retelling", ["told", "tell"]),
        ("    def tell(self) -> int:", []),
        ("Let go, made anew, hangs on the mesh", ["Let go", "anew", "hangs on"]),
        ("hangar, change, exchange", []),
        ("a kick, booked, booking, a book, notebook", ["kick", "booked", "booking"]),
        ("Warp By Vector, warped cells, warp", ["warp"]),
        ("becoming, incoming; the coming step", ["coming"]),
        ("at_least, at least, least squares, least_speed, _LEAST", ["least_speed", "_LEAST"]),
        ("cases/grenade_155_tnt.toml of a grenade", ["grenade"]),
        ("`min_speed`, before `least_speed`; now `least_speed`", ["least_speed"]),
        ("It goes on with the run; goes on", ["goes on with"]),
        ("thrown back; for the eye; no number; dimensions", ["thrown back", "for the eye", "no number"]),
    ],
)
def test_words_are_found_in_texts_and_identifiers(text: str, words: list[str]) -> None:
    assert sorted(one.word for one in vocabulary.faults_in(text)) == sorted(words)


def test_a_fault_names_file_line_and_what_to_use() -> None:
    (fault,) = vocabulary.faults_in("first\nThe front is thrown back.\n", "docs/theory/burn.md")
    assert str(fault) == 'docs/theory/burn.md:2: "thrown back" is not used here; use reflected (tests/vocabulary.py)'


def test_names_of_files_are_read_too(tmp_path) -> None:
    (tmp_path / "lighting.py").write_text("x = 1\n", encoding="utf-8")
    (fault,) = vocabulary.faults_of(tmp_path / "lighting.py", tmp_path)
    assert (fault.where, fault.word) == ("lighting.py", "lighting")


def test_advice_uses_no_word_of_the_list() -> None:
    """No replacement sends the reader to another word of the list."""
    for term in vocabulary.TERMS:
        assert not vocabulary.faults_in(term.instead), term.instead
