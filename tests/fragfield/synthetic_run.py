"""A run directory with every file of the contract, made from closed forms in a second: no solver needed."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from burst_fenicsx.files.output import TimeSeries
from burst_fenicsx.meshing.placement import FACING
from flight.files.ensemble import write_ensemble
from flight.files.hdf5 import write_table
from flight.fluence import PolarGrid
from flight.hazard.density.directions import Directions
from flight.hazard.density.sectors import SECTOR_HITS
from flight.hazard.ensemble import EnsembleHazard
from flight.rows import LANDING, Status
from fragfield.files.run_directory import stamped_toml
from fragfield.hazard.recommended import hazard_of, recommended_of
from fragfield.interface.results import Run
from fragfield.results.part import to_json
from fragfield.results.summary import Summary
from tests.flight.fields import ensemble_of_landings
from tests.fragfield.example_results import complete

LENGTH, RADIUS, BORE = 0.60, 0.0775, 0.055
END_TIME = 120e-6
SEGMENTS = (("ogive", "nose", 0.0, 0.18), ("cylinder", "wall", 0.18, 0.54), ("base", "base", 0.54, 0.60))
PROVENANCE = {"seed": "1", "program_version": "0.1.0", "versions": json.dumps({"dolfinx": "0.5.2", "numpy": "1.24.2"})}
STEEL, FILL = 7850.0, 1630.0

CASE = """title = "{title}"
seed = 1

[burst]
cell_size = "0.012 m"
quadrature = "one_point"
products = "landau_cj"
end_time = "0.00012 s"

[burst.leakage]
enabled = true
radius_ratio = 1.75

{rounds}
[break_up]
dimension = 2
mean_mass = "mott"
prefactor = 4.0
fracture_energy = "147000.0 J/m^2"
sampler = "quantile"

[flight]
drag = "shell_fragment_tp12"

[flight.air]
model = "constant"
density = "1.225 kg/m^3"

[[witness]]
name = "ring"
kind = "cylinder"
radius = "7.62 m"

[hazard]
energy = "79.0 J"
density = "0.017953321364452424 1/m^2"
"""
ROUND = """[[round]]
name = "{name}"
position = ["{x} m", "0.0 m", "0.0 m"]

[round.profile]
unit = "mm"
outer = {{ points = [[0, 77.5], [600, 77.5]] }}
cavity = {{ points = [[0, 55], [600, 55]] }}
charge = {{ front = 0 }}

[round.explosive]
name = "TNT"
density = "1630.0 kg/m^3"
detonation_velocity = "6940.0 m/s"
heat_of_detonation = "4520000.0 J/kg"
sound_speed = "2570.0 m/s"

[round.casing]
name = "shell steel"
density = "7850.0 kg/m^3"
elastic_modulus = "200000000000.0 Pa"
poisson_ratio = 0.3
shear_strength = "224000000.0 Pa"
tensile_strength = "448000000.0 Pa"

