"""A burst of one's own in plain FEniCSx, broken up and flown: an expanding steel ring in its meridian.

The ring is driven by gas that fills it at 3 GPa and expands with r^-6; it stores energy in its volume, does work
against a constant hoop stress, and has some viscosity. The live velocity function goes to `transition.snapshot_of`.

Run it: `python examples/own_fenicsx.py [FOLDER]`.
"""

from __future__ import annotations

import sys
from pathlib import Path

import h5py  # noqa: F401
import numpy as np
from mpi4py import MPI

# isort: split
# PyPI's wheel of dolfinx needs both to be loaded before it.
import ufl
from dolfinx import fem, mesh
from dolfinx.fem.petsc import assemble_vector
from matplotlib.figure import Figure

import flight
from transition import BreakUpSettings, CasingInMesh, break_up, snapshot_of

INNER, OUTER, LENGTH = 0.040, 0.050, 0.080  # m
DENSITY, BULK, YIELD, VISCOSITY = 7850.0, 160e9, 0.8e9, 3e4  # kg/m3, Pa, Pa, Pa s
PRESSURE, STEP, END = 3e9, 1e-7, 50e-6  # Pa, s, s


def burst() -> tuple[fem.Function, fem.Function, list[tuple[float, float]]]:
    """Velocity and displacement at the end, and the mean speed over time."""
    corners = [[INNER, 0.0], [OUTER, LENGTH]]
    domain = mesh.create_rectangle(MPI.COMM_WORLD, corners, [3, 24], mesh.CellType.quadrilateral)
    new = hasattr(fem, "functionspace")  # dolfinx 0.7 and later
    space = (
        fem.functionspace(domain, ("Lagrange", 1, (2,))) if new else fem.VectorFunctionSpace(domain, ("Lagrange", 1))
    )
    u, v, test = fem.Function(space), fem.Function(space), ufl.TestFunction(space)
    pressure = fem.Constant(domain, 0.0)

    inside = mesh.locate_entities_boundary(domain, 1, lambda x: np.isclose(x[0], INNER))
    tags = mesh.meshtags(domain, 1, inside, np.full(len(inside), 1, dtype=np.int32))
    r = ufl.SpatialCoordinate(domain)[0]
    gradient = ufl.Identity(2) + ufl.grad(u)
    hoop = 1.0 + u[0] / r
    volume = ufl.det(gradient) * hoop
    energy = 0.5 * BULK * (volume - 1.0) ** 2 + YIELD * ufl.ln(hoop)
    flow = VISCOSITY * ufl.inner(ufl.sym(ufl.grad(v)), ufl.grad(test)) * r * ufl.dx
    push = pressure * (r + u[0]) * (1.0 + ufl.grad(u)[1, 1]) * test[0] * ufl.ds(domain, subdomain_data=tags)(1)
    force = fem.form(2.0 * ufl.pi * (push - flow - ufl.derivative(energy * r * ufl.dx, u, test)))
    one = fem.Constant(domain, np.ones(2))
    mass = assemble_vector(fem.form(2.0 * ufl.pi * DENSITY * r * ufl.dot(one, test) * ufl.dx)).array

    radius = space.tabulate_dof_coordinates()[:, 0]
    at_inside = np.isclose(radius, INNER)
    history = []
    for number in range(round(END / STEP)):
        displacement = u.x.array.reshape(-1, 2)
        pressure.value = PRESSURE * (1.0 + displacement[at_inside, 0].mean() / INNER) ** -6.0
        v.x.array[:] += STEP * assemble_vector(force).array / mass
        u.x.array[:] += STEP * v.x.array
        history.append(((number + 1) * STEP, float(v.x.array.reshape(-1, 2)[:, 0].mean())))
    return v, u, history


def main(folder: Path) -> Path:
    """Burst, break up, fly; the picture's path."""
    folder.mkdir(parents=True, exist_ok=True)
    velocity, displacement, history = burst()
    print(f"mean speed after {1e6 * history[-1][0]:.0f} us: {history[-1][1]:.0f} m/s")

    ring = CasingInMesh(DENSITY, LENGTH, position=(0.0, 0.0, 1.0), name="ring")
    snapshot = snapshot_of(velocity, ring, displacement=displacement, time=history[-1][0])
    events = [break_up(snapshot, BreakUpSettings(), seed=1, realisation=k).fragments for k in range(20)]
    print(f"{len(events[0])} fragments, {events[0].mass.sum():.2f} kg")
    expected = flight.hazard_distance(events, flight.hazard.Criteria(), by="all")
    print(f"hazard distance: {expected.distance:.0f} m")

    landed = flight.fly(events[0]).landing
    figure = Figure(figsize=(7.4, 3.4), layout="constrained")
    left, right = figure.subplots(1, 2)
    left.plot(*np.array(history).T * [[1e6], [1.0]], color="#16365c")
    left.set(xlabel="Time (us)", ylabel="Mean speed (m/s)")
    right.plot(*landed["position"][:, :2].T, ".", color="#16365c", markersize=2)
    right.set(xlabel="x (m)", ylabel="y (m)", aspect="equal", title="Landing, one event")
    picture = folder / "own_fenicsx.png"
    figure.savefig(picture, dpi=150)
    return picture


if __name__ == "__main__":
    print("picture:", main(Path(sys.argv[1] if len(sys.argv) > 1 else "runs/examples/own_fenicsx")))
