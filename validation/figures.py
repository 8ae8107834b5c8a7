"""How the figures of the validation are drawn and kept: in the report's style."""

from __future__ import annotations

import shutil
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fragfield.report.figures.drawing import WIDE, drawing_style, new_figure, to_bytes

if TYPE_CHECKING:
    from collections.abc import Iterator

    from matplotlib.axes import Axes

__all__ = ["keep_picture", "picture"]

_PICTURES = Path(__file__).resolve().parent.parent / "docs" / "pictures"


@contextmanager
def picture(path: Path, columns: int = 1, *, rows: int = 1, height: float = 3.2, **grid: Any) -> Iterator[list[Axes]]:
    """Axes to draw on, in reading order; on leaving, the figure is written to `path` (PNG).

    Parameters
    ----------
    path : Path
        Of the picture; its folder is made where it is missing.
    columns, rows : int
        Numbers of axes.
    height : float
        In inches; the width is that of the report.
    """
    with drawing_style():
        figure, axes = new_figure(rows, columns, width=WIDE, height=height, **grid)
        yield axes
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(to_bytes(figure, "png"))


def keep_picture(path: Path) -> None:
    """Copy a picture to where the documents find it."""
    shutil.copyfile(path, _PICTURES / path.name)
