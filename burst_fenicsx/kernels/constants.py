"""Numbers of the model that are no input: what each bounds, and why it has this value."""

from __future__ import annotations

import math

# Element erosion: volumes over the initial one.

FOLDED_VOLUME = 2.0
"""From here on folded metal without strength is eroded: half of the cell is void."""
NOTHING_LEFT = 0.1
"""Below, metal without strength is eroded: no pressure of a burst compresses it so far."""
CRUSHED = 0.3
"""Below, products are eroded: with gamma 3 they have 37 times their pressure at the charge's volume there; the front is
reflected by a rigid wall to 0.57."""

# Charge on casing.

MOST_CORRECTION = 30.0
"""Force of the spring over the gas's own: beyond, a node suddenly far from a wall that has folded would be shot off."""
ENTRY = 1.5
"""Steps in which a node newly met can have come in: the last one, and half of one besides."""
BENT = 0.1
"""What it may have come in besides, of the distance below: the surface bends under it."""
OFF_EDGE = 0.5
"""Of a face's size or an edge's length: a node farther beyond the rim, or deeper, has left: half a cell is its own."""
SMOOTH = math.cos(math.radians(45.0))
"""Cosine between normals above which faces or edges are one smooth surface: half of a right-angled corner."""

# Contact of surfaces.

EVEN_SHARING = 1.6
"""Smallest sum of the reduced masses of a node's contacts over its own mass: that of two equal grids that meet."""
UNLOADED_TIME = 2e-6
"""In which a depth (s) that was there before contact is taken up by the spring."""

# Cells.

MOST_DAMPED = 1.0
"""Fraction of an hourglass rate that viscosity may take away in one step: beyond, the rate would change its sign."""
MOST_STIFF = 0.25
"""Square of the hourglass springs' frequency times the step: a sixteenth of what is stable, 4."""
FRONT_SOUND = 0.75
"""Sound speed of products at the front over the detonation velocity: gamma / (gamma + 1) with gamma 3."""

# Steps.

STEP_GROWTH = 1.05
"""The step may shrink at once but grows by this factor at most, so that one cell's relief does not jolt the rest."""
BURN_PER_STEP = 0.25
"""No cell burns by more than this fraction in a step, so that coarse cells are resolved too."""
LOCAL_CFL = 0.68
"""Fraction of its stable step that a cell takes with local time stepping. Below sin(pi/4) its fastest oscillation turns
by less than a quarter in its own step and by less than a half in a neighbour's twice as long: no resonance."""
PRODUCTS_HELD = 20.0
"""How long a cell keeps the step in which it burns: so many times what it takes to burn."""
EARLIEST_FRONT = 0.9
"""Where compression burns a cell, its front may come sooner than timed: by the square root of 27/32 (`landau`)."""
CONTACT_FRACTION = 0.7
"""Contact's step, whose square its stiffness goes against, over the first step, or that in which cells burn."""
STEPS_PER_CHOICE = 16
"""Levels are chosen again after so many macro steps ..."""
MIN_FRACTION = 0.9
"""... or where cells have got so thin that the macro step has to be cut below this fraction of what was chosen ..."""
FEWEST_STEPS = 4
"""... but not sooner than after so many."""
AHEAD = 32.0
"""Cells beyond the farthest that a front or a wave can have come, from where on cells are at rest and take no steps:
numerically a front sends ever less of itself ahead, cell by cell. Of hexahedra 24 change no bit, 20 the last ones."""
HIGHEST_LEVEL = 10
"""Cells take steps of down to 2^-10 of the macro step."""
CONTACT_CANDIDATES = 3
"""Macro steps tried where there is contact: that of contact, twice and four times it. Thin products could take longer
ones, but are then strained so far in one that they run away where rounds collide; and little time is saved."""
BELOW_CONTACT = 1
"""Levels by which cells beside contact may lie below it. By two, springs and cells resonate: the paper's round with 5
mm cells has its ledger open by 6 % after 9 us."""
LONGEST_STEP = 1e-6
"""Longest macro step (s): venting and the ledger look at its ends alone."""

# Burn.

FRONT_REACH = 2.0
"""A front is near where it arrives within this many burning times, each of 3/2 cells at D."""
REFLECTION_TIME = 10e-6
"""For about this long (s) after the last cell has burnt out the front is reflected from the casing."""
GREATEST_GROWTH = 16.0
"""Sums of radial displacements, for venting, stay exact up to four times this many initial radii."""

# Times at which the state is looked at.

EROSION_INTERVAL = 2e-6
"""Cells to erode are looked for whenever the time (s) passes a multiple of this."""
CHECK_INTERVAL = 10e-6
"""... and what has passed through, whether a checkpoint is due, of this."""
ASYMPTOTE_GROWTH = 1.35
"""Growth of the charge's radius over which the asymptote of the casing's kinetic energy is taken ..."""
STEADY_ASYMPTOTE = 0.05
"""... and meanwhile may not move by more than this fraction: casings that collide move it, the thin products do not."""

# Energies.

LARGEST_WORK = 0.125
"""Of the largest pressure times all volume: how finely work is rounded. Four times that is several times what the
charges can give."""
MIN_WORK = 1e-3
"""Of the chemical energy: while less work has been done, the error of the balance is taken relative to it."""
MIN_CONTACT_WORK = 10.0
"""The same for contact's error, over `MIN_WORK`. Where a front has just reached the first wall, the work is a
thousandth of the chemical energy, and what contact makes there, on which no result depends, is a tenth of it."""
MIN_WORK_FOR_A_STOP = 0.05
"""Of the largest charge's chemical energy: an error that would be within the tolerance with so much work stops nothing.
In coarse cells the front's first contact with the wall is one impact of a whole row of cells: contact makes or loses up
to a tenth of the work done by then, which is less than 0.3 % of what the charge gives in the end."""
LARGEST_CONTACT_ERROR = 0.01
"""Of the work: what contact may make or lose without a warning."""

# What is refused, and what is read off a burst.

PLANE_SLACK = 0.02
"""Of the cell size: how far a round may lie behind a plane; the outline of the cells bulges over the circle."""

GURNEY_VOLUME = 7.0
"""Relative volume at which sqrt(2 E) is taken as the explosive's Gurney velocity, as in cylinder tests."""
FRONT_CELLS = 4.0
"""Cells over which artificial viscosity spreads a shock."""
LONGEST_FRONT = 1.0 / 3.0
"""Of a pulse's duration: up to which its front may take for the pulse to be resolved."""
LARGEST_PASSED_FRACTION = 0.01
"""Of a casing's mass: how much may have passed through planes or into other rounds before the run stops."""