"""


def run_of(**known: Any) -> Run:
    """A run of no directory, of which these attributes alone are known."""
    run = Run(Path())
    vars(run).update(known)
    return run


def write_run(
    folder: Path, rounds: int = 1, title: str = "Synthetic round", stages: int = 3, *, axisymmetric: bool = False
) -> Path:
    """Write the files of the first `stages` of burst, break-up and flight, and all that goes with them.

    An `axisymmetric` burst has quadrilaterals of the meridian of its one round in place of hexahedra.
    """
    folder.mkdir(parents=True, exist_ok=True)
    names = [f"round {chr(65 + index)}" for index in range(rounds)]
    places = (np.arange(rounds) - (rounds - 1) / 2) * 0.19
    tables = "".join(ROUND.format(name=name, x=x) for name, x in zip(names, places, strict=True))
    (folder / "case.toml").write_text(stamped_toml(CASE.format(title=title, rounds=tables)), encoding="utf-8")
    (folder / "run.log").write_text("burst: 120.0 us reached\nbreak-up: done\n", encoding="utf-8")
    summary: dict[str, Any] = {"title": title, "versions": json.loads(PROVENANCE["versions"]), "seed": 1}
    mesh = _meridian() if axisymmetric else _mesh(places)
    if stages >= 1:
        summary["burst"] = _burst(folder, mesh, names, places)
    if stages >= 2:
        fragments = _fragments(places)
        summary["break_up"] = _break_up(folder, fragments, names)
    if stages >= 3:
        _flight(folder, fragments, summary)
    (folder / "summary.json").write_text(json.dumps(complete(Summary, summary), indent=1), encoding="utf-8")
    return folder


def _mesh(places: np.ndarray) -> dict[str, np.ndarray]:
    """Tubes of hexahedra, one a place; the axis is left open by a thin bore, which no picture shows."""
    radii = np.r_[np.linspace(0.004, BORE, 5), np.linspace(BORE, RADIUS, 3)[1:]]
    around, along = 24, 30
    r, turn, z = np.meshgrid(radii, np.arange(around), np.linspace(0, LENGTH, along + 1), indexing="ij")
    number = np.arange(r.size).reshape(r.shape)
    ahead = np.roll(number, -1, axis=1)
    low = [number[:-1, :, :-1], number[1:, :, :-1], ahead[1:, :, :-1], ahead[:-1, :, :-1]]
    high = [number[:-1, :, 1:], number[1:, :, 1:], ahead[1:, :, 1:], ahead[:-1, :, 1:]]
    cells = np.stack([*(item.ravel() for item in low), *(item.ravel() for item in high)], axis=1)
    angle = 2 * np.pi * turn.ravel() / around
    local = np.column_stack([r.ravel() * np.cos(angle), r.ravel() * np.sin(angle), z.ravel()])
    layer = np.broadcast_to(np.arange(len(radii) - 1)[:, None, None], low[0].shape).ravel()
    part = np.where(layer >= 4, 0, 1)
    station = LENGTH - local[cells][:, :, 2].mean(axis=1)
    segment = np.where(part == 0, np.searchsorted([s[3] for s in SEGMENTS], station), -1)
    repeat = len(places)
    return {
        "reference": np.concatenate([local + np.array([x, 0.0, 0.0]) for x in places]),
        "axis_x": np.repeat(places, len(local)),
        "cells": np.concatenate([cells + index * len(local) for index in range(repeat)]),
        "part": np.tile(part, repeat),
        "round": np.repeat(np.arange(repeat), len(cells)),
        "segment": np.tile(segment, repeat),
        "station": np.tile(station, repeat),
    }


def _meridian() -> dict[str, np.ndarray]:
    """Meridian of the tube, from the axis on, in the half plane y = 0."""
    radii = np.r_[np.linspace(0.0, BORE, 5), np.linspace(BORE, RADIUS, 3)[1:]]
    r, z = np.meshgrid(radii, np.linspace(0, LENGTH, 31))
    number = np.arange(r.size).reshape(r.shape)
    corners = [number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]]
    cells = np.stack([item.ravel() for item in corners], axis=1)
    nodes = np.column_stack([r.ravel(), np.zeros(r.size), z.ravel()])
    part = np.tile(np.where(np.arange(len(radii) - 1) >= 4, 0, 1), 30)
    station = LENGTH - nodes[cells][:, :, 2].mean(axis=1)
    return {
        "reference": nodes,
        "axis_x": np.zeros(len(nodes)),
        "cells": cells,
        "part": part,
        "round": np.zeros(len(cells), dtype=int),
        "segment": np.where(part == 0, np.searchsorted([s[3] for s in SEGMENTS], station), -1),
        "station": station,
    }


def speed_at(station: np.ndarray) -> np.ndarray:
    """Casing speed along the round (m/s): fastest ahead of the middle, slow at both ends."""
    x = station / LENGTH
    return 1250.0 * (4 * x * (1 - x)) ** 0.3 * (1.08 - 0.16 * x)


def moved(mesh: dict[str, np.ndarray], time: float) -> tuple[np.ndarray, np.ndarray]:
    """Positions and velocities at a time: a radial expansion that starts at the nose."""
    nodes = mesh["reference"]
    centre = np.column_stack([mesh["axis_x"], np.zeros(len(nodes)), nodes[:, 2]])
    radial = nodes - centre
    delay = (LENGTH - nodes[:, 2]) / 6940.0
    lived = np.clip(time - delay, 0.0, None)
    rise = 1.0 - np.exp(-lived / 12e-6)
    speed = speed_at(LENGTH - nodes[:, 2]) * rise
    way = speed_at(LENGTH - nodes[:, 2]) * (lived - 12e-6 * rise)
    return nodes + radial / RADIUS * way[:, None], radial / RADIUS * speed[:, None]


def _burst(folder: Path, mesh: dict[str, np.ndarray], names: list[str], places: np.ndarray) -> dict[str, Any]:
    series = TimeSeries(folder / "burst", mesh["cells"], PROVENANCE)
    for time in np.linspace(0.0, END_TIME, 7):
        position, velocity = moved(mesh, time)
        if mesh["cells"].shape[1] == 4:
            position, velocity = position @ FACING, velocity @ FACING
        series.write(
            time, position, point_data={"velocity": velocity},
            cell_data={"part": mesh["part"], "pressure": np.full(len(mesh["part"]), 1e9)},
        )  # fmt: skip
    position, velocity = moved(mesh, END_TIME)
    text = h5py.string_dtype()
    segment_type = [("name", text), ("kind", text)] + [
        (name, float)
        for name in (
            "start", "end", "outer_radius", "wall_thickness", "charge_radius", "casing_mass", "charge_mass", "speed",
        )
    ]  # fmt: skip
    along_names = ("station", "mean_speed", "max_speed", "outer_diameter", "casing_mass")
    casing_mass, charge_mass = _masses()
    with h5py.File(folder / "burst_snapshot.h5", "w") as file:
        file.attrs.update({"format": "fragfield burst snapshot", "format_version": 1, "time": END_TIME, **PROVENANCE})
        if mesh["cells"].shape[1] == 4:
            file.attrs["geometry"] = "axisymmetric"
        file["nodes/reference"], file["nodes/position"], file["nodes/velocity"] = mesh["reference"], position, velocity
        file["cells/nodes"], file["cells/part"] = mesh["cells"], mesh["part"].astype(np.uint8)
        for name in ("round", "segment", "station"):
            file[f"cells/{name}"] = mesh[name]
        corners = mesh["reference"][mesh["cells"]]
        ring = np.pi * corners[..., 0].mean(axis=1) * np.abs(np.cross(*_diagonals(corners)[..., ::2]))
        density = np.where(mesh["part"] == 0, STEEL, FILL)
        file["cells/mass"] = density * ring if corners.shape[1] == 4 else np.full(len(ring), 0.1)
        for name in ("plastic_shear_strain", "plastic_volumetric_strain"):
            file[f"cells/{name}"] = np.full(len(mesh["part"]), 0.1)
        for index, (name, x) in enumerate(zip(names, places, strict=True)):
            group = file.create_group(f"rounds/{index}")
            group.attrs.update(
                {"name": name, "length": LENGTH, "casing_density": STEEL, "casing_mass": casing_mass,
                 "charge_mass": charge_mass, "fuze_mass": 0.0, "explosive": "TNT", "explosive_density": FILL,
                 "detonation_velocity": 6940.0, "gurney_velocity": 2440.0, "position": (x, 0.0, 0.0),
                 "axis": (0.0, 0.0, 1.0)}
            )  # fmt: skip
            rows = [
                (label, kind, start, end, RADIUS, RADIUS - BORE, BORE, casing_mass * (end - start) / LENGTH,
                 charge_mass * (end - start) / LENGTH, float(speed_at(np.array((start + end) / 2))))
                for label, kind, start, end in SEGMENTS
            ]  # fmt: skip
            group["segments"] = np.array(rows, dtype=segment_type)
            station = (np.arange(30) + 0.5) / 30 * LENGTH
            mean = speed_at(station) * (1 + 0.02 * index)
            table = np.column_stack([station, mean, mean * 1.06, np.full(30, 0.33), np.full(30, casing_mass / 30)])
            group["along"] = np.array([tuple(line) for line in table], dtype=[(name, float) for name in along_names])
        _history(file, len(places), casing_mass, charge_mass)
    count = len(places)
    each = [
        {"name": name, "mean_initial_speed": 1085.0, "max_initial_speed": 1340.0, "outer_diameter": 0.331}
        for name in names
    ]
    return {
        "cells": len(mesh["cells"]), "nodes": len(position), "ranks": 1, "threads": 2, "steps": 1030,
        "cell_steps": 1030 * len(mesh["cells"]),
        "end_time": END_TIME, "wall_seconds": 12.5, "seconds_per_cell_step": 2.1e-7, "peak_memory_bytes": 310e6,
        "casing_mass": casing_mass * count, "charge_mass": charge_mass * count, "mean_initial_speed": 1085.0,
        "max_initial_speed": 1340.0, "outer_diameter": 0.331, "lost_cells": 0, "folded_cells": 0, "released_cells": 0,
        "min_scaled_jacobian": 0.7, "max_aspect_ratio": 2.5, "energy_error": 0.0031,
        "contact_error": 0.0028, "contact_error_at_end": 0.0012,
        "momentum_error": 2e-13, "contact": {"max_collision_penetration": 1.1e-4},
        "products_balance": 0.998, "acceleration_complete": 1.1e-4, "acceleration_left": 0.1,
        "mean_speed_at_end": 1034.5, "rounds": each,
    }  # fmt: skip


def _diagonals(corners: np.ndarray) -> np.ndarray:
    return np.stack([corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]])


def _masses() -> tuple[float, float]:
    return STEEL * np.pi * (RADIUS**2 - BORE**2) * LENGTH, FILL * np.pi * BORE**2 * LENGTH


def _history(file: h5py.File, count: int, casing_mass: float, charge_mass: float) -> None:
    time = np.linspace(0.0, END_TIME, 200)
    rise = 1.0 - np.exp(-time / 25e-6)
    work = count * charge_mass * 4.52e6 * 0.78 * rise
    shares = {"kinetic": 0.86, "kinetic_casing": 0.62, "strain": 0.01, "plastic": 0.08, "viscous": 0.035,
              "hourglass": 0.006, "contact": 0.004, "damping": 0.0}  # fmt: skip
    columns = {name: share * work for name, share in shares.items()}
    columns |= {
        "time": time, "time_step": np.full(200, 1.2e-7), "products_work": work,
        "products_energy_left": count * charge_mass * 4.52e6 - work, "energy_error": 0.0031 * rise,
        "contact_gain": 0.0012 * work, "contact_error": 0.0028 * rise,
        "mean_casing_speed": 1085.0 * rise, "outer_diameter": 0.155 + 0.176 * (time / END_TIME) ** 1.2,
    }  # fmt: skip
    for name, values in columns.items():
        file[f"history/{name}"] = values


def _fragments(places: np.ndarray) -> dict[str, np.ndarray]:
    random = np.random.default_rng(1)
    columns: dict[str, list[np.ndarray]] = {name: [] for name in ("mass", "position", "velocity", "round", "segment")}
    for index, x in enumerate(places):
        for segment, (_, _, start, end) in enumerate(SEGMENTS):
            number = round(N0 * (end - start) / LENGTH)
            mass = MU * np.log(number / (np.arange(number) + 0.5)) ** 2
            turn = random.uniform(0, 2 * np.pi, number)
            station = random.uniform(start, end, number)
            outward = np.column_stack([np.cos(turn), np.sin(turn), random.normal(0.0, 0.09, number)])
            focus = 1.0 + (0.8 * np.abs(np.sin(turn)) ** 12 if len(places) > 1 else 0.0)
            columns["mass"].append(mass)
            columns["position"].append(
                np.column_stack([x + 0.15 * outward[:, 0], 0.15 * outward[:, 1], LENGTH - station])
            )
            columns["velocity"].append(outward * (speed_at(station) * focus)[:, None])
            columns["round"].append(np.full(number, index))
            columns["segment"].append(np.full(number, segment))
    return {name: np.concatenate(items) for name, items in columns.items()}


REALISATIONS = 6
N0, MU = 1800.0, 7.0e-3
"""Fragments a round, and Mott's mu (kg)."""


