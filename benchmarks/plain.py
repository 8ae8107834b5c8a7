"""What a user of FEniCSx writes without kernels of his own: explicit dynamics with J2 plasticity, in dolfinx and numpy.

The baseline of the comparison, on a box of equal bricks. Strains come from an Expression at the quadrature points,
stresses from numpy, forces from an assembled form. There is no hourglass control, no objective rate of stress, no
viscosity and no contact: strains are small, and the one-point rule leaves the hourglass modes free.
"""

from __future__ import annotations

import inspect
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from mpi4py import MPI

from burst_fenicsx import compat

# isort: split
import basix
import ufl
from dolfinx import fem
from dolfinx.mesh import CellType, create_box

__all__ = ["Material", "PlainBox", "straining_box"]

_COMPILE = {"timeout": 300, "cffi_extra_compile_args": ["-O3", "-march=native"]}
_CFL = 0.5
_SPEED = 120.0  # m/s, of the ends of `straining_box`


@dataclass(frozen=True)
class Material:
    """Von Mises with linear isotropic hardening. Units: kg/m3, Pa."""

    density: float = 7800.0
    elastic_modulus: float = 210e9
    poisson_ratio: float = 0.3
    yield_stress: float = 600e6
    hardening: float = 1e9

    @property
    def shear(self) -> float:
        """Shear modulus (Pa)."""
        return 0.5 * self.elastic_modulus / (1.0 + self.poisson_ratio)

    @property
    def lame(self) -> float:
        """First modulus of Lamé (Pa)."""
        nu = self.poisson_ratio
        return self.elastic_modulus * nu / ((1.0 + nu) * (1.0 - 2.0 * nu))

    @property
    def wave_speed(self) -> float:
        """Speed of longitudinal waves (m/s)."""
        return float(np.sqrt((self.lame + 2.0 * self.shear) / self.density))


