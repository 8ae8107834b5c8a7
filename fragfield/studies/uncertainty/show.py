"""A study of uncertainty on the terminal."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fragfield.hazard.certainty import metres
from fragfield.hazard.recommended import parts_words

if TYPE_CHECKING:
    from collections.abc import Mapping


def print_study(found: Mapping[str, Any]) -> None:
    """Print the recommended distance, the shares of the inputs and the exposed sites."""
    from rich.table import Table

    from fragfield.terminal.show import plain_console

    console = plain_console(wide=160)
    states = found["states"]
    lost = states["failed"] + states["not_determined"] + states["missing"]
    if lost:
        console.print(f"{lost} of {found['design']['samples']} samples gave no distance and are left out:")
        for message in states["messages"]:
            console.print(f"  {message}")
    if not found["distance"]:
        console.print(f"no result: {states.get('reason', 'no sample gave a distance')}")
        return
    spread = found["distance"]["spread"]
    console.print(
        f"expected distance over the inputs: 5 % {spread['low']:.1f}, median {spread['median']:.1f}, 95 % "
        f"{spread['high']:.1f} m (± {spread['high_standard_error']:.1f} m for {spread['samples']} samples)"
    )
    table = Table(box=None, pad_edge=False)
    for head in ("input", "total effect %", "first order %", "distance at its 5 and 95 %, m"):
        table.add_column(head, justify="left" if head == "input" else "right")
    for one, bar in zip(found["distance"].get("indices") or [], found["distance"].get("tornado") or [], strict=True):
        shares = [f"{100 * one[key]:.1f} ± {100 * one[f'{key}_standard_error']:.1f}" for key in ("total", "first")]
        table.add_row(one["name"], *shares, f"{bar['low']:.1f}  {bar['high']:.1f}")
    console.print(table)
    for site in found["exposed"]:
        if site["hits"] is not None:
            over = site["hits"]["spread"]
            words = f"5 % {over['low']:.3g}, median {over['median']:.3g}, 95 % {over['high']:.3g}"
            console.print(f"{site['name']}: expected hits {words}")
    console.print(f"recommended distance {metres(found['hazard']['recommended'])}")
    console.print(f"  {parts_words(found['hazard'])}")
    cost = found["cost"]
    if cost["samples_made_now"]:
        each = cost["wall_seconds"] / cost["samples_made_now"]
        console.print(f"{cost['samples_made_now']} samples in {cost['wall_seconds']:.0f} s, {each:.2f} s each")
    console.print(f"written to {found['directory']}")
