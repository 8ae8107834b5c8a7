"""A case that is edited: comments and content kept, faults as the command line has them, contours turned exactly."""

from __future__ import annotations

import itertools
import json
import math
import tomllib
from pathlib import Path

import pytest
from pydantic import BaseModel

from burst_fenicsx.geometry import profile_from_table
from burst_fenicsx.geometry.files import PROFILES, profile_names
from fragfield.app.contour import from_case, number_of, to_case
from fragfield.app.document import CaseDocument, steps_of
from fragfield.app.fields import fields_of, kinds_of, read_field
from fragfield.app.site_plan import imported, move, plan_of
from fragfield.app.workspace import STATE, Workspace, safe_name
from fragfield.case import load_case
from fragfield.case.keys import tables_in
from fragfield.case.new_case import write_new_case
from fragfield.case.schema import CaseTable
from fragfield.errors import InputError
from fragfield_base import errors

CASES = Path(__file__).resolve().parents[2] / "cases"


@pytest.fixture
def space(tmp_path):
    for name in ("m107_pair_site.toml", "m107_pair_site.asc", "m107_row4.toml"):
        (tmp_path / name).write_bytes((CASES / name).read_bytes())
    write_new_case(tmp_path / "new.toml", "m107", "tnt")
    return Workspace(tmp_path.resolve())


def test_a_change_keeps_comments_and_everything_else(space):
    case = CaseDocument(space, "m107_pair_site.toml")
    before = case.text
    case.set(("burst", "cell_size"), "8 mm")
    case.set(("exposed", 0, "position"), ["46 m", "-90 m"])
    assert case.text == before.replace('"6 mm"', '"8 mm"').replace('["45 m", "-90 m"]', '["46 m", "-90 m"]')


def test_a_commented_default_is_taken_as_a_user_would(space):
    case = CaseDocument(space, "new.toml")
    lines = case.text.count("\n")
    case.set(("burst", "convergence"), "off")
    case.set(("round", 0, "base"), "0 m")
    assert case.text.count("\n") == lines
    assert '\nconvergence = "off"\n' in case.text
    assert '\nbase = "0 m"\n' in case.text


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("burst", "time_step", "cfl"), 0.5),
        (("exposed", 6), {"name": "x", "position": ["1 m", "2 m"]}),
        (("exposed", 1), None),
        (("exposed",), None),
        (("round", 0, "profile"), {"unit": "mm", "outer": {"points": [[0, 1], [2, 3]]}}),
        (("round", 0, "ignition", 0, "station"), "nose"),
        (("flight", "ground"), None),
        (("stack",), {"arrangement": "row", "gap": "1 mm", "count": 2}),
        (("document", "changes"), ["a", 'b "c"\n']),
        (("title",), "\x00 \u202e € ]]"),
    ],
)
def test_every_change_is_what_was_meant(space, path, value):
    case = CaseDocument(space, "m107_pair_site.toml")
    others = {key: entry for key, entry in case.tables.items() if key != path[0]}
    case.set(path, value)
    assert {key: entry for key, entry in tomllib.loads(case.text).items() if key != path[0]} == others
    found = case.get(path)
    assert found == value if value is not None else found != {"name": "shelter behind the bank"}


def test_the_file_changes_when_it_is_saved(space):
    case = CaseDocument(space, "new.toml")
    saved = case.path.read_text(encoding="utf-8")
    case.set(("seed",), 7)
    assert case.path.read_text(encoding="utf-8") == saved
    assert case.is_draft
    assert CaseDocument(space, "new.toml").get(("seed",)) != 7
    case.save()
    assert load_case(case.path).seed == 7
    assert not CaseDocument(space, "new.toml").is_draft


def test_what_another_program_wrote_is_never_replaced(space):
    case = CaseDocument(space, "new.toml")
    case.set(("seed",), 7)
    case.path.write_text("title = 'outside'\n", encoding="utf-8")
    assert case.changed_on_disk
    with pytest.raises(InputError, match=r"new\.toml: another program has changed the file"):
        case.save()
    assert case.path.read_text(encoding="utf-8") == "title = 'outside'\n"
    case.reload()
    assert (case.text, case.is_draft) == ("title = 'outside'\n", False)
    case.path.unlink()
    with pytest.raises(InputError, match="another program"):
        case.save()


@pytest.mark.parametrize(
    ("path", "value", "key"),
    [
        (("burst", "cell_size"), "6", "burst.cell_size"),
        (("burst", "cel_size"), "6 mm", "burst.cel_size"),
        (("round", 0, "attitude"), "uprigt", "round[1].attitude"),
        (("round", 0, "profile"), "m108", "round[1].profile"),
        (("exposed", 2, "obstacle"), "workshop 2", "exposed[3].obstacle"),
        (("flight", "ground", "map"), "none.asc", "flight.ground.map"),
        (("hazard", "energy"), "-1 J", "hazard.energy"),
    ],
)
def test_a_fault_is_that_of_the_command_line(space, path, value, key):
    case = CaseDocument(space, "m107_pair_site.toml")
    case.set(path, value)
    case.save()
    with pytest.raises(errors.InputError) as found:
        load_case(case.path)
    (fault,) = case.faults()
    assert fault.key.startswith(key)
    assert fault.words in str(found.value)


