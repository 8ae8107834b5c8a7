"""The parts `rules`, `official` and `distance_to_apply` of the summary."""

from __future__ import annotations

from typing import Literal

from fragfield.results.part import Part, out


class Contents(Part):
    """What stands there, images too; null where the masses are not known."""

    explosive: float = out("Net explosive quantity", "kg")
    tnt: float = out("Its equivalent in TNT for peak pressure", "kg")
    all_up: float = out("Mass of all rounds whole, without packaging", "kg")
    largest_round: float = out("Mass of the heaviest round", "kg")
    rounds: int = out("Rounds")
    equivalents: tuple[str, ...] = out("The TNT equivalents taken, in words", default=())
    in_a_row: bool = out("Whether two or more rounds stand in one straight line, within 1 mm", default=False)
    clearance: float | None = out("Smallest clear distance of a row", "m")
    charge_diameter: float | None = out("Largest diameter of a charge", "m")
    at_once: bool = out("Whether all are initiated at once", default=True)
    protective_works: tuple[str, ...] = out("`hazard.protective_works`", default=())
    alike: bool = out("Whether all rounds have the same contour, casing and explosive", default=True)


class Beam(Part):
    """The distance of the worst polar zone of a single round."""

    distance: float = out("Distance", "m")
    low: float = out("Start of the worst polar zone from the nose", "deg")
    high: float = out("Its end", "deg")
    per_steradian: float = out("Hazardous fragments per steradian there", "1/sr")


class FragmentField(Part):
    """A Mott law in a polar zone of the single round."""

    per_steradian: float = out("Q0, fragments per steradian", "1/sr")
    mean_mass: float = out("m0", "kg")
    speed: float = out("Speed", "m/s")


class StackRule(Part):
    """The distance of several rounds."""

    side: int = out("Rounds on the fullest side")
    top: int = out("Rounds in the top layer")
    cover: str = out("`hazard.stack_rule.cover`")
    distance: float | None = out("Distance; null where there is none", "m")
    reason: str | None = out("Why there is none", default=None)
    effective_number: float | None = out("Effective number of rounds", default=None)
    lightest: float | None = out("Lightest hazardous fragment", "kg", default=None)
    free_fall: bool | None = out("Whether it is hazardous at its terminal speed", default=None)
    low: float | None = out("Start of the polar zone", "deg", default=None)
    high: float | None = out("Its end", "deg", default=None)
    single: FragmentField | None = out("Of the single round in that zone", default=None)


class Tp12(Part):
    """DDESB TP-12, see Theory, Hazard."""

    single_round: str = out("Where the single round's fragments come from, or why there are none")
    realisations: int = out("Its realisations")
    beam: Beam | None
    stack: StackRule | None


class Rule(Part):
    """A distance by a published rule."""

    name: str = out("Name")
    hazard: Literal["fragments", "blast"] = out("What it keeps people from")
    use: Literal["siting", "disposal", "comparison"] = out(
        "What it is prescribed for, storage and handling or disposal in the open; or shown beside the others alone"
    )
    distance: float | None = out("Distance; null where it does not apply", "m")
    source: str = out("Source")
    formula: str = out("Formula")
    inputs: str = out("What went in")
    range: str = out("Range of validity")
    reason: str = out("Why it does not apply; empty where it does", default="")
    basis: str = out("What it rests on", default="mass alone")
    outside: float | None = out("What its formula gives where it does not apply", "m")
    missing: bool = out("Whether it is prescribed for such rounds and none takes its place", default=False)

    def __post_init__(self) -> None:
        """Raise ValueError for a rule with both a distance and a reason why it has none, or neither."""
        if (self.distance is None) != bool(self.reason):
            raise ValueError(f"{self.name}: a rule has either a distance or a reason why it has none")


class Rules(Part):
    """Prescribed distances."""

    contents: Contents | None
    tp12: Tp12
    rules: tuple[Rule, ...] = out("One a rule")
    left_out: tuple[str, ...] = out("Rules that are not applied, and why")


class Official(Part):
    """The table `[official]`, the authority's distances; null without it."""

    hazardous_fragment_distance: float | None = out("Hazardous fragment distance of the authority", "m")
    maximum_fragment_distance: float | None = out("Maximum fragment distance of the authority", "m")
    rounds: int = out("Rounds it is published for")
    source: str = out("Source")
    rounds_here: int | None = out("Rounds that stand here")
    alike: bool | None = out("Whether they are alike")
    covers: bool | None = out("Whether the official distances cover them; null where rounds are not known")


class LeftOut(Part):
    """A distance that was left out."""

    name: str = out("Name of the rule")
    reason: str = out("Why")
    distance: float | None = out("What its formula gives all the same; null where it gives nothing", "m")
    missing: bool = out("Whether it is meant for such rounds and nothing takes its place: the distance is incomplete")


class DistanceOfUse(Part):
    """A distance to apply."""

    distance: float | None = out("Distance; null where nothing is known", "m")
    by: str | None = out("What it is by")
    left_out: tuple[LeftOut, ...] = out("Distances left out that are larger or not known")

    @property
    def incomplete(self) -> bool:
        """Whether a distance is missing that may be larger."""
        return any(one.missing for one in self.left_out)


class DistanceToApply(Part):
    """Distances to apply: the largest of the computed, official and prescribed ones, and what was left out."""

    line: str = out("In one line, as every view shows it")
    computed: float | None = out("Recommended distance of the computation; null where it is not determined", "m")
    siting: DistanceOfUse = out("For storage and handling")
    disposal: DistanceOfUse = out("For disposal in the open")
    official: tuple[str, ...] = out("Sentences on the official distances against the computed ones")
    words: tuple[str, ...] = out("Sentences: what each is by, what was left out and why, and `official`")

    @property
    def distances(self) -> str:
        """The line without its heading."""
        return self.line.partition(": ")[2]
