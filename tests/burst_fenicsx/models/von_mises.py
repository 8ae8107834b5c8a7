"""Von Mises plasticity with linear isotropic hardening: k = k0 + H e, e the equivalent plastic shear strain."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from burst_fenicsx.kernels.cells.layout import SOLID_OWN
from burst_fenicsx.kernels.lanes import lane_function
from burst_fenicsx.kernels.vectors.tensors import symmetric_square
from burst_fenicsx.problem import CasingMaterial


@dataclass(frozen=True, kw_only=True)
class HardeningMaterial(CasingMaterial):
    """A material whose shear strength grows by `hardening` (Pa) times the plastic strain."""

    hardening: float


MATERIAL = HardeningMaterial
PARAMETERS = ("shear_strength", "hardening")


def constants(material):
    return material.shear_strength, material.hardening


def without_strength(parameters, shear_strain, volume_strain, scale):
    return np.zeros(len(scale), dtype=bool)


@lane_function
def strengths(parameters, shear_strain, volume_strain, scale):
    return parameters[SOLID_OWN] + parameters[SOLID_OWN + 1] * shear_strain, np.inf


@lane_function
def is_elastic(stress, tau, sigma):
    xx, yy, zz, xy, yz, zx = stress
    mean = (xx + yy + zz) / 3.0
    return symmetric_square((xx - mean, yy - mean, zz - mean, xy, yz, zx)) <= tau * tau


@lane_function
def return_stress(stress, tau, sigma, modulus, poisson):
    xx, yy, zz, xy, yz, zx = stress
    mean = (xx + yy + zz) / 3.0
    size = np.sqrt(symmetric_square((xx - mean, yy - mean, zz - mean, xy, yz, zx)))
    kept = tau / size if size > tau else 1.0
    returned = (
        mean + kept * (xx - mean), mean + kept * (yy - mean), mean + kept * (zz - mean),
        kept * xy, kept * yz, kept * zx,
    )  # fmt: skip
    strain = (1.0 - kept) * size * (1.0 + poisson) / modulus  # over sqrt(2): of the deviator's norm
    return returned, np.sqrt(2.0) * strain, 0.0, 2.0 * kept * size * strain
