"""What follows from a case before anything is computed: masses, speeds, mesh, cost, and where all stands."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import numpy as np

from burst_fenicsx.axisymmetric.mesh import mesh_meridian
from burst_fenicsx.geometry import Profile
from burst_fenicsx.meshing import MeshQuality, mesh_round, part_volumes, quality
from burst_fenicsx.meshing.cut import split_charges
from burst_fenicsx.meshing.mesh import CellMesh
from burst_fenicsx.problem import BurstSettings, Explosive, Mirror, Part, RigidPlane, Round
from flight import Fragments, HeightMap
from flight.scene.scene import Scene
from fragfield.case import CaseTable, plain
from fragfield.case.checks.estimates import check_numbers, given_fragments
from fragfield.case.checks.expected_masses import recovered_warning
from fragfield.case.conversion.attitude import attitude_of, is_mixed
from fragfield.case.conversion.clearance import Body, min_clearance
from fragfield.case.conversion.exposed_sites import exposed_sites_of
from fragfield.case.conversion.rounds import burst_rounds, first_alike, heights, masses_of, placed
from fragfield.case.conversion.surroundings import air_words, altitude_of, bearing_of, surroundings, wind_words
from fragfield.case.faults import Doubt
from fragfield.case.problem import break_up_settings, burst_geometry, burst_settings, rigid_plane
from fragfield.case.tables.round import PlaneTable, RoundTable
from fragfield.checking.case_warnings import (
    case_warnings,
    expected_cost,
    graded_name,
    mean_mass_warnings,
    waiting_on_estimates,
)
from fragfield.contours.read import is_of_file
from fragfield.hazard.contents import contents_of
from fragfield.hazard.rules import rules_for
from fragfield.hazard.to_apply import distance_to_apply, official_part
from fragfield.pipeline.arena import read_arena
from fragfield.pipeline.attitudes import attitudes_of
from fragfield.results import check as results
from fragfield.results.burst import ComputedPart
from fragfield.results.part import marks
from transition.law.mean_mass import gurney_coefficient, gurney_speed


def arrangement(case: CaseTable) -> results.Arrangement:
    """Rounds, smallest clear distance, planes, surroundings and contact of a resolved case with a burst."""
    bodies = [placed(entry) for entry in case.round]
    contact = burst_settings(case).contact
    nearest = min_clearance(bodies)
    return results.Arrangement(
        attitude=attitude_of(case),
        rounds=tuple(
            results.PlacedRound(
                name=entry.name,
                position=entry.position,
                axis=entry.axis,
                ignition_points=len(entry.ignition or []),
                delays=(min(times), max(times)) if (times := [p.delay for p in entry.ignition or []]) else None,
                initiation=results.Shock(**entry.initiation.model_dump()) if entry.initiation else None,
            )
            for entry in case.round
        ),
        min_clearance=nearest
        and results.Clearance(
            rounds=(case.round[nearest[0]].name, case.round[nearest[1]].name), clearance=max(nearest[2], 0.0)
        ),
        planes=tuple(_plane(case, plane, bodies) for plane in case.plane),
        surroundings=describe_surroundings(case),
        contact=results.SettingsOfContact(
            charge_casing=contact.charge_casing,
            cohesion=contact.cohesion,
            tensile_strength=contact.tensile_strength,
            friction_angle_deg=contact.friction_angle,
            surfaces=contact.surfaces,
            surface_friction_angle_deg=contact.surface_friction_angle,
        ),
    )


def _plane(case: CaseTable, plane: PlaneTable, bodies: Sequence[Body]) -> results.PlacedPlane:
    low = [heights(body, plane)[0] for body in bodies]
    nearest = int(np.argmin(np.round(low, 9)))
    rigid = rigid_plane(plane)
    return results.PlacedPlane(
        name=plane.name, kind=plane.kind, point=rigid.point, normal=rigid.normal,
        friction_angle_deg=rigid.friction_angle if isinstance(rigid, RigidPlane) else None,
        nearest_round=case.round[nearest].name, clearance=max(low[nearest], 0.0),
    )  # fmt: skip


def describe_surroundings(case: CaseTable) -> results.Surroundings:
    """Ground, ricochet, obstacles and exposed sites in numbers, for `fragfield check` (m)."""
    made = surroundings(case)
    ground, ricochet, scene = made["ground"], made["ricochet"], Scene(made["ground"])
    obstacles = []
    for obstacle, entry in zip(made["obstacles"], case.obstacle, strict=True):
        tops = obstacle.crest(scene.ground_at)[1]
        obstacles.append(
            results.PlacedObstacle(
                name=entry.name, kind=entry.kind, base=float(tops.min()) - obstacle.height, top=float(tops.max()),
                height=obstacle.height, follows=bool(np.ptp(tops) > 0.0), ricochet=entry.ricochet,
            )
        )  # fmt: skip
    return results.Surroundings(
        ground=results.FlatGround(height=ground) if isinstance(ground, float) else _map_extent(ground),
        altitude=altitude_of(case) if case.flight.air.model == "standard" else None,
        air=air_words(case),
        wind=wind_words(case),
        ricochet=ricochet and results.RicochetLaw(**asdict(ricochet)),
        obstacles=tuple(obstacles),
        exposed=tuple(describe_exposed(case)),
    )


def _map_extent(ground: HeightMap) -> results.GroundMap:
    (west, south), (east, north) = ground.corner, ground.end
    heights = ground.heights
    stated = {key: value for key, value in ground.facts.items() if key in marks(results.GroundMap)}
    return results.GroundMap(
        map=ground.name, nodes=(heights.shape[1], heights.shape[0]), cell=(ground.step[0], ground.step[1]),
        x=(west, east), y=(south, north), z=(float(heights.min()), float(heights.max())),
        datum=ground.datum, **stated,
    )  # fmt: skip


def describe_exposed(case: CaseTable) -> Iterator[results.PlacedSite]:
    """Distance and direction of the nearest edge of each exposed site."""
    for exposed in exposed_sites_of(case):
        distance, azimuth = exposed.nearest(case.flight.origin)
        yield results.PlacedSite(
            name=exposed.table.name, kind=exposed.table.kind, distance=distance, azimuth_deg=azimuth,
            bearing_deg=bearing_of(case, azimuth),
        )  # fmt: skip


def check_report(case: CaseTable) -> results.CheckedBurst:
    """What `fragfield check` reports of a resolved case with a burst.

    Raises InputError: the mesh cannot be made, since the contours do not allow it or a mesh file is at fault.
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
    descriptions: dict[int, results.CheckedRound] = {}
    for key, index, cuts in zip(computed, part.indices, part.cuts, strict=True):
        if key not in meshed:
            meshed[key], qualities[key] = _meshed(rounds[index], settings, cuts)
            descriptions.setdefault(first[index], _round(rounds[index], settings, meshed[key], 1 << len(cuts)))
    of_round = [computed[source] for source in part.source.tolist()]
    described = [
        replace(descriptions[key], **_of_drawing(table, descriptions[key]), name=table.name)
        for (key, _), table in zip(of_round, case.round, strict=True)
    ]
    cells = sum(qualities[key].cells for key in computed)
    symmetry = ComputedPart.of_stage(part.summary())
    attitudes = attitudes_of(case) if is_mixed(case) else None
    expected = expected_cost(settings, rounds, [meshed[key] for key in of_round], cells, symmetry.share, attitudes)
    return results.CheckedBurst(
        case=plain(case),
        rounds=tuple(described),
        arrangement=arrangement(case),
        geometry=results.ChosenGeometry(choice=settings.geometry, reason=burst_geometry(case).reason),
        mesh=results.CheckedMesh(
            cells=cells,
            nodes=sum(qualities[key].nodes for key in computed),
            min_scaled_jacobian=min(one.min_scaled_jacobian for one in qualities.values()),
            max_aspect_ratio=max(one.max_aspect_ratio for one in qualities.values()),
            min_edge=min(one.min_edge for one in qualities.values()),
        ),
        symmetry=symmetry,
        expected=expected,
        warnings=(
            *case_warnings(case, settings, described, expected),
            *waiting_on_estimates(rounds),
            *mean_mass_warnings(case, rounds, described),
            *(Doubt(key, f": {words}") for key, words in check_numbers(case, break_up_settings(case), margin=1.0)),
        ),
        **_prescribed(case),
    )


