"""The procedure of DDESB Technical Paper 12 (Zaker 1975): fragments of one round by polar angle, and stacks of it.

The paper counts fragments per steradian Q0 about a round, lets them fly straight and slow down by drag alone, and takes
a fragment as hazardous at a distance R where it keeps the critical energy E there, or has it in free fall at its
terminal speed (p. 8-10, 14):

    m V^2 exp(-2 R / (L1 m^(1/3))) = 2 E    or    g L1 m^(4/3) = 2 E,    L1 = 2 k^(2/3) / (C_D rho)

With the Mott law of the mean mass m0 the number per area normal to the path is q = Q0 / R^2 exp(-(2 m / m0)^(1/2)); the
distance is where it falls to the acceptable density. Attitude, height and ground play no part.

Two distances follow: that of a stack, by the paper's steps and constants, see `stack_distance`; and that of a single
round in its worst polar zone, as an arena test reports it, see `beam_distance`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flight.arguments import real_array, require_number, require_numbers
from flight.drag import Drag
from flight.errors import InputError
from flight.fragments import Fragments
from flight.hazard.criteria import Criteria
from flight.scene.air import STANDARD_GRAVITY
from flight.shape import HEAVY_PIECES_OF_STACKS
from fragfield.results.rules import Beam
from fragfield_base.errors import names_allowed

Array = NDArray[np.float64]

COVERS = {"open": (0.9, 0.1), "earth": (0.7, 0.1)}
"""Weights of the rounds on the side and of those on top, by the stack's cover (p. 11, after Fugelso 1973)."""
SUPERSONIC_DRAG = 1.28
"""C_D taken as constant at its supersonic value (p. 8)."""
ZONE_WIDTH = 10.0
"""Width of a polar zone (degrees)."""
COARSE = 0.7
"""Fraction of a zone's mass, from the heaviest fragment down, to which the Mott law is fitted: what is heavier than 1.8
mean masses, of the M107 20 g. The distance of a stack of M107 scatters over sets of 12 break-ups by 0.6 %; with half of
the mass by 1.6 %, about the same mean."""
FEWEST = 10  # fragments in the coarse end of a zone, of all realisations
_SMALLEST = 0.1  # of the mean excess over the edge, in the root of the mass: 0.5 for a Mott law
_STEP = 1.0  # degrees between the zones that are tried
_FINEST = 2e-3  # in ln v, of the integral over the drag table


def _last_mass(holds: Callable[[float], bool], low: float, high: float) -> tuple[float, float]:
    """The masses (kg) up to which a condition holds and from which it does not, between two logarithms of masses."""
    for _ in range(80):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if holds(math.exp(middle)) else (low, middle)
    return math.exp(low), math.exp(high)


