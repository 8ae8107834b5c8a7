"""Where published fragment data lie: within them the laws of the mean mass were compared, outside no data are near.

The data and the comparison are in `validation/mean_mass`; a test holds these bounds against them. Every casing is
described as there: by the cylinder of its outer diameter that has its ratio of charge to metal.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from fragfield_base.substances import substance_key

if TYPE_CHECKING:
    from collections.abc import Iterator

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
