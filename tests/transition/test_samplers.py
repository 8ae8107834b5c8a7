"""Samplers: number by mass against the law, exact mass, kept tail, the paper's grades by hand."""

from __future__ import annotations

import numpy as np
import pytest

from transition import Graded, InputError, MottLaw, Quantile
from transition.draws import Draws

MEAN = 0.0149
DIMENSIONS = (2, 3, "mixed")


def draws(dimension, number, realisations, seed=0):
    law = MottLaw.from_mean(MEAN, dimension)
    return law, [Quantile().draw(law, number * MEAN, Draws(seed, one)) for one in range(realisations)]


def kolmogorov(masses, survival):
    """Largest difference between the number above m and the law, in fragments."""
    heavy_first = np.sort(masses)[::-1]
    expected = masses.size * survival(heavy_first)
    rank = np.arange(masses.size)
    return max(np.abs(expected - rank).max(), np.abs(expected - rank - 1).max())


@pytest.mark.parametrize("dimension", DIMENSIONS)
@pytest.mark.parametrize("number", [1.0, 2.3, 8.0, 31.7, 1760.0, 40_000.0])
def test_mass_closes_to_round_off(dimension, number):
    _, drawn = draws(dimension, number, 3)
    for draw in drawn:
        assert draw.sum() == pytest.approx(number * MEAN, rel=1e-12)
        assert (np.diff(draw) <= 0.0).all()
        assert draw.min() > 0.0


@pytest.mark.parametrize("dimension", DIMENSIONS)
@pytest.mark.parametrize("number", [150.0, 1760.0, 20_000.0])
def test_one_realisation_follows_the_law_far_closer_than_independent_draws(dimension, number):
    """Independent draws stray by 0.87 sqrt(n) on average; a heavy fragment alone moves the rest by its mass."""
    law, drawn = draws(dimension, number, 12)
    strays = [kolmogorov(draw, law.survival) for draw in drawn]
    assert np.mean(strays) < 0.35 * np.sqrt(number) + 2.0, strays


@pytest.mark.parametrize(
    ("dimension", "number", "realisations", "bias"),
    [(2, 12.0, 2000, 0.45), (3, 12.0, 2000, 0.45), ("mixed", 40.0, 600, 0.35), (2, 300.0, 600, 0.12)],
)
def test_number_above_any_mass_is_right_in_expectation(dimension, number, realisations, bias):
    """Closing on the mass adds less than half a fragment at any mass: a share of the number that falls with 1/n."""
    law, drawn = draws(dimension, number, realisations)
    for share in (0.99, 0.8, 0.5, 0.2, 0.05, 0.01):
        mass = float(law.inverse(share))
        if mass > 0.5 * number * MEAN:
            continue
        expected = number * share
        counts = np.array([(draw > mass).sum() for draw in drawn])
        # Fragments too many by 20,000, 8,000 and 3,000 realisations, largest over the shares. 12: 0.33 in two
        # dimensions, 0.41 in three, at a mass of 0.37 of the segment's; 40: 0.09 and 0.31; 300: 0.03 and 0.10.
        tolerance = 4.0 * counts.std() / np.sqrt(realisations) + bias
        assert abs(counts.mean() - expected) < tolerance, (share, counts.mean(), expected, tolerance)


def test_tail_is_kept():
    """Fragments that a realisation holds once in a hundred come once in a hundred; the heaviest grow with ln^2."""
    law, drawn = draws(2, 1000.0, 1000)
    rare = float(law.inverse(0.01 / 1000.0))
    seen = sum(int((draw > rare).sum()) for draw in drawn)
    assert abs(seen - 10) < 4 * np.sqrt(10), seen
    heaviest = np.array([draw[0] for draw in drawn])
    # P(heaviest > m) is N(m) with never more than one fragment in the first unit, 1 - exp(-N(m)) if independent
    median = float(np.median(heaviest))
    assert 0.44 < 1000.0 * float(law.survival(median)) < np.log(2.0) + 0.06


@pytest.mark.parametrize("dimension", [2, 3])
def test_second_moment_over_an_ensemble(dimension):
    law, drawn = draws(dimension, 1760.0, 250)
    sums = np.array([(draw**2).sum() for draw in drawn])
    expected = 1760.0 * law.moment(2)
    assert abs(sums.mean() - expected) < 4.0 * sums.std() / np.sqrt(sums.size)


