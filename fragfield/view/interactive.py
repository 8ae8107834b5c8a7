"""Interactive 3-D views as pages that open offline: `view_burst.html` and `view_fragments.html` in a run directory.

VTK's scene is handed to vtk.js, which trame-vtk brings in one page; no server and no network are needed, neither to
write a page nor to read it.
"""

from __future__ import annotations

import io
import json
import re
import zipfile
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.errors import InputError
from fragfield.report.figures.drawing import SPEED_MAP
from fragfield.view.offscreen import VIEWS, PictureUnavailableError
from fragfield.view.scenes import STREAK, final_burst, fragment_points, section
from fragfield_base.writing import write_text

if TYPE_CHECKING:
    from pathlib import Path

    import pyvista

    from fragfield.report.reading.run_files import RunFiles


_ALONE = re.compile(r"https://kitware\.github\.io/vtk-js/icon/favicon-[^`\"']*")
"""Icons that vtk.js asks the network for when a page is opened."""
_POLICY = (
    "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src data: blob: 'unsafe-inline' 'unsafe-eval'\">"
)
"""Whatever else the viewer may ask for, the browser does not fetch it."""
MOST_TRIANGLES = 120_000
"""Of a view: its page stays about 10 MB, and telephones turn it."""
_HINT = "Drag to turn, wheel or two fingers to zoom, Shift and drag to move."


def interactive_fault() -> str | None:
    """Why no interactive view can be written here, with the cure; None when it can."""
    from importlib.util import find_spec

    if find_spec("trame_vtk") is None:
        return "interactive views need the package trame-vtk; install it: pip install trame-vtk"
    return None


def write_interactive_views(run: RunFiles, folder: Path) -> None:
    """Write a page for the burst and one for the fragments, as far as the run has them.

    `run`: the run; `folder`: where to write. Raises PictureUnavailableError: trame-vtk is missing.
    """
    if fault := interactive_fault():
        raise PictureUnavailableError(fault)
    if run.nodes:
        view_of_burst(run, folder)
    if run.fragments:
        view_of_fragments(run, folder)


def view_of_burst(run: RunFiles, folder: Path) -> Path:
    """Write the page of the rounds at the end of the burst, cut open, coloured by speed; return its path."""
    grid = final_burst(run)
    fastest = float(grid.point_data["speed"].max()) or 1.0
    plotter = _plotter()
    _add_coloured(plotter, _light_surface(section(grid)), fastest)
    plotter.view_vector((0.35, -1.0, 0.3), viewup=(0, 0, 1))
    words = f"Section of the burst at {1e6 * (run.burst_time or 0.0):.0f} µs"
    return _write(plotter, folder / VIEWS["picture_of_burst"], run.title, words, "Speed (m/s)", fastest)


def _light_surface(grid: pyvista.UnstructuredGrid) -> pyvista.PolyData:
    """The outside of the cells in at most about `MOST_TRIANGLES`."""
    surface = _bare(grid.extract_surface(algorithm="dataset_surface").triangulate())
    if surface.n_cells <= MOST_TRIANGLES:
        return surface
    return surface.decimate_pro(1.0 - MOST_TRIANGLES / surface.n_cells, preserve_topology=True)


