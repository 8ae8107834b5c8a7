"""Profile files: built-in ones by name, a user's by path, all of the same checked form."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from burst_fenicsx.data import DATA_DIRECTORY, LENGTH_UNITS, Table, nearest_name, read_toml
from burst_fenicsx.errors import InputError
from burst_fenicsx.geometry.contour import Contour
from burst_fenicsx.geometry.profile import Fuze, Profile
from burst_fenicsx.geometry.segments import SEGMENT_KINDS, Segment, SegmentKind, check_segments

if TYPE_CHECKING:
    from collections.abc import Mapping


PROFILES = DATA_DIRECTORY / "profiles"
KEYS = ("name", "title", "unit", "source", "notes", "outer", "cavity", "charge", "fuze", "segment")


def profile_names() -> tuple[str, ...]:
    """Return the names of the built-in profiles."""
    return tuple(sorted(path.stem for path in PROFILES.glob("*.toml")))


_SHORTEST, _LONGEST = 1e-3, 20.0  # m; a round is no grain and no pipeline
_MOST_POINTS = 2000


def load_profile(name_or_path: str | Path) -> Profile:
    """Load a built-in profile by name, or a profile file by path (anything that ends in .toml).

    Raises
    ------
    InputError
        The name is unknown, the file cannot be read, or its content is not a sound profile.
    """
    text = str(name_or_path)
    if text.endswith(".toml"):
        path = Path(text)
    elif text in profile_names():
        path = PROFILES / f"{text}.toml"
    else:
        raise InputError(
            f"profile '{text}' is unknown; {nearest_name(text, profile_names())}; or a path that ends in .toml"
        )
    return profile_from_table(read_toml(path), where=path.name if path.parent == PROFILES else text, name=path.stem)


def profile_from_table(values: Mapping[str, Any], where: str, name: str = "profile") -> Profile:
    """Build a profile from the content of a profile file (also for points given inline in a case).

    The form, lengths in `unit` ("m", "cm", "mm" or "in"), masses in kg::

        unit = "mm"
        source = "..."
        [outer]                                 # from the nose end (station 0) to the base
        points = [[0, 30], [200, 77.5], [600, 77.5]]    # station, radius
        arcs = [900, 0]                         # optional, signed radius per piece: 0 straight, + outwards
        [cavity]                                # the same form
        [charge]
        front = 80                              # the charge fills the cavity from its base end up to here
        [fuze]                                  # only where the charge does not fill the cavity
        fill = "inert"                          # or "void"
        mass = 1.0
        [[segment]]                             # optional: name, start, end, kind = nose | wall | base

    Parameters
    ----------
    values : the tables as read.
    where : file, as it shall stand in messages.
    name : name, where the tables give none.

    Raises
    ------
    InputError
        With file, key, what was found and what is allowed.
    """
    root = Table(values, where, KEYS)
    unit = LENGTH_UNITS[root.text("unit", choices=LENGTH_UNITS)]
    outer = _contour(root, "outer", unit, where)
    cavity = _contour(root, "cavity", unit, where)
    charge = root.table("charge", ("front",))
    front = unit * charge.number("front", cavity.start / unit, unit=root.text("unit"))
    if abs(front - cavity.start) < 1e-9 * outer.length:
        front = cavity.start
    fuze = None
    if "fuze" in root:
        table = root.table("fuze", ("fill", "mass"))
        fill = table.text("fill", choices=("inert", "void"))
        if fill == "inert":
            fuze = Fuze("inert", table.number("mass", above=0.0, unit="kg"))
        else:
            fuze = Fuze("void", table.number("mass", 0.0, at_least=0.0, unit="kg"))
    profile = Profile(
        name=where,  # for the messages of the checks; the true name follows
        outer=outer,
        cavity=cavity,
        charge_front=front,
        fuze=fuze,
        segments=_segments(root, unit, outer.end),
        source=root.text("source", ""),
        notes=root.text("notes", ""),
    )
    object.__setattr__(profile, "name", root.text("name", name))
    return profile


def _contour(root: Table, key: str, unit: float, where: str) -> Contour:
    table = root.table(key, ("points", "arcs"))
    points = table.values.get("points")
    if not isinstance(points, list) or len(points) < 2:
        raise table.fault("points", "a list of at least two [station, radius] is expected")
    pairs = []
    for index, point in enumerate(points):
        pair = Table({f"points[{index}]": point}, table.where, (f"points[{index}]",)).numbers(f"points[{index}]", 2)
        pairs.append([unit * value for value in pair])
    largest = max(max(abs(value) for value in pair) for pair in pairs)
    if not _SHORTEST < largest < _LONGEST or len(pairs) > _MOST_POINTS:
        raise table.fault(
            "points",
            f"found {len(pairs)} points up to {largest:g} m; allowed: at most {_MOST_POINTS}, the largest station or "
            f"radius between {_SHORTEST:g} and {_LONGEST:g} m (is the unit right?)",
        )
    arcs: list[float] = []
    if "arcs" in table:
        arcs = [unit * value for value in table.numbers("arcs", len(points) - 1)]
    return Contour.from_points(pairs, arcs, name=f"{where} [{key}]")


def _segments(root: Table, unit: float, length: float) -> tuple[Segment, ...]:
    if "segment" not in root:
        return ()
    entries = root.values["segment"]
    if not isinstance(entries, list):
        raise root.fault("segment", "a list of tables [[segment]] is expected")
    segments = []
    for number, entry in enumerate(entries, start=1):
        table = Table(entry, f"{root.where} [[segment]] {number}", ("name", "start", "end", "kind"))
        kind = cast("SegmentKind", table.text("kind", "wall", choices=SEGMENT_KINDS))
        name = table.text("name", f"{kind} {number}")
        segments.append(Segment(name, unit * table.number("start"), unit * table.number("end"), kind))
    return check_segments(segments, length, f"{root.where} [[segment]]")