def test_two_hundred_fields_of_nonsense_are_kept_and_reported(space):
    case = CaseDocument(space, "m107_pair_site.toml")
    places = [
        (("round", 0), ("round",), ""),
        *(((name,), (name,), "") for name in ("burst", "break_up", "hazard", "document")),
    ]
    places += [(("flight", part), ("flight", part), "") for part in ("air", "wind", "ground", "ricochet")]
    places += [(("exposed", number), ("exposed",), kind) for number, kind in enumerate(kinds_of(("exposed",)) * 4)]
    written = 0
    for place, names, kind in places:
        try:
            fields = fields_of(names, kind)
        except KeyError:
            continue
        for one in fields:
            if one.form not in ("table", "tables") and one.name not in ("kind", "name"):
                case.set((*place, one.name), read_field(one, "]] 17 \u202e{nonsense} \\ '\""))
                written += 1
    assert written >= 150
    faults = case.faults()
    assert len(faults) > 100
    assert all(fault.words and "Traceback" not in fault.words for fault in faults)
    assert tomllib.loads(case.text) == case.tables


def test_text_that_is_no_toml_is_kept_too(space):
    case = CaseDocument(space, "new.toml")
    case.replace("[[[ nonsense")
    (fault,) = case.faults()
    assert "not valid TOML" in fault.words
    assert case.text == "[[[ nonsense"


def _tables(model: type[BaseModel], path: tuple[str, ...] = ()):
    yield path, model
    for name, field in model.model_fields.items():
        for _, table in tables_in(field.annotation):
            yield from _tables(table, (*path, name))


def test_every_key_of_the_case_has_a_field():
    for path, model in _tables(CaseTable):
        kind = getattr(model.model_fields.get("kind"), "annotation", None)
        words = getattr(kind, "__args__", ())
        word = str(words[0]) if len(words) == 1 else ""
        fields = {one.name: one for one in fields_of(path, word)}
        assert list(fields) == list(model.model_fields), path
        assert all(fields[name].meaning for name, entry in model.model_fields.items() if entry.description)


@pytest.mark.parametrize("name", profile_names())
def test_a_contour_turned_as_a_drawing_has_it_comes_back_exactly(name):
    tables = tomllib.loads((PROFILES / f"{name}.toml").read_text(encoding="utf-8"))
    wanted = profile_from_table(tables, name)
    for diameters, from_base in itertools.product((False, True), repeat=2):
        shown = from_case(tables, diameters=diameters, from_base=from_base)
        found = profile_from_table(to_case(shown, tables), name)
        assert (found.outer, found.cavity, found.charge_front, found.fuze) == (
            wanted.outer, wanted.cavity, wanted.charge_front, wanted.fuze,
        )  # fmt: skip


def test_numbers_of_a_contour_have_a_point_and_nonsense_is_kept():
    """A comma is refused here as in every other field: 1,500 may be 1.5 or 1500."""
    assert [number_of(text) for text in ("77,5", " 77.5 ", "1e2", "30", "x", "1,500", "nan", "")] == [
        "77,5", 77.5, 100, 30, "x", "1,500", "nan", "",
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("path", "value"),
    [(("burst", "cell_size"), "6,5 mm"), (("burst", "end_time"), "1,500 us"), (("round", 0, "position", 2), "1,5 m")],
)
def test_a_decimal_comma_is_refused_in_words(space, path, value):
    case = CaseDocument(space, "m107_pair_site.toml")
    case.set(path, value)
    assert any("which has a comma; a number has a decimal point" in fault.words for fault in case.faults())


def test_a_mark_is_moved_where_it_stands_on_the_map_and_on_earth(space):
    case = CaseDocument(space, "m107_pair_site.toml")
    marked = (
        ("exposed", 0, "position"),
        ("exposed", 4, "points", 1),
        ("obstacle", 1, "position"),
        ("exposed", 3, "latitude"),
    )
    for number, path in enumerate(marked):
        x = 123.0 + 30.0 * number
        move(case, path, x, -45.5)
        marks = {tuple(one["path"]): one["at"] for one in plan_of(case, [], [])["handles"]}
        assert marks[path] == pytest.approx((x, -45.5), abs=0.01)
    assert case.faults() == []
    with pytest.raises(InputError, match="changed in another window"):
        move(case, ("exposed", 40, "position"), 0.0, 0.0)


def test_places_come_from_geojson(space):
    case = CaseDocument(space, "m107_pair_site.toml")
    file = space.folder / "in.geojson"
    site = case.resolved().site
    place = [math.degrees(site.longitude) + 1e-3, math.degrees(site.latitude)]
    geometry = {"type": "Point", "coordinates": place}
    feature = {"type": "Feature", "properties": {"name": "gate", "kind": "person"}, "geometry": geometry}
    file.write_text(json.dumps({"type": "FeatureCollection", "features": [feature]}), encoding="utf-8")
    tables, _ = imported(case, file)
    assert [entry["name"] for entry in tables["exposed"]] == ["gate"]
    for name, text in (("a.geojson", "[]"), ("a.geojson", "{"), ("a.kml", "<!DOCTYPE kml><kml/>"), ("a.kml", "")):
        (space.folder / name).write_text(text, encoding="utf-8")
        with pytest.raises(errors.InputError, match=name):
            imported(case, space.folder / name)


@pytest.mark.parametrize(
    "name", ["../secret", "/etc/passwd", "", ".", f"{STATE}/settings.json", "link/x", "\0", "a/../../b"]
)
def test_no_path_leads_outside(space, name):
    (space.folder / "link").symlink_to("/etc")
    with pytest.raises(InputError, match="found the path"):
        space.inside(name)


def test_names_of_new_files_are_plain():
    assert safe_name(" ../../Mein Geschoß 1.toml", ".toml") == "Mein_Geschoß_1.toml"
    with pytest.raises(InputError, match="letters or digits"):
        safe_name("../..", ".toml")


def test_steps_of_a_key():
    assert steps_of("round[2].casing.density") == ("round", 1, "casing", "density")
