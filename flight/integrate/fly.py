"""`fly`: computes landings and hits of fragments."""

from __future__ import annotations

import time
import warnings
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.arguments import real_array, require_number
from flight.drag import Drag
from flight.errors import DragTableWarning, FlightWarning, InputError
from flight.fluence import FluenceGrid, Weights
from flight.fragments import Fragments, shaped
from flight.integrate.contact import Contact, Encounters, legs_between
from flight.integrate.job import Adaptive, Domain, FixedStep, FlightJob, FlightProgress
from flight.result import FlightResult
from flight.rows import Status
from flight.scene.air import STANDARD_GRAVITY, Air, ConstantAir, StandardAtmosphere
from flight.scene.obstacles import Barricade, Building, Wall
from flight.scene.ricochet import DEFAULT, Ricochet
from flight.scene.scene import HeightMap, Scene
from flight.scene.targets import Cylinder, Panel, Polygon
from flight.scene.wind import Wind
from flight.shape import DEFAULT_SHAPE_FACTOR, describe
from fragfield_base.cores import cores
from fragfield_base.errors import names_allowed

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from numpy.typing import ArrayLike, NDArray

    from flight.integrate.job import Integrator
    from flight.rows import Flown
    from flight.scene.obstacles import Obstacle
    from flight.scene.targets import Witness
    from flight.shape import Shape


_OR_NONE, _WIND = " or None", ", such as flight.Wind.constant(5.0, towards_deg=90.0), or None"
_HEAVY = 5.0  # kg: where no fragment is lighter, grams may have been meant
RANGES = np.dtype(
    [
        ("mass", "f8"),  # kg
        ("speed", "f8"),  # m/s, at launch
        ("elevation", "f8"),  # degrees above the horizontal
        ("range", "f8"),  # m, to the first impact on the ground
        ("time", "f8"),  # s
        ("arrival_speed", "f8"),  # m/s
        ("energy", "f8"),  # J, on arrival
        ("angle", "f8"),  # degrees, of the path below the horizontal on arrival
    ]
)