def test_few_pieces_never_fewer_than_one():
    law = MottLaw.from_mean(2.0, 2)
    whole = Quantile().draw(law, 1.5, Draws(1))
    assert whole.tolist() == pytest.approx([1.5], rel=1e-15)
    numbers = [Quantile().draw(law, 2.0 * 3.4, Draws(1, one)).size for one in range(200)]
    assert set(numbers) == {3, 4}
    assert np.mean(numbers) == pytest.approx(3.4, abs=0.01)  # drawn one by one: 0.035


def test_grades_by_hand():
    """Whole numbers of the differences of N(m), for mu = 1 g, N0 = 100, dm = 1 g, m_0 = 0.

    N(m) at the half grades: 49.307, 29.383, 20.574, 15.400, 11.987, 9.583,
    7.812, 6.466, 5.418, 4.586; differences: 19, 8, 5, 3, 2, 1, 1, 1, and then 0.83 stops.
    """
    law = MottLaw.from_mean(2e-3, 2)
    draw = Graded(0.0, 1e-3).draw(law, 0.2, Draws(0))
    grades, counts = np.unique(np.round(draw * 1e3, 9), return_counts=True)
    assert grades.tolist() == [1, 2, 3, 4, 5, 6, 7, 8]
    assert counts.tolist() == [19, 8, 5, 3, 2, 1, 1, 1]
    assert draw.sum() == pytest.approx(0.093, rel=1e-12)
    # m_0 shifts the grades: 1.5 g, 2.5 g, ... with N at 1, 2, 3 g: 36.788, 24.312, 17.692
    _, counts = Graded(5e-4, 1e-3).grades(law, 100.0, 0.2)
    assert counts[:2].tolist() == [12, 6]


def test_last_grade_is_corrected_to_the_mass():
    """Eq. 29: N0 larger than M/mean. 19 g and 16 g are given; of 37 g, 2 g are left, none of 3 g: 40 g leave one."""
    law = MottLaw.from_mean(2e-3, 2)
    sampler = Graded(0.0, 1e-3)
    assert sampler.grades(law, 100.0, 0.037)[1].tolist() == [19, 8, 0]
    assert sampler.grades(law, 100.0, 0.0401)[1].tolist() == [19, 8, 1]


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("step", [1e-4, 1e-3, 1e-2])
def test_graded_loses_the_heavy_end_and_says_so(dimension, step):
    """The deficit is what lies beyond the last grade, and less than one fragment of every grade."""
    law, total = MottLaw.from_mean(MEAN, dimension), 1760 * MEAN
    draw = Graded(0.0, step).draw(law, total, Draws(0))
    edge = draw[0] + 0.5 * step
    beyond = float(law.mass_fraction_above(edge)) * total
    # Within a grade m_i stands for masses up to half a step away, of 1760 fragments at most.
    count = 1760 * (1.0 - float(law.survival(edge)))
    deficit = total - draw.sum()
    assert beyond - 0.5 * step * count < deficit < beyond + np.unique(draw).sum() + 0.5 * step * count
    assert deficit > 0.15 * total  # why it is not the default
    expected = 1760 * (law.survival(0.5 * step) - law.survival(edge))
    assert expected - np.unique(draw).size < draw.size <= expected


def test_grades_finer_than_the_fragments_are_refused():
    law = MottLaw.from_mean(MEAN, 2)
    with pytest.raises(InputError, match=r"first grade \(m_0 \+ dm = 0.1 g\) holds less than one of the 9.0 fragments"):
        Graded(0.0, 1e-4).draw(law, 9 * MEAN, Draws(0))


@pytest.mark.parametrize("dimension", [2, 3])
@pytest.mark.parametrize("step", [1e-4, 1e-3])
def test_every_grade_holds_one_fragment_and_the_next_would_not(dimension, step):
    """The rule at which the paper's grades stop."""
    law, total = MottLaw.from_mean(MEAN, dimension), 1760 * MEAN
    masses, counts = Graded(0.0, step).grades(law, 1760.0, total)
    assert counts.min() >= 1
    after = masses[-1] + step
    assert 1760.0 * (law.survival(after - 0.5 * step) - law.survival(after + 0.5 * step)) < 1.0


def test_no_fragment_is_lighter_than_a_file_of_fragments_holds():
    # The smallest stratum's end is a mass of nothing: a draw there once ended a run of 300 realisations.
    class AtTheEnds(Draws):
        def uniform(self, quantity, *shape):
            return np.zeros(shape)

    masses = Quantile().draw(MottLaw.from_mean(MEAN, 2), 500 * MEAN, AtTheEnds(0))
    assert masses.size == 500
    assert masses.min() > 1e-13
