"""What moves the two ratios, and by how much: leakage, gap, friction, softening and cell size, one at a time.

The pair stands as one round before a plane of symmetry. Where the varied parameter belongs to the round, the single
twin is computed with it too; gap and friction between casings do not touch the single round. Two rounds that move as
mirror images never slide on each other, so friction between casings can act only where one folds on itself; that of
the charge on its casing is varied beside it.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from validation.ensembles import ring_ensemble_of_run
from validation.paper_3_2.check import NAME, REFERENCE
from validation.paper_3_2.ratios import Estimate, number_ratio, sector, speed_ratio
from validation.rows import markdown_table
from validation.runs import STOPPED, StudyError, summary_of

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from validation.ensembles import RingEnsemble
    from validation.runs import Runs

__all__ = ["BASE_SIZE", "HALF_WIDTHS", "VARIATIONS", "Outcome", "Variation", "compute", "table"]

BASE_SIZE = "6 mm"
HALF_WIDTHS = (10.0, 25.0)
GAP = 0.0217  # m


@dataclass(frozen=True)
class Variation:
    """One parameter changed.

    Attributes
    ----------
    name : str
        Of its runs.
    words : str
        What is changed, to which value.
    changes : dict
        As `validation.runs.changed_case` takes them.
    size : str
        Cell size.
    of_the_round : bool
        Whether the single round changes with it.
    """

    name: str
    words: str
    changes: dict[str, Any] = field(default_factory=dict)
    size: str = BASE_SIZE
    of_the_round: bool = True


def _softening(strain: float) -> dict[str, Any]:
    kinds = ("shear_softening_strain", "tensile_softening_strain")
    return {f"round.*.casing.{kind}": strain for kind in kinds}


def _farther(by: float) -> Callable[[str], str]:
    """Move the round away from the plane x = 0 by half of what the gap grows (m)."""
    return lambda old: f"{float(old.split()[0]) + 0.5 * by!r} m"


VARIATIONS = (
    Variation("base", "base: leakage radius 1.75, gap 21.7 mm, friction 20 degrees, softening limits 0.5"),
    Variation("leakage_1_6", "leakage radius 1.6", {"burst.leakage.radius_ratio": 1.6}),
    Variation("leakage_2_1", "leakage radius 2.1", {"burst.leakage.radius_ratio": 2.1}),
    Variation("gap_half", "gap 10.85 mm", {"round.0.position.0": _farther(-0.5 * GAP)}, of_the_round=False),
    Variation("gap_double", "gap 43.4 mm", {"round.0.position.0": _farther(GAP)}, of_the_round=False),
    Variation(
        "friction_0", "friction of casings 0 degrees", {"burst.contact.surface_friction_angle": "0 deg"},
        of_the_round=False,
    ),
    Variation(
        "friction_40", "friction of casings 40 degrees", {"burst.contact.surface_friction_angle": "40 deg"},
        of_the_round=False,
    ),
    Variation(
        "charge_friction_0", "friction of charge on casing 0 degrees", {"burst.contact.friction_angle": "0 deg"}
    ),
    Variation(
        "charge_friction_40", "friction of charge on casing 40 degrees", {"burst.contact.friction_angle": "40 deg"}
    ),
    Variation("softening_0_25", "softening limits 0.25", _softening(0.25)),
    Variation("softening_1_0", "softening limits 1.0", _softening(1.0)),
    Variation("cells_8", "cell size 8 mm", size="8 mm"),
    Variation("cells_4", "cell size 4 mm", size="4 mm"),
)  # fmt: skip


@dataclass(frozen=True)
class Outcome:
    """Ratios of one variation, numbers and largest speeds by half-width; none where its burst stopped."""

    variation: Variation
    number: dict[float, Estimate]
    speed: dict[float, Estimate]
    energy_error: float = 0.0
    lost_cells: int = 0
    cell_size: float = 0.0  # m

    @property
    def stopped(self) -> bool:
        """Whether a burst ended before its time."""
        return not self.number

    @property
    def sound(self) -> bool:
        """Whether its runs may be compared."""
        closed = self.energy_error <= REFERENCE["allowed"]["energy_error"]
        return closed and self.lost_cells == 0 and not self.stopped

    def as_dict(self) -> dict[str, Any]:
        """For the machine-readable output."""
        found: dict[str, Any] = {"variation": self.variation.name, "words": self.variation.words, "sound": self.sound}
        for name in ("number", "speed"):
            for half_width, ratio in getattr(self, name).items():
                found[f"{name}_ratio_{half_width:g}_deg"] = ratio.value
                found[f"{name}_ratio_{half_width:g}_deg_standard_error"] = ratio.error
        return found


def compute(
    runs: Runs, variations: Sequence[Variation] = VARIATIONS, *, realisations: int = 200, base_size: str | None = None
) -> list[Outcome]:
    """Run what is missing and give the ratios; the first variation is the base.

    Parameters
    ----------
    runs : Runs
        Where runs are made.
    variations : sequence of Variation
        What to compute.
    realisations : int
        Of every ensemble.
    base_size : str, optional
        Cell size in place of `BASE_SIZE`.

    Raises
    ------
    StudyError
        The base, or any input, is at fault. What was finished stays; with `runs.resume` it is kept. A variation
        whose burst stops is an outcome without ratios.
    """
    singles: dict[str, tuple[RingEnsemble, dict[str, Any]]] = {}
    outcomes: list[Outcome] = []
    for variation in variations:
        size = base_size if base_size and variation.size == BASE_SIZE else variation.size
        twin = variation.name if variation.of_the_round else variations[0].name
        try:
            if twin not in singles:
                changes = variation.changes if variation.of_the_round else {}
                folder = runs.run(f"{NAME}_single_{twin}", REFERENCE["single"], size, changes, stage="burst")
                singles[twin] = ring_ensemble_of_run(folder, 1, seed=2, realisations=realisations), summary_of(folder)
            folder = runs.run(
                f"{NAME}_mirrored_{variation.name}", REFERENCE["mirrored"], size, variation.changes, stage="burst"
            )
        except StudyError as error:
            if error.code != STOPPED or not outcomes:
                raise
            outcomes.append(Outcome(variation, {}, {}))
            continue
        pair = ring_ensemble_of_run(folder, 2, seed=1, realisations=realisations)
        outcomes.append(_outcome(variation, pair, singles[twin][0], [summary_of(folder), singles[twin][1]]))
    return outcomes


def _outcome(
    variation: Variation, pair: RingEnsemble, single: RingEnsemble, summaries: list[dict[str, Any]]
) -> Outcome:
    ours, base = pair.every_height, single.every_height
    sectors = {half_width: sector(ours, half_width) for half_width in HALF_WIDTHS}
    bursts = [summary["burst"] for summary in summaries]
    return Outcome(
        variation,
        {half_width: number_ratio(ours, base, where) for half_width, where in sectors.items()},
        {half_width: speed_ratio(ours, base, where, "largest") for half_width, where in sectors.items()},
        max(burst["energy_error_at_outputs"] for burst in bursts),
        sum(burst["lost_cells"] for burst in bursts),
        bursts[0]["cell_size"],
    )


def table(outcomes: Sequence[Outcome]) -> str:
    """The ratios of every variation with their differences from the base, for the README."""
    base = outcomes[0]
    head = [f"varied, at {1e3 * base.cell_size:g} mm where nothing else is said"]
    for half_width in HALF_WIDTHS:
        head += [f"number ratio within {half_width:g}°", f"speed ratio within {half_width:g}°"]
    body = []
    for outcome in outcomes:
        words = outcome.variation.words
        if outcome.stopped:
            body.append([f"{words} (the burst stopped)", *("-" for _ in head[1:])])
            continue
        line = [words if outcome.sound else f"{words} (ledger open, void)"]
        for half_width in HALF_WIDTHS:
            for kind in ("number", "speed"):
                ratio, of_base = getattr(outcome, kind)[half_width], getattr(base, kind)[half_width]
                digits = 2 if kind == "number" else 3
                shown = f"{ratio.value:.{digits}f} ± {ratio.error:.{digits}f}"
                line.append(shown if outcome is base else f"{shown} ({ratio.value - of_base.value:+.{digits}f})")
        body.append(line)
    return markdown_table(head, body)