def fly(
    fragments: Fragments,
    *,
    air: Air | str | float = "standard",
    drag: Drag | str | Path | float = "shell_fragment",
    gravity: float = STANDARD_GRAVITY,
    wind: Wind | None = None,
    ground: float | HeightMap | None = 0.0,
    ricochet: Ricochet | str | None = DEFAULT,
    obstacles: Obstacle | Sequence[Obstacle] = (),
    witnesses: Witness | Sequence[Witness] = (),
    integrator: Integrator | None = None,
    contact: Contact | None = None,
    shape: Shape | None = None,
    domain: Domain | None = None,
    time_limit: float = 3600.0,
    origin: tuple[float, float] = (0.0, 0.0),
    fluence: FluenceGrid | None = None,
    weights: Weights | None = None,
    sample: int | ArrayLike = 0,
    seed: int = 0,
    threads: int | None = None,
    on_progress: Callable[[FlightProgress], None] | None = None,
) -> FlightResult:
    """Fly fragments through air until each has landed, left the domain or run out of time.

    Parameters
    ----------
    fragments : Fragments
        What flies; none may start below the ground.
    air : Air, "standard", "vacuum" or float
        A float is a constant density (kg/m3). "standard": the standard atmosphere, z = 0 at the altitude that a
        `HeightMap` says (`datum`), else at sea level.
    drag : Drag, str, Path or float
        A table, the name of a built-in one, a .csv file, or a constant coefficient.
    gravity : float
        Downward acceleration (m/s2).
    wind : Wind, optional
        Horizontal wind; a speed alone has no direction and is refused.
    ground : float, HeightMap or None
        Height of flat ground (m), a map of heights, or no ground.
    ricochet : Ricochet, str or None
        How fragments ricochet off the ground, or the kind of ground (`flight.scene.ricochet.KINDS`), by default
        "soft_soil" as everywhere here; "none" or None: they stay where they land.
    obstacles : Wall, Barricade or Building, or a sequence of them
        What stops fragments, or lets them ricochet.
    witnesses : Cylinder, Panel or Polygon, or a sequence of them
        Surfaces that record every crossing: those up to the first impact on the ground as `hits`, later ones as
        `ricochet_hits`.
    integrator : Adaptive or FixedStep
        Default `Adaptive()`.
    contact : Contact, optional
        Lets fragments strike each other in the first metres. One that has reached flat ground strikes none any more;
        one that an obstacle or a map's slope has stopped may still deflect another within those metres.
    shape : flight.shape.Mean, Lognormal or Box, optional
        Model of the presented areas, drawn with `seed`; default: the shape factors that the fragments bring.
    domain : Domain, optional
        Where a fragment counts as gone.
    time_limit : float
        End of every flight (s).
    origin : (2,) floats
        Position from which distance and azimuth are counted (m).
    fluence : FluenceGrid, optional
        Count the lengths of paths below a person's height, by azimuth and distance; needs a ground.
    weights : flight.fluence.Weights, optional
        Of fragments that stand for others, in what is counted near the ground; without contact alone.
    sample : int or indices
        Fragments whose paths are kept: that many drawn with `seed`, or those named.
    seed : int
        Of whatever is drawn at random: presented areas, slopes of the ground, the fragments whose paths are kept.
    threads : int, optional
        Default: all cores this process may use. The result does not depend on it.
    on_progress : callable, optional
        Called now and then with a FlightProgress.

    Raises
    ------
    InputError
        A fragment starts below the ground, off the map or in an obstacle, or an argument is out of range.

    Notes
    -----
    Wang et al., Eqs. 32-34; see `flight.kernels.motion`. The first call compiles for some seconds, once a machine.
    """
    began = time.perf_counter()
    drag = Drag.of(drag)
    integrator = Adaptive() if integrator is None else integrator
    _check_kinds(
        fragments=(fragments, Fragments, ""), wind=(wind, Wind, _WIND), domain=(domain, Domain, _OR_NONE),
        contact=(contact, Contact, _OR_NONE), fluence=(fluence, FluenceGrid, _OR_NONE),
        weights=(weights, Weights, _OR_NONE),
    )  # fmt: skip
    _check(gravity, time_limit, origin, threads, seed, integrator)
    witnesses = _several("witnesses", witnesses, (Cylinder, Panel, Polygon))
    scene = Scene(ground, Ricochet.of(ricochet), _several("obstacles", obstacles, (Wall, Barricade, Building)))
    scene.check(fragments, origin)
    if len(fragments) and (lightest := float(fragments.mass.min())) >= _HEAVY:
        warnings.warn(
            f"fragments: the lightest of {len(fragments)} weighs {lightest:g} kg; masses are in kilograms",
            FlightWarning, stacklevel=2,
        )  # fmt: skip
    fragments = fragments if shape is None else shaped(fragments, shape, seed)
    if weights is not None:
        weights.check(len(fragments))
        if contact is not None:
            raise InputError("fly: found weights together with contact; allowed: one of the two")
    job = FlightJob(
        fragments, _air(air, ground), drag, gravity, wind, scene, witnesses, integrator, domain or Domain(), time_limit,
        origin, fluence, seed, weights,
    )  # fmt: skip
    chosen = _chosen(sample, len(fragments), seed)
    threads = threads or cores()
    if contact is None or not contact.possible(fragments):
        flown, encounters = job.run(threads, on_progress, began), None
    else:
        flown, encounters = _fly_in_contact(job, contact, threads, on_progress, began)
    result = FlightResult(
        flown.landing, flown.hits, job.paths(chosen), job.witnesses, {},
        None if encounters is None else encounters.contacts, scene.obstacles, flown.struck, job.fluence,
        flown.ricochet_hits, flown.ricochets, job,
    )  # fmt: skip
    if encounters is not None:
        result.summary["contact"] = encounters.summary
    result.summary["presented_area"] = describe(shape, fragments.shape_factor)
    result.summary.update(_summary(result, flown.extremes, drag, job, time.perf_counter() - began))
    return result


