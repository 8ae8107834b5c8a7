"""From a file to a resolved case: read, check, and replace names by their data."""

from __future__ import annotations

import dataclasses
import logging
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from pydantic import ValidationError

from burst_fenicsx.data import LENGTH_UNITS
from burst_fenicsx.geometry import Profile, load_profile
from burst_fenicsx.geometry.files import PROFILES
from burst_fenicsx.materials.library import load_casing, load_explosive, load_substance
from burst_fenicsx.meshing import mesh_round
from burst_fenicsx.problem import Part
from fragfield.case.checks.consistency import check_case, check_charges, check_protective_works
from fragfield.case.checks.estimates import stage_faults
from fragfield.case.checks.expected_masses import unit_faults
from fragfield.case.conversion.attitude import attitude_faults, is_mixed, with_axes
from fragfield.case.conversion.exposed_sites import resolved_exposed
from fragfield.case.conversion.mean_mass import check_counts, with_casing_data, with_counts
from fragfield.case.conversion.rounds import base_faults, burst_round, masses_of, on_base, profile_of_table
from fragfield.case.conversion.stack import expanded, stacked_names
from fragfield.case.conversion.surroundings import altitude_of, site_of
from fragfield.case.conversion.turned import origin_faults
from fragfield.case.faults import CaseFaults, Fault, explain, faults_at, refuse
from fragfield.case.problem import check_geometry
from fragfield.case.schema import CaseTable
from fragfield.case.tables.round import (
    CasingTable,
    ContourTable,
    ExplosiveTable,
    IgnitionTable,
    JwlTable,
    RoundTable,
    resolved_plane,
)
from fragfield.case.tables.surroundings import PlacesTable
from fragfield.contours.read import casing_volume, profile_of_contour
from fragfield.errors import InputError
from fragfield.terminal.logs import hidden_in, visible
from fragfield_base.paths import absolute
from fragfield_base.reading import read_text
from fragfield_base.substances import Substance

if TYPE_CHECKING:
    from _typeshed import DataclassInstance


Material = ExplosiveTable | CasingTable

_log = logging.getLogger(__name__)


MOST_CASE = 1 << 26
"""Largest size (bytes) of a case file: 64 MB hold ten thousand rounds of inline points."""
MOST_DEPTH = 30
"""Levels of tables and lists in a case."""


def read_document(path: Path) -> dict[str, Any]:
    """Tables of a TOML file; raises InputError where it is missing, unreadable or not TOML."""
    if not path.exists():
        raise InputError(f"{path}: no such case file")
    try:
        document = tomllib.loads(read_text(path, InputError, most=MOST_CASE))
    except RecursionError:
        raise InputError(f"{path}: not valid TOML for this program: tables or lists nested too deep") from None
    except ValueError as error:  # also an integer of more digits than Python reads
        if isinstance(error, InputError):
            raise
        raise InputError(f"{path}: not valid TOML: {error}") from None
    _refuse_deep(document, str(path))
    return document


def read_resolved(path: Path) -> CaseTable:
    """Read a case that this program has resolved and written; raises InputError where it is not sound."""
    return _validated(read_document(path), str(path))


def case_from_document(document: Mapping[str, Any], *, source: str, folder: Path, burst: bool = True) -> CaseTable:
    """Check and resolve the tables of a case; see `fragfield.case.load_case`. Raises CaseFaults."""
    case = _validated(document, source)
    if case.site is not None and case.site.places is not None:
        case = _validated(_with_places(document, case, source, folder), source)
    of_attitude = [*attitude_faults(case), *base_faults(case)]
    case = with_axes(case)
    refuse(source, [*of_attitude, *check_case(case, burst=burst)])
    stacked = stacked_names(case) if case.stack is not None else []
    rounds = [_resolved_round(entry, source, f"round[{i}]", folder) for i, entry in enumerate(case.round, start=1)]
    planes, exposed = [resolved_plane(entry) for entry in case.plane], resolved_exposed(case)
    with_files = _with_altitude(_with_files(case, source, folder), source)
    standing = {entry.name for entry in rounds if entry.base == "ground"}
    with faults_at(source, ""):
        rounds = [on_base(entry, with_files) for entry in rounds]
        rounds = expanded(with_files.model_copy(update={"round": rounds}), standing)
    changes: dict[str, Any] = {"round": rounds, "stack": None, "plane": planes, "exposed": exposed}
    if case.burst is not None:
        changes["break_up"] = with_casing_data(case.break_up, _casings(case, folder), source)
    if case.burst is not None and case.burst.stop is None:
        stop = "acceleration" if case.burst.end_time is None else "time"
        changes["burst"] = case.burst.model_copy(update={"stop": stop})
    case = with_counts(with_files.model_copy(update=changes), source, folder)
    refuse(source, check_charges(case, stacked))
    refuse(source, check_geometry(case))
    if is_mixed(case):
        refuse(source, origin_faults(case))
    refuse(source, check_counts(case))
    refuse(source, stage_faults(case))
    refuse(source, check_protective_works(case))
    return case


