"""A plane section across the rounds of a stack: a disc of charge in a ring of casing each, in plane strain.

All cells of a round's section ignite together, after the time that its detonation front takes to the section: no axial
flow. The kernels are those of the axisymmetric burst with the weight one in the place of 2 pi r; contact of casings and
planes is that of three dimensions, with edges drawn out along the axis. Masses, forces and energies are per metre.

In this package a node has the coordinates (u, 0, v): u and v across the rounds, see `PlaneSection`.
"""