@dataclass(frozen=True, eq=False)
class Retardation:
    """Straight flight against drag alone, and free fall.

    Along a path dv/ds = -C_D(v/a) rho v (m/k)^(2/3) / (2 m), so that the distance in which a fragment slows down from
    one speed to another is m^(1/3) times a function of the speeds: for a constant C_D it is L1 m^(1/3) ln(v0 / v).

    Attributes
    ----------
    drag : Drag
        Coefficient over Mach number.
    density, sound_speed : float
        Of the air (kg/m3, m/s).
    shape_factor : float
        k of the presented area (m/k)^(2/3) (kg/m3).
    gravity : float
        m/s2.

    Raises
    ------
    InputError
        A value that is not a number above zero; density and gravity may be zero.
    """

    drag: Drag
    density: float
    sound_speed: float
    shape_factor: float
    gravity: float = STANDARD_GRAVITY

    def __post_init__(self) -> None:
        """Refuse values that mean nothing."""
        require_numbers("retardation", self, {"density": "kg/m3", "gravity": "m/s2"}, low=0.0)
        require_numbers("retardation", self, {"sound_speed": "m/s", "shape_factor": "kg/m3"}, above=0.0)

    @property
    def scale(self) -> float:
        """2 k^(2/3) / rho (m/kg^(1/3)): L1 times C_D; infinite in a vacuum."""
        return 2.0 * self.shape_factor ** (2.0 / 3.0) / self.density if self.density > 0.0 else math.inf

    def distance(self, mass: ArrayLike, start: ArrayLike, end: ArrayLike) -> Array:
        """Distance (m) in which fragments (kg) slow down from `start` to `end` (m/s); 0 where they start slower."""
        mass, start, end = np.broadcast_arrays(*(np.asarray(one, dtype=np.float64) for one in (mass, start, end)))
        slows = start > end
        between = np.zeros(mass.shape)
        if slows.any():
            between[slows] = self._between(start[slows], end[slows])
        with np.errstate(invalid="ignore"):
            return np.where(slows, self.scale * np.cbrt(mass) * between, 0.0)

    def _between(self, start: Array, end: Array) -> Array:
        """Integral of dv / (C_D v) between speeds, by the trapezoidal rule in ln v; exact for a constant C_D."""
        low, high = np.log(np.maximum(end, 1e-9)), np.log(start)
        grid = np.linspace(low.min(), high.max(), 2 + math.ceil((high.max() - low.min()) / _FINEST))
        with np.errstate(divide="ignore"):
            slowness = 1.0 / self.drag.at(np.exp(grid) / self.sound_speed)
        whole = np.concatenate([[0.0], np.cumsum(0.5 * (slowness[1:] + slowness[:-1]) * np.diff(grid))])
        return np.asarray(np.interp(high, grid, whole) - np.interp(low, grid, whole))

    def lightest_in_free_fall(self, energy: float) -> float:
        """Mass (kg) from which on the terminal speed alone gives this energy (J); infinite without weight."""
        if energy <= 0.0 or not math.isfinite(self.scale):
            return 0.0
        if not self.gravity > 0.0:
            return math.inf

        def floats(
            mass: float,
        ) -> bool:  # m g against the drag at the speed sqrt(2 E / m): the one rises, the other falls
            speed = math.sqrt(2.0 * energy / mass)
            drag = speed**2 * mass * float(self.drag.at(speed / self.sound_speed))
            return mass * self.gravity * self.scale * mass ** (1.0 / 3.0) <= drag

        return _last_mass(floats, math.log(1e-12), math.log(1e12))[1]

    def reach(self, mass: ArrayLike, speed: ArrayLike, energy: float) -> Array:
        """Distances (m) up to which fragments (kg) launched at speeds (m/s) have an energy (J).

        What has it in free fall has it as far as it may fly at all, V^2 / g.
        """
        mass, speed = np.broadcast_arrays(*(np.asarray(one, dtype=np.float64) for one in (mass, speed)))
        near = self.distance(mass, speed, np.sqrt(2.0 * energy / mass))
        if not self.gravity > 0.0:
            return near
        falls = mass >= self.lightest_in_free_fall(energy)
        return np.where(falls, np.maximum(near, speed**2 / self.gravity), near)


def effective_number(side: float, top: float, cover: str = "open") -> float:
    """Effective number N_E of rounds of a stack: 0.9 N_S + 0.1 N_T in the open, 0.7 N_S + 0.1 N_T under earth.

    The paper's sentence names N_S and N_T in the wrong order ("in the top layer and on the side ... respectively",
    p. 11); the subscripts, and rounds on the side as those that throw towards a place, leave no doubt.

    Parameters
    ----------
    side, top : float
        Rounds on the side that faces the place, and in the top layer.
    cover : "open" or "earth"
        Of the stack.

    Raises
    ------
    InputError
        A number below zero or without meaning, none at all, or another cover.
    """
    if cover not in COVERS:
        raise InputError(f"stack rule: cover is {cover!r}{names_allowed(cover, COVERS)}; allowed: {', '.join(COVERS)}")
    for name, value in (("side", side), ("top", top)):
        require_number("stack rule", name, value, "", low=0.0)
    number = COVERS[cover][0] * side + COVERS[cover][1] * top
    if not number > 0.0:
        raise InputError("stack rule: no round on the side and none on top")
    return number


