"""A quarter of a thick-walled elastic tube in plane strain under inner pressure: damped explicit run and static solve.

Both have the same mesh, nodal loads and held nodes. The static equations are those of 2 x 2 x 2 points with the mean
dilatation of each cell (B-bar), assembled by dolfinx and solved by PETSc's conjugate gradients: the run with the same
quadrature must meet them to within its geometric nonlinearity, of the order of pressure over modulus.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from burst_fenicsx import compat

# isort: split
import dolfinx.fem.petsc
import dolfinx.mesh
import ufl
from petsc4py import PETSc

from burst_fenicsx.mechanics.nodal_loads import NodalConstraint
from validation.solid.bodies import SETTINGS, elastic, grid, solver_on

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from burst_fenicsx.problem import Quadrature

__all__ = ["ElasticTube", "QuarterTube", "StaticTube", "elastic_tube", "static_tube"]

_RELAXED = 40.0  # times that a wave takes through the mean radius until the damped tube is at rest
_GAUSS = {"quadrature_degree": 2}  # 2 x 2 x 2 points
_RESIDUAL = 1e-12  # of the conjugate gradients, relative


@dataclass(frozen=True, eq=False)
class StaticTube:
    """Radial displacement of the inner and the outer surface (m) by the static solve."""

    inner_moved: float
    outer_moved: float


@dataclass(frozen=True, eq=False)
class ElasticTube:
    """What the damped run and the static solve gave.

    Attributes
    ----------
    inner_moved, outer_moved : radial displacement of the surfaces (m), one-point cells with hourglass control.
    radius, hoop : of their rings of cells, centres (m) and hoop stresses (Pa).
    static : the same mesh by PETSc.
    difference : largest of a node between the damped run with 2 x 2 x 2 points and the static solve, over the largest
        displacement.
    """

    inner_moved: float
    outer_moved: float
    radius: NDArray[np.float64]
    hoop: NDArray[np.float64]
    static: StaticTube
    difference: float


class QuarterTube:
    """The tube's quadrant, one cell along the axis, held at its planes of symmetry and along the axis."""

    def __init__(self, values: Mapping[str, Any], cells: int, quadrature: Quadrature) -> None:
        inner, outer = values["inner_radius"], values["outer_radius"]
        self.material, self.cells, height = elastic(values), cells, (outer - inner) / cells
        around = cells * round(0.25 * np.pi * (inner + outer) / (outer - inner))

        def carry(points: NDArray[Any]) -> NDArray[Any]:
            radius, azimuth = inner + (outer - inner) * points[:, 0], 0.5 * np.pi * points[:, 1]
            return np.stack([radius * np.cos(azimuth), radius * np.sin(azimuth), height * points[:, 2]], axis=1)

        # Twice the frequency of the breathing ring, about sqrt(E/rho) over the mean radius: critical damping.
        bar_speed = float(np.sqrt(self.material.elastic_modulus / self.material.density))
        self.breathing = 2.0 * bar_speed / (inner + outer)
        settings = replace(SETTINGS, cell_size=height, damping=2.0 * self.breathing, quadrature=quadrature)
        mesh = grid((cells, around, 1), carry)
        self.solver = solver_on(mesh, self.material, settings, external=self._press)
        self.start, near = self.solver.fields.start, 1e-9 * inner
        radius = np.hypot(self.start[:, 0], self.start[:, 1])
        self.inner, self.outer = np.flatnonzero(radius < inner + near), np.flatnonzero(radius > outer - near)
        self._held = [np.flatnonzero(self.start[:, 0] < near), np.flatnonzero(self.start[:, 1] < near)]
        self._held.append(np.arange(len(radius)))
        self.solver.constraints = tuple(NodalConstraint(nodes, np.eye(3)[i]) for i, nodes in enumerate(self._held))
        self.load = self._load(values["pressure"], inner + near)

    def _press(self, _: float, force: NDArray[np.float64]) -> None:
        if hasattr(self, "load"):  # not yet when the solver begins
            force += self.load

    def _load(self, pressure: float, radius: float) -> NDArray[np.float64]:
        """Nodal forces (nodes, 3) in N of the pressure (Pa) on the faces within the radius (m)."""
        own = self.solver.fields.mesh
        faces = dolfinx.mesh.locate_entities_boundary(own.domain, 2, lambda x: np.hypot(x[0], x[1]) < radius)
        tags = dolfinx.mesh.meshtags(own.domain, 2, np.sort(faces), np.ones(len(faces), dtype=np.int32))
        pressed = ufl.Measure("ds", domain=own.domain, subdomain_data=tags, metadata=_GAUSS)(1)
        test = ufl.TestFunction(own.vector_space)
        form = compat.form(-pressure * ufl.inner(ufl.FacetNormal(own.domain), test) * pressed)
        return np.array(dolfinx.fem.assemble_vector(form).array).reshape(-1, 3)

    def rest(self) -> NDArray[np.float64]:
        """Displacements (nodes, 3) in m when damping has brought the pressed tube to rest."""
        while self.solver.time < _RELAXED / self.breathing:
            self.solver.step()
        return self.solver.fields.nodes.position - self.start

    def solve(self) -> NDArray[np.float64]:
        """Displacements (nodes, 3) in m of the static equations of small strain.

        Raises
        ------
        RuntimeError
            The conjugate gradients have not converged.
        """
        own, material = self.solver.fields.mesh, self.material
        shear = 0.5 * material.elastic_modulus / (1.0 + material.poisson_ratio)
        bulk = material.elastic_modulus / (3.0 - 6.0 * material.poisson_ratio)
        space, flat = own.vector_space, compat.cell_space(own.domain)
        trial, test, cell = ufl.TrialFunction(space), ufl.TestFunction(space), ufl.TestFunction(flat)
        dx = ufl.dx(own.domain, metadata=_GAUSS)
        deviators = ufl.inner(ufl.dev(ufl.sym(ufl.grad(trial))), ufl.dev(ufl.sym(ufl.grad(test))))
        distortion = dolfinx.fem.petsc.assemble_matrix(compat.form(2.0 * shear * deviators * dx))
        dilatation = dolfinx.fem.petsc.assemble_matrix(compat.form(ufl.div(trial) * cell * dx))
        for matrix in (distortion, dilatation):
            matrix.assemble()
        # bulk / V (int div u) (int div v) of every cell.
        volume = np.array(dolfinx.fem.assemble_vector(compat.form(cell * dx)).array)
        pressure = dilatation.copy()
        pressure.diagonalScale(L=PETSc.Vec().createWithArray(bulk / volume, comm=PETSc.COMM_SELF))
        stiffness = dilatation.transposeMatMult(pressure)
        stiffness.axpy(1.0, distortion)
        fixed = np.concatenate([3 * nodes + i for i, nodes in enumerate(self._held)])
        stiffness.zeroRowsColumns(fixed.astype(np.int32), diag=2.0 * shear * own.domain.geometry.x.max())
        force = self.load.copy()
        force.reshape(-1)[fixed] = 0.0
        solver = PETSc.KSP().create(PETSc.COMM_SELF)
        solver.setOperators(stiffness)
        solver.setType("cg")
        solver.getPC().setType("icc")
        solver.setTolerances(rtol=_RESIDUAL)
        moved = np.zeros_like(force)
        solver.solve(
            *(PETSc.Vec().createWithArray(array.reshape(-1), comm=PETSc.COMM_SELF) for array in (force, moved))
        )
        if solver.getConvergedReason() <= 0:
            raise RuntimeError(f"PETSc's conjugate gradients stopped after {solver.getIterationNumber()} iterations")
        return moved

    def radial(self, nodes: NDArray[np.integer[Any]], moved: NDArray[np.float64]) -> float:
        """Mean outward displacement (m) of nodes, of displacements (all nodes, 3)."""
        flat = self.start[nodes, :2]
        return float((np.einsum("ij,ij->i", flat, moved[nodes, :2]) / np.hypot(*flat.T)).mean())

    def hoop(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Radii (m) of the rings of cells and the mean hoop stress (Pa) in each."""
        fields = self.solver.fields
        x, y, _ = fields.nodes.position[fields.mesh.dofmap].mean(axis=1).T
        radius, stress = np.hypot(x, y), fields.solid.stress[: len(x)].mean(axis=1)
        hoop = (y * y * stress[:, 0] + x * x * stress[:, 1] - 2.0 * x * y * stress[:, 3]) / radius**2
        order = np.argsort(radius).reshape(self.cells, -1)
        return radius[order].mean(axis=1), hoop[order].mean(axis=1)


def static_tube(values: Mapping[str, Any], cells: int) -> StaticTube:
    """Solve the static equations alone, with `cells` through the wall."""
    tube = QuarterTube(values, cells, "full")
    moved = tube.solve()
    return StaticTube(tube.radial(tube.inner, moved), tube.radial(tube.outer, moved))


def elastic_tube(values: Mapping[str, Any], cells: int) -> ElasticTube:
    """Press the tube from within, with `cells` through the wall: damped runs at both quadratures, static solve."""
    tube, full = QuarterTube(values, cells, "one_point"), QuarterTube(values, cells, "full")
    moved, static = tube.rest(), full.solve()
    return ElasticTube(
        tube.radial(tube.inner, moved),
        tube.radial(tube.outer, moved),
        *tube.hoop(),
        StaticTube(full.radial(full.inner, static), full.radial(full.outer, static)),
        float(np.abs(full.rest() - static).max() / np.abs(static).max()),
    )