def range_table(
    mass: ArrayLike, speed: ArrayLike, elevation: ArrayLike, *, height: float = 1.0,
    shape_factor: ArrayLike = DEFAULT_SHAPE_FACTOR, **flight_arguments: Any,
) -> NDArray[Any]:  # fmt: skip
    """Where single fragments land and how fast: one row for each combination of mass, speed and elevation.

    Parameters
    ----------
    mass, speed, elevation : (m,), (s,), (e,) or single
        kg, m/s, and degrees above the horizontal.
    height : float
        Above the ground at which they start (m).
    shape_factor : float
        k of the presented area (kg/m3).
    **flight_arguments
        Of `fly`; ricochet off "soft_soil" by default as there, which changes nothing before the first impact.

    Returns
    -------
    (m s e,) structured array of dtype `RANGES`
        NaN where a fragment does not land.

    Raises
    ------
    InputError
        An elevation beyond -90 to 90 degrees, or what `fly` and `Fragments` refuse.
    """
    require_number("range_table", "height", height, "m", low=0.0)
    given = (("mass", mass, "kg"), ("speed", speed, "m/s"), ("elevation", elevation, "degrees"))
    values = np.meshgrid(*(np.atleast_1d(real_array("range_table", *one)) for one in given), indexing="ij")
    masses, speeds, degrees = (one.ravel() for one in values)
    if (steep := ~(np.abs(degrees) <= 90.0)).any():
        raise InputError(f"range_table: elevation is {degrees[steep][0]:g} degrees, allowed: -90 to 90")
    angle = np.radians(degrees)
    velocity = speeds[:, None] * np.column_stack([np.cos(angle), np.zeros_like(angle), np.sin(angle)])
    ground = flight_arguments.get("ground", 0.0)
    start = (0.0, 0.0, height + (float(ground) if isinstance(ground, int | float) else 0.0))
    landing = fly(Fragments(masses, start, velocity, shape_factor), **flight_arguments).landing
    table = np.full(len(masses), np.nan, dtype=RANGES)
    table["mass"], table["speed"], table["elevation"] = masses, speeds, degrees
    landed = landing["status"] == Status.LANDED
    names = {"range": "distance", "time": "time", "arrival_speed": "speed", "energy": "energy", "angle": "angle"}
    for name, field in names.items():
        table[name][landed] = landing[field][landed]
    return table


def _fly_in_contact(
    job: FlightJob, contact: Contact, threads: int, on_progress: Callable[[FlightProgress], None] | None, began: float,
) -> tuple[Flown, Encounters]:  # fmt: skip
    encounters = Encounters(job.fragments, contact, job.around, job.limits.ground, threads)
    legs = legs_between(job.fragments, encounters.contacts)
    # Slopes of the ground are a fragment's own, whatever legs contact makes of its flight.
    job.fragments, job.clock, job.numbers, job.legs = legs.fragments, legs.clock, legs.owner, legs
    cells, job.cells = job.cells, None
    run = job.run(threads, on_progress, began)
    flown = legs.flown(run.landing)
    joined = legs.join(run)
    if cells is not None:  # again, those legs alone that were flown: a fragment that has landed is struck no more
        job.cells, job.fragments = cells, legs.fragments.select(flown)
        job.clock, job.numbers = legs.clock[flown], legs.owner[flown]
        job.run(threads, None, began)
        job.fragments, job.clock, job.numbers = legs.fragments, legs.clock, legs.owner
    return joined, encounters


def _air(value: Air | str | float, ground: float | HeightMap | None) -> Air:
    if isinstance(value, str):
        altitude = ground.datum if isinstance(ground, HeightMap) else None
        names: dict[str, Air] = {"standard": StandardAtmosphere(altitude or 0.0), "vacuum": ConstantAir(0.0)}
        if value not in names:
            raise InputError(f"air: unknown name {value!r}{names_allowed(value, names)}, or a density in kg/m3")
        return names[value]
    if isinstance(value, int | float):
        return ConstantAir(float(value))
    if not hasattr(value, "table"):
        raise InputError(f"air is {value!r}; allowed: a name, a density, flight.ConstantAir or StandardAtmosphere")
    return value