def _with_places(document: Mapping[str, Any], case: CaseTable, source: str, folder: Path) -> dict[str, Any]:
    from fragfield.places.tables import tables_of_places

    site = site_of(case)
    assert site is not None
    assert case.site is not None
    places = case.site.places
    table = PlacesTable(file=places) if isinstance(places, str) else places
    assert table is not None
    with faults_at(source, "site.places"):
        made, notes = tables_of_places(table, absolute(table.file, InputError, folder), site, case.flight.origin)
    for note in notes:
        _log.warning("site.places: %s", note)
    changed = {**document, "site": {key: value for key, value in document["site"].items() if key != "places"}}
    return changed | {key: [*document.get(key, []), *entries] for key, entries in made.items()}


def _validated(document: Mapping[str, Any], source: str) -> CaseTable:
    _refuse_deep(document, source)
    refuse(
        source, [Fault(key, f"found the control character {sign}; allowed: text") for key, sign in hidden_in(document)]
    )
    try:
        return CaseTable.model_validate(document)
    except ValidationError as error:
        raise CaseFaults(source, explain(error, CaseTable)) from None


def _refuse_deep(document: Mapping[str, Any], source: str) -> None:
    """Keys with dots nest as deep as they are long, without a limit of the TOML reader."""
    waiting: list[tuple[str, object, int]] = [(str(key), value, 1) for key, value in document.items()]
    while waiting:
        first, found, depth = waiting.pop()
        if depth > MOST_DEPTH:
            refuse(source, [Fault(visible(first), f"found tables nested deeper; allowed: {MOST_DEPTH} levels")])
        below = found.values() if isinstance(found, dict) else found if isinstance(found, (list, tuple)) else ()
        waiting += [(first, value, depth + 1) for value in below]


def _casings(case: CaseTable, folder: Path) -> list[Substance]:
    named = [entry.casing for entry in case.round if isinstance(entry.casing, str)]
    names = dict.fromkeys(_located(name, folder) for name in named)
    return [found for name in names if (found := load_substance("casing", name)) is not None]


def _with_files(case: CaseTable, source: str, folder: Path) -> CaseTable:
    flight: dict[str, Any] = {}
    if isinstance(case.flight.drag, str) and case.flight.drag.lower().endswith(".csv"):
        with faults_at(source, "flight.drag"):
            flight["drag"] = _file(case.flight.drag, folder)
    if case.flight.ground.map is not None:
        with faults_at(source, "flight.ground.map"):
            flight["ground"] = case.flight.ground.model_copy(update={"map": _file(case.flight.ground.map, folder)})
    return case.model_copy(update={"flight": case.flight.model_copy(update=flight)}) if flight else case


def _with_altitude(case: CaseTable, source: str) -> CaseTable:
    if case.flight.air.model != "standard" or case.flight.air.altitude is not None:
        return case
    with faults_at(source, "flight.ground.map", said="ground.map: "):
        air = case.flight.air.model_copy(update={"altitude": altitude_of(case)})
    return case.model_copy(update={"flight": case.flight.model_copy(update={"air": air})})