def _break_up(folder: Path, fragments: dict[str, np.ndarray], names: list[str]) -> dict[str, Any]:
    with h5py.File(folder / "fragments.h5", "w") as file:
        file.attrs.update({"format": "fragfield fragments", "format_version": 1, **PROVENANCE})
        for name, values in fragments.items():
            file[f"fragments/{name}"] = values
        file["fragments/shape_factor"] = np.full(len(fragments["mass"]), 2600.0)
    segments = [
        {"name": name, "mean_mass": 2 * MU, "mu": MU, "n0": round(N0 * (end - start) / LENGTH),
         "parts": [{"dimension": 2, "mu": MU, "mass_fraction": 1.0}]}
        for name, _, start, end in SEGMENTS
    ]  # fmt: skip
    return {
        "fragments": len(fragments["mass"]), "mass": float(fragments["mass"].sum()), "mass_error": 1e-13,
        "momentum_error": 3e-4, "energy_error": 0.012,
        "rounds": [{"name": name, "segments": segments} for name in names],
    }  # fmt: skip


def _flight(folder: Path, fragments: dict[str, np.ndarray], summary: dict[str, Any]) -> None:
    mass, velocity = fragments["mass"], fragments["velocity"]
    speed = np.linalg.norm(velocity, axis=1)
    reach = 2 * mass / (0.9 * 1.225 * (mass / 2600.0) ** (2 / 3))  # 1/e length of the speed
    rise = np.clip(velocity[:, 2] / speed, 0.002, None)
    distance = reach * np.log1p(4.0 * rise * 150.0 / reach) + 4.0
    impact = np.maximum(speed * np.exp(-distance / reach), 25.0)
    turn = np.arctan2(velocity[:, 1], velocity[:, 0])
    azimuth = np.degrees(turn) % 360
    energy = 0.5 * mass * impact**2
    columns = flight_columns(fragments, distance, turn, impact, energy)
    write_table(columns, folder / "landing.h5", "landing", (), PROVENANCE)
    bins = np.round(azimuth / 5).astype(int) % 72
    hazardous = energy >= 79.0
    by_azimuth = []
    for index in range(72):
        inside = bins == index
        by_azimuth.append(
            {"azimuth_deg": 5.0 * index, "hits": int(inside.sum()), "hazardous_hits": int((inside & hazardous).sum()),
             "max_initial_speed": float(speed[inside].max()), "mean_initial_speed": float(speed[inside].mean())}
        )  # fmt: skip
    summary["flight"] = {
        "fragments": len(mass), "landed": len(mass), "wall_seconds": 1.4, "drag": "shell_fragment_tp12",
        "above_drag_table": 7,
    }  # fmt: skip
    found = _ensemble(folder, columns, by_azimuth)
    summary["flight"] |= {name: found.summary()[name] for name in ("hazardous_fragments", "realisations")}
    summary["hazard"] = to_json(recommended_of(hazard_of(found.headline), None))
    summary["witness"] = [{"name": "ring", "hits": len(mass), "by_azimuth": by_azimuth}]


