"""Contacts of charges on their casings, in three dimensions and in the meridian: their state, energies and counts."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.contact.nodes import ContactPairs
from burst_fenicsx.kernels.contact.law import Law
from burst_fenicsx.kernels.contact.pairs import no_pairs
from burst_fenicsx.kernels.contact.sliding import Attached, Bonds
from burst_fenicsx.kernels.vectors.exact import rounding_constant
from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from burst_fenicsx.contact.nodes import ContactNodes
    from burst_fenicsx.kernels.contact.facets import Surface
    from burst_fenicsx.mechanics.fields import BurstFields
    from burst_fenicsx.problem import ContactSettings

PAIR_STATE = ("facet", "point", "normal", "gap", "stiffness", "slip", "energies")
BOND_STATE = ("bonded", "off")
"""Arrays from which pairs and contacts of charges go on."""
_MOST_CELLS = 2.0**6
_LARGEST_PRESSURE = 2.0**40  # Pa; bounds how finely sums over the cells of a node are rounded
_ROUNDINGS = rounding_constant(_MOST_CELLS), rounding_constant(_LARGEST_PRESSURE)


class ChargeContacts(ContactPairs):
    """A contact for each smooth group of facets in which a node of a charge lies, of this rank's own nodes.

    Parameters
    ----------
    fields : this rank's fields.
    nodes : contact's rows.
    settings : strength and friction of unreacted explosive on the casing.
    surface : the facets, with the `cell` of the whole mesh that each belongs to.
    beside : (facets, corners) rows of the charge's nodes at each facet, -1 where none lies.
    group : (contacts,) int32 of own nodes. row, cells, strength : see `Bonds`.

    Attributes
    ----------
    bonds, surface, attached : the kernels' arrays.
    groups, around : (k,) int32, groups and facets around the contacts.
    """

    def __init__(
        self,
        fields: BurstFields,
        nodes: ContactNodes,
        settings: ContactSettings,
        surface: Surface,
        cell: np.ndarray,
        beside: np.ndarray,
        group: np.ndarray,
        row: np.ndarray,
        cells: np.ndarray,
        strength: np.ndarray,
    ) -> None:
        count, corners = len(group), surface.facets.shape[1]
        super().__init__(fields, nodes, no_pairs(row, corners), surface.facets)
        self.settings, self.surface, self._cell = settings, surface, cell
        of_row = np.bincount(row, minlength=1)
        self.bonds: Bonds = Bonds(
            group=group,
            of_node=of_row[row].astype(float),
            cells=cells,
            strength=strength,
            beside=beside,
            area=np.zeros((len(beside), 3)),
            bonded=np.ones(count, dtype=np.int8),
            off=np.zeros(count, dtype=np.int8),
        )
        facet = surface.member[surface.first[group]]
        at = np.argmax(surface.corner[facet] == group[:, None], axis=1)
        self.pairs.facet[:] = facet
        self.pairs.point[:, 0] = np.where((at == 0) | (at == 3), -1.0, 1.0)
        self.pairs.point[:, 1] = np.where(at < 2, -1.0, 1.0) if corners == 4 else 0.0
        self.groups = np.arange(len(surface.first) - 1, dtype=np.int32)
        self.around = np.arange(len(beside), dtype=np.int32)
        self.attached = self._around(beside)

    def _around(self, beside: np.ndarray) -> Attached:
        """The charges' cells of this rank around the nodes beside the surface."""
        mesh, nodes = self._fields.mesh, self._nodes
        charge = np.flatnonzero(mesh.part == Part.CHARGE)
        at_surface = np.zeros(len(mesh.node), dtype=bool)
        local = nodes.rows.local[np.unique(beside[beside >= 0])]
        at_surface[local[local >= 0]] = True
        which, corner = np.nonzero(at_surface[mesh.dofmap[charge]])
        row = nodes.rows_of(mesh.node[mesh.dofmap[charge[which], corner]])
        order = np.argsort(row, kind="stable")
        rows, first = np.unique(row[order], return_index=True)
        in_one_order = beside.shape[1] == 2  # a meridian, of one rank
        return Attached(
            row=rows,
            first=np.append(first, len(row)).astype(np.int32),
            cell=charge[which[order]].astype(np.int32),
            slot=self._fields.blocks.slot_of_cell,
            roundings=(0.0, 0.0) if in_one_order else _ROUNDINGS,
            total=np.zeros((len(nodes.rows.mass), 3)),
        )

    def law(self, max_squared_frequency: float, step: float) -> Law:
        """The law in a step (s), with springs of at most that squared frequency (1/s2)."""
        settings = self.settings
        friction = math.tan(math.radians(settings.friction_angle))
        return Law(max_squared_frequency, step, friction, settings.tensile_strength, settings.cohesion)

    def leave_eroded(self, eroded: np.ndarray) -> None:
        """Free for good the charge's nodes that lie on faces of `eroded` cells (cells of the whole mesh,) now.

        Eroded metal holds no products back: those kept on its nodes are drawn out by them until their cells fold.
        """
        self.bonds.off[eroded[self._cell[self.pairs.facet]]] = 1

    def counts(self) -> np.ndarray:
        """Contacts of this rank that are bonded, that touch without a bond, and that have left their surface."""
        off = self.bonds.off
        bonded, touching = (self.bonds.bonded != 0) & (off == 0), self.pairs.stiffness > 0.0
        return np.array([bonded.sum(), (touching & ~bonded).sum(), (off == 1).sum()], dtype=float)
