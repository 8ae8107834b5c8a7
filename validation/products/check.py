"""Rows of the products: closure of the energy, effective Gurney velocities, work in a progressive detonation."""

from __future__ import annotations

from math import sqrt
from typing import TYPE_CHECKING, Any

from burst_fenicsx.materials.library import load_casing, load_explosive
from burst_fenicsx.materials.products import make_products
from validation.files import reference_beside
from validation.products.energies import energy_given, gurney_velocity, progressive_share
from validation.rows import Row, compare

if TYPE_CHECKING:
    from collections.abc import Mapping

    from burst_fenicsx.materials.products import Products
    from burst_fenicsx.problem import Explosive, ProductModel

__all__ = [
    "EXPLOSIVES",
    "MODELS",
    "NAME",
    "REFERENCE",
    "check_laws",
    "check_progressive",
    "cylinder_gurney",
    "model_of",
]

NAME = "products"
REFERENCE = reference_beside(__file__)
MODELS: tuple[ProductModel, ...] = ("landau", "landau_cj", "jwl")
EXPLOSIVES = ("tnt", "comp_b")


def model_of(explosive: str, model: ProductModel) -> tuple[Products, Explosive]:
    """Products and explosive by name."""
    charge = load_explosive(explosive)
    return make_products(charge, model), charge


def check_laws() -> list[Row]:
    """Rows of the models alone, without a burst."""
    rows = []
    for explosive in EXPLOSIVES:
        for model in MODELS:
            rows += _check_model(explosive, model)
    return rows


def _check_model(explosive: str, model: ProductModel) -> list[Row]:
    allowed, printed = REFERENCE["allowed"], REFERENCE["gurney"]
    products, charge = model_of(explosive, model)
    label = f"{explosive}, {model}"
    given, heat = energy_given(products, charge, model) / 1e9, products.energy / 1e9
    whole = "E0 of the JWL set" if model == "jwl" else "rho Q"
    rows = [compare(NAME, f"{label}: energy given to infinity", given, heat, allowed["closure"], whole, "GJ/m3")]
    references = {printed["volume"]: (0.5 * sum(printed[explosive]), printed["source"])}
    if model != "jwl":
        jwl, _ = model_of(explosive, "jwl")
        earlier = {volume: gurney_velocity(jwl, charge, volume) for volume in printed["earlier"]}
        references |= {volume: (speed, printed["earlier_source"]) for volume, speed in earlier.items()}
    for volume, (speed, source) in sorted(references.items()):
        quantity = f"{label}: effective Gurney velocity at V/V0 = {volume:g}"
        found = gurney_velocity(products, charge, volume)
        rows.append(compare(NAME, quantity, found, speed, allowed["gurney"], source, "m/s"))
    if explosive == REFERENCE["cylinder"]["explosive"]:
        rows += _against_cylinder(label, products, charge)
    return rows


def _against_cylinder(label: str, products: Products, explosive: Explosive) -> list[Row]:
    """Against the cylinder test; only the last speed judges: Gurney's formula takes the gas as even, a late state."""
    rows = []
    measured = cylinder_gurney()
    last = max(volume for volume, _ in measured)
    for volume, speed in measured:
        tolerance = REFERENCE["allowed"]["gurney"] if volume == last else None
        quantity = f"{label}: effective Gurney velocity at V/V0 = {volume:.2f}"
        ours = gurney_velocity(products, explosive, volume)
        rows.append(compare(NAME, quantity, ours, speed, tolerance, REFERENCE["cylinder"]["source"], "m/s"))
    return rows


def cylinder_gurney() -> list[tuple[float, float]]:
    """V/V0 of the products and sqrt(2E) (m/s) at the two displacements of the copper cylinder test.

    The wall's volume stays; sqrt(2E) = v sqrt(M/C + 1/2).
    """
    test = REFERENCE["cylinder"]
    bore, outer = test["bore_radius"], test["bore_radius"] + test["wall"]
    section = outer**2 - bore**2
    casing, charge = load_casing(test["casing"]), load_explosive(test["explosive"])
    ratio = casing.density * section / (charge.density * bore**2)  # M/C
    return [
        (((outer + moved) ** 2 - section) / bore**2, speed * sqrt(ratio + 0.5))
        for moved, speed in zip(test["displacement"], test["wall_speed"], strict=True)
    ]


def check_progressive(model: ProductModel, burst: Mapping[str, Any]) -> list[Row]:
    """Work done and left in the gas of an initiated charge over its heat, against the theory of the model's front.

    Parameters
    ----------
    model : of the burst. burst : the burst's part of summary.json.
    """
    _, charge = model_of("tnt", model)
    share, found = progressive_share(charge, model), burst["products_balance"]
    whole = "E0" if model == "jwl" else "rho Q"
    quantity = f"tnt, {model}: work done and left over {whole}, initiated progressively"
    rows = [compare(NAME, quantity, found, share, REFERENCE["allowed"]["progressive"], "theory of the steady front")]
    if share != 1.0:
        rows.append(compare(NAME, f"{quantity}, against 1", found, 1.0, None, "conservation of energy"))
    return rows
