"""Tables of the rounds: positions, state at the end of the burst, contact, fragments."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.case.tables.round import IgnitionTable
from fragfield.numbers import number
from fragfield.quantities import shown
from fragfield.report.blocks import Rows, Table
from fragfield.report.figures.fragments import segment_laws
from fragfield_base.substances import substance_title

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fragfield.case.tables.round import RoundTable
    from fragfield.report.reading.run_files import RoundTables, RunFiles


MOST_ROUNDS_SHOWN = 4
"""Tables by round and segment show no more rounds than this: those of a stack are mostly alike."""


def arrangement_table(run: RunFiles) -> Iterator[Table]:
    """Places and ignition of several rounds."""
    rounds = run.case.round if run.case is not None else []
    if len(rounds) < 2:
        return
    lines = [
        (
            entry.name,
            *(number(1e3 * value, 5) for value in entry.position),
            ", ".join(number(value, 3) for value in entry.axis),
            _ignition(entry),
        )
        for entry in rounds
    ]
    yield Table(
        "Arrangement", ("Round", "x (mm)", "y (mm)", "z (mm)", "Axis", "Initiation"), tuple(lines),
        note="Position of the centre of the base; the axis points from the base to the nose.",
    )  # fmt: skip


def _ignition(entry: RoundTable) -> str:
    """How a round of the resolved case is initiated, in words."""
    words = []
    if entry.ignition is None or entry.ignition:
        times = sorted({1e6 * point.delay for point in entry.ignition or [IgnitionTable()]})
        words.append("at " + " and ".join(number(time, 3) for time in times[:: max(1, len(times) - 1)]) + " µs")
    if (shock := entry.initiation) is not None:
        if shock.pressure is not None:
            words.append(f"by {number(shock.pressure * 1e-9, 3)} GPa held for {number(shock.duration * 1e6, 3)} µs")
        elif not words:
            words.append("never; shock reported")
    return " or ".join(words)


def round_table(run: RunFiles) -> Iterator[Table]:
    """Rounds one by one, and the segments of each."""
    reported = {str(item.get("name")): item for item in run.part("burst").get("rounds") or []}
    balanced = any(item.get("products_balance") is not None for item in reported.values())
    lines = [_round_line(item, reported.get(item.name, {}), balanced=balanced) for item in run.rounds]
    head = (
        "Round", "Fill", "Casing (kg)", "Charge (kg)", "Charge / casing", "Mean speed (m/s)", "Largest speed (m/s)",
        "Diameter (mm)", "Fastest at (% of length)",
    )  # fmt: skip
    if lines:
        note = "Products: work done and energy left, over the charge's heat of detonation." if balanced else ""
        yield Table("Rounds at the end of the burst", (*head, "Products (%)") if balanced else head, tuple(lines), note)
    for item in run.rounds[:MOST_ROUNDS_SHOWN]:
        yield Table(
            f"Segments of {item.name}",
            ("Segment", "From (mm)", "To (mm)", "Mean wall (mm)", "Casing (kg)", "Charge (kg)", "Speed (m/s)"),
            tuple(
                (
                    str(line["name"]),
                    number(1e3 * float(line["start"]), 4),
                    number(1e3 * float(line["end"]), 4),
                    number(1e3 * float(line["wall_thickness"]), 3),
                    number(float(line["casing_mass"]), 4),
                    number(float(line["charge_mass"]), 4),
                    number(round(float(line["speed"]))) if np.isfinite(line["speed"]) else "–",
                )
                for line in item.segments
            ),
            note="Stations from the nose; wall before the burst; speed at its end, by mass."
            + _others_left_out(len(run.rounds)),
        )


def _round_line(item: RoundTables, summary: dict[str, Any], *, balanced: bool) -> tuple[str, ...]:
    casing, charge = float(item.attributes["casing_mass"]), float(item.attributes["charge_mass"])
    along = item.along[item.along["casing_mass"] > 0]
    mean = float(np.average(along["mean_speed"], weights=along["casing_mass"])) if len(along) else np.nan
    fastest = along["station"][along["mean_speed"].argmax()] / float(item.attributes["length"]) if len(along) else 0
    share = summary.get("products_balance")
    return (
        item.name,
        substance_title(str(item.attributes["explosive"])),
        number(casing, 4),
        number(charge, 4),
        number(charge / casing, 3) if casing else "–",
        number(round(summary.get("mean_initial_speed") or mean)),
        number(round(float(summary.get("max_initial_speed") or along["max_speed"].max(initial=0)))),
        number(round(1e3 * float(summary.get("outer_diameter") or along["outer_diameter"].max(initial=0)))),
        number(100 * float(fastest), 3),
        *((number(100 * float(share), 4) if share is not None else "–",) if balanced else ()),
    )


def _others_left_out(rounds: int) -> str:
    left = rounds - MOST_ROUNDS_SHOWN
    return f" The first {MOST_ROUNDS_SHOWN} of {rounds} rounds are shown." if left > 0 else ""


def contact_rows(run: RunFiles) -> Iterator[Rows]:
    """What was in contact during the burst, and how far surfaces overlapped."""
    size = run.cell_size
    rows = []
    for one in shown("report", "burst.contact", "burst.passed_through"):
        overlap = size and one.unit == "m"
        note = f"{number(100 * one.of(run.summary) / size, 2)} % of a cell" if overlap and one.of(run.summary) else ""
        rows += [replace(line, note=note) for line in one.rows(run.summary)]
    if rows:
        yield Rows("Contact", tuple(rows))


def broken_rounds_table(run: RunFiles) -> Iterator[Table]:
    """Fragments of each round, with those behind planes of symmetry."""
    rounds = run.part("break_up").get("rounds") or []
    if len(rounds) < 2:
        return
    speed = np.linalg.norm(run.fragments["velocity"], axis=1)
    mirrored = any(item.get("mirror_of") for item in rounds)
    lines = []
    for index, item in enumerate(rounds):
        chosen = run.fragments["round"] == index
        masses = run.fragments["mass"][chosen]
        lines.append(
            (
                str(item.get("name", index)),
                *((str(item.get("mirror_of") or "–"),) if mirrored else ()),
                number(len(masses)),
                number(float(masses.sum()), 4),
                number(1e3 * float(masses.max(initial=0.0)), 4),
                number(round(float(speed[chosen].max(initial=0.0)))),
            )
        )
    head = ("Round", *(("Image of",) if mirrored else ()), "Fragments", "Mass (kg)", "Heaviest (g)", "Fastest (m/s)")
    note = (
        "An image lies behind a plane of symmetry: its motion is mirrored, and it breaks up with its own random seed."
    )
    yield Table("Fragments by round", head, tuple(lines), note if mirrored else "")


def segment_table(run: RunFiles) -> Iterator[Table]:
    """Law and sample of each segment."""
    lines = []
    rounds = run.part("break_up").get("rounds") or []
    for law in segment_laws(run):
        if law.round_index >= MOST_ROUNDS_SHOWN:
            break
        chosen = (run.fragments["round"] == law.round_index) & (run.fragments["segment"] == law.segment_index)
        masses = run.fragments["mass"][chosen]
        name = str(rounds[law.round_index].get("name", law.round_index))
        mean = law.line.get("mean_mass")
        lines.append(
            (
                f"{name}, {law.name}" if len(rounds) > 1 else law.name,
                number(1e3 * float(mean), 4) if mean is not None else "–",
                " + ".join(number(1e3 * mu, 4) for _, mu, _ in law.terms),
                " + ".join(number(float(round(n0)), 4) for n0, _, _ in law.terms),
                number(len(masses)),
                number(float(masses.sum()), 4),
                number(1e3 * float(masses.max(initial=0.0)), 4),
            )
        )
    head = ("Segment", "Mean mass (g)", "μ (g)", "N₀", "Sampled", "Mass (kg)", "Heaviest (g)")
    if lines:
        yield Table(
            "Law and sample by segment",
            head,
            tuple(lines),
            note="Number heavier than m: N₀ exp(−(m/μ)^λ), λ = 1/2 or 1/3 (Eq. 19); two terms for a mixture."
            + _others_left_out(len(rounds)),
        )