def _ensemble(folder: Path, landing: np.ndarray, by_azimuth: list[dict[str, Any]]) -> EnsembleHazard:
    """REALISATIONS of the flight: the first, and others turned and stretched at random."""
    random = np.random.default_rng(2)
    parts = [landing]
    hits = np.zeros((REALISATIONS, 72), dtype=SECTOR_HITS)
    for name in ("hits", "hazardous_hits", "max_initial_speed", "mean_initial_speed"):
        hits[name] = [line[name] for line in by_azimuth]
    for number in range(1, REALISATIONS):
        other = landing.copy()
        other["azimuth"] = (other["azimuth"] + random.uniform(0.0, 360.0)) % 360.0
        other["distance"] *= random.uniform(0.95, 1.05)
        parts.append(other)
        hits[number] = np.roll(hits[0], random.integers(72))
    found = ensemble_of_landings(parts, Directions(PolarGrid.of(reach=3000.0), "worst_direction"))
    write_ensemble(found, {"ring": hits}, folder, PROVENANCE)
    return found


def flight_columns(
    fragments: dict[str, np.ndarray], distance: np.ndarray, turn: np.ndarray, impact: np.ndarray, energy: np.ndarray
) -> np.ndarray:
    """The structured array of landing.h5."""
    columns = np.zeros(len(distance), dtype=LANDING)
    columns["fragment"], columns["status"] = np.arange(len(distance)), Status.LANDED
    columns["position"][:, 0], columns["position"][:, 1] = distance * np.cos(turn), distance * np.sin(turn)
    columns["distance"], columns["azimuth"] = distance, np.degrees(turn) % 360
    columns["angle"] = 20.0
    columns["mass"], columns["speed"], columns["energy"] = fragments["mass"], impact, energy
    for name in ("round", "segment"):
        columns[name] = fragments[name]
    return columns
