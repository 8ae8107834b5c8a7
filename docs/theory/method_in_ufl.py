"""The method in UFL: a tube of steel thrown outward, by plain dolfinx forms and by the solver, compared.

Central differences, lumped mass, one-point hexahedra, the rate of Hughes and Winget, Tresca's plasticity with tension
cut-off and softening. Run it: `python docs/theory/method_in_ufl.py`.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from mpi4py import MPI

from burst_fenicsx import compat

# isort: split
import ufl
from dolfinx import fem

from burst_fenicsx.materials.library import load_casing
from burst_fenicsx.meshing import HexahedralMesh
from burst_fenicsx.problem import BurstSettings, Hourglass, Leakage, TimeStep, Viscosity
from validation.solid.bodies import grid, solver_on

STEEL = replace(load_casing("steel_paper"), shear_softening_strain=0.4)  # shear is nearer its limit in some cells only
STEP, STEPS = 2.5e-7, 60  # s


def tube() -> HexahedralMesh:
    """A tube of 288 cells, radii 20 and 26 mm, 30 mm high; the first and the last of its sectors share their nodes."""

    def carry(unit: np.ndarray) -> np.ndarray:
        radius, angle = 0.02 + 0.006 * unit[:, 0], 2.0 * np.pi * unit[:, 1]
        return np.stack([radius * np.cos(angle), radius * np.sin(angle), 0.03 * unit[:, 2]], axis=1).round(12)

    mesh = grid((2, 24, 6), carry)
    nodes, number = np.unique(mesh.nodes + 0.0, axis=0, return_inverse=True)
    return replace(mesh, nodes=nodes, cells=number.reshape(-1)[mesh.cells])


def thrown(position: np.ndarray) -> np.ndarray:
    """Velocities (nodes, 3) at the start (m/s): outward, faster at one end and along x."""
    x, y, z = position.T
    return (150.0 + 2000.0 * z + 1e5 * (x**2 - y**2))[:, None] * np.stack([x, y, 0.0 * z], axis=1) / 0.02


def elastic_trial(stress: Any, rate: Any) -> Any:
    """Stress turned by the step's rotation, plus Hooke's increment; `rate` is the velocity gradient (1/s)."""
    one, modulus, poisson = ufl.Identity(3), STEEL.elastic_modulus, STEEL.poisson_ratio
    shear, lame = modulus / (2 + 2 * poisson), modulus * poisson / ((1 + poisson) * (1 - 2 * poisson))
    spin, strain = STEP / 2 * (rate - rate.T), STEP / 2 * (rate + rate.T)
    turn = ufl.inv(one - spin / 2) * (one + spin / 2)
    return turn * stress * turn.T + lame * ufl.tr(strain) * one + 2 * shear * strain


def principal(stress: Any) -> tuple[Any, ...]:
    """Principal stresses (Pa), descending; if the first stands alone; its n n^T, and p p^T - q q^T of the others."""
    one, pick = ufl.Identity(3), ufl.conditional
    mean, size = ufl.tr(stress) / 3, ufl.sqrt(ufl.inner(ufl.dev(stress), ufl.dev(stress)) / 6) + 1e-30
    shape = ufl.dev(stress) / size
    cosine = ufl.det(shape) / 2
    first = ufl.ge(cosine, 0)
    far = pick(first, 2, -2) * ufl.cos(ufl.acos(ufl.min_value(abs(cosine), 1)) / 3)
    alone = ufl.cofac(shape - far * one) / ufl.tr(ufl.cofac(shape - far * one))
    plane = shape + far / 2 * one - 3 * far / 2 * alone
    gap = ufl.sqrt(ufl.inner(plane, plane) / 2)
    s, upper, lower = mean + size * far, mean + size * (gap - far / 2), mean - size * (gap + far / 2)
    return pick(first, s, upper), pick(first, upper, lower), pick(first, lower, s), first, alone, plane / (gap + 1e-30)


def returned(s1: Any, s2: Any, s3: Any, tau: Any, sigma: Any) -> tuple[Any, Any, Any]:
    """Closest admissible principal stresses (Pa), region by region as in casing.md."""
    pick, poisson = ufl.conditional, STEEL.poisson_ratio
    mean, excess = (s1 + s2 + s3) / 3, ufl.max_value((s1 - s3) / 2 - tau, 0)
    top, bottom = ufl.gt(s2, s1 - excess), ufl.lt(s2, s3 + excess)
    a1 = pick(top, mean + 2 * tau / 3, pick(bottom, mean + 4 * tau / 3, s1 - excess))
    a3 = pick(top, mean - 4 * tau / 3, pick(bottom, mean - 2 * tau / 3, s3 + excess))
    a2 = pick(top, a1, pick(bottom, a3, s2))
    b2, b3 = (s - poisson / (1 - poisson) * (s1 - sigma) for s in (s2, s3))
    edge = ufl.gt(b2, sigma)
    b3 = ufl.min_value(pick(edge, s3 - poisson * (s1 + s2 - 2 * sigma), b3), sigma)
    c3 = sigma - 2 * tau
    c2 = ufl.min_value(ufl.max_value(s2 - poisson * (s1 + s3 - sigma - c3), c3), sigma)
    prism, cut = ufl.le(a1, sigma), ufl.le(sigma - b3, 2 * tau)
    r2, r3 = pick(cut, pick(edge, sigma, b2), c2), pick(cut, b3, c3)
    return pick(prism, a1, sigma), pick(prism, a2, r2), pick(prism, a3, r3)


def tresca(trial: Any, shear_strain: Any, volume_strain: Any) -> tuple[Any, Any, Any]:
    """Stress returned to the softened strengths, and the plastic strains with what the elastic law leaves over."""
    modulus, poisson, pick = STEEL.elastic_modulus, STEEL.poisson_ratio, ufl.conditional
    of_limits = shear_strain / STEEL.shear_softening_strain, volume_strain / STEEL.tensile_softening_strain
    left = ufl.max_value(0, 1 - ufl.max_value(*of_limits))
    tau, sigma = STEEL.shear_strength * left, STEEL.tensile_strength * left
    s1, s2, s3, first, alone, others = principal(trial)
    e1, e2, e3 = (r - s for r, s in zip(returned(s1, s2, s3, tau, sigma), (s1, s2, s3), strict=True))
    e, upper, lower = pick(first, e1, e3), pick(first, e2, e1), pick(first, e3, e2)
    middle = (upper + lower) / 2
    change = (e - middle) * alone + (upper - lower) / 2 * others + middle * ufl.Identity(3)
    plastic = -((1 + poisson) * change - poisson * ufl.tr(change) * ufl.Identity(3)) / modulus
    deviator = ufl.dev(plastic)
    return trial + change, shear_strain + ufl.sqrt(ufl.inner(deviator, deviator)), volume_strain + ufl.tr(plastic)


def symmetric(f: Any) -> Any:
    """The tensor of the components xx, yy, zz, xy, yz, zx."""
    return ufl.as_matrix([[f[0], f[3], f[5]], [f[3], f[1], f[4]], [f[5], f[4], f[2]]])


def six(tensor: Any) -> list[Any]:
    """These components of a tensor."""
    return [tensor[index] for index in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))]


def by_forms(mesh: HexahedralMesh) -> tuple[np.ndarray, np.ndarray]:
    """Positions (m) and velocities (m/s) of the mesh's nodes after all steps, by dolfinx forms."""
    cells = mesh.cells
    domain = compat.create_hexahedral_mesh(MPI.COMM_SELF, cells, mesh.nodes, np.zeros(len(cells), dtype=np.int32))
    centre, points = (ufl.dx(domain, metadata={"quadrature_degree": degree}) for degree in (1, 2))  # 1 and 2x2x2 points
    spaces = compat.vector_space(domain), *(compat.cell_space(domain, size) for size in (9, 6, 8, 1))
    velocity, rate, trial, state, density = (fem.Function(space) for space in spaces)
    of_nodes, of_rate, of_trial, of_state, of_cells = (ufl.TestFunction(space) for space in spaces)

    def assembled(values: Any, test: Any, measure: Any) -> Any:
        form = compat.form(ufl.inner(ufl.as_vector(values) if isinstance(values, list) else values, test) * measure)
        return lambda: np.array(fem.assemble_vector(form).array)

    # Of cells: a sum over their points divided by their volume there.
    volume, volume_at_centre = assembled(1.0, of_cells, points), assembled(1.0, of_cells, centre)
    stress, gradient = symmetric(state), ufl.as_matrix([[rate[3 * i + j] for j in range(3)] for i in range(3)])
    mean_rate = assembled([ufl.grad(velocity)[index] for index in np.ndindex(3, 3)], of_rate, points)
    next_trial = assembled(six(elastic_trial(stress, gradient)), of_trial, centre)
    new, shear_strain, volume_strain = tresca(symmetric(trial), state[6], state[7])
    next_state = assembled([*six(new), shear_strain, volume_strain], of_state, centre)
    force = assembled(-stress, ufl.grad(of_nodes), points)
    # One point gives every node an eighth of its cells' mass.
    density.x.array[:] = STEEL.density * volume() / volume_at_centre()
    mass = assembled([density, density, density], of_nodes, centre)().reshape(-1, 3)

    x, v, last_step = domain.geometry.x, velocity.x.array.reshape(-1, 3), 0.0
    v[:] = thrown(x)
    for _ in range(STEPS):
        v += (last_step + STEP) / 2 * force().reshape(-1, 3) / mass
        x += STEP / 2 * v  # to the middle of the step, where the velocity gradient is taken
        rate.x.array[:] = mean_rate() / np.repeat(volume(), 9)
        x += STEP / 2 * v
        trial.x.array[:] = next_trial() / np.repeat(volume_at_centre(), 6)
        state.x.array[:] = next_state() / np.repeat(volume_at_centre(), 8)
        last_step = STEP
    given = np.argsort(domain.geometry.input_global_indices)
    return x[given], v[given]


