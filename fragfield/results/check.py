"""What `fragfield check` reports of a case, see `fragfield.checking.check`: SI, angles in degrees."""

from __future__ import annotations

from typing import Any

from fragfield.results.burst import ComputedPart
from fragfield.results.flight import Recovered
from fragfield.results.hazard import Attitude
from fragfield.results.part import Part, out
from fragfield.results.rules import Contents, DistanceToApply, Official, Rule

Vector = tuple[float, float, float]


class Graded(Part):
    """A substance, and the grades of its values; of the user's own values none."""

    name: str
    grades: str


class DrawnMass(Part):
    """A mass by the drawing, and the relative deviation of the contours."""

    mass: float
    deviation: float


class Contour(Part):
    """The file from which a profile was read, and how."""

    source: str
    notes: str


class CheckedSegment(Part):
    """A segment of a casing: masses by the contours, mean wall of the mesh by volume, as the burst records it."""

    name: str
    kind: str
    start: float
    end: float
    mean_wall: float
    casing_mass: float
    charge_mass: float
    gurney_speed: float | None


class CheckedRound(Part):
    """What follows from a round; what a round from a mesh file, or its products, do not have is left out."""

    name: str
    explosive: Graded
    casing: Graded
    profile: str | None = None
    length: float
    outer_diameter: float
    fuze_mass: float | None = None
    fuze_density: float | None = None
    charge_length: float
    segments: tuple[CheckedSegment, ...] | None = None
    casing_mass: float
    charge_mass: float
    mass_error_of_mesh: dict[str, float]
    charge_ratio: float
    detonation_velocity: float
    gurney_constant: float
    gurney_speed: float
    initial_pressure: float | None = out("Pressure of the products", "Pa", default=None, key="P0")
    knee_pressure: float | None = out("Pressure at the knee", "Pa", default=None, key="Pk")
    knee_volume: float | None = out("Relative volume at the knee", default=None, key="Vk_over_V0")
    energy_density: float
    effective_gurney_constant: dict[str, float] | None = None
    contour: Contour | None = None
    drawing: dict[str, DrawnMass] | None = None


class Shock(Part):
    """Pressure held for a time that initiates a round, null where the shock is reported alone."""

    pressure: float | None = out("Pressure", "Pa")
    duration: float | None = out("Duration", "s")
    floor: float | None = out("From which a pulse counts", "Pa")


class PlacedRound(Part):
    """Where a round stands, and what initiates it: first and last delay, pressure and duration of a shock."""

    name: str
    position: Vector
    axis: Vector
    ignition_points: int
    delays: tuple[float, float] | None = out("First and last")
    initiation: Shock | None = out("Shock")


class Clearance(Part):
    """The nearest pair of rounds and its clear distance."""

    rounds: tuple[str, str]
    clearance: float


class PlacedPlane(Part):
    """A plane with its nearest round; the friction of a plane of symmetry is null."""

    name: str
    kind: str
    point: Vector
    normal: Vector
    friction_angle_deg: float | None = out("Friction", "deg")
    nearest_round: str
    clearance: float


class PlacedObstacle(Part):
    """An obstacle: lowest and highest point, and whether it follows the ground."""

    name: str
    kind: str
    base: float
    top: float
    height: float
    follows: bool
    ricochet: str


class PlacedSite(Part):
    """Distance and direction of the nearest edge of an exposed site."""

    name: str
    kind: str
    distance: float
    azimuth_deg: float
    bearing_deg: float | None = out("Null without `[site]`", "deg")


class FlatGround(Part):
    """Ground of one height."""

    height: float


class GroundMap(Part):
    """A map of heights: nodes, edges of a cell, extent, filled holes, height of z = 0; then what its file states."""

    map: str
    nodes: tuple[int, int]
    cell: tuple[float, float]
    filled: int
    x: tuple[float, float]
    y: tuple[float, float]
    z: tuple[float, float]
    datum: float | None = out("Null where it is not known", "m")
    format: str | None = None
    crs: str | None = None
    plan_unit: str | None = None
    position: str | None = None
    north: str | None = None
    height_unit: str | None = None
    vertical: str | None = None
    notes: tuple[str, ...] | None = None


class RicochetLaw(Part):
    """The law of ricochet off the ground."""

    critical_angle: float
    speed_kept: float
    departure: float
    roughness: float
    name: str
    source: str


class Surroundings(Part):
    """Surroundings of the flight; air and wind in words."""

    ground: FlatGround | GroundMap
    altitude: float | None = out("Of z = 0 in the standard atmosphere", "m")
    air: str
    wind: str
    ricochet: RicochetLaw | None = out("Law")
    obstacles: tuple[PlacedObstacle, ...]
    exposed: tuple[PlacedSite, ...]


class SettingsOfContact(Part):
    """Contact of charge and casing, and between colliding surfaces."""

    charge_casing: str
    cohesion: float
    tensile_strength: float
    friction_angle_deg: float
    surfaces: bool
    surface_friction_angle_deg: float


class Arrangement(Part):
    """What stands where."""

    attitude: Attitude
    rounds: tuple[PlacedRound, ...]
    min_clearance: Clearance | None = out("Null of a single round")
    planes: tuple[PlacedPlane, ...]
    surroundings: Surroundings
    contact: SettingsOfContact


class ChosenGeometry(Part):
    """Geometry of the burst, and why."""

    choice: str
    reason: str


class CheckedMesh(Part):
    """The mesh of what is computed."""

    cells: int
    nodes: int
    min_scaled_jacobian: float
    max_aspect_ratio: float
    min_edge: float


class ExpectedCost(Part):
    """First stable step, when the burst may end (null where a round is from a mesh file), memory."""

    stable_time_step: float
    end_time: float | None = out("End", "s")
    memory_bytes: float
    attitudes: int | None = None


class CheckedFragments(Part):
    """What a file of fragments holds, of an arena table for one round."""

    file: str
    number: float
    mass: float
    recovered: Recovered | None = None


class Checked(Part):
    """What `fragfield check` reports of a case without a burst."""

    case: dict[str, Any]
    fragments: CheckedFragments | None = None
    warnings: tuple[str, ...]
    official: Official | None = out("As in summary.json")
    contents: Contents | None = out("As in summary.json")
    rules: tuple[Rule, ...]
    distance_to_apply: DistanceToApply = out("As in summary.json, without the computed distance")


class CheckedBurst(Checked):
    """What `fragfield check` reports of a case with a burst."""

    rounds: tuple[CheckedRound, ...]
    arrangement: Arrangement
    geometry: ChosenGeometry
    mesh: CheckedMesh
    symmetry: ComputedPart
    expected: ExpectedCost
