"""Mean mass of fragments: every law against published shells and cylinders, and with the speeds of our own bursts."""

from __future__ import annotations

from typing import TYPE_CHECKING

from transition import BreakUp, BreakUpSettings
from transition.law.mean_mass import FACTORS
from validation.figures import keep_picture
from validation.mean_mass.data import REFERENCE, above_a_cut, fit_shells, measured
from validation.mean_mass.figure import draw
from validation.mean_mass.scatter import LAWS, computed, scatter

if TYPE_CHECKING:
    from validation.mean_mass.data import Casing
    from validation.rows import Rows
    from validation.runs import Runs

__all__ = ["check_laws", "study"]

FILLINGS = {"TNT": "tnt", "Composition B": "comp_b"}
SIZE, QUICK_SIZE = "2 mm", "3.2 mm"
SAME = 1.1  # a stated factor is rounded up by less than this
_DATA = "computed over measured mean mass, all published casings"


def study(runs: Runs, rows: Rows) -> None:
    """Compare the laws in closed form, then with the strain rates of the cylinder's own bursts."""
    casings = measured()
    check_laws(rows, casings)
    by_name = {casing.name: casing for casing in casings}
    means = {}
    for explosive, filling in FILLINGS.items():
        changes = {"round.*.explosive": filling}
        folder, _ = runs.burst(f"mean_mass_{filling}", REFERENCE["case"], QUICK_SIZE if rows.quick else SIZE, changes)
        laws = BreakUp(folder / "burst_snapshot.h5", BreakUpSettings()).laws
        means[explosive] = sum(law.mass for law in laws) / sum(law.n0 for law in laws)
        rows.compare(f"cylinder from the burst, {explosive}: mean mass", 1e3 * means[explosive],
                     1e3 * by_name[f"cylinder, {explosive}"].mean, REFERENCE["sources"]["tp12"]["title"], "g",
                     "burst", f"explosive:{filling}")  # fmt: skip
    _brisance(rows, "cylinder from the bursts", means["Composition B"] / means["TNT"], "burst")
    path = draw(casings, runs.folder / "mean_mass.png")
    if not rows.quick:
        keep_picture(path)


def check_laws(rows: Rows, casings: list[Casing]) -> None:
    """Rows of the laws in closed form: the default for every casing, bias and scatter of each, the factor it states."""
    rms, source = max(fit.rms for fit in fit_shells().values()), REFERENCE["sources"]["ordnance_1944"]["title"]
    rows.bound("rms of ln N about the fitted law, worst table", rms, (0.0, REFERENCE["allowed"]["fit"]), source)
    for casing in casings:
        if casing.name in REFERENCE["shown"]:
            rows.compare(f"mott: mean mass, {casing.name}", 1e3 * computed("mott", casing), 1e3 * casing.mean,
                         REFERENCE["sources"][casing.source]["title"], "g")  # fmt: skip
    for law in LAWS:
        found = scatter(law, casings)
        rows.trend(f"{law}: computed over measured, geometric mean of {found.geometries} geometries (standard "
                   f"deviation: a factor of {found.deviation:.2f})", found.bias, 1.0, _DATA)  # fmt: skip
        rows.bound(f"{law}: the factor that results state holds bias and scatter", found.factor,
                   (FACTORS[law] / SAME, FACTORS[law]), _DATA)  # fmt: skip
        strong, weak = (
            next(casing for casing in casings if casing.name == f"cylinder, {explosive}")
            for explosive in ("Composition B", "TNT")
        )
        _brisance(rows, law, computed(law, strong) / computed(law, weak))


def _brisance(rows: Rows, label: str, ours: float, *subjects: str) -> None:
    """Composition B over TNT in the cylinder, against the ratio of the means of all pieces."""
    charges = {charge["explosive"]: charge["average_grain"] for charge in REFERENCE["cylinder"]["charge"]}
    cut = REFERENCE["cylinder"]["cut_grain"]
    test = above_a_cut(charges["Composition B"], cut) / above_a_cut(charges["TNT"], cut)
    source = "TP-12, Table 1: 12 over 17.5 grains above 1 grain, as means of all pieces"
    rows.compare(f"{label}: mean mass, Composition B over TNT", ours, test, source, "", *subjects)