class PlainBox:
    """A box of bricks that moves freely.

    Parameters
    ----------
    counts : bricks along x, y and z.
    cell_size : their edge (m).
    points : quadrature points of a brick.
    material : of all of them.

    Attributes
    ----------
    position : (nodes, 3) m, initial. velocity, displacement : (nodes, 3) m/s and m.
    stress : (points, 6) Pa in the order xx, yy, zz, xy, yz, zx. plastic_strain : (points,), equivalent.
    step_size : s. weight : volume of a point (m3). plastic_work : J so far.
    flowing : share of the points that flowed in the last step.
    """

    def __init__(
        self,
        counts: tuple[int, int, int],
        cell_size: float,
        points: Literal[1, 8] = 1,
        material: Material | None = None,
    ) -> None:
        self.material = material or Material()
        corner = [count * cell_size for count in counts]
        self.domain = create_box(MPI.COMM_SELF, [[0.0, 0.0, 0.0], corner], list(counts), CellType.hexahedron)
        self.cells = int(np.prod(counts))
        self.weight = cell_size**3 / points
        self.step_size = _CFL * cell_size / self.material.wave_speed
        space = compat.vector_space(self.domain)
        self._moved, self._force = fem.Function(space), fem.Function(space)
        self._velocity = fem.Function(space)
        tensors = compat.quadrature_space(self.domain, 6) if points == 8 else compat.cell_space(self.domain, 6)
        self._stress = fem.Function(tensors)
        self.stress = self._stress.x.array.reshape(-1, 6)
        self.plastic_strain = np.zeros(len(self.stress))
        self.plastic_work = 0.0
        self.flowing = 0.0
        self.displacement = self._moved.x.array.reshape(-1, 3)
        self.velocity = self._velocity.x.array.reshape(-1, 3)
        self.position = space.tabulate_dof_coordinates()[:, :3]
        self._cells = np.arange(self.cells, dtype=np.int32)
        self._strain, self._form = self._compile(space, degree=1 if points == 1 else 2)
        self.mass = self._lumped_mass(cell_size)

    def _compile(self, space: fem.FunctionSpace, degree: int) -> tuple[Any, Any]:
        """The strain rate as an expression at the points, and the internal force as a form."""
        rate, test = ufl.sym(ufl.grad(self._velocity)), ufl.sym(ufl.grad(ufl.TestFunction(space)))
        # Shear strains twice, so that products with stresses are work.
        rates, tests = (
            ufl.as_vector([e[0, 0], e[1, 1], e[2, 2], 2 * e[0, 1], 2 * e[1, 2], 2 * e[2, 0]]) for e in (rate, test)
        )
        points, _ = basix.make_quadrature(basix.CellType.hexahedron, degree)
        measure = ufl.Measure("dx", domain=self.domain, metadata={"quadrature_degree": degree})
        work = -ufl.inner(self._stress, tests) * measure
        # 0.5 says "jit_params" for what is "jit_options" since.
        name = "jit_options" if "jit_options" in inspect.signature(fem.form).parameters else "jit_params"
        return fem.Expression(rates, points, **{name: _COMPILE}), fem.form(work, **{name: _COMPILE})

    def _lumped_mass(self, cell_size: float) -> np.ndarray:
        """An eighth of every cell's mass for each of its nodes (nodes, 1) in kg."""
        share = self.material.density * cell_size**3 / 8.0
        nodes = compat.cells_dofmap(self._velocity.function_space)
        return share * np.bincount(nodes.ravel(), minlength=len(self.position))[:, None]

    def step(self) -> None:
        """Central differences: velocities by the forces, places and stresses by the velocities."""
        force = self._force.x.array
        force[:] = 0.0
        fem.assemble_vector(force, self._form)
        self.velocity += self.step_size / self.mass * force.reshape(-1, 3)
        self.displacement += self.step_size * self.velocity
        self._advance_stresses(self.step_size * self._rates())

    def _rates(self) -> np.ndarray:
        """Strain rates (points, 6) in 1/s, shear twice."""
        modern = "mesh" in inspect.signature(self._strain.eval).parameters
        rates = self._strain.eval(self.domain, self._cells) if modern else self._strain.eval(self._cells)
        return rates.reshape(-1, 6)

    def _advance_stresses(self, strain: np.ndarray) -> None:
        """Elastic trial and radial return (Simo and Hughes 1998, box 3.1); `strain` is the step's, shear twice."""
        law, stress = self.material, self.stress
        dilatation = law.lame * (strain[:, 0] + strain[:, 1] + strain[:, 2])
        stress[:, :3] += 2.0 * law.shear * strain[:, :3] + dilatation[:, None]
        stress[:, 3:] += law.shear * strain[:, 3:]
        size = von_mises(stress)
        beyond = size - (law.yield_stress + law.hardening * self.plastic_strain)
        plastic = np.flatnonzero(beyond > 0.0)
        self.flowing = len(plastic) / len(stress)
        if not len(plastic):
            return
        slip = beyond[plastic] / (3.0 * law.shear + law.hardening)
        returned, size = stress[plastic], size[plastic]
        mean = (returned[:, 0] + returned[:, 1] + returned[:, 2]) / 3.0
        returned[:, :3] -= mean[:, None]
        returned *= (1.0 - 3.0 * law.shear * slip / size)[:, None]
        returned[:, :3] += mean[:, None]
        stress[plastic] = returned
        self.plastic_strain[plastic] += slip
        self.plastic_work += self.weight * float(np.sum(slip * (size - 3.0 * law.shear * slip)))

    @property
    def kinetic_energy(self) -> float:
        """Kinetic energy (J), of the velocities half a step ago."""
        return 0.5 * float(np.sum(self.mass * self.velocity**2))

    @property
    def elastic_energy(self) -> float:
        """Energy stored elastically (J)."""
        law, stress = self.material, self.stress
        trace = stress[:, 0] + stress[:, 1] + stress[:, 2]
        square = (stress[:, :3] ** 2).sum(axis=1) + 2.0 * (stress[:, 3:] ** 2).sum(axis=1)
        density = ((1.0 + law.poisson_ratio) * square - law.poisson_ratio * trace**2) / (2.0 * law.elastic_modulus)
        return self.weight * float(density.sum())


def von_mises(stress: np.ndarray) -> np.ndarray:
    """Equivalent stress (points,) of stresses (points, 6)."""
    xx, yy, zz, xy, yz, zx = stress.T
    square = 0.5 * ((xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2)
    return np.sqrt(square + 3.0 * (xy * xy + yz * yz + zx * zx))


def straining_box(cells: int, points: Literal[1, 8], cell_size: float = 5e-3) -> PlainBox:
    """A cube of about so many bricks, pulled apart by its speeds until some of it flows.

    The speed along x grows with the square of the place, so one end yields while the other stays elastic.
    """
    count = round(cells ** (1.0 / 3.0))
    box = PlainBox((count, count, count), cell_size, points)
    along = box.position[:, 0] / (count * cell_size)
    box.velocity[:, 0] = _SPEED * along**2
    return box
