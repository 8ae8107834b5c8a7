"""What an import loads: each package alone in a fresh interpreter, read from `sys.modules`."""

from __future__ import annotations

import ast
import importlib
import os
import pkgutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent
OURS = {"burst_fenicsx", "transition", "flight", "fragfield"}
PARALLEL = {"dolfinx", "mpi4py", "petsc4py", "ufl", "basix", "ffcx"}
PICTURES = {"vtk", "vtkmodules", "pyvista", "matplotlib"}


def top_level_modules(statement: str) -> set[str]:
    """Names of the top-level modules that are loaded after `statement`."""
    code = f"import sys\n{statement}\nprint(*sorted({{name.partition('.')[0] for name in sys.modules}}))"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return set(done.stdout.split())


@pytest.mark.parametrize(
    ("statement", "forbidden"),
    [
        ("from flight import *", (OURS - {"flight"}) | PARALLEL | PICTURES),
        ("from transition import *", (OURS - {"transition", "flight"}) | PARALLEL | PICTURES),
        ("import burst_fenicsx.problem, burst_fenicsx.errors", (OURS - {"burst_fenicsx"}) | PARALLEL | PICTURES),
        ("import burst_fenicsx.materials, burst_fenicsx.kernels", (OURS - {"burst_fenicsx"}) | PARALLEL | PICTURES),
        ("import burst_fenicsx.geometry, burst_fenicsx.meshing", {"gmsh", "meshio", "scipy"} | PARALLEL | PICTURES),
        ("import fragfield.cli", (OURS - {"fragfield"}) | PARALLEL | PICTURES),
        ("import flight, transition, burst_fenicsx, fragfield.case, fragfield.checking.check", {"numba", "scipy"}),
    ],
)
def test_import_loads_only_what_it_needs(statement: str, forbidden: set[str]) -> None:
    loaded = top_level_modules(statement)
    assert not loaded & forbidden, f"`{statement}` loads {sorted(loaded & forbidden)}"


@pytest.mark.dolfinx
@pytest.mark.parametrize(
    "first", ["import burst_fenicsx.compat, rasterio", "import mpi4py.MPI, dolfinx; read_map('no.tif')"]
)
def test_rasterio_leaves_shapely_its_own_geos(first: str, tmp_path: Path) -> None:
    """Beside dolfinx, which may have left RTLD_GLOBAL set: the library of the system then answers for shapely."""
    pytest.importorskip("burst_fenicsx.compat")
    pytest.importorskip("rasterio")
    (tmp_path / "no.tif").write_bytes(b"no map")
    code = f"""
from fragfield.places.maps import read_map as read
def read_map(path):
    try:
        read(path)
    except ValueError:
        pass
{first}
import sys, shapely
assert "rasterio" in sys.modules
print(shapely.Point(1, 2).wkt, shapely.constrained_delaunay_triangles(shapely.box(0, 0, 1, 1)).area)
"""
    variables = os.environ | {"PYTHONPATH": str(ROOT)}
    words = [sys.executable, "-c", code]
    done = subprocess.run(words, cwd=tmp_path, env=variables, capture_output=True, text=True, check=False)
    assert done.stdout == "POINT (1 2) 1.0\n", done.stderr


@pytest.mark.parametrize("name", sorted(OURS))
def test_every_public_name_is_loaded_when_it_is_used(name: str) -> None:
    """A module of a public name would take its place once it is loaded."""
    package = importlib.import_module(name)
    assert set(package.__all__) <= set(dir(package))
    modules = {module.name for module in pkgutil.iter_modules(package.__path__)}
    for public in package.__all__:
        found = getattr(package, public)
        assert public not in modules or found is sys.modules[f"{name}.{public}"], public
    with pytest.raises(AttributeError, match=f"module '{name}' has no attribute 'nothing'"):
        _ = package.nothing


def imported_modules(package: str, root: Path = ROOT) -> dict[str, set[str]]:
    """Modules of a package and those of it that each names in an import, wherever: in functions, for types alone."""
    files = {
        ".".join(path.relative_to(root).with_suffix("").parts).removesuffix(".__init__"): path
        for path in (root / package).rglob("*.py")
    }
    found: dict[str, set[str]] = {}
    for name, path in files.items():
        named = set()
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Import):
                named |= {alias.name for alias in node.names}
            elif isinstance(node, ast.ImportFrom):
                named |= {
                    full if (full := f"{node.module}.{alias.name}") in files else str(node.module)
                    for alias in node.names
                }
        found[name] = (named & set(files)) - {name}
    return found


def modules_in_rings(imports: dict[str, set[str]]) -> set[str]:
    """Modules that reach themselves through the imports of others."""

    def reached(start: str) -> set[str]:
        seen: set[str] = set()
        waiting = list(imports[start])
        while waiting:
            name = waiting.pop()
            if name not in seen:
                seen.add(name)
                waiting += imports[name]
        return seen

    return {name for name in imports if name in reached(name)}


@pytest.mark.parametrize("package", [*sorted(OURS), "fragfield_base", "benchmarks", "validation"])
def test_no_modules_import_each_other(package: str) -> None:
    assert modules_in_rings(imported_modules(package)) == set()