@dataclass(frozen=True, eq=False, repr=False)
class PolarField:
    """Fragments of one round by polar angle from its nose, of one or several realisations; azimuths count alike.

    Attributes
    ----------
    polar : (n,) float64
        Angle of the velocity from the direction base to nose (degrees).
    mass, speed : (n,) float64
        kg, m/s.
    realisations : int
        How many bursts they are of.
    """

    polar: Array
    mass: Array
    speed: Array
    realisations: int = 1

    @classmethod
    def of(cls, realisations: Sequence[Fragments], axis: ArrayLike = (0.0, 0.0, 1.0)) -> PolarField:
        """From the fragments of a single round whose axis points along `axis` (3,), from base to nose.

        Raises
        ------
        InputError
            There is no fragment, or the axis has no length.
        """
        along = real_array("polar field", "axis", axis, "", (3,))
        if not realisations or not any(len(one) for one in realisations):
            raise InputError("polar field: no fragment")
        if not along.any():
            raise InputError("polar field: axis is [0, 0, 0], needed: a direction")
        mass = np.concatenate([one.mass for one in realisations])
        velocity = np.concatenate([one.velocity for one in realisations])
        speed = np.linalg.norm(velocity, axis=1)
        cosine = velocity @ (along / np.linalg.norm(along)) / np.maximum(speed, 1e-300)
        polar = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))
        return cls(polar, mass, speed, len(realisations))

    def __repr__(self) -> str:
        return f"<flight.PolarField: {len(self.mass)} fragments of {self.realisations} realisations>"

    def zone(self, low: float, high: float) -> PolarField:
        """The fragments between two polar angles (degrees); those at 180 degrees belong to the last zone."""
        inside = (self.polar >= low) & ((self.polar < high) | (high >= 180.0))
        return PolarField(self.polar[inside], self.mass[inside], self.speed[inside], self.realisations)


def solid_angle(low: float, high: float) -> float:
    """Solid angle (sr) between two polar angles (degrees)."""
    return 2.0 * math.pi * (math.cos(math.radians(low)) - math.cos(math.radians(high)))


def beam_distance(
    field: PolarField, retardation: Retardation, criteria: Criteria, *, width: float = ZONE_WIDTH
) -> Beam:
    """Distance of a single round in its worst polar zone, by the paper's procedure with counted fragments.

    An arena test reports fragments by polar zone; here every fragment of the zone counts with its own mass and speed,
    in place of a Mott law and one speed. Zones, `width` wide (degrees, from 1 to 180), are moved in steps of a degree,
    so that none cuts a beam in two. The paper's shape factor in `retardation` is 2600 kg/m3 for single shells.
    """
    require_number("beam distance", "width", width, "degrees", low=1.0, high=180.0)
    reach = retardation.reach(field.mass, field.speed, criteria.energy)
    order = np.argsort(-reach, kind="stable")
    reach, polar = reach[order], field.polar[order]
    best = Beam(distance=0.0, low=0.0, high=width, per_steradian=0.0)
    for low in np.append(np.arange(0.0, 180.0 - width, _STEP), 180.0 - width).tolist():
        high = low + width
        inside = reach[(polar >= low) & ((polar < high) | (high >= 180.0))]
        each = 1.0 / (solid_angle(low, high) * field.realisations)  # per steradian, of one fragment
        number = each * np.arange(1, len(inside) + 1)
        found = np.minimum(inside, np.sqrt(number / criteria.density))  # of the k farthest: how far they are enough
        if len(found) and found.max() > best.distance:
            at = int(np.argmax(found))
            best = Beam(distance=float(found[at]), low=low, high=high, per_steradian=float(number[at]))
    return best


