"""Figures as a person reads them, ratios beside their targets: rows for the terminal and for the README."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from validation.rows import markdown_table

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

__all__ = ["Row", "at_least", "at_most", "markdown", "print_figures", "rows_of", "shown"]

_PREFIXES = ((1.0, ""), (1e-3, "m"), (1e-6, "u"), (1e-9, "n"))
_COMPARISON = ("compared", "ratio", "target", "met")
_HEAD = ("what", "figure", "target", "met")


def at_most(ratio: float, target: float, what: str) -> dict[str, Any]:
    """The ratio is to be the target or less; `what` says of what to what."""
    return {"compared": what, "ratio": ratio, "target": target, "met": bool(ratio <= target)}


def at_least(ratio: float, target: float, what: str) -> dict[str, Any]:
    """The ratio is to be the target or more."""
    return {"compared": what, "ratio": ratio, "target": target, "met": bool(ratio >= target)}


class Row(NamedTuple):
    """One line of a table, all text."""

    what: str
    figure: str
    target: str
    met: str


def rows_of(figures: Mapping[str, Any], path: str = "") -> Iterator[Row]:
    """Rows of all figures but lists, which are tables of their own; a comparison with its target is one row."""
    nested = {key: value for key, value in figures.items() if isinstance(value, dict)}
    for key, value in figures.items():
        if not (key in nested or isinstance(value, list) or key in _COMPARISON):
            yield Row(path + _words(key), shown(key, value), "", "")
    if "ratio" in figures:
        yield _comparison(figures, path)
    for key, value in nested.items():
        yield from rows_of(value, f"{path}{_words(key)}: ")


def _comparison(figures: Mapping[str, Any], path: str) -> Row:
    target = "" if "target" not in figures else f"{figures['target']:.3g}"
    met = {True: "yes", False: "MISSED", None: ""}[figures.get("met")]
    return Row(path + figures["compared"], f"{figures['ratio']:.3g}", target, met)


def _words(key: str) -> str:
    """A key as words; the unit stands beside the figure."""
    words = (
        key.replace("_", " ").replace("seconds per cell step", "a cell and step").replace("bytes per cell", "a cell")
    )
    return words.removeprefix("seconds ").replace("seconds per ", "a ")


def shown(key: str, value: object) -> str:
    """A value with its unit, which its key names: everything is in SI."""
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return str(value)
    if "per_second" in key:
        unit = "B/s" if key.startswith("bytes") else "/s"
        return f"{1e-9 * value:.3g} G{unit}" if value >= 1e9 else f"{1e-6 * value:.3g} M{unit}"
    if "seconds" in key or key == "time_step":
        return _with_prefix(value, "s")
    if key == "cell_size":
        return f"{1e3 * value:.3g} mm"
    if "bytes" in key:
        return f"{1e-9 * value:.2f} GB" if value >= 1e7 else f"{value:.0f} B"
    return f"{value:.0f}" if isinstance(value, int) or value >= 100.0 else f"{value:.3g}"


def _with_prefix(value: float, unit: str) -> str:
    """Three digits with a prefix: 0.000125 s as 125 us."""
    for factor, prefix in _PREFIXES:
        if abs(value) >= 0.9995 * factor:
            return f"{value / factor:.3g} {prefix}{unit}"
    return f"{value / _PREFIXES[-1][0]:.3g} {_PREFIXES[-1][1]}{unit}"


def tables_in(figures: Mapping[str, Any], path: str = "") -> Iterator[tuple[str, list[dict[str, Any]]]]:
    """Every list of rows among the figures, with its name."""
    for key, value in figures.items():
        if isinstance(value, list):
            yield f"{path}{key}", value
        elif isinstance(value, dict):
            yield from tables_in(value, f"{path}{key}, ")


def markdown(figures: Mapping[str, Any]) -> str:
    """The tables of one benchmark for the README."""
    parts = [markdown_table(_HEAD, rows_of(figures))]
    for _, rows in tables_in(figures):
        head = [_words(key) for key in rows[0]]
        parts.append(markdown_table(head, ([shown(key, value) for key, value in row.items()] for row in rows)))
    return "\n\n".join(parts)


def print_figures(found: Mapping[str, Mapping[str, Any]]) -> None:
    """Print the tables of all benchmarks on stdout."""
    from rich.console import Console
    from rich.table import Table

    console = Console()
    if not console.is_terminal:
        console = Console(width=140)  # a pipe has no width of its own
    for name, figures in found.items():
        table = Table(title=name, title_justify="left", box=None, pad_edge=False)
        for head in _HEAD:
            table.add_column(head, justify="right" if head in ("figure", "target") else "left")
        for row in rows_of(figures):
            table.add_row(*row)
        console.print(table)
        for title, rows in tables_in(figures):
            part = Table(title=title, title_justify="left", box=None, pad_edge=False)
            for key in rows[0]:
                part.add_column(_words(key), justify="right")
            for entry in rows:
                part.add_row(*(shown(key, value) for key, value in entry.items()))
            console.print(part)
        console.print()
