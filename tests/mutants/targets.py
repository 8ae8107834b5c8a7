"""Which modules get faults, and which tests can notice one there."""

from __future__ import annotations

import ast
import re
from dataclasses import dataclass
from fnmatch import fnmatch
from functools import cache
from pathlib import Path

__all__ = ["AREAS", "Area", "files_of", "modules_of", "names_imported", "on_ranks"]

_ROOT = Path(__file__).parents[2]

_BURST = "tests/burst_fenicsx"
_RINGS = f"{_BURST}/axisymmetric"
_PARTS = [f"{_BURST}/test_parts_by_hand.py"]
_SOLVER = [f"{_BURST}/test_solver_by_hand.py"]
_CELLS = [f"{_BURST}/test_{name}.py" for name in (
    "cells_by_hand", "cell_energies_by_hand", "cells_side_by_side", "tresca", "elements", "solids", "subcycling",
)]  # fmt: skip
_CHARGE = [f"{_BURST}/test_{name}.py" for name in (
    "cells_by_hand", "cell_energies_by_hand", "cells_side_by_side", "products", "detonation", "elements", "initiation",
)]  # fmt: skip
_TOUCH = [f"{_BURST}/test_{name}.py" for name in (
    "springs", "slide_law", "search", "slide_points", "contact", "sliding",
)]  # fmt: skip
_SURFACES = [f"{_BURST}/test_{name}.py" for name in ("contact", "surfaces")]
_STEP = [f"{_BURST}/test_{name}.py" for name in ("cells_by_hand", "elements", "subcycling", "detonation", "initiation")]
# Tests that run on several ranks: what is wrong with messages between them shows there alone.
_RANKS = [f"{_BURST}/test_{name}.py" for name in ("ranks", "interior_contact", "erosion", "initiation")]
_FLIGHT = [f"tests/flight/test_{name}.py" for name in (
    "kernels_by_hand", "motion", "balance", "shape", "crossings", "obstacles", "height_map", "near_ground", "ricochet",
    "contact", "surroundings", "walls", "arguments", "allowed_values", "published_values",
)]  # fmt: skip
_HAZARD = [f"tests/flight/test_{name}.py" for name in (
    "hazard", "expected", "ensemble", "exposed", "contours", "ring_counts", "arena", "fragments", "walls", "tp12",
    "arguments", "allowed_values", "published_values",
)]  # fmt: skip


@dataclass(frozen=True)
class Area:
    """A part of the program: its modules, those left out, and tests by pattern of module; all patterns that fit count.

    `ranks` are files whose tests on several ranks (marked `mpi`) are for those modules that send messages.
    Patterns are those of fnmatch, on paths from the root, whose `*` takes in folders too.
    """

    name: str
    modules: tuple[str, ...]
    tests: tuple[tuple[str, list[str]], ...]
    left_out: tuple[str, ...] = ()
    ranks: tuple[str, ...] = ()


