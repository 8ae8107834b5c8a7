"""Files of fragments counted by mass, as `break_up.mean_mass` names them: a table of the case, and its check.

A file is CSV with a line of column names (commas, semicolons or tabs; lines with # are comments) and has one of four
forms; UNIT is any of mass, as kg, g, mg, lb, oz, grain.

- Groups: mass_from_UNIT, mass_to_UNIT, number, and, where they were weighed, mass_UNIT (of all pieces of the group). A
  last mass_to of inf is a group without an upper end.
- Numbers above masses: mass_above_UNIT, number.
- Single pieces: mass_UNIT, and, where one line stands for several, number. The lightest piece is taken for the limit of
  what was collected.
- An arena table (`flight.arena`), its zones added up. Groups between its own that have no line hold nothing.

Numbers are of all rounds together; a line "# rounds = 4" gives their number, 1 where it is missing; below 1 it is the
part of a round whose fragments were caught. Those of an arena table are of one round, the mean over that many.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from flight.arena import ArenaTable
from flight.files.text_tables import import_hint, in_columns_of, read_columns
from fragfield.case.conversion.rounds import are_alike, masses_of
from fragfield.case.faults import Fault, faults_at, refuse
from fragfield.case.schema import CaseTable
from fragfield.case.tables.burst import BreakUpTable, FragmentCountsTable
from fragfield.errors import InputError, nearest
from fragfield_base.errors import show
from fragfield_base.inputs import with_unit
from fragfield_base.paths import absolute
from fragfield_base.reading import read_text
from fragfield_base.substances import Substance
from transition.errors import InputError as BreakUpInputError
from transition.law.fragment_counts import FragmentCounts

Array = NDArray[np.float64]
Groups = tuple[Array, Array, Array | None]


_MASSES = ("mass_from_kg", "mass_to_kg", "mass_above_kg", "mass_kg")
_FORMS = "mass_from_g, mass_to_g, number or mass_above_g, number or mass_g or the columns of an arena table"
_ROUNDS = re.compile(r"^#\s*rounds\s*[=:]\s*(\S+)\s*$")
_PER_OCTAVE = 8  # groups into which single pieces are put: the fit differs by less than 1 % of its standard error
_SAME = 1e-5  # of a mass: edges of neighbouring groups


def with_counts(case: CaseTable, source: str, folder: Path) -> CaseTable:
    """A case with the counts of the file that `break_up.mean_mass` names; one that has them already stays as it is."""
    part = case.break_up
    if not part.mean_mass_is_file:
        if part.counts is not None:
            words = f'allowed: only with mean_mass = "{part.counts.source}"'
            refuse(source, [Fault("break_up.counts", f"found without a file in break_up.mean_mass; {words}")])
        return case
    if part.counts is not None and part.counts.source == part.mean_mass:
        return case
    with faults_at(source, "break_up.mean_mass"):
        counts = read_counts(absolute(str(part.mean_mass), InputError, folder), str(part.mean_mass))
    mass = None if counts.mass is None else [with_unit(one, "kg") for one in counts.mass]
    values = {"edges": [with_unit(edge, "kg") for edge in counts.edges], "number": list(counts.number), "mass": mass}
    table = FragmentCountsTable.model_validate({"source": str(part.mean_mass), "rounds": counts.rounds, **values})
    return case.model_copy(update={"break_up": part.model_copy(update={"counts": table})})


def check_counts(case: CaseTable) -> Iterator[Fault]:
    """Faults of counts that fix no mean mass, hold another mass than the casing, or stand for rounds that differ."""
    if case.break_up.counts is None or not case.break_up.mean_mass_is_file:
        return
    from transition.law.count_fit import SegmentMasses, fit_counts  # needs scipy

    key = "break_up.mean_mass"
    if not are_alike(case):
        source = case.break_up.counts.source
        yield Fault(
            key,
            f"{source} holds the fragments of one kind of round, and those of the case differ; allowed: rounds alike, "
            "or a law or a mass",
        )
        return
    known = None
    if case.round:
        known = SegmentMasses((1.0,), (masses_of(case.round[0]).casing,))
    try:
        fit_counts(case.break_up.counts.made(), case.break_up.dimension, case.break_up.mixed_fraction, known)
    except BreakUpInputError as error:
        yield Fault(key, str(error))


def read_counts(path: Path, name: str | None = None) -> FragmentCounts:
    """Read a file of counted fragments; messages and results call it `name`, by default the name of the file.

    Raises InputError: of flight, of the break-up or ours: no such file, columns that are not of one of the forms,
    groups that overlap or leave a gap, numbers that are no counts; the message names the file.
    """
    name = path.name if name is None else name
    read = read_columns(path, "pit")
    columns = in_columns_of(path, read, _MASSES)
    rounds = _rounds(path)
    if "zone_from_deg" in columns:
        edges, number, mass = _of_arena(path, ArenaTable.read(path))
        return _counts(path, name, (edges, number * rounds, None if mass is None else mass * rounds), rounds)
    if unknown := set(columns) - {*_MASSES, "number"}:
        column = min(unknown)
        raise InputError(
            f"{path}: unknown column {column!r}{nearest(column, [*_MASSES, 'number'])}; needed: {_FORMS}"
            f"{import_hint(path, 'pit')}"
        )
    values = {name.removesuffix("_kg"): column for name, column in columns.items() if name != "number"}
    kinds = set(values)
    if kinds == {"mass"}:
        return _counts(path, name, _of_pieces(path, values["mass"], columns.get("number")), rounds)
    if "number" in columns and kinds == {"mass_above"}:
        return _counts(path, name, _of_cumulative(path, values["mass_above"], columns["number"]), rounds)
    if "number" in columns and kinds in ({"mass_from", "mass_to"}, {"mass_from", "mass_to", "mass"}):
        found = _of_groups(path, values["mass_from"], values["mass_to"], columns["number"], values.get("mass"))
        return _counts(path, name, found, rounds)
    raise InputError(f"{path}: found columns {', '.join(read)}; needed: {_FORMS}, in any unit of mass")


def _counts(path: Path, name: str, groups: Groups, rounds: float) -> FragmentCounts:
    edges, number, mass = groups
    try:
        return FragmentCounts(
            name, tuple(edges.tolist()), tuple(number.tolist()), rounds, None if mass is None else tuple(mass.tolist())
        )
    except BreakUpInputError as error:
        raise InputError(str(error).replace(f"{name}:", f"{path}:", 1)) from None


def _rounds(path: Path) -> float:
    for line in read_text(path, InputError).splitlines():
        if found := _ROUNDS.match(line):
            try:
                value = float(found[1].strip('"'))
            except ValueError:
                value = 0.0
            if not 0.0 < value < np.inf:
                raise InputError(f"{path}: found the line {line!r}; needed: a number above zero, as # rounds = 4")
            return value
    return 1.0


def _of_groups(path: Path, start: Array, end: Array, number: Array, mass: Array | None) -> Groups:
    order = np.argsort(start, kind="stable")
    start, end, number = start[order], end[order], number[order]
    off = np.abs(start[1:] - end[:-1]) > _SAME * start[1:]
    if off.any():
        at = int(np.argmax(off))
        what = "overlap" if start[at + 1] < end[at] else "leave a gap; a group without pieces needs a row with number 0"
        raise InputError(f"{path}: groups that end at {end[at]:g} kg and begin at {start[at + 1]:g} kg {what}")
    edges = start if np.isposinf(end[-1]) else np.append(start, end[-1])
    return edges, number, None if mass is None else mass[order]


def _of_cumulative(path: Path, above: Array, number: Array) -> Groups:
    order = np.argsort(above, kind="stable")
    above, number = above[order], number[order]
    rising = np.diff(number) > 0.0
    if rising.any():
        at = int(np.argmax(rising))
        raise InputError(
            f"{path}: {number[at]:g} pieces above {above[at]:g} kg and {number[at + 1]:g} above {above[at + 1]:g} kg; "
            "numbers above a mass fall with it"
        )
    return above, np.append(number[:-1] - number[1:], number[-1]), None


def _of_pieces(path: Path, mass: Array, number: Array | None) -> Groups:
    times = np.ones(len(mass)) if number is None else number
    if not (np.isfinite(mass).all() and (mass > 0.0).all() and np.isfinite(times).all() and (times >= 0.0).all()):
        raise InputError(f"{path}: pieces need masses above zero, and numbers of 0 or more")
    mass, times = mass[times > 0.0], times[times > 0.0]
    if not len(mass):
        raise InputError(f"{path}: no piece in it")
    lightest = mass.min()
    count = int(np.floor(_PER_OCTAVE * np.log2(mass.max() / lightest))) + 1
    edges = lightest * 2.0 ** (np.arange(count) / _PER_OCTAVE)
    group = np.clip(np.searchsorted(edges, mass, side="right") - 1, 0, count - 1)
    numbers = np.bincount(group, weights=times, minlength=count)
    weighed = np.bincount(group, weights=times * mass, minlength=count)
    numbers[0] -= 1.0  # the lightest is the limit, not a piece above it
    weighed[0] -= lightest
    return edges, np.maximum(numbers, 0.0), np.maximum(weighed, 0.0)


def _of_arena(path: Path, table: ArenaTable) -> Groups:
    """Groups of all zones together, empty ones between them, and all heavier masses, of which there were none."""
    rows = table.mass_to > table.mass_from
    if (table.number[~rows] > 0.0).any():
        raise InputError(f"{path}: a row has fragments and no group of mass (mass_from_kg below mass_to_kg)")
    pairs, group = np.unique(np.column_stack([table.mass_from[rows], table.mass_to[rows]]), axis=0, return_inverse=True)
    if not len(pairs):
        raise InputError(f"{path}: no fragment in it")
    number = np.bincount(group.ravel(), weights=table.number[rows])
    mass = np.bincount(group.ravel(), weights=(table.number * table.mass)[rows])
    edges, numbers, masses = [pairs[0, 0]], [], []
    for (start, end), n, m in zip(pairs, number, mass, strict=True):
        gap = start - edges[-1]
        if gap < -_SAME * start:
            raise InputError(
                f"{path}: groups of mass from {start:g} kg overlap those up to {edges[-1]:g} kg; allowed: the same "
                "groups in every zone"
            )
        if gap > _SAME * start:
            edges.append(start)
            numbers.append(0.0)
            masses.append(0.0)
        edges.append(end)
        numbers.append(float(n))
        masses.append(float(m))
    return np.array(edges), np.array([*numbers, 0.0]), np.array([*masses, 0.0])


_FILE = "a file of fragments that a test of it counted"
_NEEDED: dict[str, tuple[str, ...]] = {
    "mott": ("critical_strain", "fracture_energy"),
    "mott_1947": ("critical_strain", "fracture_stress", "fracture_gamma"),
    _FILE: ("critical_strain",),
}
"""By law: its inputs that are the casing's own."""


