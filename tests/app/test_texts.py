"""Texts of the pages and words for the fields, in every language."""

from __future__ import annotations

import re

import pytest

from fragfield.app.fields import LANGUAGES, _read, fields_of, kinds_of, texts_in

ENGLISH = re.compile(r"\b(a|an|with|without|each|for|of|the|or|and|greater|least|most|above|below|to|its|number)\b")


def every_field(path=()):
    """All fields that the pages can show."""
    for kind in kinds_of(path) or ("",):
        for entry in fields_of(path, kind):
            yield entry
            if entry.kind in ("table", "tables"):
                yield from every_field((*path, entry.name))


def test_every_text_is_there_in_every_language():
    for group, table in _read("texts").items():
        for name, words in table.items():
            assert set(words) == ({"en"} if group == "key" else set(LANGUAGES)), name
            places = [sorted(part.split("}")[0] for part in text.split("{")[1:]) for text in words.values()]
            assert places[0] == places[-1], name
    assert texts_in("de")("case.save") == "Speichern"


@pytest.mark.parametrize("language", [one for one in LANGUAGES if one != "en"])
def test_every_field_has_its_words_in_every_language(language):
    """Label and meaning of each, reasons of bounds, and no English word left in what is allowed."""
    words, texts, known = _read(f"fields_{language}"), texts_in(language), set()
    for entry in every_field():
        plain = re.sub(r"\[\w+\]", "", entry.key)
        known |= {entry.key, plain}
        assert plain in words["fields"] or entry.key in words["fields"], entry.key
        assert bool(texts.meaning(entry)) == bool(entry.meaning), entry.key
        assert not entry.why or entry.why in words["reasons"], entry.why
        shown = texts.help(entry).removeprefix(texts.meaning(entry))
        assert not ENGLISH.search(re.sub(r'"[^"]*"', "", shown)), shown
    assert set(words["fields"]) <= known
    assert {entry.why for entry in every_field()} >= set(words["reasons"])
    assert texts.label("exposed[building].height") == "Höhe"


def test_english_is_what_the_inputs_say():
    entry = next(one for one in fields_of(("burst",)) if one.name == "cell_size")
    assert texts_in("en").label(entry.key) == "cell size"
    assert texts_in("en").help(entry).startswith("Target edge length of the cells; the only mesh parameter. Allowed: a")
    assert "Grenzen: 0.0001 bis 0.5 m (Zellen unter 0.1 mm" in texts_in("de").help(entry)