def _chosen(sample: int | ArrayLike, number: int, seed: int) -> NDArray[np.int64]:
    if isinstance(sample, int | np.integer):
        if sample < 0:
            raise InputError(f"sample is {sample}, needed: zero or more, or indices of fragments")
        draw = np.random.default_rng(seed).choice(number, size=min(int(sample), number), replace=False)
        return np.sort(draw).astype(np.int64)
    chosen = np.asarray(sample)
    if (
        chosen.ndim != 1
        or chosen.dtype.kind not in "iu"
        or (chosen.size and (chosen.min() < 0 or chosen.max() >= number))
    ):
        raise InputError(f"sample: indices must be whole numbers from 0 to {number - 1}")
    return chosen.astype(np.int64)


def _several(name: str, given: Any, kinds: tuple[type, ...]) -> tuple[Any, ...]:  # noqa: ANN401 - what a user gave
    several = (given,) if isinstance(given, kinds) or not np.iterable(given) else tuple(given)
    for one in several:
        if not isinstance(one, kinds):
            words = " or ".join([", ".join(kind.__name__ for kind in kinds[:-1]), kinds[-1].__name__])
            raise InputError(f"fly: {name}: found {one!r}; allowed: flight.{words}, or a sequence of them")
    return several


def _check_kinds(**given: tuple[Any, type, str]) -> None:
    for name, (value, kind, example) in given.items():
        if not (isinstance(value, kind) or (value is None and name != "fragments")):
            module = "flight.fluence" if kind.__module__ == "flight.fluence" else "flight"
            raise InputError(f"fly: {name} is {value!r}; allowed: {module}.{kind.__name__}{example}")


def _check(
    gravity: float, time_limit: float, origin: tuple[float, float], threads: int | None, seed: int,
    integrator: Integrator,
) -> None:  # fmt: skip
    require_number("fly", "gravity", gravity, "m/s2", finite=True)
    require_number("fly", "time_limit", time_limit, "s", above=0.0)
    real_array("fly", "origin", origin, "m", (2,))
    for name, value, low in (("threads", threads, 1.0), ("seed", seed, 0.0)):
        if value is not None:
            require_number("fly", name, value, "", low=low)
    if not isinstance(integrator, Adaptive | FixedStep):
        raise InputError(f"integrator is {integrator!r}, allowed: flight.Adaptive or flight.FixedStep")


def _summary(
    result: FlightResult, extremes: NDArray[np.float32], drag: Drag, job: FlightJob, seconds: float
) -> dict[str, Any]:
    landing = result.landing
    landed = landing["status"] == Status.LANDED
    ended = landing["last_status"] == Status.LANDED
    beyond = int((extremes[:, 3] > drag.highest_mach).sum()) if job.in_air else 0
    below = int((extremes[:, 2] < drag.lowest_mach).sum()) if job.in_air else 0
    if beyond:
        warnings.warn(
            f"drag {drag.name}: {beyond} of {len(landing)} fragments flew above Mach {drag.highest_mach:g}, the "
            f"table's last entry (fastest: Mach {extremes[:, 3].max():.3g}); its last coefficient was used there",
            DragTableWarning, stacklevel=3,
        )  # fmt: skip
    return {
        "fragments": len(landing),
        "mass": float(landing["mass"].sum()),
        "landed": int(landed.sum()),
        "status": _by_status(landing, "status"),
        "last_status": _by_status(landing, "last_status"),
        "ricochets": int(landing["ricochets"].sum()),
        "ricocheted": int((landing["ricochets"] > 0).sum()),
        "hits": len(result.hits),
        "obstacle_hits": len(result.obstacle_hits),
        "max_range": float(landing["last_distance"].max(where=ended, initial=0.0)),
        "max_first_range": float(landing["distance"].max(where=landed, initial=0.0)),
        "drag": drag.name,
        "above_drag_table": beyond,
        "below_drag_table": below,
        "steps": int(extremes[:, 0].sum(dtype=np.float64)),
        "rejected_steps": int(extremes[:, 1].sum(dtype=np.float64)),
        "wall_seconds": seconds,
    }


def _by_status(landing: NDArray[Any], field: str) -> dict[str, dict[str, Any]]:
    """Numbers and mass by a status, so that they add up to all that flew."""
    rows = {status: landing["mass"][landing[field] == status] for status in Status}
    return {status.name.lower(): {"fragments": len(mass), "mass": float(mass.sum())} for status, mass in rows.items()}
