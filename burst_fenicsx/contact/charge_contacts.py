"""Contacts of charges on their casings, on slide surfaces and on slide lines: their state, energies and counts."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.kernels.contact.slide_law import SlideLaw
from burst_fenicsx.kernels.vectors.exact import quantise

if TYPE_CHECKING:
    from burst_fenicsx.kernels.axisymmetric.line_points import LineContacts
    from burst_fenicsx.kernels.contact.sliding import SlideContacts
    from burst_fenicsx.mechanics.fields import BurstFields
    from burst_fenicsx.problem import ContactSettings

__all__ = ["CONTACT_STATE", "ChargeContacts", "slide_law"]

CONTACT_STATE = ("face", "point", "bonded", "off", "stiffness", "slip", "tally", "load")
"""Arrays from which contacts go on."""


def slide_law(settings: ContactSettings, max_squared_frequency: float, step: float) -> SlideLaw:
    """The law in a step (s), with springs of at most that squared frequency (1/s2)."""
    friction = math.tan(math.radians(settings.friction_angle))
    return SlideLaw(max_squared_frequency, step, settings.tensile_strength, settings.cohesion, friction)


class ChargeContacts:
    """State and sums of the contacts between the charges and what encloses them.

    Parameters
    ----------
    fields : this rank's fields.
    nodes : (k,) int32, this rank's nodes that may get a force.
    own : (contacts,) int32, those that this rank computes.
    cell : (faces,) number in the whole mesh of the cell that each face, or edge, belongs to.

    Attributes
    ----------
    contacts : the kernels' arrays.
    """

    contacts: SlideContacts | LineContacts

    def __init__(self, fields: BurstFields, nodes: np.ndarray, own: np.ndarray, cell: np.ndarray) -> None:
        self._fields = fields
        self.nodes = nodes
        self._own = own
        self._cell = cell

    def leave_eroded(self, eroded: np.ndarray) -> None:
        """Free for good the charge's nodes that lie on faces of `eroded` cells (cells of the whole mesh,) now.

        Eroded metal holds no products back: those kept on its nodes are drawn out by them until their cells fold.
        """
        self.contacts.off[self._own[eroded[self._cell[self.contacts.face[self._own]]]]] = 1

    @property
    def energies(self) -> np.ndarray:
        """Spring energy now and friction in the last step (J), exact, on this rank's contacts."""
        tally = self.contacts.tally[self._own, :2]
        total: np.ndarray = quantise(tally, self._fields.grid.rounding).sum(axis=0)
        return total

    @property
    def deepest(self) -> float:
        """Largest penetration in the last step (m) on this rank."""
        return float(self.contacts.tally[self._own, 2].max(initial=0.0))

    def counts(self) -> np.ndarray:
        """Contacts of this rank that are bonded, that touch without a bond, and that have left their surface."""
        contacts, own = self.contacts, self._own
        off = contacts.off[own]
        bonded, touching = (contacts.bonded[own] != 0) & (off == 0), contacts.stiffness[own] > 0.0
        return np.array([bonded.sum(), (touching & ~bonded).sum(), (off == 1).sum()], dtype=float)

    def look_around(self) -> None:
        """Take up what the contacts lie on, where a checkpoint has put them; collective."""
