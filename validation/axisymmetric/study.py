"""Single rounds in their meridian, from their runs to their rows."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from validation.axisymmetric.check import NAME, REFERENCE, beside, convergence_table, converging
from validation.readme import insert_tables
from validation.runs import summary_of

if TYPE_CHECKING:
    from pathlib import Path

    from validation.options import Options
    from validation.rows import Row
    from validation.runs import Runs

__all__ = ["study"]


def study(options: Options, runs: Runs, rows: list[Row]) -> None:
    """Run every round in its meridian at every cell size, and two of them in three dimensions as well."""
    bursts: dict[str, dict[str, dict[str, Any]]] = {}
    for name, entry in REFERENCE["rounds"].items():
        bursts[name] = {}
        for size in [options.cell_size] if options.cell_size else entry["quick_sizes" if options.quick else "sizes"]:
            folder = _run(runs, name, size, "axisymmetric")
            bursts[name][size] = summary_of(folder)["burst"]
        rows += converging(name, bursts[name])
    plan = REFERENCE["three_dimensions"]
    for name in plan["rounds"]:
        for products in plan["products"][:1] if options.quick else plan["products"]:
            for size, allowed in plan["quick_sizes" if options.quick else "sizes"].items():
                folders = tuple(_run(runs, name, size, geometry, products) for geometry in ("axisymmetric", "3d"))
                one, two = (summary_of(folder)["burst"] for folder in folders)
                rows += beside(f"{name}, {products}", size, allowed, (folders[0], folders[1]), (one, two))
    if options.readme and not options.quick:
        insert_tables({NAME + "_convergence": convergence_table(bursts)})


def _run(runs: Runs, name: str, size: str, geometry: str, products: str | None = None) -> Path:
    """One burst to a given end, with the mean mass of fragments and flights left out."""
    entry = REFERENCE["rounds"][name]
    changes = {"burst.geometry": geometry, "burst.stop": "time", "burst.end_time": entry["end"]}
    changes |= {"burst.products": products} if products else {}
    words = [NAME, *name.lower().replace(",", "").split(), geometry, *([products] if products else [])]
    return runs.run("_".join(words), entry["case"], size, changes, stage="burst")
