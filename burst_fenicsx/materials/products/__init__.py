"""Detonation products, one module a model; every module of this folder is known by its `NAMES`.

NAMES, PARAMETERS : words of `BurstSettings.products`, and its columns of the table of explosives, from `CHARGE_OWN`.
make : its `Products` of an explosive.
press : pressure and stiffness of a block's cells into the scratch, through `charge_pressure.mix`; compiled.

Volumes are relative to the unexploded charge, v = V/V0.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

from burst_fenicsx.data import nearest_name
from burst_fenicsx.errors import InputError
from burst_fenicsx.materials import laws

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike

    from burst_fenicsx.problem import Explosive

__all__ = ["Products", "make_products", "number_of"]


class Products(Protocol):
    """What the burst asks of the products of a charge."""

    density: float
    """Initial (kg/m3)."""

    @property
    def energy(self) -> float:
        """What a progressively initiated charge gives in all, per initial volume (J/m3)."""

    @property
    def start_energy(self) -> float:
        """Internal energy that the model integrates, to start with (J/m3 of initial volume); 0 if it does not."""

    @property
    def cj_volume(self) -> float:
        """Relative volume at the Chapman-Jouguet state."""

    @property
    def dilute_exponent(self) -> float:
        """Isentropic exponent of products that have expanded far."""

    @property
    def front_speed(self) -> float:
        """Speed (m/s) of a front that compression burns by itself."""

    @property
    def escape_speed(self) -> float:
        """Speed (m/s) at which products expand into a vacuum from behind a plane front."""

    @property
    def parameters(self) -> tuple[float, ...]:
        """Values of the columns PARAMETERS."""

    def remaining_work(self, volume: ArrayLike, energy: ArrayLike) -> np.ndarray:
        """Work left at the relative volume and the internal energy (J/m3), per initial volume (J/m3)."""


def number_of(model: str) -> int:
    """Number of a model in the kernels.

    Raises
    ------
    InputError
        There is no such model.
    """
    for number, module in enumerate(laws("products")):
        if model in module.NAMES:
            return number
    known = [name for module in laws("products") for name in module.NAMES]
    raise InputError(f"products = '{model}'; {nearest_name(model, known)}")


def make_products(explosive: Explosive, model: str) -> Products:
    """Products of an explosive by the model of a name.

    Raises
    ------
    InputError
        There is no such model, or the explosive has no constants for it.
    """
    products: Products = laws("products")[number_of(model)].make(explosive, model)
    return products
