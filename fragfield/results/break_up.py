"""The part `break_up` of the summary."""

from __future__ import annotations

from fragfield.results.part import Part, out


class OutsideData(Part):
    """A round beyond published data."""

    round: str = out("Round")
    text: str = out("In which respect no published data are near")


class FragmentTest(Part):
    """Fit to the pieces of a test."""

    source: str = out("File")
    rounds: float = out("Rounds of the test")
    what: str = out("What was counted")
    scale: float = out("Factor on the law")
    mean: float = out("Mean mass", "kg")
    standard_error: float = out("Relative standard error of the mean, with the misfit")
    curvature_error: float = out("The same without it")
    chi_square: float = out("Chi-square")
    degrees_of_freedom: int = out("Degrees of freedom")
    probability: float | None = out("Probability of a chi-square as large")
    recovered_fraction: float | None = out("Fraction of the casing's mass that was recovered")
    fraction_in_range: float = out("Fraction of the law's mass in the groups counted")
    mass_margin: float = out(
        "Factor within which the mass of the pieces is known: two standard errors, 1 where they were weighed"
    )
    edges: tuple[float | None, ...] = out("Edges of the groups", "kg")
    number: tuple[float, ...] = out("Pieces counted by group")
    expected: tuple[float, ...] = out("Pieces expected by group")


class MeanMass(Part):
    """Where the mean mass comes from."""

    law: str = out("Name of the law; `given` for a value, `fitted` for a test's pieces")
    factor: float | None = out(
        "Geometric standard deviation of the mean mass about the truth; null where a value without one was given"
    )
    factor_source: str = out("Source of the factor")
    outside_data: tuple[OutsideData, ...] = out("Where no published data are near")
    test: FragmentTest | None = None


class MottPart(Part):
    """A part of the law of a segment."""

    dimension: int = out("Dimension of the Mott law")
    mu: float = out("mu", "kg")
    mass_fraction: float = out("Fraction of the mass")


class Segment(Part):
    """The break-up of a segment of a casing."""

    name: str = out("Name")
    mean_mass: float = out("Mean mass of the law", "kg")
    mu: float = out("Mott's mu of the first part", "kg")
    n0: float = out("Number that the law gives")
    parts: tuple[MottPart, ...] = out("Parts of the law")
    fragments: int = out("Fragments drawn")
    mass: float = out("Their mass", "kg")
    speed: float = out("Speed at the end of the burst", "m/s")


class BrokenRound(Part):
    """The break-up of a round."""

    name: str = out("Name")
    mirror_of: str | None = out("Round of which it is the image")
    fragments: int = out("Fragments")
    mass: float = out("Mass", "kg")
    segments: tuple[Segment, ...] = out("By segment")


class BreakUp(Part):
    """The break-up, first realisation but for `realisations`."""

    fragments: int = out("Fragments", views="terminal compare sweep uncertainty")
    mass: float = out("Mass of the fragments", "kg", views="terminal")
    mass_error: float = out("Mass against the casing")
    momentum_error: float = out("Momentum against the burst")
    energy_error: float = out("Kinetic energy against the burst")
    mean_mass: MeanMass
    tilt_deviation: float = out("Standard deviation of the tilt", "rad")
    rounds: tuple[BrokenRound, ...] = out("By round")
    realisations: int = out("Realisations drawn by the break-up; `hazard.realisations` were flown")
