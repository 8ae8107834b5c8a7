"""The flight library: time beside scipy, error of the range, crossings, contact."""

from __future__ import annotations

import math
import time
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.flight_plain import PlainFlight, burst_cloud, plain_seconds, two_tubes
from benchmarks.table import at_least, at_most
from flight import Contact, Cylinder, Fragments, Panel, StandardAtmosphere, fly
from flight.drag import Drag
from flight.integrate.contact import Encounters
from flight.integrate.job import Adaptive, Domain, FlightJob
from flight.scene.scene import Scene

if TYPE_CHECKING:
    from benchmarks.options import Options

__all__ = ["crossing_faults", "flight"]

_NUMBER = 100_000
_TARGET = 1.0  # s
_SAMPLE = 200  # fragments whose range is compared
_PLAIN_SAMPLE = 20  # fragments that scipy is timed on
_CROSSING = 1_000_000
_IN_CONTACT, _COMPARED = 50_000, 5_000
_CONTACT_TARGET = 10.0  # s
_EDGE = 1e-9  # m; closer to a surface's edge than that, either answer is right
_REPEATS = 3


def flight(options: Options) -> dict[str, Any]:
    """All figures; with `quick` a tenth of the fragments whose crossings are counted."""
    crossing = _CROSSING // 10 if options.quick else _CROSSING
    return {**_to_the_ground(), "crossings": _crossings(crossing), "contact": _contact()}


def _to_the_ground() -> dict[str, Any]:
    """Standard air, TP-12 drag, to flat ground; scipy on a few of the same fragments, one by one."""
    fragments = burst_cloud(_NUMBER)
    fly(fragments.select(slice(0, 5000)))
    seconds = core_seconds = math.inf
    for _ in range(_REPEATS):
        began, worked = time.perf_counter(), time.process_time()
        result = fly(fragments)
        seconds = min(seconds, time.perf_counter() - began)
        core_seconds = min(core_seconds, time.process_time() - worked)
    plain = PlainFlight(fragments)
    chosen = np.random.default_rng(1).choice(_NUMBER, _SAMPLE, replace=False)
    exact = np.array([plain.exact_range(int(i), float(result.landing["time"][i])) for i in chosen])
    errors = np.abs(result.landing["distance"][chosen] / exact - 1.0)
    few = chosen[:_PLAIN_SAMPLE]
    rows = plain_seconds(plain, few, exact[:_PLAIN_SAMPLE], float(errors.max()))
    quickest = min(
        (row for row in rows if row["error"] <= errors.max()), key=lambda row: float(row["seconds_a_fragment"])
    )
    ratio = quickest["seconds_a_fragment"] * _NUMBER / seconds
    return {
        "fragments": _NUMBER,
        "seconds": seconds,
        "core_seconds": core_seconds,
        "steps_a_fragment": result.summary["steps"] / _NUMBER,
        **at_most(seconds / _TARGET, 1.0, "wall time of 100,000 fragments over 1 s"),
        "scipy": {
            "method": quickest["method"],
            "seconds_a_fragment": quickest["seconds_a_fragment"],
            "times_the_core_time": quickest["core_seconds_a_fragment"] * _NUMBER / core_seconds,
            **at_least(ratio, 1000.0, "scipy.solve_ivp one by one over this, same error"),
            "methods": rows,
        },
        "range": {
            "median_error": float(np.median(errors)),
            **at_most(float(errors.max()), 1e-6, "largest error of range on 200, DOP853 at 1e-12"),
        },
    }


def crossing_faults(number: int) -> tuple[int, int, int]:
    """Crossings that there are, that were missed and that were invented, in a vacuum, where all are known.

    Strips of 1 cm and 1 m height across the flight, and a ring band of 1 cm; what passes within 1e-9 m of an edge is
    left out.
    """
    fragments = burst_cloud(number, seed=5)
    distances, half_width, half_height = (2.0, 7.62, 60.0), 5e-3, 0.5
    surfaces: list[Any] = [
        Panel((x, 0.0, 1.0), (1.0, 0.0, 0.0), 2.0 * half_width, 2.0 * half_height, name=f"{x}") for x in distances
    ]
    surfaces.append(Cylinder(7.62, bottom=1.0, top=1.01, name="ring"))
    result = fly(fragments, air="vacuum", witnesses=surfaces)
    u, v, w = fragments.velocity.T
    gravity = 9.80665
    end = (w + np.sqrt(w * w + 2.0 * gravity)) / gravity
    there = missed = invented = 0
    for surface in surfaces:
        with np.errstate(divide="ignore", invalid="ignore"):
            if isinstance(surface, Cylinder):
                at = 7.62 / np.hypot(u, v)
                z = 1.0 + at * (w - 0.5 * gravity * at)
                inside = np.minimum(z - 1.0, 1.01 - z)
            else:
                at = surface.centre[0] / u
                z = at * (w - 0.5 * gravity * at)
                inside = np.minimum(half_width - np.abs(at * v), half_height - np.abs(z))
        inside = np.where((at > 0.0) & (at < end) & np.isfinite(inside), inside, -1.0)
        clear = np.abs(inside) > _EDGE
        hit = np.bincount(result.hits_on(surface.name)["fragment"], minlength=number)
        there += int((inside > 0.0).sum())
        missed += int(((inside > 0.0) & clear & (hit == 0)).sum())
        invented += int((clear & (hit > (inside > 0.0))).sum())
    return there, missed, invented


def _crossings(number: int) -> dict[str, Any]:
    there, missed, invented = crossing_faults(number)
    return {
        "fragments": number,
        "crossings": there,
        "invented": invented,
        **at_most(float(missed), 0.0, "crossings missed of thin strips and a ring"),
    }


def _contact() -> dict[str, Any]:
    """Pairs found against all pairs compared, and the time of the first 10 m; compiled before."""
    few, many = two_tubes(_COMPARED), two_tubes(_IN_CONTACT)
    cells = _encounters(few)
    compared = _encounters(few, one_cell=True, windows=cells.window_ends)
    same = len(cells.contacts) == len(compared.contacts) and bool((cells.contacts == compared.contacts).all())
    began, worked = time.perf_counter(), time.process_time()
    found = _encounters(many)
    seconds, core_seconds = time.perf_counter() - began, time.process_time() - worked
    return {
        "fragments": _IN_CONTACT,
        "contacts": len(found.contacts),
        "windows": found.summary["windows"],
        "seconds": seconds,
        "core_seconds": core_seconds,
        "momentum_error": found.summary["momentum_error"],
        "contacts_of_5000": len(cells.contacts),
        "same_as_comparing_all_pairs_of_5000": same,
        **at_most(seconds / _CONTACT_TARGET, 1.0, "first 10 m of 50,000 in contact, over 10 s"),
    }


def _encounters(fragments: Fragments, **options: Any) -> Encounters:
    from benchmarks.timing import all_threads

    job = FlightJob(
        fragments, StandardAtmosphere(), Drag.named("shell_fragment"), 9.80665, None, Scene(0.0), (), Adaptive(),
        Domain(), 3600.0, (0.0, 0.0),
    )  # fmt: skip
    return Encounters(fragments, Contact(), job.around, 0.0, all_threads(), **options)