def _resolved_round(entry: RoundTable, source: str, key: str, folder: Path) -> RoundTable:
    changes: dict[str, Any] = {
        name: named_material(name, value, source=source, key=f"{key}.{name}", folder=folder)
        for name, value in (("explosive", entry.explosive), ("casing", entry.casing))
        if isinstance(value, str)
    }
    if entry.mesh is not None:
        with faults_at(source, f"{key}.mesh"):
            changes["mesh"] = _file(entry.mesh, folder)
            if not Path(changes["mesh"]).is_file():
                raise InputError(f"no such file {changes['mesh']}")
            changes["ignition"] = []
            front, end = _charge_of_mesh(entry.model_copy(update=changes))
    else:
        given = entry.profile
        if entry.contour is not None:
            table = ContourTable(file=entry.contour) if isinstance(entry.contour, str) else entry.contour
            with faults_at(source, f"{key}.contour"):
                given, unit = profile_of_contour(table, absolute(table.file, InputError, folder))
            casing = changes.get("casing", entry.casing)
            faults = unit_faults(entry, casing.density * casing_volume(given), unit)
            refuse(source, [Fault(f"{key}.contour", words) for words in faults])
            changes["contour"] = None
        with faults_at(source, f"{key}.{'profile' if entry.contour is None else 'contour'}"):
            changes["profile"], profile = _profile(given, folder)
        front, end = profile.charge_front, profile.charge_end
    points = [IgnitionTable()] if entry.ignition is None else entry.ignition
    words = {"nose": front, "middle": 0.5 * (front + end), "base": end}
    stations = [words[point.station] if isinstance(point.station, str) else point.station for point in points]
    changes["ignition"] = [
        point.model_copy(update={"station": station}) for point, station in zip(points, stations, strict=True)
    ]
    for number, station in enumerate(stations, start=1):
        if not front - 1e-6 <= station <= end + 1e-6:
            fault = (
                f"found {station * 1e3:.6g} mm, outside the charge; allowed: {front * 1e3:.6g} mm to {end * 1e3:.6g} "
                "mm from the nose end"
            )
            raise CaseFaults(source, [Fault(f"{key}.ignition[{number}].station", fault)])
    made = entry.model_copy(update=changes)
    if entry.mesh is not None:
        faults = unit_faults(entry, masses_of(made).casing, LENGTH_UNITS[made.mesh_unit or "m"])
        refuse(source, [Fault(f"{key}.mesh", words) for words in faults])
    return made


def named_material(kind: str, name: str, *, source: str, key: str, folder: Path) -> Material:
    """Table of an "explosive" or a "casing" of the library or of a user's file; raises CaseFaults for another name."""
    with faults_at(source, key):
        located = _located(name, folder)
        if kind == "explosive":
            return _as_table(load_explosive(located), ExplosiveTable)
        return _as_table(load_casing(located), CasingTable)


def _charge_of_mesh(entry: RoundTable) -> tuple[float, float]:
    mesh = mesh_round(burst_round(entry), 1.0)
    nodes = mesh.nodes[np.unique(mesh.cells[mesh.part == Part.CHARGE])]
    axis = np.array(entry.axis) / np.linalg.norm(entry.axis)
    stations = mesh.lengths[0] - (nodes - np.array(entry.position)) @ axis
    return float(stations.min()), float(stations.max())


def _located(name: str, folder: Path) -> str:
    file, sign, part = name.partition("#")
    return f"{_file(file, folder)}{sign}{part}" if file.lower().endswith(".toml") else name


def _file(name: str, folder: Path) -> str:
    """Absolute path of a file that a case names, relative to the case's folder; the only rule for all of them."""
    return str(absolute(name, InputError, folder).resolve())


def _as_table(material: DataclassInstance, table: type[Material]) -> Material:
    values = dataclasses.asdict(material)
    if table is CasingTable:
        for key in ("shear_softening_strain", "tensile_softening_strain", "softening_length"):
            values[key] = "none" if values[key] is None else values[key]
    if values.get("jwl"):
        values["jwl"] = JwlTable.model_construct(**values["jwl"])
    return table.model_construct(**values)


def _profile(value: str | dict[str, Any] | None, folder: Path) -> tuple[dict[str, Any], Profile]:
    if isinstance(value, dict):
        return value, profile_of_table(value)
    assert value is not None  # checked before: a round has a profile or a mesh
    located = _located(value, folder)
    profile = load_profile(located)
    file = Path(located) if value.lower().endswith(".toml") else PROFILES / f"{value}.toml"
    return {"name": profile.name, **read_document(file)}, profile
