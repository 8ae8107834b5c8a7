"""The part `flight` of the summary."""

from __future__ import annotations

from fragfield.results.part import Part, out


class PresentedArea(Part):
    """Presented areas."""

    model: str = out("Model of the presented areas", note="`as given`: shape factors of the fragments themselves")
    shape_factor_5_percent: float = out("Shape factor that 5 % are below", "kg/m3")
    shape_factor_95_percent: float = out("Shape factor that 95 % are below", "kg/m3")


class CountAndMass(Part):
    """Fragments and their mass."""

    fragments: int = out("Number")
    mass: float = out("Mass", "kg")


class Status(Part):
    """Fragments by how their flight ended; they add up to all that flew."""

    landed: CountAndMass = out("Reached the ground")
    time_out: CountAndMass = out("Still flew at the end of `flight.time_limit`")
    left_domain: CountAndMass = out("Left the map of heights or the domain")
    step_limit: CountAndMass = out("Used up the steps allowed")
    not_a_number: CountAndMass = out("Gave no finite number")
    stopped: CountAndMass = out("Were stopped by an obstacle")


class FlightContact(Part):
    """Contact between fragments, with `[flight.collisions]`."""

    contacts: int = out("Impacts between fragments")
    energy_lost: float = out("Energy lost in them", "J")


class Recovered(Part):
    """Of an arena table."""

    mass: float = out("Fragments of the arena table", "kg")
    casing_mass: float | None = out("Casing of the round", "kg", note="Null without `[[round]]`")
    arena_mass: str = out("`flight.arena_mass`")
    fraction: float | None = out("Recovered of the casing")
    factor: float = out("Factor on the numbers of the arena table")
    words: str = out("The same in words")


class Flight(Part):
    """The flight; of the first realisation where nothing else is said."""

    presented_area: PresentedArea
    fragments: int = out("Fragments flown, first realisation")
    landed: int = out("Landed", views="terminal")
    status: Status = out("How flights ended at their first impact on the ground")
    ricochets: int = out("Ricochets")
    ricocheted: int = out("Ricocheted off the ground")
    drag: str = out("Drag table")
    above_drag_table: int = out("Fragments above the drag table's speeds")
    wall_seconds: float = out("Wall time", "s")
    contact: FlightContact | None = None
    fragments_file: str | None = out("Name of the file, of fragments from another source", default=None)
    recovered: Recovered | None = None
    hazardous_fragments: float = out(
        "Hazardous fragments that landed, per event", views="convergence", name="hazardous_fragments"
    )
    realisations: int = out("Realisations of which single counts are kept")
