"""Mean fragment mass of a segment: the laws, what they need at rupture, and where each comes from.

Within published fragment data the laws were compared, outside no data are near. The data and the comparison are in
`validation/mean_mass`; a test holds the bounds here against them. Every casing is described as there: by the cylinder
of its outer diameter that has its ratio of charge to metal.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Literal

from fragfield_base.errors import names_allowed
from fragfield_base.substances import substance_key, substance_title, substances_with
from transition.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterator


PAPER_PREFACTOR = 0.3815  # the printed 381.5 of Eq. 21, read as grams
ASPECT_RATIO = 1.6  # length over breadth of a piece: mean over three sets of recovered fragments (Felix et al. 2022)


def mott_linfoot(
    prefactor: float | Literal["paper"],
    density: float,
    radius: float,
    fracture_energy: float,
    thickness: float,
    speed: float,
) -> float:
    """Mean fragment mass m = C rho^(1/3) a^(4/3) W^(2/3) delta / v0^(4/3) (kg), Eq. 21.

    Mott and Linfoot (1943): the crack spacing in a ring that expands at the rate v0/a, for a crack energy W, with
    C = 24^(2/3) kappa dimensionless in SI; kappa is the shape of the piece. At rest it is infinite.

    Parameters
    ----------
    prefactor : float or "paper"
        C, measured 2 to 6; "paper" is `PAPER_PREFACTOR`.
    density : float
        Of the casing (kg/m3).
    radius, thickness : float
        Outer radius a and wall delta at rupture (m).
    fracture_energy : float
        W (J/m2).
    speed : float
        v0 (m/s).
    """
    if speed <= 0.0:
        return math.inf
    factor = PAPER_PREFACTOR if prefactor == "paper" else float(prefactor)
    return factor * density ** (1 / 3) * (radius / speed) ** (4 / 3) * fracture_energy ** (2 / 3) * thickness


def mott_1947(density: float, fracture_stress: float, gamma: float, thickness: float, rate: float) -> float:
    """Mean fragment mass rho (1.5 x0)^2 A delta (kg), with x0 = sqrt(2 P_F / (rho gamma)) / rate.

    Mott (1947): cracks start at random where the strain at fracture scatters, and relieve what is around them; the
    mean breadth of the pieces of a ring is 1.5 x0. The theory gives no length: it is A = 1.6 times the breadth
    (`ASPECT_RATIO`). At rest it is infinite.

    Parameters
    ----------
    density : float
        rho of the casing (kg/m3).
    fracture_stress : float
        P_F, true stress at fracture (Pa).
    gamma : float
        Sharpness of the scatter of the strain at fracture: its standard deviation is 1.28/gamma.
    thickness : float
        Wall delta at rupture (m).
    rate : float
        Rate of hoop strain at rupture, v/r (1/s).
    """
    if rate <= 0.0:
        return math.inf
    spacing = math.sqrt(2.0 * fracture_stress / (density * gamma)) / rate
    return density * (1.5 * spacing) ** 2 * ASPECT_RATIO * thickness


def gurney_sarmousakis(constant: float, thickness: float, inner_diameter: float) -> float:
    """Mean fragment mass 2 M_A^2 (kg), with M_A = B t^(5/6) d^(1/3) (1 + t/d).

    Gurney and Sarmousakis (1943), as used in UFC 3-340-02 (the form in SI: Nystroem 2008, p. 15): mu = M_A^2 of a law
    in two dimensions, whose mean is 2 mu. `constant` is B (kg^(1/2) m^(-7/6)), `thickness` t and `inner_diameter` d
    those of the casing before the burst (m). A solid piece (d = 0) does not break: infinite.
    """
    if inner_diameter <= 0.0:
        return math.inf
    scale = constant * thickness ** (5 / 6) * inner_diameter ** (1 / 3) * (1.0 + thickness / inner_diameter)
    return 2.0 * scale**2


def explosive_constant(explosive: str, given: float | None) -> float:
    """B of Gurney and Sarmousakis: `given`, or that of the explosive by its name (kg^(1/2) m^(-7/6))."""
    if given is not None:
        return given
    constants = substances_with("explosive", "fragmentation", "explosive_constant")
    constant = constants.get(substance_key(explosive))
    if constant is not None:
        return float(constant)
    raise InputError(
        f"break_up.mean_mass = 'gurney_sarmousakis': no constant is known for the explosive {explosive!r}"
        f"{names_allowed(explosive, map(substance_title, constants))}; "
        "give break_up.explosive_constant in kg^(1/2) m^(-7/6)"
    )


def ruptured(radius: float, thickness: float, critical_strain: float) -> tuple[float, float]:
    """Outer radius and wall (m) at the hoop strain of rupture, (1 + e) a0 and delta0/(1 + e), Eq. 22."""
    return (1.0 + critical_strain) * radius, thickness / (1.0 + critical_strain)


def gurney_coefficient(detonation_velocity: float) -> float:
    """sqrt(2E) (m/s) from the detonation velocity (m/s): 0.52 + 2.8e-4 D gives km/s, Eq. 24."""
    return 1000.0 * (0.52 + 2.8e-4 * detonation_velocity)


def gurney_speed(detonation_velocity: float, charge_ratio: float) -> float:
    """v0 = sqrt(2E) sqrt(beta / (1 + beta/2)) (m/s) of a cylinder, beta = charge mass/casing mass, Eq. 23."""
    return gurney_coefficient(detonation_velocity) * math.sqrt(charge_ratio / (1.0 + 0.5 * charge_ratio))


FACTORS = {"mott": 1.6, "mott_1947": 1.9, "gurney_sarmousakis": 1.5}
"""By law: geometric standard deviation of computed over measured mean mass about 1, over the published data."""
FACTOR_SOURCE = "validation/mean_mass: published shells of 75 to 240 mm and cylinders of 63.5 mm"
OUTER_DIAMETER = (63.5e-3, 240e-3)
"""Smallest and largest outer diameter of the data (m)."""
WALL_RATIO = (0.05, 0.45)
"""Smallest and largest wall over inner diameter of the equivalent cylinders of the data."""
STEEL_DENSITY = (7700.0, 8000.0)
"""Casings of the data are of steel; other metals have other densities (kg/m3)."""
STEEL_YIELD = (400e6, 800e6)
"""Yield strength (Pa) of steels like those of the data: forged shell steel of at least 448 MPa (drawing of the M107),
and AISI 1045 of Rockwell B 100, whose tensile strength is about 800 MPa (from memory of ASTM A370, not checked)."""
EXPLOSIVES = ("TNT", "Composition B", "Cyclotol", "Pentolite", "H-6", "HBX-1", "HBX-3", "PTX-1", "PTX-2")
"""Explosives of the data; the shells are all taken as TNT."""


def equivalent_cylinder(
    outer_diameter: float, charge_ratio: float, casing_density: float, explosive_density: float
) -> tuple[float, float]:
    """Wall and inner diameter (m) of the cylinder with this outer diameter (m) and charge ratio.

    `charge_ratio` is the mass of the charge over that of the casing: C/M = rho_e d^2 / (rho (D^2 - d^2)).
    """
    areas = charge_ratio * casing_density / explosive_density  # d^2 / (D^2 - d^2)
    inner = outer_diameter * math.sqrt(areas / (1.0 + areas))
    return 0.5 * (outer_diameter - inner), inner


def outside_data(
    outer_diameter: float,
    charge_ratio: float,
    casing: tuple[float, float | None],
    filling: tuple[str, float],
) -> Iterator[str]:
    """Yield in which respects no published data are near a casing; nothing where data are near.

    `outer_diameter`: largest (m); `charge_ratio`: mass of the charge over that of the casing; `casing` (float, float or
    None): density (kg/m3) and yield strength (Pa; None: not known); `filling` (str, float): name and density (kg/m3) of
    the explosive.
    """
    (casing_density, casing_yield), (explosive, explosive_density) = casing, filling
    low, high = OUTER_DIAMETER
    if not low <= outer_diameter <= high:
        yield f"outer diameter {outer_diameter * 1e3:.4g} mm (data: {low * 1e3:g} to {high * 1e3:g} mm)"
    ratio = math.inf
    if charge_ratio > 0.0:
        wall, inner = equivalent_cylinder(outer_diameter, charge_ratio, casing_density, explosive_density)
        ratio = wall / inner
    low, high = WALL_RATIO
    if not low <= ratio <= high:
        yield f"wall over inner diameter {ratio:.3g} of the equivalent cylinder (data: {low:g} to {high:g})"
    low, high = STEEL_DENSITY
    if not low <= casing_density <= high:
        yield f"casing of {casing_density:g} kg/m3 (data: steel)"
    elif casing_yield is not None and not STEEL_YIELD[0] <= casing_yield <= STEEL_YIELD[1]:
        low, high = STEEL_YIELD
        yield f"yield strength {casing_yield / 1e6:.4g} MPa (data: steels of about {low / 1e6:g} to {high / 1e6:g} MPa)"
    if substance_key(explosive) not in {substance_key(name) for name in EXPLOSIVES}:
        yield f"explosive {explosive!r} (data: {', '.join(EXPLOSIVES)})"
