"""Rows of the mean mass: every casing by the default law, the scatter of every law, and Composition B over TNT."""

from __future__ import annotations

from typing import TYPE_CHECKING

from transition import BreakUp, BreakUpSettings
from transition.law.mean_mass_data import FACTORS
from validation.mean_mass.data import REFERENCE, above_a_cut, fit_shells, measured, metal_shares
from validation.mean_mass.scatter import LAWS, computed, correlation, scatter
from validation.rows import Row, compare, within

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from validation.mean_mass.data import Casing

__all__ = ["NAME", "REFERENCE", "check_bursts", "check_laws"]

NAME = "mean_mass"
_DEFAULT = BreakUpSettings().mean_mass
_SAME = 1.1  # scatters of two laws within this factor of each other are the same: 14 geometries fix them to 20 %
_DATA = "computed over measured mean mass, all published casings"
_BURST_LAWS = {
    "mott, strain rate v0/a": BreakUpSettings(),
    "mott_1947": BreakUpSettings(mean_mass="mott_1947"),
    "gurney_sarmousakis": BreakUpSettings(mean_mass="gurney_sarmousakis"),
}


def check_laws() -> list[Row]:
    """Rows of the laws in closed form, without a burst."""
    casings = measured()
    rms, source = max(fit.rms for fit in fit_shells().values()), REFERENCE["sources"]["ordnance_1944"]["title"]
    label = "rms of ln N about the fitted law, worst table"
    rows = [within(NAME, label, rms, 0.0, REFERENCE["allowed"]["fit"], source)]
    for name, share in metal_shares().items():
        rows.append(
            Row(NAME, f"mass of the fitted law over that of the metal, {name}", share, None, None, None, None, source)
        )
    for casing in casings:
        ours, source = computed("mott", casing), REFERENCE["sources"][casing.source]["title"]
        rows.append(compare(NAME, f"mott: {casing.name}", 1e3 * ours, 1e3 * casing.mean, None, source, "g"))
    found = {law: scatter(law, casings) for law in LAWS}
    for law, one in found.items():
        trend = correlation(law, casings, "wall")
        rows += [
            compare(NAME, f"{law}: geometric mean of the ratio, {one.geometries} casings", one.bias, 1.0, None, _DATA),
            compare(NAME, f"{law}: geometric standard deviation", one.deviation, 1.0, None, _DATA),
            compare(NAME, f"{law}: worst, {one.worst}", one.worst_ratio, 1.0, None, _DATA),
            Row(NAME, f"{law}: correlation of ln(ratio) with ln(wall)", trend, None, None, None, None, _DATA),
        ]
    assert isinstance(_DEFAULT, str)
    default = found[_DEFAULT]
    for law, one in found.items():
        if law != _DEFAULT:
            share = default.deviation / one.deviation
            rows.append(within(NAME, f"{_DEFAULT}: scatter over that of {law}", share, 0.0, _SAME, _DATA))
    for law, one in found.items():
        label = f"{law}: factor, bias included, within the stated one"
        rows.append(within(NAME, label, one.factor, FACTORS[law] / _SAME, FACTORS[law], _DATA))
    return rows + _brisance({law: _ratio(law, casings) for law in LAWS})


def _ratio(law: str, casings: list[Casing]) -> float:
    by_name = {casing.name: casing for casing in casings}
    strong, weak = by_name["cylinder, Composition B"], by_name["cylinder, TNT"]
    return computed(law, strong) / computed(law, weak)


def _brisance(found: Mapping[str, float]) -> list[Row]:
    """Composition B over TNT in the cylinder, against the ratio of the means of all pieces."""
    charges = {charge["explosive"]: charge["average_grain"] for charge in REFERENCE["cylinder"]["charge"]}
    cut = REFERENCE["cylinder"]["cut_grain"]
    test = above_a_cut(charges["Composition B"], cut) / above_a_cut(charges["TNT"], cut)
    source = "TP-12, Table 1: 12 over 17.5 grains above 1 grain, as means of all pieces"
    return [compare(NAME, f"{law}: Composition B over TNT", ratio, test, None, source) for law, ratio in found.items()]


def check_bursts(folders: Mapping[str, Path]) -> list[Row]:
    """Rows of the cylinder from its bursts; `folders` are the run directories by explosive, TNT and Composition B."""
    by_name = {casing.name: casing for casing in measured()}
    rows, means = [], {}
    for explosive, folder in folders.items():
        casing = by_name[f"cylinder, {explosive}"]
        for law, settings in _BURST_LAWS.items():
            mean = _mean(folder, settings)
            means[law, explosive] = mean
            rows.append(compare(NAME, f"burst, {explosive}, {law}", 1e3 * mean, 1e3 * casing.mean, None,
                                REFERENCE["sources"]["tp12"]["title"], "g"))  # fmt: skip
    ratio = {law: means[law, "Composition B"] / means[law, "TNT"] for law in _BURST_LAWS}
    return rows + _brisance({f"burst, {law}": value for law, value in ratio.items()})


def _mean(folder: Path, settings: BreakUpSettings) -> float:
    """Mean mass (kg) of all pieces of a burst casing."""
    laws = BreakUp(folder / "burst_snapshot.h5", settings).laws
    return sum(law.mass for law in laws) / sum(law.n0 for law in laws)
