"""Results on stdout."""

from __future__ import annotations

from io import StringIO
from typing import TYPE_CHECKING, Any, TextIO

from rich.console import Console
from rich.table import Table

from fragfield.case.conversion.attitude import attitude_words
from fragfield.case.conversion.surroundings import direction_words
from fragfield.hazard.certainty import (
    basis_words,
    margin_metres,
    metres,
    ricochet_words,
    rounded_metres,
    single_note,
    single_words,
    source_words,
)
from fragfield.hazard.contents import quantity_words
from fragfield.hazard.recommended import parts_words
from fragfield.hazard.verdict import criterion_words, exposed_rounds, exposure_words, part_text
from fragfield.numbers import SPACE, number, row
from fragfield.pipeline.grid_convergence import KINDS
from fragfield.quantities import shown
from fragfield.terminal.progress import duration

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence


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


def summary_text(summary: Mapping[str, Any]) -> str:
    """What `print_summary` prints."""
    text = StringIO()
    print_summary(summary, text)
    return stripped(text.getvalue())


def stripped(text: str) -> str:
    """A text without spaces at the ends of its lines, and without its last line break."""
    return "\n".join(line.rstrip() for line in text.splitlines()).rstrip("\n")


def print_summary(summary: Mapping[str, Any], file: TextIO | None = None) -> None:
    """Print the main numbers of a summary, on stdout or into a file."""
    console = plain_console(file)
    for part in _parts(summary):
        console.print(part)


def _parts(summary: Mapping[str, Any]) -> Iterator[str | Table]:
    table = Table(
        title=str(summary.get("title", "")), title_justify="left", box=None, show_header=False, pad_edge=False
    )
    for entry in shown("terminal"):
        for found in entry.rows(summary):
            table.add_row(entry.stage, f"{found.name[0].lower()}{found.name[1:]}", found.value)
    rounds = (summary.get("burst") or {}).get("rounds") or []
    for entry in rounds if len(rounds) > 1 else []:
        if "ignition" in entry:
            table.add_row("burst", f"ignition of {entry['name']}", _initiated(entry["ignition"]))
    for name, exposure, initiated in exposed_rounds(summary.get("burst") or {}):
        label = "initiated" if initiated else "not initiated"
        table.add_row("burst", f"{name}, {label}", exposure_words(exposure))
    for surface in summary.get("witness") or []:
        table.add_row("witness", f"hits on {surface['name']}", number(surface["hits"]))
    for obstacle in summary.get("obstacle") or []:
        hits = f"{obstacle['hits']:d}, hazardous {obstacle['hazardous_hits']:d}, stopped {obstacle['stopped']:d}"
        table.add_row("obstacle", f"hits on {obstacle['name']}", hits)
    yield table
    if recovered := (summary.get("flight") or {}).get("recovered"):
        yield recovered["words"]
    if to_apply := summary.get("distance_to_apply"):
        yield to_apply["line"]
        yield from (f"  {words}" for words in to_apply["words"])
    yield from _hazard(summary.get("hazard") or {})
    yield from _tp12((summary.get("rules") or {}).get("tp12") or {})
    yield from _prescribed(summary)
    yield from convergence_words(summary.get("convergence") or {})
    for entry in summary.get("exposed") or []:
        yield f"exposed {entry['name']}: {_exposed_words(entry)}"
    if "directory" in summary:
        yield f"written to {summary['directory']}"


def _exposed_words(entry: Mapping[str, Any]) -> str:
    """Verdict on an exposed site, by which criterion, where it lies, and its margin where one says something."""
    part, where = part_text(entry), direction_words(entry["azimuth_deg"], entry["bearing_deg"], whole=True)
    shown = "" if part == "–" else f"; {part} of the limit"
    agrees = entry["margin"] is not None and (entry["margin"] >= 0.0) == (entry["verdict"] == "met")
    margin = f"; margin by density {margin_metres(entry['margin'])} m" if agrees else ""
    verdict = f"{entry['verdict']} ({criterion_words(entry)}{shown})"
    return f"{verdict}, {rounded_metres(entry['distance'])} m, {where}{margin}"


