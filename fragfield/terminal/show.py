"""Results on stdout."""

from __future__ import annotations

from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO

from rich.console import Console
from rich.table import Table

from fragfield.case.conversion.attitude import attitude_words
from fragfield.case.conversion.surroundings import direction_words
from fragfield.hazard.contents import quantity_words
from fragfield.hazard.verdict import criterion_words, part_text
from fragfield.numbers import with_unit
from fragfield.pipeline.grid_convergence import KINDS
from fragfield.quantities import numbers_of, shown
from fragfield.results.summary import Summary, read_summary
from fragfield.results.words import (
    basis_words,
    headline,
    margin_metres,
    metres,
    ricochet_words,
    rounded_metres,
    single_note,
    single_words,
    source_words,
)
from fragfield.terminal.progress import duration

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from fragfield.results.convergence import Convergence
    from fragfield.results.hazard import Hazard
    from fragfield.results.rules import Tp12
    from fragfield.results.site import ExposedSite


OFFICIAL_LABELS = {
    "hazardous_fragment_distance": "official, hazardous fragments",
    "maximum_fragment_distance": "official, farthest fragment",
}
"""Official distances as the terminal names them."""
_WIDTH = 120  # letters of a line in a text


def plain_console(file: TextIO | None = None, *, wide: int | None = None) -> Console:
    """A console that prints texts as they are, on stdout or into a file: names of rounds may hold brackets.

    `wide`: letters of a line on stdout where no terminal sets a bound.
    """
    width = None if file is None else _WIDTH
    console = Console(file=file, width=width, highlight=False, markup=False, soft_wrap=True)
    if wide is not None and not console.is_terminal:
        console.width = wide
    return console


def number_text(value: object, factor: float) -> str:
    """A number times a factor with four digits, a whole number in full, "-" for none."""
    if isinstance(value, int) and factor == 1.0:
        return f"{value:d}"
    return f"{value * factor:.4g}" if isinstance(value, (int, float)) else "-"


def summary_text(summary: Summary, directory: str = "") -> str:
    """What `print_summary` prints."""
    text = StringIO()
    print_summary(summary, directory, text)
    return stripped(text.getvalue())


def stripped(text: str) -> str:
    """A text without spaces at the ends of its lines, and without its last line break."""
    return "\n".join(line.rstrip() for line in text.splitlines()).rstrip("\n")


def print_summary(summary: Summary, directory: str = "", file: TextIO | None = None) -> None:
    """Print the main numbers of a summary, and where its files lie, on stdout or into a file."""
    console = plain_console(file)
    for part in _parts(summary):
        console.print(part)
    if directory:
        console.print(f"written to {directory}")


def _parts(summary: Summary) -> Iterator[str | Table]:
    table = Table(title=summary.title, title_justify="left", box=None, show_header=False, pad_edge=False)
    for line in numbers_of(summary):
        table.add_row(*line)
    yield table
    if summary.flight is not None and summary.flight.recovered is not None:
        yield summary.flight.recovered.words
    if to_apply := summary.distance_to_apply:
        yield to_apply.line
        yield from (f"  {words}" for words in to_apply.words)
    if summary.hazard is not None:
        yield from _hazard(summary.hazard)
    if summary.rules is not None:
        yield from _tp12(summary.rules.tp12)
    yield from _prescribed(summary)
    if summary.convergence is not None:
        yield from convergence_words(summary.convergence)
    for site in summary.exposed or ():
        yield f"exposed {site.name}: {_exposed_words(site)}"


def _exposed_words(site: ExposedSite) -> str:
    part, where = part_text(site), direction_words(site.azimuth_deg, site.bearing_deg, whole=True)
    shown = "" if part == "–" else f"; {part} of the limit"
    agrees = site.margin is not None and (site.margin >= 0.0) == (site.verdict == "met")
    margin = f"; margin by density {margin_metres(site.margin)} m" if agrees else ""
    verdict = f"{site.verdict} ({criterion_words(site)}{shown})"
    return f"{verdict}, {rounded_metres(site.distance)} m, {where}{margin}"


def convergence_words(part: Convergence) -> list[str]:
    """One line of text on grid convergence; none where no other size was computed."""
    if not part.sizes:
        return []
    words = []
    for one in shown("convergence"):
        entry = (part.quantities or {}).get(one.name)
        if entry is None or entry.uncertainty is None:
            continue
        order = f"order {entry.order:.2g}" if entry.order is not None else KINDS[entry.kind]
        width = with_unit(entry.uncertainty, one.unit, 2)
        words.append(f"{one.label[0].lower()}{one.label[1:]} ± {width}, {order}")
    sizes = ", ".join(f"{1e3 * size:.3g}" for size in part.sizes)
    return [f"uncertainty by the cells ({sizes} mm): {'; '.join(words)}"] if words else []


def _hazard(hazard: Hazard) -> Iterator[str | Table]:
    yield f"attitude: {attitude_words(hazard.attitude)}"
    yield headline(hazard).lines
    if not hazard.determined:
        return
    yield f"  {source_words(hazard)}; {basis_words(hazard)}"
    others = ricochet_words(hazard).partition(";")[0]
    short = metres(hazard.without_ricochet.recommended)
    for label, value, note in (
        ("without ricochet", short, f"the same up to the first impact; others {others}"),
        ("single events", single_words(hazard), f"5 to 95 %, {single_note(hazard)}"),
        ("throw exceeded in 5 % of events", f"{rounded_metres(hazard.largest_throw)} m", "no distance to keep"),
    ):
        yield f"{label:37}{value:>16}  {note}"


def _tp12(part: Tp12) -> Iterator[str | Table]:
    if beam := part.beam:
        zone = f"worst polar zone, {beam.low:.0f} to {beam.high:.0f} degrees from the nose"
        yield f"{'TP-12: beam of the single round':37}{metres(beam.distance):>16}  {zone}"
    if part.stack is not None and part.stack.distance is not None:
        words = f"{part.stack.effective_number:.3g} effective rounds, perpendicular to their axes"
        yield f"{'TP-12: rule for stacks':37}{metres(part.stack.distance):>16}  {words}"


def _prescribed(summary: Summary) -> Iterator[str | Table]:
    if official := summary.official:
        for key, label in OFFICIAL_LABELS.items():
            if (distance := getattr(official, key)) is not None:
                yield f"{label:37}{metres(distance):>16}  {official.source}"
    if contents := summary.rules and summary.rules.contents:
        yield quantity_words(contents.explosive, contents.tnt, contents.equivalents)


def print_info(found: Mapping[str, Any]) -> None:
    """Print what `fragfield.files.provenance.describe` found."""
    console = plain_console()
    if "directory" in found:
        stages = ", ".join(f"{name} {'done' if done else 'missing'}" for name, done in found["stages"].items())
        console.print(f"{found['directory']}: {stages}")
        summary = read_summary({**found["summary"], "title": found["title"]}, Path(found["directory"]) / "summary.json")
        print_summary(summary)
        if summary.burst is not None:
            console.print(f"burst computed in {duration(summary.burst.wall_seconds)}")
        for name, size in found["files"].items():
            console.print(f"{size / 1e6:10.3f} MB  {name}")
        return
    console.print(f"{found['file']}: {found['format']}")
    for key, value in found["attributes"].items():
        text = str(value)
        console.print(f"  {key} = {text if len(text) < 100 else text[:97] + '...'}")
    for name, shape in found["datasets"].items():
        console.print(f"  /{name}: {shape}")
