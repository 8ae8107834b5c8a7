"""Physical bounds: every number of the schema has some, with a reason; beyond the hard ones a case is refused."""

from __future__ import annotations

import copy
import math

import pytest
from pydantic import BaseModel

from fragfield.case import load_case
from fragfield.case.faults import outside_hard, outside_soft
from fragfield.case.keys import bounds_of, marks_of, tables_in
from fragfield.case.load import case_from_document
from fragfield.case.schema import CaseTable
from fragfield.errors import InputError
from fragfield_base.bounds import UNIT_BOUNDS, Bounds
from fragfield_base.inputs import Quantity, Vector
from tests.attack.cases import BASE
from tests.fragfield.short_run import ROOT, SHORT, invoke

CASES = sorted((ROOT / "cases").glob("*.toml"))


def _fields(model: type[BaseModel], above=""):
    for name, field in model.model_fields.items():
        path = f"{above}.{name}" if above else name
        yield path, field
        for _, table in tables_in(field.annotation):
            yield from _fields(table, path)


FIELDS = dict(_fields(CaseTable))


def test_bounds_have_a_reason_hold_the_default_and_are_narrower_when_usual():
    for key, bounds, default in [
        *((key, bounds_of(field), field.default) for key, field in FIELDS.items()),
        *((unit, bounds, None) for unit, bounds in UNIT_BOUNDS.items()),
    ]:
        assert bounds.low < bounds.high, key
        assert len(bounds.why) > 5, key
        if isinstance(default, float):
            assert bounds.holds(default), key
            assert bounds.usual is None or bounds.usual[0] <= default <= bounds.usual[1], key
        if bounds.usual is not None:
            assert bounds.low <= bounds.usual[0] < bounds.usual[1] <= bounds.high, key


def _component(field):
    """The quantity that a field or each of its components is; None of a pure number."""
    marks = (mark.component if isinstance(mark, Vector) else mark for mark in marks_of(field))
    return next((mark for mark in marks if isinstance(mark, Quantity)), None)


def _alone(key: str, value: object) -> CaseTable:
    """A case that has this value and nothing else but its defaults."""
    table, chosen, *steps = CaseTable, CaseTable, *key.split(".")
    models: list[type[BaseModel]] = []
    for step, after in zip(steps, [*steps[1:], None], strict=True):
        models.append(chosen)
        within = tables_in(chosen.model_fields[step].annotation)
        chosen = next((table for _, table in within if after is None or after in table.model_fields), chosen)
    for model, step in zip(reversed(models), reversed(steps), strict=True):
        left_out = {name: None for name, field in model.model_fields.items() if field.is_required()}
        table = model.model_construct(**{**left_out, step: value})
        value = [table]
    return table


@pytest.mark.parametrize(
    "key",
    [
        key
        for key, field in FIELDS.items()
        if any(isinstance(mark, (Bounds, Quantity, Vector)) for mark in marks_of(field))
    ],
)
def test_one_beyond_either_end_is_refused_of_every_key(key):
    """By the check of the bounds itself, and, where the key's table can stand alone, of a whole document."""
    field = FIELDS[key]
    bounds, quantity = bounds_of(field), _component(field)
    size = next((mark.size for mark in marks_of(field) if isinstance(mark, Vector)), 0)
    *path, name = key.split(".")
    for end, outwards in ((bounds.low, -math.inf), (bounds.high, math.inf)):
        beyond = math.nextafter(end, outwards)
        found = list(outside_hard(_alone(key, (beyond,) * size if size else beyond)))
        assert len(found) == 1, (beyond, found)
        assert bounds.why in found[0].words
        if path[:1] not in (["burst"], ["flight"], ["hazard"], ["break_up"]) or "counts" in path:
            continue
        document = copy.deepcopy(BASE)
        table = document
        for part in path:
            table = table.setdefault(part, {})
        written = beyond if quantity is None else f"{beyond!r} {quantity.symbol}"
        table[name] = [written] * size if size else written
        with pytest.raises(InputError, match=f"{key}: found .*allowed: "):
            case_from_document(document, source="case.toml", folder=ROOT)


@pytest.mark.parametrize("path", CASES, ids=lambda path: path.stem)
def test_the_ready_cases_are_usual(path):
    case = load_case(path)
    assert list(outside_hard(case)) == []
    assert list(outside_soft(case)) == []


def named(text):
    """A parameter in the name of a test."""
    return text if len(text) < 100 else f"{len(text)} characters"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (SHORT.replace("seed", "x = " + "[" * 5000 + "]" * 5000 + "\nseed", 1), "nested too deep"),
        (SHORT.replace("seed = 1", "seed = " + "9" * 5000), "not valid TOML: Exceeds the limit (4300 digits)"),
        (SHORT + "\n".join(f'[[plane]]\nname = "p{i}"\nkind = "ground"' for i in range(2000)), "found 2000 entries"),
        (SHORT.split("[[round]]")[0] + '\n[stack]\narrangement = "row"\ncount = 2\ngap = "1 cm"\n',
         "stack.round: found no table [[round]]"),
        (SHORT + '\n[stack]\narrangement = "row"\ncount = 2\ngap = "2e10 m"\n', "stack.gap: found 2e+10 m; allowed: "),
    ],
    ids=named,
)  # fmt: skip
def test_documents_of_no_sense_are_refused(text, words, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(text)
    done = invoke("check", path)
    assert done.exit_code == 2, done.stderr
    assert words in done.stderr


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("title = ", 'title = "a\\u001b]0;x\\u0007"\n#', "title: found the control character U+001B; allowed: text"),
        ('name = "tube"', 'name = "a\\u202eb"', "round[1].name: found the control character U+202E; allowed: text"),
        ("seed = 1", '"se\\u009bed" = 1', "se\\x9bed: found the control character U+009B; allowed: text"),
        ("seed = 1", '"se\\ned" = 1', "se\\ned: found the control character U+000A; allowed: text"),
        ("seed = 1", f"{'.'.join('a' * 5000)} = 1", "a: found tables nested deeper; allowed: 30 levels"),
    ],
    ids=named,
)
def test_texts_that_command_a_terminal_and_keys_without_end_are_refused(old, new, words, tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(SHORT.replace(old, new, 1))
    done = invoke("check", path)
    assert done.exit_code == 2, done.stderr
    assert f"{path}: {words}" in done.stderr


def test_a_setting_nested_without_end_is_refused(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(SHORT)
    for setting in (
        f"{'.'.join('a' * 5000)}=1",
        f"seed={{{'.'.join('a' * 5000)}=1}}",
        f"seed={'[' * 5000}{']' * 5000}",
    ):
        done = invoke("check", path, "--set", setting)
        assert done.exit_code == 2, done.stderr[-500:]
