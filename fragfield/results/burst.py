"""The part `burst` of the summary."""

from __future__ import annotations

from typing import Literal

from fragfield.results.part import Part, out


class SymmetryPlane(Part):
    """A plane of symmetry that was used."""

    point: tuple[float, float, float] = out("A point of the plane", "m")
    normal: tuple[float, float, float] = out("Its unit normal")
    through_rounds: tuple[str, ...] = out("Names of the rounds that it cuts")


class ComputedRound(Part):
    """A round that was computed, whole or in part."""

    name: str = out("Name")
    share: float = out("Fraction of the round that was computed")


class ImageRound(Part):
    """A round that is the image of a computed one."""

    name: str = out("Name")
    image_of: str = out("Name of the round computed")


class UnusedPlane(Part):
    """A plane that positions alone would allow."""

    normal: tuple[float, float, float] = out("Unit normal")
    reason: str = out("Why it is no plane of symmetry")


class ComputedPart(Part):
    """What of the arrangement is computed."""

    planes: tuple[SymmetryPlane, ...] = out("Planes of symmetry used")
    computed_rounds: tuple[ComputedRound, ...] = out("Rounds computed, whole or in part")
    image_rounds: tuple[ImageRound, ...] = out("Rounds that are images of computed ones")
    share: float = out("Fraction of the arrangement that was computed")
    not_used: tuple[UnusedPlane, ...] = out("Planes that the positions alone would allow")


class Symmetry(ComputedPart):
    """What of the arrangement was computed."""

    all_cells: int = out("Cells with those of the images")


class SpeedQuantiles(Part):
    """Speeds that a percentage of the mass of a casing does not exceed."""

    speed_90: float = out("Speed not exceeded by 90 % of the casings' mass", "m/s", name="speed_90", key="90")
    speed_99: float = out(
        "Speed not exceeded by 99 % of the casings' mass",
        "m/s",
        name="speed_99",
        views="terminal compare sweep convergence uncertainty",
        key="99",
    )


class PassedThrough(Part):
    """Casings that passed through planes or each other."""

    beyond_planes: float = out("Behind planes at the end", "kg")
    in_other_rounds: float = out("Within other rounds at the end", "kg")
    largest_beyond_planes: float = out("Largest mass of casings beyond planes", "kg")
    largest_in_other_rounds: float = out("Largest mass of casings within other rounds", "kg")
    largest_together: float = out("Largest of all outputs, both together", "kg")


class BurstContact(Part):
    """Contact of charges and casings, and between surfaces."""

    gain: float = out("Energy that contact has made (lost: negative)", "J")
    max_interface_penetration_at_front: float = out("Largest overlap of charge and casing, while a front passes", "m")
    max_interface_penetration: float = out("– afterwards", "m")
    max_collision_penetration: float = out("Largest overlap of colliding surfaces", "m")
    max_plane_penetration: float = out("Largest overlap with a plane", "m")


class Ignition(Part):
    """What initiated a charge."""

    by: Literal["point", "delay", "shock"] = out("What initiated the charge")
    time: float = out("When", "s")
    place: tuple[float, float, float] = out("Where", "m")
    station: float = out("The same from the nose", "m")


class Exposure(Part):
    """Of rounds without ignition points: what the shock of a neighbour did."""

    peak_pressure: float = out("Largest pressure", "Pa")
    energy: float = out("Energy of the strongest pulse", "J/m2")
    pulse_pressure: float = out("Pressure of that pulse", "Pa")
    held_time: float = out("How long it was held", "s")
    floor: float = out("Pressure from which a pulse counts", "Pa")
    resolved_cell: float = out("Largest cell size that resolves the pulse", "m")
    resolved: bool = out("Whether the cells resolve it")
    critical_energy: tuple[float, float] | None = out("Published critical energies, smallest and largest", "J/m2")
    ratio: tuple[float, float] | None = out("Energy over the smallest and over the largest of them")
    verdict: Literal["below", "within", "above", "no critical energy"] = out("Against the published critical energies")


