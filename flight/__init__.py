"""Flight of fragments through air to the ground, and the hazard they make.

>>> import flight
>>> fragments = flight.Fragments(mass=0.01, position=(0.0, 0.0, 1.0), velocity=(800.0, 0.0, 100.0))
>>> result = flight.fly(fragments, witnesses=[flight.Cylinder(radius=7.62, name="ring")])
>>> print(f"{result.landing['distance'][0]:.0f} m, {result.hits_on('ring')['speed'][0]:.0f} m/s at the ring")
221 m, 692 m/s at the ring
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from fragfield_base.lazy_names import lazy_names

if TYPE_CHECKING:
    from flight import shape
    from flight.arena import ArenaTable
    from flight.drag import Drag
    from flight.errors import FlightWarning, InputError, NotDeterminedError
    from flight.fragments import Fragments
    from flight.hazard.pool import hazard_distance
    from flight.integrate.contact import Contact
    from flight.integrate.fly import fly, range_table
    from flight.integrate.job import Adaptive, Domain, FixedStep, FlightProgress
    from flight.path import DANGER, FlightPath
    from flight.result import FlightResult
    from flight.rows import CONTACTS, HITS, LANDING, OBSTACLE_HITS, Status, Trajectories, to_pandas
    from flight.scene.air import VACUUM, ConstantAir, StandardAtmosphere
    from flight.scene.obstacles import Barricade, Building, Wall
    from flight.scene.ricochet import Ricochet
    from flight.scene.scene import HeightMap
    from flight.scene.targets import Cylinder, Panel, Polygon
    from flight.scene.wind import Wind

__all__ = [
    "CONTACTS",
    "DANGER",
    "HITS",
    "LANDING",
    "OBSTACLE_HITS",
    "VACUUM",
    "Adaptive",
    "ArenaTable",
    "Barricade",
    "Building",
    "ConstantAir",
    "Contact",
    "Cylinder",
    "Domain",
    "Drag",
    "FixedStep",
    "FlightPath",
    "FlightProgress",
    "FlightResult",
    "FlightWarning",
    "Fragments",
    "HeightMap",
    "InputError",
    "NotDeterminedError",
    "Panel",
    "Polygon",
    "Ricochet",
    "StandardAtmosphere",
    "Status",
    "Trajectories",
    "Wall",
    "Wind",
    "fly",
    "hazard_distance",
    "range_table",
    "shape",
    "to_pandas",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "flight.shape": "",
        "flight.arena": "ArenaTable",
        "flight.drag": "Drag",
        "flight.errors": "FlightWarning InputError NotDeterminedError",
        "flight.fragments": "Fragments",
        "flight.hazard.pool": "hazard_distance",
        "flight.integrate.contact": "Contact",
        "flight.integrate.fly": "FlightProgress fly range_table",
        "flight.integrate.job": "Adaptive Domain FixedStep",
        "flight.path": "DANGER FlightPath",
        "flight.result": "FlightResult",
        "flight.rows": "CONTACTS HITS LANDING OBSTACLE_HITS Status Trajectories to_pandas",
        "flight.scene.air": "VACUUM ConstantAir StandardAtmosphere",
        "flight.scene.scene": "HeightMap",
        "flight.scene.obstacles": "Barricade Building Wall",
        "flight.scene.ricochet": "Ricochet",
        "flight.scene.targets": "Cylinder Panel Polygon",
        "flight.scene.wind": "Wind",
    },
)