def _initiated(ignition: Sequence[Mapping[str, Any]]) -> str:
    """When a round was initiated, and whether by shock."""
    if not ignition:
        return "never initiated"
    return f"{ignition[0]['time'] * 1e6:.4g}{SPACE}µs{', by shock' if ignition[0]['by'] == 'shock' else ''}"


def convergence_words(part: Mapping[str, Any]) -> list[str]:
    """One line of text on the part `convergence` of summary.json; none where no other size was computed."""
    if "sizes" not in part:
        return []
    words = []
    for one in shown("convergence"):
        entry = part["quantities"].get(one.name)
        if entry is None or entry["uncertainty"] is None:
            continue
        order = f"order {entry['order']:.2g}" if entry["order"] is not None else KINDS[entry["kind"]]
        width = row("", entry["uncertainty"], one.unit, digits=2).value
        words.append(f"{one.label[0].lower()}{one.label[1:]} ± {width}, {order}")
    sizes = ", ".join(f"{1e3 * size:.3g}" for size in part["sizes"])
    return [f"uncertainty by the cells ({sizes} mm): {'; '.join(words)}"] if words else []


def _hazard(hazard: Mapping[str, Any]) -> Iterator[str | Table]:
    """The recommended distance, its parts, and beside it what single events do."""
    if not hazard:
        return
    if hazard.get("attitude"):
        yield f"attitude: {attitude_words(hazard['attitude'])}"
    if not hazard["determined"]:
        yield f"recommended distance: not determined\n  {hazard['reason']}"
        return
    yield f"recommended distance {metres(hazard['recommended'])}"
    yield f"  {parts_words(hazard)}"
    yield f"  {source_words(hazard)}; {basis_words(hazard)}"
    lines = []
    if short := hazard.get("without_ricochet"):
        others = ricochet_words(hazard).partition(";")[0]
        lines.append(
            ("without ricochet", metres(short["recommended"]), f"the same up to the first impact; others {others}")
        )
    lines += [
        ("single events", single_words(hazard), f"5 to 95 %, {single_note(hazard)}"),
        ("throw exceeded in 5 % of events", f"{rounded_metres(hazard['largest_throw'])} m", "no distance to keep"),
    ]
    for label, value, note in lines:
        yield f"{label:37}{value:>16}  {note}"


def _tp12(part: Mapping[str, Any]) -> Iterator[str | Table]:
    """The distances of TP-12 beside the computed one."""
    beam, stack = part.get("beam"), part.get("stack")
    if beam:
        zone = f"worst polar zone, {beam['low']:.0f} to {beam['high']:.0f} degrees from the nose"
        yield f"{'TP-12: beam of the single round':37}{metres(beam['distance']):>16}  {zone}"
    if stack and stack["distance"] is not None:
        words = f"{stack['effective_number']:.3g} effective rounds, perpendicular to their axes"
        yield f"{'TP-12: rule for stacks':37}{metres(stack['distance']):>16}  {words}"


def _prescribed(summary: Mapping[str, Any]) -> Iterator[str | Table]:
    """Official distances of the round, and net explosive quantity."""
    official = summary.get("official") or {}
    for key, label in OFFICIAL_LABELS.items():
        if official.get(key) is not None:
            yield f"{label:37}{metres(official[key]):>16}  {official['source']}"
    if contents := (summary.get("rules") or {}).get("contents"):
        yield quantity_words(contents["explosive"], contents["tnt"], contents["equivalents"])


def print_info(found: Mapping[str, Any]) -> None:
    """Print what `fragfield.files.provenance.describe` found."""
    console = plain_console()
    if "directory" in found:
        stages = ", ".join(f"{name} {'done' if done else 'missing'}" for name, done in found["stages"].items())
        console.print(f"{found['directory']}: {stages}")
        print_summary({"title": found["title"], **found["summary"]})
        if (seconds := (found["summary"].get("burst") or {}).get("wall_seconds")) is not None:
            console.print(f"burst computed in {duration(seconds)}")
        for name, size in found["files"].items():
            console.print(f"{size / 1e6:10.3f} MB  {name}")
        return
    console.print(f"{found['file']}: {found['format']}")
    for key, value in found["attributes"].items():
        text = str(value)
        console.print(f"  {key} = {text if len(text) < 100 else text[:97] + '...'}")
    for name, shape in found["datasets"].items():
        console.print(f"  /{name}: {shape}")