class BurstRound(Part):
    """A round of the burst."""

    name: str = out("Name")
    casing_mass: float = out("Mass of the casing", "kg")
    charge_mass: float = out("Mass of the charge", "kg")
    mean_initial_speed: float = out("Speed of the casing, weighted by mass", "m/s")
    max_initial_speed: float = out("Largest mean speed of a cell", "m/s")
    speed_quantiles: SpeedQuantiles = out("Speeds that 90 and 99 % of the casing's mass do not exceed")
    outer_diameter: float = out("Largest outer diameter over stations", "m")
    fastest_station: float = out("Station of the fastest belt, from the nose", "m")
    products_balance: float = out("As for the whole")
    ignition: tuple[Ignition, ...] = out("What initiated the charge, in order of time; empty where nothing did")
    exposure: Exposure | None = None


class Burst(Part):
    """The burst; masses, energies, counts but `cells` and `nodes` are those of the whole arrangement with images."""

    geometry: Literal["3d", "axisymmetric"] = out("Geometry in which the burst was computed")
    geometry_reason: str = out("Why this geometry")
    cells: int = out("Cells computed", views="terminal sweep")
    nodes: int = out("Nodes computed")
    min_scaled_jacobian: float = out("Smallest scaled Jacobian at rest", note="1 is a box; the aim is 0.2 or more")
    max_aspect_ratio: float = out("Largest aspect ratio at rest")
    min_edge: float = out("Shortest edge at rest", "m")
    symmetry: Symmetry
    end_time: float = out("End of the burst", "s", views="terminal")
    acceleration_complete: float | None = out("Acceleration complete at", "s", note="Null where it was not")
    mean_initial_speed: float = out(
        "Mean initial speed, by mass", "m/s", views="terminal compare sweep convergence uncertainty"
    )
    speed_quantiles: SpeedQuantiles = out("Speeds that 90 and 99 % of the casing's mass do not exceed")
    max_initial_speed: float = out(
        "Largest initial speed, mean of a cell",
        "m/s",
        note="Of ever less mass as cells get smaller, so that it need not converge",
        views="terminal compare sweep convergence",
    )
    outer_diameter: float = out("Outer diameter at the end", "m", views="terminal compare sweep convergence")
    casing_mass: float = out("Mass of the casings", "kg", views="compare")
    charge_mass: float = out("Mass of the charges", "kg", views="compare")
    acceleration_left: float | None = out(
        "Kinetic energy still to come at the end, by its asymptote",
        note="Initial speeds hold it where the burst ended by itself",
    )
    mean_speed_at_end: float = out("Mean speed at the end of the burst, by mass", "m/s", views="compare")
    products_balance: float = out("Work done and energy left in the products, over heat of detonation")
    energy_error: float = out("Largest imbalance of the energy ledger", views="terminal sweep", percent=True, digits=2)
    lost_cells: int = out("Lost cells", views="terminal sweep")
    folded_cells: int = out("Cells folded at the end, torn metal apart")
    folded_casing_mass: float = out("Mass of the casing in them", "kg")
    released_casing_mass: float = out("Mass of the casing in them", "kg")
    passed_through: PassedThrough
    energy_error_at_checks: float = out("The same at multiples of 10 us alone")
    energy_error_at_end: float = out("The same at the end, without what contact makes")
    contact_error: float = out("Largest energy that contact has made or lost, over the work done")
    contact_error_at_end: float = out("The same at the end; warned above 1 %, a stop above `burst.energy_tolerance`")
    momentum_error: float = out("Drift of momentum", views="sweep")
    contact: BurstContact
    cell_size: float = out("Cell size", "m")
    steps: int = out(
        "Steps (the longest)", note="The longest ones where cells have steps of their own", views="terminal sweep"
    )
    cell_steps: int = out("Steps of cells")
    ranks: int = out("Ranks")
    threads: int = out("Threads a rank")
    wall_seconds: float = out("Wall time", "s", views="terminal")
    seconds_per_cell_step: float = out("Time per cell and step", "s")
    peak_memory_bytes: int = out("Largest memory", "byte")
    rounds: tuple[BurstRound, ...] = out("By round, images too")
