"""Kinds of values with units, as the tables of a case use them."""

from __future__ import annotations

from typing import Annotated

from fragfield.case.units.compound import Vector
from fragfield.case.units.quantities import Quantity

__all__ = [
    "Angle",
    "ArealDensity",
    "Density",
    "Direction",
    "Energy",
    "EnergyPerArea",
    "EnergyPerMass",
    "EnergyRange",
    "FrictionAngle",
    "Length",
    "Mass",
    "Offset",
    "Position",
    "PositiveLength",
    "Pressure",
    "Speed",
    "Time",
    "Velocity",
]

Length = Annotated[float, Quantity("m", "155 mm")]
PositiveLength = Annotated[float, Quantity("m", "6 mm", above=0.0)]
Time = Annotated[float, Quantity("s", "120 us", above=0.0)]
Mass = Annotated[float, Quantity("kg", "0.1 g", above=0.0)]
Speed = Annotated[float, Quantity("m/s", "6940 m/s", above=0.0)]
Density = Annotated[float, Quantity("kg/m^3", "1.63 g/cm^3", above=0.0)]
Pressure = Annotated[float, Quantity("Pa", "800 MPa", minimum=0.0)]
Energy = Annotated[float, Quantity("J", "79 J", above=0.0)]
EnergyPerMass = Annotated[float, Quantity("J/kg", "4.52 MJ/kg", above=0.0)]
EnergyPerArea = Annotated[float, Quantity("J/m^2", "14.7e4 J/m^2", above=0.0)]
EnergyRange = Annotated[
    tuple[float, float], Vector(2, Quantity("J/m^2", "1.4 MJ/m^2", above=0.0), '["1.4 MJ/m^2", "1.8 MJ/m^2"]')
]
ArealDensity = Annotated[float, Quantity("1/m^2", "1 / (55.7 m^2)", above=0.0)]
Angle = Annotated[float, Quantity("rad", "5 deg")]
FrictionAngle = Annotated[float, Quantity("rad", "20 deg", minimum=0.0, maximum=1.5)]
Position = Annotated[tuple[float, float, float], Vector(3, Quantity("m", "0 mm"), '["0 mm", "0 mm", "1 m"]')]
Offset = Annotated[tuple[float, float], Vector(2, Quantity("m", "0 mm"), '["0 mm", "5 mm"]')]
Velocity = Annotated[tuple[float, float, float], Vector(3, Quantity("m/s", "0 m/s"), '["5 m/s", "0 m/s", "0 m/s"]')]
Direction = Annotated[tuple[float, float, float], Vector(3, None, "[0, 0, 1]")]
