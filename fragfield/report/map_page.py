"""The map as a separate page: pan and zoom in the browser, in one file, without a network."""

from __future__ import annotations

import json
from dataclasses import asdict
from importlib import resources
from typing import TYPE_CHECKING, Any

from fragfield.errors import InputError
from fragfield.hazard.site_map import COLORS, KINDS, VERDICTS, extent_of
from fragfield.report.figures.site import north_of, site_shapes
from fragfield_base.version import __version__
from fragfield_base.writing import write_text

if TYPE_CHECKING:
    from pathlib import Path

    from fragfield.results.run import StoredRun


def map_data(run: StoredRun) -> dict[str, Any] | None:
    """What the page draws, in metres of the site's frame; None where there is no map."""
    found = site_shapes(run)
    if found is None:
        return None
    from fragfield.case.conversion.surroundings import site_of
    from fragfield.places.site import POINTS

    case, shapes = found
    site = site_of(case)
    low, high = extent_of(shapes)
    return {
        "shapes": [
            {
                "kind": shape.kind,
                "name": shape.name,
                "closed": shape.closed,
                "points": [[round(x, 3), round(y, 3)] for x, y in shape.points.tolist()],
                "properties": shape.properties,
                "label": shape.label,
            }
            for shape in shapes
        ],
        "kinds": KINDS,
        "colors": COLORS,
        "compass": POINTS,
        "verdicts": {name: asdict(style) for name, style in VERDICTS.items()},
        "extent": [low.tolist(), high.tolist()],
        "origin": list(case.flight.origin),
        "north": north_of(case),
        "site": None
        if site is None
        else {"latitude": site.latitude, "longitude": site.longitude, "bearing": site.bearing},
    }


def write_map(run: StoredRun, path: Path, *, identity: str, written: str) -> bool:
    """Write the page; False where there is no map.

    `run`: the run; `path`: the page; `identity`: document number, revision and classification; `written`: when.
    """
    data = map_data(run)
    if data is None:
        return False
    from jinja2 import Environment, StrictUndefined

    source = (resources.files("fragfield.report") / "templates" / "map.html").read_text(encoding="utf-8")
    # "</" ends a script element wherever it stands
    text = json.dumps(data, allow_nan=False).replace("</", "<\\/")
    environment = Environment(autoescape=True, undefined=StrictUndefined)
    to_apply = run.summary.distance_to_apply
    page = environment.from_string(source).render(
        title=run.title, to_apply=to_apply.line if to_apply else "", data=text,
        identity=f"{identity} · " if identity else "", written=written,
        program_version=run.provenance.get("program_version") or __version__,
    )  # fmt: skip
    write_text(path, page, InputError)
    return True
