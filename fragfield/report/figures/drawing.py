"""Style of the figures: readable in grey, with units, of a width that paper, screen and telephone show alike."""

from __future__ import annotations

import io
import math
from contextlib import contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from fragfield.results.run import StoredRun

    Draw = Callable[[StoredRun], Figure | str | None]
    Words = str | Callable[[StoredRun], str]


COLUMN, WIDE = 3.6, 7.4
"""Widths of figures (inches): a column of a printed page, which is the width of a telephone, and the whole page."""

INK = "#1d2733"
GREY = "#8b95a1"
RULE = "#d5dae0"
ACCENT = "#b3361e"
SPEED_MAP = "cividis"
"""Colour map of speeds; its lightness grows evenly, so that it survives a grey copy."""

# Colours differ in lightness, and every line has its own dashes, so that a grey print still distinguishes them.
LINES: tuple[dict[str, Any], ...] = (
    {"color": "#16365c", "linestyle": "-"},
    {"color": "#c4601d", "linestyle": (0, (5, 1.6))},
    {"color": "#3d8fa6", "linestyle": (0, (1.2, 1.2))},
    {"color": "#7a4b8c", "linestyle": (0, (6, 1.6, 1.2, 1.6))},
    {"color": "#9a8a1f", "linestyle": (0, (9, 2))},
    {"color": "#5d6670", "linestyle": (0, (3, 1, 1, 1, 1, 1))},
    {"color": "#b3361e", "linestyle": (0, (2.5, 1))},
    {"color": "#2f7d4f", "linestyle": (0, (7, 1, 2, 1))},
)
COLOURS: tuple[str, ...] = tuple(style["color"] for style in LINES)
"""Those of `LINES` alone."""

_STYLE = {
    "font.family": "DejaVu Sans",
    "font.size": 8.5,
    "axes.titlesize": 9,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.labelsize": 8.5,
    "axes.labelcolor": INK,
    "axes.edgecolor": GREY,
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": RULE,
    "grid.linewidth": 0.6,
    "xtick.color": INK,
    "ytick.color": INK,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "legend.fontsize": 7.8,
    "legend.frameon": False,
    "legend.handlelength": 2.8,
    "lines.linewidth": 1.6,
    "hatch.linewidth": 0.4,
    "text.color": INK,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
    "svg.fonttype": "path",
    "svg.hashsalt": "fragfield",
}


@contextmanager
def drawing_style() -> Iterator[None]:
    """Draw with the report's settings alone: without a display, and neither taking nor touching those of the caller."""
    import matplotlib as mpl
    from matplotlib.font_manager import fontManager

    with mpl.rc_context():
        mpl.rcdefaults()  # a matplotlibrc of the user's may set any other
        others = sorted({font.name for font in fontManager.ttflist if "CJK" in font.name})  # letters that ours lacks
        mpl.rcParams.update(_STYLE | {"font.family": [_STYLE["font.family"], *others]})
        yield


def plain_name(name: str) -> str:
    """A name from the case for matplotlib: "$" begins no mathematics, and letters without a glyph are code points.

    So two names never look alike.
    """
    import matplotlib as mpl
    from matplotlib.font_manager import findfont, get_font

    fonts = [get_font(findfont(family)) for family in mpl.rcParams["font.family"]]
    shown = (
        letter if letter.isspace() or any(font.get_char_index(ord(letter)) for font in fonts) else f"[{ord(letter):X}]"
        for letter in name
    )
    return "".join(shown).replace("$", r"\$")


def new_figure(
    rows: int = 1, columns: int = 1, *, height: float, width: float = COLUMN, gap: float = 0.55, **grid: Any
) -> tuple[Figure, list[Axes]]:
    """A figure with its axes in reading order; sizes in inches, `gap` between panels for titles, ticks and legends.

    Files are cut to what is drawn (`to_bytes`), so that decorations may reach beyond the margins that are left here.
    """
    figure = blank_figure(width, height)
    axes = figure.subplots(rows, columns, squeeze=False, **grid)
    room = 0.6, 0.1, 0.4, 0.25  # left, right, below and above
    high, wide = ((height - room[2] - room[3]) / rows - gap, (width - room[0] - room[1]) / columns - gap - 0.1)
    figure.subplots_adjust(
        left=room[0] / width, right=1.0 - room[1] / width, bottom=room[2] / height, top=1.0 - room[3] / height,
        hspace=gap / max(high, gap), wspace=(gap + 0.1) / max(wide, gap),
    )  # fmt: skip
    return figure, [axis for line in axes for axis in line]


def blank_figure(width: float, height: float) -> Figure:
    """A figure without axes; sizes in inches.

    It is not known to pyplot, so that nothing is left open and no window system is asked for.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width, height))
    FigureCanvasAgg(figure)
    return figure


def to_bytes(figure: Figure, kind: str, dots: int = 200) -> bytes:
    """The figure as a file ("svg" or "png", of so many dots an inch); the same bytes for the same data."""
    buffer = io.BytesIO()
    metadata = {"Date": None} if kind == "svg" else None
    drawn = figure.get_tightbbox().padded(0.06)
    figure.savefig(buffer, format=kind, dpi=dots, metadata=metadata, bbox_inches=drawn)
    return buffer.getvalue()


@dataclass(frozen=True)
class ReportFigure:
    """A figure of the report: its words, as they are or from a run, and what draws it; nothing without data."""

    name: str
    title: Words
    caption: Words
    draw: Draw

    def words(self, run: StoredRun) -> tuple[str, str]:
        """Its title and caption for a run."""
        title, caption = (one if isinstance(one, str) else one(run) for one in (self.title, self.caption))
        return title, caption

    def svg(self, run: StoredRun) -> bytes | None:
        """As `file`, SVG."""
        return self.file(run, "svg")

    def file(self, run: StoredRun, kind: str) -> bytes | None:
        """The figure of a run as SVG or PNG; None where there is no data for it."""
        with drawing_style():
            drawn = self.draw(run)
            return drawn.encode() if isinstance(drawn, str) else None if drawn is None else to_bytes(drawn, kind)


FIGURES: dict[str, ReportFigure] = {}
"""All figures of the report by name; application and Python ask for them here."""


def figure(name: str, title: Words, caption: Words) -> Callable[[Draw], Draw]:
    """Enter a function that draws a run, or returns None, as the figure of that name."""

    def enter(function: Draw) -> Draw:
        FIGURES[name] = ReportFigure(name, title, caption, function)
        return function

    return enter


def round_length(most: float) -> float:
    """The largest of 1, 2 and 5 times a power of ten that is no longer."""
    step = 10.0 ** math.floor(math.log10(most))
    return max(factor * step for factor in (1.0, 2.0, 5.0) if factor * step <= most)
