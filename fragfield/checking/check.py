"""`fragfield check`: quantities that follow from a case before anything is computed, and warnings."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.case import plain
from fragfield.case.checks.estimates import check_numbers, given_fragments
from fragfield.case.conversion.attitude import is_mixed
from fragfield.case.conversion.rounds import burst_rounds, first_alike
from fragfield.case.faults import Doubt
from fragfield.case.problem import break_up_settings, burst_geometry, burst_settings
from fragfield.checking.case_warnings import case_warnings, mean_mass_warnings, substances_of, waiting_on_estimates
from fragfield.checking.cost import expected_cost
from fragfield.contours.read import is_of_file
from fragfield.hazard.contents import arrangement, contents_of
from fragfield.hazard.rules import rules_for
from fragfield.hazard.to_apply import distance_to_apply, official_part
from fragfield.pipeline.arena import read_arena
from fragfield.pipeline.attitudes import attitudes_of
from fragfield.results.part import to_json
from transition.law.mean_mass import gurney_coefficient, gurney_speed

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence
    from pathlib import Path

    from burst_fenicsx.meshing import MeshQuality
    from burst_fenicsx.meshing.mesh import CellMesh
    from burst_fenicsx.problem import BurstSettings, Explosive, Mirror, Round
    from fragfield.case import CaseTable
    from fragfield.case.tables.round import RoundTable


def check_report(case: CaseTable) -> dict[str, Any]:
    """What `fragfield check` reports of a resolved case with a burst.

    Returns
    -------
    dict
        `case`, `rounds`, `arrangement`, `geometry`, `mesh` (of what is computed), `symmetry`, `expected`,
        `warnings`, `official` (as in summary.json), `contents` (net explosive quantity and masses), `rules` (those by
        mass, each with its distance or the reason why it does not apply) and `distance_to_apply` (as in summary.json,
        without the computed distance); numbers in SI.

    Raises
    ------
    InputError
        The mesh cannot be made: the contours do not allow it, or a mesh file is at fault.
    """
    from burst_fenicsx.symmetry import smallest_part

    settings, rounds = burst_settings(case), burst_rounds(case)
    # A ring of the meridian is whole: no plane of symmetry cuts it.
    whole = replace(settings, symmetry="off") if settings.geometry == "axisymmetric" else settings
    part = smallest_part(rounds, whole)
    # Rounds that differ in their place alone have the same mesh, so that a pallet is meshed as one round.
    first = first_alike(case)
    computed: list[tuple[int, tuple[Any, ...]]] = [
        (first[index], tuple(cut.normal for cut in cuts)) for index, cuts in zip(part.indices, part.cuts, strict=True)
    ]
    meshed: dict[tuple[Any, ...], CellMesh] = {}
    qualities: dict[tuple[Any, ...], MeshQuality] = {}
    descriptions: dict[int, dict[str, Any]] = {}
    for key, index, cuts in zip(computed, part.indices, part.cuts, strict=True):
        if key not in meshed:
            meshed[key], qualities[key] = _meshed(rounds[index], settings, cuts)
            descriptions.setdefault(first[index], _round(rounds[index], settings, meshed[key], 1 << len(cuts)))
    of_round = [computed[source] for source in part.source.tolist()]
    described = [
        {**descriptions[key], **_of_drawing(table, descriptions[key]), "name": table.name}
        for (key, _), table in zip(of_round, case.round, strict=True)
    ]
    cells = sum(qualities[key].cells for key in computed)
    symmetry = part.summary()
    expected = expected_cost(settings, rounds, [meshed[key] for key in of_round], cells, symmetry["share"])
    if is_mixed(case):
        expected["attitudes"] = attitudes_of(case)
    return {
        "case": plain(case),
        "rounds": described,
        "arrangement": arrangement(case),
        "geometry": {"choice": settings.geometry, "reason": burst_geometry(case).reason},
        "mesh": {
            "cells": cells,
            "nodes": sum(qualities[key].nodes for key in computed),
            "min_scaled_jacobian": min(one.min_scaled_jacobian for one in qualities.values()),
            "max_aspect_ratio": max(one.max_aspect_ratio for one in qualities.values()),
            "min_edge": min(one.min_edge for one in qualities.values()),
        },
        "symmetry": symmetry,
        "expected": expected,
        "warnings": [
            *case_warnings(case, settings, described, expected),
            *waiting_on_estimates(rounds),
            *mean_mass_warnings(case, rounds, described),
            *(Doubt(key, f": {words}") for key, words in check_numbers(case, break_up_settings(case), margin=1.0)),
        ],
        **_prescribed(case),
    }


def _of_drawing(table: RoundTable, found: Mapping[str, Any]) -> dict[str, Any]:
    made: dict[str, Any] = {}
    if isinstance(table.profile, dict) and is_of_file(table.profile):
        made["contour"] = {"source": table.profile["source"], "notes": table.profile.get("notes", "")}
    if table.expected is not None:
        masses = {key: getattr(table.expected, key) for key in ("casing", "charge")}
        made["drawing"] = {
            key: {"mass": mass, "deviation": found[f"{key}_mass"] / mass - 1.0} for key, mass in masses.items() if mass
        }
    return made


def _prescribed(case: CaseTable) -> dict[str, Any]:
    contents = contents_of(case)
    rules, official = tuple(rules_for(contents, case.official)), official_part(case)
    return {
        "official": to_json(official),
        "contents": to_json(contents),
        "rules": to_json(rules),
        "distance_to_apply": to_json(distance_to_apply(None, official, rules)),
    }


def _meshed(item: Round, settings: BurstSettings, cuts: Sequence[Mirror]) -> tuple[CellMesh, MeshQuality]:
    from burst_fenicsx.meshing import mesh_round, quality
    from burst_fenicsx.meshing.cut import split_charges

    if settings.geometry == "axisymmetric":
        from burst_fenicsx.axisymmetric.mesh import mesh_meridian

        assert item.profile is not None
        meridian = mesh_meridian(item.profile, settings.cell_size)
        found = quality(meridian, item.profile)
        return (split_charges(meridian) if settings.contact.charge_casing == "sliding" else meridian), found
    mesh = mesh_round(item, settings.cell_size, cuts=cuts)
    if settings.contact.charge_casing == "sliding":
        mesh = split_charges(mesh)
    return mesh, quality(mesh)


def _round(entry: Round, settings: BurstSettings, mesh: CellMesh, times: int) -> dict[str, Any]:
    """What follows from a round; it is `times` its mesh."""
    from burst_fenicsx.meshing import part_volumes
    from burst_fenicsx.problem import Part

    meshed = part_volumes(mesh)
    density = {Part.CASING: entry.casing.density, Part.CHARGE: entry.explosive.density}
    found: dict[str, Any] = {"name": entry.name}
    found |= substances_of(entry)
    in_mesh = {"casing_mass": times * meshed[Part.CASING] * density[Part.CASING]}
    in_mesh["charge_mass"] = times * meshed[Part.CHARGE] * density[Part.CHARGE]
    exact = dict(in_mesh)
    if entry.profile is not None:
        profile = entry.profile
        exact["casing_mass"] = profile.casing_volume * entry.casing.density
        exact["charge_mass"] = profile.charge_volume * entry.explosive.density
        found |= {"profile": profile.name, "length": profile.length, "outer_diameter": 2.0 * profile.max_radius}
        found |= {"fuze_mass": profile.fuze_mass, "fuze_density": profile.fuze_density}
        found |= {"charge_length": profile.charge_end - profile.charge_front}
        found["segments"] = list(_segments(entry, mesh, times))
    else:
        found |= _mesh_extent(entry, mesh)
    found |= exact
    found["mass_error_of_mesh"] = {key: in_mesh[key] / exact[key] - 1.0 for key in exact if exact[key] > 0.0}
    ratio = exact["charge_mass"] / exact["casing_mass"]
    found["charge_ratio"] = ratio
    found["detonation_velocity"] = entry.explosive.detonation_velocity
    found["gurney_constant"] = gurney_coefficient(entry.explosive.detonation_velocity)
    found["gurney_speed"] = gurney_speed(entry.explosive.detonation_velocity, ratio)
    return found | _products(entry.explosive, settings)


def _mesh_extent(entry: Round, mesh: CellMesh) -> dict[str, float]:
    from burst_fenicsx.problem import Part

    axis = np.array(entry.axis) / np.linalg.norm(entry.axis)
    relative = mesh.nodes - np.array(entry.position)
    height = relative @ axis
    radius = np.linalg.norm(relative - height[:, None] * axis, axis=1)
    charge = height[np.unique(mesh.cells[mesh.part == Part.CHARGE])]
    return {
        "length": mesh.lengths[0],
        "outer_diameter": 2.0 * float(radius.max()),
        "charge_length": float(np.ptp(charge)),
    }


def _segments(entry: Round, mesh: CellMesh, times: int) -> Iterator[dict[str, Any]]:
    """Masses by the contours; the mean wall is that of the mesh, by volume, as the burst records it."""
    from burst_fenicsx.problem import Part

    assert entry.profile is not None
    for segment in entry.profile.segments:
        volumes = entry.profile.volumes(segment.start, segment.end)
        casing, charge = volumes.casing * entry.casing.density, volumes.charge * entry.explosive.density
        inside = (mesh.station >= segment.start) & (mesh.station < segment.end)
        disc = times / (math.pi * (segment.end - segment.start))
        whole, inner = (
            disc * float(mesh.volumes[part].sum()) for part in (inside, inside & (mesh.part != Part.CASING))
        )
        speed = gurney_speed(entry.explosive.detonation_velocity, charge / casing) if charge > 0.0 else None
        yield {
            "name": segment.name,
            "kind": segment.kind,
            "start": segment.start,
            "end": segment.end,
            "mean_wall": math.sqrt(whole) - math.sqrt(inner),
            "casing_mass": casing,
            "charge_mass": charge,
            "gurney_speed": speed,
        }


def _products(explosive: Explosive, settings: BurstSettings) -> dict[str, Any]:
    from burst_fenicsx.materials.products import make_products
    from burst_fenicsx.materials.products.landau import LandauProducts

    products = make_products(explosive, settings.products)
    if not isinstance(products, LandauProducts):
        return {"energy_density": products.energy}
    return {
        "P0": products.initial_pressure,
        "Pk": products.knee_pressure,
        "Vk_over_V0": products.knee_volume,
        "energy_density": products.energy,
        "effective_gurney_constant": {str(v): products.gurney_velocity(v) for v in (2.0, 3.0, 7.0)},
    }


def fragments_report(case: CaseTable, path: Path) -> dict[str, Any]:
    """What a file of fragments or an arena table holds.

    Returns
    -------
    dict
        `fragments`: `file`, `number` and `mass` (kg) of all fragments as they are flown, of an arena table those of one
        round; and of that `recovered`, as `flight.recovered` of summary.json. `warnings`, and `official`, `contents`,
        `rules` and `distance_to_apply` as of `check_report`.

    Raises
    ------
    InputError
        The file cannot be read, or an arena table has not the mass of the case's rounds.
    """
    found = read_arena(path, case)
    if found is None:
        from flight import Fragments

        fragments = Fragments.read(path)
        held = {"file": path.name, "number": len(fragments), "mass": float(fragments.mass.sum())}
        return {"fragments": held, "warnings": given_fragments(case, path), **_prescribed(case)}
    table, recovered = found
    held = {"file": path.name, "number": float(table.number.sum()), "mass": table.total_mass}
    warnings = [recovered.warning] if recovered.warning else []
    return {"fragments": {**held, "recovered": recovered.summary()}, "warnings": warnings, **_prescribed(case)}