def _of_drawing(table: RoundTable, known: results.CheckedRound) -> dict[str, Any]:
    made: dict[str, Any] = {}
    if isinstance(table.profile, dict) and is_of_file(table.profile):
        made["contour"] = results.Contour(source=table.profile["source"], notes=table.profile.get("notes", ""))
    if table.expected is not None:
        made["drawing"] = {
            key: results.DrawnMass(mass=mass, deviation=exact / mass - 1.0)
            for key, mass, exact in (
                ("casing", table.expected.casing, known.casing_mass),
                ("charge", table.expected.charge, known.charge_mass),
            )
            if mass
        }
    return made


def _prescribed(case: CaseTable) -> dict[str, Any]:
    contents = contents_of(case)
    rules, official = tuple(rules_for(contents, case.official)), official_part(case)
    to_apply = distance_to_apply(None, official, rules)
    return {"official": official, "contents": contents, "rules": rules, "distance_to_apply": to_apply}


def _meshed(item: Round, settings: BurstSettings, cuts: Sequence[Mirror]) -> tuple[CellMesh, MeshQuality]:
    if settings.geometry == "axisymmetric":
        assert item.profile is not None
        meridian = mesh_meridian(item.profile, settings.cell_size)
        found = quality(meridian, item.profile)
        return (split_charges(meridian) if settings.contact.charge_casing == "sliding" else meridian), found
    mesh = mesh_round(item, settings.cell_size, cuts=cuts)
    if settings.contact.charge_casing == "sliding":
        mesh = split_charges(mesh)
    return mesh, quality(mesh)


