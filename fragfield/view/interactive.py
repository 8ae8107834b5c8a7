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
from fragfield.view.offscreen import PictureUnavailableError, require_offscreen
from fragfield.view.scenes import burst_states, fragment_points, section
from fragfield_base.writing import write_text

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    import pyvista

    from fragfield.report.reading.run_files import RunFiles

__all__ = [
    "VIEW_OF_BURST",
    "VIEW_OF_FRAGMENTS",
    "interactive_fault",
    "view_of_burst",
    "view_of_fragments",
    "write_interactive_views",
]

_ALONE = re.compile(r"https://kitware\.github\.io/vtk-js/icon/favicon-[^`\"']*")
"""Icons that vtk.js asks the network for when a page is opened."""
_POLICY = (
    "<meta http-equiv=\"Content-Security-Policy\" content=\"default-src data: blob: 'unsafe-inline' 'unsafe-eval'\">"
)
"""Whatever else the viewer may ask for, the browser does not fetch it."""
VIEW_OF_BURST, VIEW_OF_FRAGMENTS = "view_burst.html", "view_fragments.html"
MOST_TRIANGLES = 120_000
"""Of a view, all its times together, half of them the end's: its page stays about 10 MB, and telephones turn it."""
STATES = 5
"""Times of the burst in its view, the end among them."""
STREAK = 1e-4
"""Time (s) that fragments have flown on, without drag, in their view."""
_HINT = "Drag to turn, wheel or two fingers to zoom, Shift and drag to move."


def interactive_fault() -> str | None:
    """Why no interactive view can be written here, with the cure; None when it can."""
    from importlib.util import find_spec

    if find_spec("trame_vtk") is None:
        return "interactive views need the package trame-vtk; install it: pip install trame-vtk"
    return None


def write_interactive_views(run: RunFiles, folder: Path | None = None) -> list[Path]:
    """Write a page for the burst and one for the fragments, as far as the run has them.

    Parameters
    ----------
    run : RunFiles
        The run.
    folder : Path, optional
        Where to write; otherwise the run directory.

    Returns
    -------
    list of Path
        The pages written.

    Raises
    ------
    PictureUnavailableError
        trame-vtk is missing, or VTK cannot draw here.
    """
    if fault := interactive_fault():
        raise PictureUnavailableError(fault)
    require_offscreen()
    target = folder or run.folder
    written = []
    if run.nodes:
        written.append(view_of_burst(run, target))
    if run.fragments:
        written.append(view_of_fragments(run, target))
    return written


def view_of_burst(run: RunFiles, folder: Path) -> Path:
    """Write the page of the rounds, cut open, coloured by speed, at some times to choose from; return its path."""
    states = burst_states(run, STATES)
    fastest = max(float(grid.point_data["speed"].max()) for _, grid in states) or 1.0
    plotter = _plotter()
    times = []
    earlier = len(states) - 1
    # Without the folder burst there is one state, the last.
    each = [MOST_TRIANGLES // (2 * max(earlier, 1))] * earlier + [MOST_TRIANGLES // 2 if earlier else MOST_TRIANGLES]
    for (time, grid), most in zip(states, each, strict=True):
        surface = _light_surface(section(grid), most)
        if surface.n_cells:
            _add_coloured(plotter, surface, fastest)
            times.append(f"{time * 1e6:.0f} µs")
    plotter.view_vector((0.35, -1.0, 0.3), viewup=(0, 0, 1))
    words = "Section of the burst" + (f" at {times[0]}" if len(times) == 1 else "")
    return _write(plotter, folder / VIEW_OF_BURST, run.title, words, "Speed (m/s)", fastest, times)


def _light_surface(grid: pyvista.UnstructuredGrid, most: int) -> pyvista.PolyData:
    """The outside of the cells in at most about so many triangles."""
    surface = _bare(grid.extract_surface(algorithm="dataset_surface").triangulate())
    if surface.n_cells <= most:
        return surface
    return surface.decimate_pro(1.0 - most / surface.n_cells, preserve_topology=True)


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
    path = folder / VIEW_OF_FRAGMENTS
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


def _write(
    plotter: pyvista.Plotter,
    path: Path,
    title: str,
    words: str,
    quantity: str,
    fastest: float,
    times: Sequence[str] = (),
) -> Path:
    """Write the page of a scene; with several `times` it has a mesh for each, in their order, and shows one of them."""
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
    if len(times) > 1:
        legend += _slider(times)
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
#head, #bar, #state {{ position: fixed; z-index: 1; left: 1rem; pointer-events: none; color: #1d2733;
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


def _slider(times: Sequence[str]) -> str:
    """A slider that shows one of the scene's meshes at a time; the last one first. Arrow keys move it too."""
    last = len(times) - 1
    marks = "".join(f"<span>{escape(time)}</span>" for time in times)
    return f"""
<style>
#state {{ top: 4.2rem; width: min(26rem, calc(100% - 2rem)); }}
#state input {{ width: 100%; margin: 0; pointer-events: auto; }}
#state .times {{ display: flex; justify-content: space-between; font-size: .85rem; }}
#state .chosen {{ font-weight: bold; }}
</style>
<div id="state"><input type="range" min="0" max="{last}" value="{last}" step="1" aria-label="Time">
<div class="times">{marks}</div></div>
<script>
  const slider = document.querySelector("#state input"), marks = document.querySelectorAll("#state span");
  const scene = () => window.global && window.global.renderWindow;  // where the viewer leaves it
  const meshes = () => scene() ? scene().getRenderers().flatMap(part => part.getActors()) : [];
  function show() {{
    slider.setAttribute("aria-valuetext", marks[slider.value].textContent);
    marks.forEach((mark, number) => mark.classList.toggle("chosen", number === Number(slider.value)));
    meshes().forEach((mesh, number) => mesh.setVisibility(number === Number(slider.value)));
    scene().render();
  }}
  slider.addEventListener("input", show);
  const waiting = setInterval(() => {{
    if (meshes().length === marks.length) {{ clearInterval(waiting); show(); }}
  }}, 50);
</script>
"""
