"""The detonation products by themselves: energy, effective Gurney velocity, work in a progressive detonation."""

from __future__ import annotations

from typing import TYPE_CHECKING

from burst_fenicsx.materials.library import load_explosive
from burst_fenicsx.materials.products import make_products
from validation.products.energies import Law, energy_given, gurney_velocity, progressive_share
from validation.runs import reference_beside

if TYPE_CHECKING:
    from burst_fenicsx.problem import Explosive, ProductModel
    from validation.rows import Rows
    from validation.runs import Runs

__all__ = ["EXPLOSIVES", "MODELS", "REFERENCE", "check_laws", "model_of", "study"]

REFERENCE = reference_beside(__file__)
MODELS: tuple[ProductModel, ...] = ("landau", "landau_cj", "jwl")
EXPLOSIVES = ("tnt", "comp_b")
SIZE, QUICK_SIZE = "3 mm", "5 mm"


def study(runs: Runs, rows: Rows) -> None:
    """Check the laws, then initiate a charge of TNT with each model, nothing vented."""
    check_laws(rows)
    size = QUICK_SIZE if rows.quick else SIZE
    for model in MODELS:
        changes = {"burst.products": model, "burst.end_time": REFERENCE["end_time"], "burst.leakage.enabled": False}
        _, burst = runs.burst(f"products_{model}", REFERENCE["case"], size, changes)
        share = progressive_share(load_explosive("tnt"), model)
        rows.verify(f"tnt, {model}: work done and left over the heat, initiated at one end", burst["products_balance"],
                    share, REFERENCE["allowed"]["progressive"], "theory of the steady front", "",
                    f"products:{model}")  # fmt: skip


def model_of(explosive: str, model: ProductModel) -> tuple[Law, Explosive]:
    """Products and explosive by name."""
    charge = load_explosive(explosive)
    products = make_products(charge, model)
    assert isinstance(products, Law)
    return products, charge


def check_laws(rows: Rows) -> None:
    """Rows of the models alone, without a burst."""
    allowed, printed = REFERENCE["allowed"], REFERENCE["gurney"]
    for explosive in EXPLOSIVES:
        low, high = printed[explosive]
        for model in MODELS:
            products, charge = model_of(explosive, model)
            subjects = (f"explosive:{explosive}", f"products:{model}")
            given, heat = energy_given(products, charge, model) / 1e9, products.energy / 1e9
            whole = "E0 of the JWL set" if model == "jwl" else "rho Q"
            rows.verify(f"{explosive}, {model}: energy given to infinity", given, heat, allowed["closure"], whole,
                        "GJ/m3", *subjects)  # fmt: skip
            ours = gurney_velocity(products, charge, printed["volume"])
            rows.compare(f"{explosive}, {model}: effective Gurney velocity at V/V0 = 7", ours, 0.5 * (low + high),
                         printed["source"], "m/s", *subjects)  # fmt: skip