@dataclass(frozen=True)
class MottField:
    """Q0 exp(-(2 m / m0)^(1/2)) fragments per steradian heavier than m, with one speed."""

    per_steradian: float
    """Q0 (1/sr)."""
    mean_mass: float
    """m0 (kg)."""
    speed: float
    """V (m/s)."""

    @classmethod
    def fitted(cls, field: PolarField, low: float, high: float) -> MottField:
        """The Mott law of a polar zone, fitted to its coarse end, and the zone's mean speed by mass.

        Above a mass m_c the law is an exponential in x = (2 m)^(1/2), whose parameter m0^(1/2) is the mean of x - x_c
        (maximum likelihood); Q0 is such that the number above m_c is kept. Above m_c lie seven tenths of the zone's
        mass: the paper asks to emphasise the coarse end (step 3). Raises InputError: too few fragments in the coarse
        end, or all of one mass.
        """
        zone = field.zone(low, high)
        mass = -np.sort(-zone.mass)
        held = np.cumsum(mass)
        edge = float(mass[np.searchsorted(held, COARSE * held[-1])]) if len(mass) else math.inf
        coarse = int(np.searchsorted(-mass, -edge))  # those heavier than the edge
        excess = float(np.mean(np.sqrt(2.0 * mass[:coarse]))) - math.sqrt(2.0 * edge) if coarse else 0.0
        if coarse < FEWEST or excess < _SMALLEST * math.sqrt(2.0 * edge):
            raise InputError(
                f"stack rule: {coarse} fragments in the coarse end of the zone from {low:g} to {high:g} degrees; "
                f"needed for a Mott law: {FEWEST} or more, of different masses"
            )
        above = coarse / (field.realisations * solid_angle(low, high))
        speed = float((zone.mass * zone.speed).sum() / zone.mass.sum())
        return cls(above * math.exp(math.sqrt(2.0 * edge) / excess), excess**2, speed)

    def heavier(self, mass: float) -> float:
        """Fragments per steradian heavier than a mass (kg)."""
        return self.per_steradian * math.exp(-math.sqrt(2.0 * mass / self.mean_mass))


@dataclass(frozen=True)
class StackDistance:
    """Distance of a stack, and what it rests on."""

    distance: float
    """m."""
    lightest: float
    """Lightest hazardous fragment there (kg)."""
    free_fall: bool
    """Whether it is hazardous at its terminal speed."""
    low: float
    high: float
    """Polar zone of the single round (degrees from the nose)."""
    single: MottField
    """Of the single round in that zone."""


def procedure(
    single: MottField, number: float, retardation: Retardation, criteria: Criteria
) -> tuple[float, float, bool]:
    """Steps 4 and 5 of the paper (p. 14): distance (m), lightest hazardous mass there (kg), whether by free fall.

    The distance is the larger of two: with the mass that keeps the critical energy against drag, and with that which
    has it in free fall.
    """
    limit = criteria.density / number
    low = math.log(max(2.0 * criteria.energy / single.speed**2, 1e-12)) if single.speed > 0.0 else 30.0
    high = max(low, 0.0) + 30.0

    def dense(mass: float) -> bool:  # with the mass the distance rises and the density there falls
        at = float(retardation.distance(mass, single.speed, math.sqrt(2.0 * criteria.energy / mass)))
        return at <= 0.0 or single.heavier(mass) >= limit * at**2

    flown = _last_mass(dense, low, high)[0]
    reached = float(retardation.distance(flown, single.speed, math.sqrt(2.0 * criteria.energy / flown)))
    falling = retardation.lightest_in_free_fall(criteria.energy)
    if math.isfinite(falling):
        fallen = math.sqrt(single.heavier(falling) / limit)
        if fallen > reached:
            return fallen, falling, True
    return reached, flown, False


def stack_distance(
    field: PolarField, number: float, criteria: Criteria, *, density: float = 1.225, gravity: float = STANDARD_GRAVITY
) -> StackDistance:
    """Distance of a stack by the paper's suggested procedure (p. 13-14), of air of `density` (kg/m3).

    Perpendicular to the rounds' axes N_E (`number`, see `effective_number`) times the single round's fragments, with k
    = 4740 kg/m3 and C_D = 1.28. Of the zones of 10 degrees that hold the perpendicular the worst counts. The paper
    takes the initial speed from Gurney's formula and the Mott law from an arena test; here both are those of the
    fragments given. Raises InputError where the number is not above zero, or the zones hold too few fragments for a
    Mott law.
    """
    require_number("stack rule", "effective number", number, "", above=0.0)
    drag = Drag.constant(SUPERSONIC_DRAG)  # for which the speed of sound is of no meaning
    retardation = Retardation(drag, density, 340.0, HEAVY_PIECES_OF_STACKS, gravity)
    found, fault = [], ""
    for low in np.arange(90.0 - ZONE_WIDTH, 90.0 + 0.5 * _STEP, _STEP).tolist():
        try:
            single = MottField.fitted(field, low, low + ZONE_WIDTH)
        except InputError as error:
            fault = str(error)
            continue
        found.append(StackDistance(*procedure(single, number, retardation, criteria), low, low + ZONE_WIDTH, single))
    if not found:
        raise InputError(fault)
    return max(found, key=lambda one: one.distance)