AREAS = (
    Area(
        "kernels of the burst",
        ("burst_fenicsx/kernels/*.py", "burst_fenicsx/materials/[tp]*.py"),
        (
            ("*/charge*.py", _CHARGE),
            ("*/materials/products.py", _CHARGE),
            ("*/kernels/contact/*", [*_TOUCH, *_PARTS]),
            ("*/kernels/geometry/*", [*_TOUCH, *_CELLS, *_PARTS]),
            ("*/kernels/vectors/*", [*_TOUCH, *_CELLS, *_PARTS]),
            ("*/kernels/step/*", [*_TOUCH, *_PARTS]),
            ("*/kernels/cells/*", [*_PARTS, f"{_BURST}/test_erosion.py"]),
            ("*", [*_CELLS, f"{_BURST}/test_transposition.py"]),
        ),
        left_out=("*/__init__.py", "*/lanes.py", "*/transposition*.py", "*/axisymmetric/*", "*/state.py"),
    ),
    Area(
        "axisymmetric burst",
        ("burst_fenicsx/kernels/axisymmetric/*.py", "burst_fenicsx/axisymmetric/*.py"),
        (
            ("*/applicability.py", ["tests/fragfield/test_burst_geometry.py"]),
            ("*/slide_line.py", [f"{_RINGS}/test_ring_contacts.py"]),
            ("*", [f"{_RINGS}/test_rings_by_hand.py", _RINGS, f"{_BURST}/test_revolve.py"]),
            ("*/kernels/*", [f"{_BURST}/test_cells_side_by_side.py"]),
        ),
        left_out=("*/__init__.py",),
    ),
    Area(
        "step, contact and detonation",
        tuple(
            f"burst_fenicsx/{name}.py"
            for name in (
                "contact/*",
                "mechanics/solver",
                "mechanics/subcycling",
                "mechanics/ledger",
                "mechanics/detonation",
                "mechanics/initiation",
                "records/measures",
                "mechanics/fields",
                "mechanics/material_tables",
                "mechanics/nodal_loads",
                "mechanics/burning_times",
                "records/exposure",
            )
        ),
        (
            (
                "*/contact/*",
                [*_PARTS, *_SURFACES, *_TOUCH, f"{_BURST}/test_interior_contact.py"],
            ),
            ("*/exposure.py", [f"{_BURST}/test_exposure.py"]),
            ("*/measures.py", [*_PARTS, f"{_BURST}/test_simulation.py", f"{_BURST}/test_output.py"]),
            ("*/detonation.py", [f"{_BURST}/test_detonation.py"]),
            ("*/initiation.py", [f"{_BURST}/test_initiation.py"]),
            ("*/ledger.py", [f"{_BURST}/test_simulation.py", *_CHARGE]),
            ("*/mechanics/[bfmns]*.py", [*_PARTS, *_SOLVER, *_STEP, f"{_BURST}/test_solids.py"]),
        ),
        left_out=("*/__init__.py", "*/halo.py"),
        ranks=tuple(_RANKS),
    ),
    Area(
        "break-up",
        ("transition/*.py",),
        (("*", ["tests/transition"]),),
        left_out=(
            "*/__init__.py",
            "*/compiling.py",
            "*/errors.py",
            "*_data.py",
            "*/results.py",
            "*/summary.py",
            "*/snapshot.py",
        ),
    ),
    Area(
        "flight and hazard",
        ("flight/*.py",),
        (
            ("*/kernels/*", [*_FLIGHT, "tests/flight/test_ensemble.py", "tests/flight/test_exposed.py"]),
            ("*/number_text.py", ["tests/flight/test_text_tables.py"]),
            ("flight/r[eo]*.py", ["tests/flight/test_files.py", "tests/flight/test_package.py"]),
            ("flight/arguments.py", ["tests/flight/test_arguments.py"]),
            *(
                (f"flight/{name}.py", _HAZARD)
                for name in (
                    "hazard/criteria",
                    "hazard/density/fields",
                    *(
                        f"hazard/density/{name}"
                        for name in ("expected", "estimate", "distance", "directions", "groups")
                    ),
                    "hazard/flown",
                    "hazard/ensemble",
                    "hazard/exposed",
                    "hazard/contours",
                    "hazard/density/ring_counts",
                    "arena",
                    "hazard/density/tally",
                    "hazard/pool",
                    "hazard/density/witness_hazard",
                    "hazard/density/polar_grid",
                    "hazard/retardation",
                    "hazard/tp12",
                    "fragments",
                    "scene/tables",
                )
            ),
            *(
                (f"flight/{name}.py", [*_FLIGHT, *_HAZARD])
                for name in (
                    "constants",
                    "scene/air",
                    "drag",
                    "shape",
                    "scene/wind",
                    "scene/walls",
                    "scene/ricochet",
                    "integrate/contact",
                    "scene/targets",
                    "scene/obstacles",
                    "scene/height_map",
                    "integrate/fly",
                    "integrate/integrator",
                    "hazard/density/near_ground",
                    "integrate/after_landing",
                    "hazard/balance",
                    "integrate/legs",
                    "scene/scene",
                    "result",
                    "rows",
                    "integrate/job",
                )
            ),
        ),
        left_out=("*/__init__.py", "*/compiling.py", "*/errors.py", "*/shape_factors.py", "flight/files/*"),
    ),
)
"""The parts that compute."""


def modules_of(area: Area, root: Path) -> list[str]:
    """The area's modules as paths from the root, in order."""
    names = {str(path.relative_to(root)) for path in root.glob("*/**/*.py")}
    return sorted(
        name
        for name in names
        if any(fnmatch(name, pattern) for pattern in area.modules)
        and not any(fnmatch(name, pattern) for pattern in area.left_out)
    )


def files_of(module: str) -> list[str]:
    """The tests that can notice a fault in a module (its path from the root), each file or folder once.

    Those of its area, and the test files of its package that import it by name.
    """
    area = _area_of(module)
    if area is None:
        return []
    own = [test for pattern, tests in area.tests if fnmatch(module, pattern) for test in tests]
    package, name = module.partition("/")[0], module.removesuffix(".py").replace("/", ".")
    own += [str(path) for path, names in _imports(package).items() if name in names]
    return list(dict.fromkeys(own))


def on_ranks(module: str) -> list[str]:
    """Files whose tests on several ranks are for a module; none where it sends no messages."""
    area = _area_of(module)
    speaks = area is not None and re.search(r"\bcomm\b|\b_comm\b", (_ROOT / module).read_text())
    return list(area.ranks) if area is not None and speaks else []


def _area_of(module: str) -> Area | None:
    for area in AREAS:
        if any(fnmatch(module, pattern) for pattern in area.modules) and not any(
            fnmatch(module, pattern) for pattern in area.left_out
        ):
            return area
    return None


@cache
def _imports(package: str) -> dict[Path, set[str]]:
    """What the test files of a package import, by their path from the root."""
    files = sorted((_ROOT / "tests" / package).rglob("test_*.py"))
    return {path.relative_to(_ROOT): names_imported(path) for path in files}


@cache
def names_imported(path: Path) -> set[str]:
    """Modules that a file imports, and what it imports from them, with dots."""
    names = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.ImportFrom) and node.module:
            names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
        elif isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
    return names