def by_solver(mesh: HexahedralMesh) -> tuple[np.ndarray, np.ndarray]:
    """The same by the solver, without hourglass control and viscosity, which no form states."""
    settings = BurstSettings(
        cell_size=5e-3,
        time_step=TimeStep(fixed=STEP),
        viscosity=Viscosity(linear=0.0, quadratic=0.0),
        hourglass=Hourglass(charge_viscous=0.0, casing_viscous=0.0, casing_stiffness=0.0),
        leakage=Leakage(enabled=False),
    )
    solver = solver_on(mesh, STEEL, settings)
    nodes, given = solver.fields.nodes, np.argsort(solver.fields.mesh.node)
    nodes.velocity[:] = thrown(nodes.position)
    for _ in range(STEPS):
        solver.step()
    return nodes.position[given], nodes.velocity[given]


def differences() -> tuple[float, float, float]:
    """Largest displacement (m); largest differences of positions and velocities over the largest of each."""
    mesh = tube()
    (position, velocity), (x, v) = by_forms(mesh), by_solver(mesh)
    moved, speed = (float(np.abs(values).max()) for values in (x - mesh.nodes, v))
    return moved, float(np.abs(position - x).max()) / moved, float(np.abs(velocity - v).max()) / speed


if __name__ == "__main__":
    print("displacement {:.2e} m; difference of positions {:.1e}, of velocities {:.1e}".format(*differences()))