def view_of_fragments(run: RunFiles, folder: Path) -> Path:
    """Write the page of the fragments a moment after the burst, coloured by initial speed; return its path."""
    import pyvista

    points, start = fragment_points(run, STREAK)
    fastest = float(points.point_data["speed"].max()) or 1.0
    symbol = pyvista.Icosahedron()
    shown = _evenly(points.n_points, MOST_TRIANGLES // symbol.n_cells)
    cloud = pyvista.PolyData(points.points[shown])
    cloud.point_data["speed"] = points.point_data["speed"][shown]
    cloud.point_data["size"] = points.point_data["size"][shown]
    # A mean fragment is drawn as a two-hundredth of the cloud, whatever its size: true sizes may vanish.
    enlarged = 0.005 * float(points.length) / max(float(cloud.point_data["size"].mean()), 1e-9)
    symbols = cloud.glyph(scale="size", factor=enlarged, orient=False, geom=symbol)
    plotter = _plotter()
    _add_coloured(plotter, _bare(symbols), fastest)
    plotter.add_mesh(_segments(start[shown], cloud.points), color="#8b95a1", line_width=1)
    plotter.view_vector((-1.0, -1.6, 0.7), viewup=(0, 0, 1))
    number = f"{len(shown):,} of {points.n_points:,} fragments" if len(shown) < points.n_points else (
        f"{points.n_points:,} fragments"
    )  # fmt: skip
    words = f"{number} {STREAK * 1e6:.0f} µs after the burst, drag neglected; symbols stand for the mass"
    path = folder / VIEWS["picture_of_fragments"]
    return _write(plotter, path, run.title, words, "Initial speed (m/s)", fastest)


def _evenly(number: int, most: int) -> Any:  # noqa: ANN401 - an index array
    """Indices of at most `most` of `number` things, evenly spread."""
    return np.unique(np.linspace(0, number - 1, min(number, most)).round().astype(int))


def _segments(start: Any, end: Any) -> pyvista.PolyData:  # noqa: ANN401 - arrays (n, 3)
    """A line from every start to its end."""
    import pyvista

    number = len(start)
    lines = np.column_stack([np.full(number, 2), np.arange(number), np.arange(number) + number])
    return pyvista.PolyData(np.vstack([start, end]).astype(np.float32), lines=lines)


def _bare(mesh: pyvista.PolyData) -> pyvista.PolyData:
    """The surface with its speeds alone, in single precision: all else would only make the page larger."""
    import pyvista

    bare = pyvista.PolyData(mesh.points.astype(np.float32), mesh.faces)
    bare.point_data["speed"] = mesh.point_data["speed"].astype(np.float32)
    return bare


def _plotter() -> pyvista.Plotter:
    import pyvista

    plotter = pyvista.Plotter(off_screen=True, window_size=(1280, 900))
    plotter.set_background("white")
    return plotter


def _add_coloured(plotter: pyvista.Plotter, mesh: pyvista.PolyData, fastest: float) -> None:
    plotter.add_mesh(
        mesh, scalars="speed", cmap=SPEED_MAP, clim=(0.0, fastest), show_scalar_bar=False, ambient=0.5, diffuse=0.6,
        specular=0.0, copy_mesh=False,
    )  # fmt: skip


def _write(plotter: pyvista.Plotter, path: Path, title: str, words: str, quantity: str, fastest: float) -> Path:
    """Write the page of a scene."""
    from trame_vtk.tools.vtksz2html import write_html

    plotter.reset_camera()
    plotter.camera.zoom(1.2)
    page = io.StringIO()
    try:
        write_html(_scene(plotter), page)
    finally:
        plotter.close()
    text = _ALONE.sub("data:,", page.getvalue())
    head, _, rest = text.partition("<title>")
    _, _, rest = rest.partition("</title>")
    body, _, tail = rest.rpartition("</body>")
    heading = f"{title} – {words}"
    legend = _legend(title, words, quantity, fastest)
    return write_text(path, f"{head}{_POLICY}<title>{escape(heading)}</title>{body}{legend}</body>{tail}", InputError)


def _scene(plotter: pyvista.Plotter) -> bytes:
    """The scene as vtk.js reads it: what trame's local view hands out, without its server."""
    from trame_vtk.modules.vtk.serializers import (
        SynchronizationContext,
        extract_array_hash,
        initialize_serializers,
        reference_id,
        serialize,
    )

    window = plotter.render_window
    initialize_serializers()
    context = SynchronizationContext()
    context.set_ignore_last_dependencies(True)
    scene = serialize(None, window, reference_id(window), context, 1)
    camera = window.GetRenderers().GetFirstRenderer().GetActiveCamera()
    scene["extra"] = {
        "vtkRefId": reference_id(window),
        "centerOfRotation": camera.GetFocalPoint(),
        "camera": reference_id(camera),
    }
    hashes = {
        entry["hash"]: {**entry, "content": context.get_cached_data_array(entry["hash"])}
        for entry in extract_array_hash(scene)
    }
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("index.json", json.dumps({"hashes": hashes, "scene": scene}))
    return archive.getvalue()


def _legend(title: str, words: str, quantity: str, fastest: float) -> str:
    """Place of the scene, and over it title, colour bar and hint, which let the mouse through."""
    from matplotlib import colormaps
    from matplotlib.colors import to_hex

    colours = ", ".join(to_hex(colour) for colour in colormaps[SPEED_MAP](np.linspace(0.0, 1.0, 11)))
    ticks = "".join(f"<span>{share * fastest:,.0f}</span>" for share in (0.0, 0.25, 0.5, 0.75, 1.0))
    return f"""
<style>
.content {{ position: fixed; inset: 0; }}
#head, #bar {{ position: fixed; z-index: 1; left: 1rem; pointer-events: none; color: #1d2733;
  font: 15px/1.4 "Segoe UI", "Helvetica Neue", Helvetica, "Liberation Sans", "DejaVu Sans", Arial, sans-serif; }}
#head {{ top: .8rem; right: 1rem; }}
#head h1 {{ margin: 0; font-size: 1.25rem; line-height: 1.2; }}
#head p {{ margin: .2rem 0 0; color: #56616d; }}
#bar {{ bottom: 1rem; width: min(26rem, calc(100% - 2rem)); }}
#bar .colours {{ height: .8rem; background: linear-gradient(to right, {colours}); }}
#bar .ticks {{ display: flex; justify-content: space-between; font-variant-numeric: tabular-nums; font-size: .85rem; }}
#bar .hint {{ color: #56616d; font-size: .85rem; }}
</style>
<div class="content"></div>
<div id="head"><h1>{escape(title)}</h1><p>{escape(words)}</p></div>
<div id="bar"><div>{escape(quantity)}</div><div class="colours"></div><div class="ticks">{ticks}</div>
<div class="hint">{_HINT}</div></div>
"""
