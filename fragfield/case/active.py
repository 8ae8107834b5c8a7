"""Keys of a resolved case that apply to a run: the others keep their defaults and change nothing.

A key that only one choice reads ("for model = "power_law"") is not active under another choice; a table that a switch
turns off is not active as a whole. What is meant is the choice in the case, not whether a value matters much.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from fragfield.case.schema import Case

__all__ = ["active_tables"]

Tables = dict[str, Any]


def active_tables(case: Case, tables: Mapping[str, Any], *, own_fragments: bool = True) -> Tables:
    """The tables of a case without keys that take no part in its run.

    Parameters
    ----------
    case : Case
        Resolved.
    tables : mapping
        The same case as nested dicts, in whatever form of its values (`fragfield.case.write`).
    own_fragments : bool
        False where the run flew fragments from a file: burst, rounds and break-up took no part then.

    Returns
    -------
    dict
        A copy. Empty lists, texts and tables are left out too.
    """
    left_out = set(_inactive(case, own_fragments=own_fragments))
    found = _without((), tables, left_out)
    for entry, table in zip(found.get("round", ()), case.round, strict=False):
        _drop(entry, _inactive_of_round(case, table.initiation is not None))
    for entry in found.get("exposed", ()):
        if entry.get("number") == 1.0:
            del entry["number"]
    return found


def _inactive(case: Case, *, own_fragments: bool) -> Iterator[str]:
    """Dotted keys, without those of rounds."""
    flight, wind = case.flight, case.flight.wind
    yield from _of_choice(
        "flight.air", flight.air.model, {"standard": ("altitude",), "constant": ("density", "sound_speed")}
    )
    calm = wind.model != "profile" and wind.speed == 0.0
    if calm:
        yield "flight.wind"
    elif wind.model != "power_law":
        yield from ("flight.wind.reference_height", "flight.wind.exponent")
    if wind.model == "profile":
        yield from ("flight.wind.speed", "flight.wind.towards")
    box = ("ratios", "density")
    yield from _of_choice("flight.shape", flight.shape.model, {"mean": (), "lognormal": ("spread",), "box": box})
    if flight.shape.model == "box":
        yield "flight.shape_factor"
    yield from _of_choice(
        "flight.integrator", flight.integrator.method, {"adaptive": ("tolerance",), "fixed": ("step",)}
    )
    ground = flight.ground
    if ground.map is None:
        yield from (f"flight.ground.{key}" for key in ("site", "datum", "holes"))
    else:
        yield "flight.ground.height"
    if ground.ricochet == "none":
        yield from (f"flight.ground.{key}_factor" for key in ("critical_angle", "speed_kept", "departure", "roughness"))
    if not own_fragments or (len(case.round) < 2 and not any(plane.kind == "symmetry" for plane in case.plane)):
        yield "hazard.stack_rule"
        if own_fragments:
            yield "flight.collisions"
    if own_fragments:
        yield from _inactive_of_burst(case)
        yield from _inactive_of_break_up(case)
    else:
        yield from ("burst", "round", "plane", "stack", "break_up")
    yield "uncertainty"  # of the study, whose page lists its inputs


def _inactive_of_burst(case: Case) -> Iterator[str]:
    burst = case.burst
    if burst is None:
        return
    if burst.stop == "time":
        yield from (f"burst.{key}" for key in ("acceleration_tolerance", "acceleration_window", "time_limit"))
    if burst.damping == 0.0:
        yield "burst.damping"
    if burst.time_step.fixed is not None:
        yield "burst.time_step.cfl"
    if not burst.leakage.enabled:
        yield from (f"burst.leakage.{key}" for key in ("radius_ratio", "alpha", "beta", "parts"))
    if burst.quadrature == "full":
        yield "burst.hourglass"
    if burst.contact.charge_casing == "shared":
        yield from (f"burst.contact.{key}" for key in ("cohesion", "tensile_strength", "friction_angle"))
    if not burst.contact.surfaces:
        yield "burst.contact.surface_friction_angle"


def _inactive_of_break_up(case: Case) -> Iterator[str]:
    part = case.break_up
    given, law = not isinstance(part.mean_mass, str), "mott" if part.mean_mass_is_file else part.mean_mass
    if part.dimension != "mixed":
        yield "break_up.mixed_fraction"
    if given or law != "mott" or part.mean_mass_is_file:  # a common factor, which the fit replaces
        yield from ("break_up.prefactor", "break_up.fracture_energy")
    if given or law != "mott_1947":
        yield from ("break_up.fracture_stress", "break_up.fracture_gamma")
    if given or law != "gurney_sarmousakis":
        yield "break_up.explosive_constant"
    if part.mean_mass_is_file:
        yield "break_up.counts"  # the report shows them beside the law
    if given or law == "gurney_sarmousakis":
        yield from (f"break_up.{key}" for key in ("critical_strain", "velocity_source"))
    if part.sampler != "graded":
        yield from ("break_up.graded_m0", "break_up.graded_dm")
    if part.tilt == 0.0:
        yield "break_up.tilt"


def _inactive_of_round(case: Case, waits: bool) -> tuple[str, ...]:
    assert case.burst is not None  # a case with rounds that take part has a burst
    keys = [] if case.burst.products == "jwl" else ["explosive.jwl"]
    if not waits:
        keys += ["explosive.critical_energy", "explosive.critical_energy_source"]
    return tuple(keys)


def _of_choice(prefix: str, choice: str, keys_of: Mapping[str, tuple[str, ...]]) -> Iterator[str]:
    """The keys that only other choices read."""
    own = set(keys_of[choice])
    yield from (f"{prefix}.{key}" for keys in keys_of.values() for key in keys if key not in own)


def _without(path: tuple[str, ...], tables: Mapping[str, Any], left_out: set[str]) -> Tables:
    found: Tables = {}
    for key, value in tables.items():
        place = (*path, key)
        if ".".join(place) in left_out or value in ("", [], {}):
            continue
        if isinstance(value, dict):
            inner = _without(place, value, left_out)
            if inner:
                found[key] = inner
        elif isinstance(value, list):
            found[key] = [dict(one) if isinstance(one, dict) else one for one in value]
        else:
            found[key] = value
    return found


def _drop(entry: Tables, keys: tuple[str, ...]) -> None:
    """Take dotted keys out of a copy of a table, copying the tables on the way."""
    for key in keys:
        *way, last = key.split(".")
        table: Any = entry
        for step in way:
            if not isinstance(table.get(step), dict):
                break
            table[step] = dict(table[step])
            table = table[step]
        else:
            table.pop(last, None)