def _round(entry: Round, settings: BurstSettings, mesh: CellMesh, times: int) -> results.CheckedRound:
    """What follows from a round; it is `times` its mesh."""
    meshed = part_volumes(mesh)
    density = {Part.CASING: entry.casing.density, Part.CHARGE: entry.explosive.density}
    in_mesh = {"casing_mass": times * meshed[Part.CASING] * density[Part.CASING]}
    in_mesh["charge_mass"] = times * meshed[Part.CHARGE] * density[Part.CHARGE]
    exact = dict(in_mesh)
    shape = _mesh_extent(entry, mesh)
    if (profile := entry.profile) is not None:
        masses = masses_of(entry)
        exact = {"casing_mass": masses.casing, "charge_mass": masses.charge}
        shape = {
            "profile": profile.name, "length": profile.length, "outer_diameter": 2.0 * profile.max_radius,
            "fuze_mass": profile.fuze_mass, "fuze_density": profile.fuze_density,
            "charge_length": profile.charge_end - profile.charge_front,
            "segments": tuple(_segments(entry, profile, mesh, times)),
        }  # fmt: skip
    shape |= exact
    detonation_velocity, ratio = entry.explosive.detonation_velocity, exact["charge_mass"] / exact["casing_mass"]
    return results.CheckedRound(
        name=entry.name,
        explosive=graded_name(entry.explosive),
        casing=graded_name(entry.casing),
        **shape,
        mass_error_of_mesh={key: in_mesh[key] / exact[key] - 1.0 for key in exact if exact[key] > 0.0},
        charge_ratio=ratio,
        detonation_velocity=detonation_velocity,
        gurney_constant=gurney_coefficient(detonation_velocity),
        gurney_speed=gurney_speed(detonation_velocity, ratio),
        **_products(entry.explosive, settings),
    )


def _mesh_extent(entry: Round, mesh: CellMesh) -> dict[str, Any]:
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


def _segments(entry: Round, profile: Profile, mesh: CellMesh, times: int) -> Iterator[results.CheckedSegment]:
    for segment, masses in zip(profile.segments, masses_of(entry).segments, strict=True):
        inside = (mesh.station >= segment.start) & (mesh.station < segment.end)
        disc = times / (math.pi * (segment.end - segment.start))
        whole, inner = (
            disc * float(mesh.volumes[part].sum()) for part in (inside, inside & (mesh.part != Part.CASING))
        )
        ratio = masses.charge / masses.casing
        speed = gurney_speed(entry.explosive.detonation_velocity, ratio) if ratio > 0.0 else None
        yield results.CheckedSegment(
            name=segment.name, kind=segment.kind, start=segment.start, end=segment.end,
            mean_wall=math.sqrt(whole) - math.sqrt(inner), casing_mass=masses.casing, charge_mass=masses.charge,
            gurney_speed=speed,
        )  # fmt: skip


def _products(explosive: Explosive, settings: BurstSettings) -> dict[str, Any]:
    from burst_fenicsx.materials.products import make_products  # needs numba
    from burst_fenicsx.materials.products.landau import LandauProducts

    products = make_products(explosive, settings.products)
    if not isinstance(products, LandauProducts):
        return {"energy_density": products.energy}
    return {
        "initial_pressure": products.initial_pressure,
        "knee_pressure": products.knee_pressure,
        "knee_volume": products.knee_volume,
        "energy_density": products.energy,
        "effective_gurney_constant": {str(v): products.gurney_velocity(v) for v in (2.0, 3.0, 7.0)},
    }


def fragments_report(case: CaseTable, path: Path) -> results.Checked:
    """What a file of fragments or an arena table holds, and what is doubtful in it.

    Raises InputError: the file cannot be read, or an arena table has not the mass of the case's rounds.
    """
    if (known := read_arena(path, case)) is None:
        fragments = Fragments.read(path)
        held = results.CheckedFragments(file=path.name, number=len(fragments), mass=float(fragments.mass.sum()))
        warnings = given_fragments(case, path)
    else:
        table, recovered = known
        held = results.CheckedFragments(
            file=path.name, number=float(table.number.sum()), mass=table.total_mass,
            recovered=recovered,
        )  # fmt: skip
        warnings = list(filter(None, [recovered_warning(recovered)]))
    return results.Checked(case=plain(case), fragments=held, warnings=tuple(warnings), **_prescribed(case))