def with_casing_data(break_up: BreakUpTable, casings: list[Substance], source: str) -> BreakUpTable:
    """The table [break_up] with what its law needs of the casings, as far as the case leaves it out.

    `source` is the case's file, for messages. Raises CaseFaults: a casing's file lacks it, or two casings differ in it;
    the message names the laws that remain.
    """
    law = _FILE if break_up.mean_mass_is_file else break_up.mean_mass
    needed = _NEEDED.get(law, ()) if isinstance(law, str) else ()
    values = {key: _of_casings(key, casings, source) for key in needed if key not in break_up.model_fields_set}
    lacking = [key for key, value in values.items() if value is None]
    if casings and lacking:
        refuse(source, [Fault("break_up.mean_mass", _refusal(break_up, law, lacking, casings))])
    changes = {key: value for key, value in values.items() if casings and value != getattr(break_up, key)}
    return break_up.model_copy(update=changes) if changes else break_up


def _refusal(break_up: BreakUpTable, law: object, lacking: list[str], casings: list[Substance]) -> str:
    names = [show(one.name) for one in casings if any(one.value("break_up", key) is None for key in lacking)]
    given = break_up.model_fields_set
    remaining = [f"break_up.mean_mass = {show(one)}" for one in _remaining(casings, given) if one != law]
    keys = " and ".join([f"break_up.{key}" for key in lacking])
    return (
        f"{show(law) if law != _FILE else law} needs {' and '.join(lacking)}, of which the casing "
        f"{' and '.join(names)} has no data; allowed: {' or '.join([f'with {keys} given', *remaining])}, or the mean "
        'mass itself from a test, for example "14.9 g"'
    )


def _remaining(casings: list[Substance], given: set[str]) -> Iterator[str]:
    for law in ("mott", "mott_1947"):
        keys = [key for key in _NEEDED[law] if key not in given]
        if all(one.value("break_up", key) is not None for one in casings for key in keys):
            yield law


def _of_casings(key: str, casings: list[Substance], source: str) -> float | None:
    values = {one.name: one.value("break_up", key) for one in casings}
    if None in values.values():
        return None
    if len(set(values.values())) > 1:
        listed = ", ".join(f"{value:g} of {name}" for name, value in values.items())
        words = f"missing, and the casings differ in it: {listed}; give one for all rounds"
        refuse(source, [Fault(f"break_up.{key}", words)])
    return next(iter(values.values()), None)
