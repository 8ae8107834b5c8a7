"""Mean fragment mass of a segment: the laws, what they need at rupture, and where each comes from."""

from __future__ import annotations

import math
from typing import Literal

from fragfield_base.errors import names_allowed
from fragfield_base.substances import substance_key, substance_title, substances_with
from transition.errors import InputError

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
