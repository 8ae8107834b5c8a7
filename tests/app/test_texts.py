"""Words for the fields of the pages."""

from __future__ import annotations

from fragfield.app.fields import fields_of, help_of, label_of


def test_a_field_says_what_the_inputs_say():
    entry = next(one for one in fields_of(("burst",)) if one.name == "cell_size")
    assert label_of(entry.path) == "cell size"
    words = help_of(entry)
    assert words.startswith("Target edge length of the cells; the only mesh parameter. Allowed: a")
    assert "Bounds: 0.0001 to 0.5 m (cells below 0.1 mm" in words
