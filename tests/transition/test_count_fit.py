"""Mean masses fitted to counted fragments: the estimator against closed forms, known scales and a bootstrap."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from tests.transition.synthetic import Tube
from transition import BreakUp, BreakUpSettings
from transition.errors import InputError
from transition.law.count_fit import SegmentMasses, _chi_square, expected_numbers, fit_counts
from transition.law.fragment_counts import FragmentCounts
from transition.law.mott import MottLaw

SEGMENTS = SegmentMasses((8e-3, 14e-3, 40e-3), (12.0, 15.0, 4.0))
OPEN = np.geomspace(5e-4, 0.3, 13)
COARSE_ONLY = np.geomspace(5e-3, 0.3, 11)


def pieces(scale, generator, dimension=2, segments=SEGMENTS):
    """Masses of all pieces of a round whose segments break by Mott's law, their numbers being Poisson's."""
    drawn = []
    for mean, mass in zip(segments.relative, segments.masses, strict=True):
        number = generator.poisson(mass / (scale * mean))
        drawn.append(MottLaw.from_mean(scale * mean, dimension).inverse(1.0 - generator.random(number)))
    return np.concatenate(drawn)


def grouped(masses, edges, **more):
    """Counts in open groups."""
    number, _ = np.histogram(masses, np.append(edges, np.inf))
    return FragmentCounts("pit.csv", tuple(edges), tuple(number.astype(float)), **more)


def exact(scale, edges=OPEN, share=1.0, dimension=2):
    """The expected numbers themselves, as counts."""
    law, ends = MottLaw.from_mean(1.0, dimension), np.append(edges, np.inf)
    number = expected_numbers(ends, scale, np.array(SEGMENTS.relative), np.array(SEGMENTS.masses), law)
    return FragmentCounts("pit.csv", tuple(edges), tuple(share * number))


def of_many_rounds(share):
    """So many pieces that two standard errors of the scale are less than a thousandth."""
    counts = exact(1.0, share=share)
    return replace(counts, number=tuple(1e4 * n for n in counts.number), rounds=1e4)


def test_two_open_groups_have_a_closed_form():
    """With the groups [0, a) and above a the share above is exp(-sqrt(a/mu)): mu and its error by hand."""
    below, above, edge = 700.0, 300.0, 5e-3
    fit = fit_counts(FragmentCounts("pit.csv", (0.0, edge), (below, above)))
    share = above / (below + above)
    x = -math.log(share)
    assert fit.scale == pytest.approx(2.0 * edge / x**2, rel=1e-6)
    error = 2.0 / (share * x) * math.sqrt(share * (1.0 - share) / (below + above))  # delta method, binomial
    assert fit.curvature_error == pytest.approx(error, rel=1e-4)
    assert (fit.degrees, fit.probability, fit.standard_error) == (0, None, fit.curvature_error)


@pytest.mark.parametrize("dimension", [2, 3, "mixed"])
@pytest.mark.parametrize("scale", [0.4, 1.0, 2.5])
def test_expected_numbers_give_their_scale_back(scale, dimension):
    if dimension == "mixed":
        law = MottLaw.from_mean(1.0, "mixed", 0.3)
        means, masses = np.array(SEGMENTS.relative), np.array(SEGMENTS.masses)
        number = expected_numbers(np.append(OPEN, np.inf), scale, means, masses, law)
        counts = FragmentCounts("pit.csv", tuple(OPEN), tuple(number))
    else:
        counts = exact(scale, dimension=dimension)
    fit = fit_counts(counts, dimension, 0.3, SEGMENTS)
    assert fit.scale == pytest.approx(scale, rel=1e-6)
    assert fit.chi_square == pytest.approx(0.0, abs=1e-6)
    assert fit.recovered == pytest.approx(fit.in_range, rel=1e-6)
    number = sum(m / (scale * r) for r, m in zip(SEGMENTS.relative, SEGMENTS.masses, strict=True))
    assert fit.mean == pytest.approx(sum(SEGMENTS.masses) / number, rel=1e-6)


@pytest.mark.parametrize(("edges", "kept"), [(OPEN, 1.0), (COARSE_ONLY, 0.7)])
def test_scale_is_recovered_to_its_stated_error(edges, kept):
    """200 tests of a round with a known scale, with pieces lost at random: bias, spread and coverage."""
    generator = np.random.default_rng(5)
    scale, found = 1.3, []
    for _ in range(200):
        masses = pieces(scale, generator)
        masses = masses[generator.random(masses.size) < kept]
        fit = fit_counts(grouped(masses, edges), segments=SEGMENTS)
        found.append((math.log(fit.scale / scale) / fit.curvature_error, fit.probability, fit.completeness))
    z, probability, completeness = np.array(found).T
    assert abs(z.mean()) < 0.25  # 3.5 standard errors of the mean of 200
    assert 0.85 < z.std() < 1.15  # 3 of the standard deviation
    assert 0.58 < (np.abs(z) < 1.0).mean() < 0.78
    assert (np.abs(z) < 1.96).mean() > 0.90
    assert (probability < 0.05).mean() < 0.10  # the law holds: chi-square rejects it one time in twenty
    assert completeness.mean() == pytest.approx(kept, rel=0.02)


def test_standard_error_is_that_of_a_parametric_bootstrap():
    generator = np.random.default_rng(8)
    counts = grouped(pieces(1.0, generator), OPEN)
    fit = fit_counts(counts, segments=SEGMENTS)
    share = np.array(fit.expected) / counts.pieces
    again = [
        math.log(fit_counts(replace(counts, number=tuple(map(float, row))), segments=SEGMENTS).scale)
        for row in generator.multinomial(int(counts.pieces), share, size=200)
    ]
    assert np.std(again) == pytest.approx(fit.curvature_error, rel=0.17)  # 200 of them: 5 % each standard error


def test_fine_groups_change_nothing_and_coarse_ones_little():
    masses = pieces(1.0, np.random.default_rng(2))
    masses = masses[masses > OPEN[0]]
    fine, finer, coarse = (
        fit_counts(grouped(masses, OPEN[0] * 2.0 ** (np.arange(0.0, 9.5, step))), segments=SEGMENTS)
        for step in (1 / 8, 1 / 64, 1.0)
    )
    assert abs(math.log(fine.scale / finer.scale)) < 0.02 * fine.curvature_error
    assert abs(math.log(coarse.scale / finer.scale)) < coarse.curvature_error
    assert finer.curvature_error <= fine.curvature_error * 1.001 <= coarse.curvature_error * 1.002


def test_unit_of_mass_and_size_of_the_sample():
    counts = exact(1.1)
    fit = fit_counts(counts, segments=SEGMENTS)
    scaled = SegmentMasses(tuple(3.0 * r for r in SEGMENTS.relative), tuple(3.0 * m for m in SEGMENTS.masses))
    tripled = fit_counts(replace(counts, edges=tuple(3.0 * e for e in counts.edges)), segments=scaled)
    assert tripled.scale == pytest.approx(fit.scale, rel=1e-6)
    assert tripled.curvature_error == pytest.approx(fit.curvature_error, rel=1e-4)
    four = fit_counts(replace(counts, number=tuple(4.0 * n for n in counts.number), rounds=4.0), segments=SEGMENTS)
    assert four.scale == pytest.approx(fit.scale, rel=1e-6)
    assert four.curvature_error == pytest.approx(0.5 * fit.curvature_error, rel=1e-3)
    assert four.recovered == pytest.approx(fit.recovered, rel=1e-6)
    halved = fit_counts(exact(1.1, share=0.6), segments=SEGMENTS)
    assert halved.scale == pytest.approx(fit.scale, rel=1e-6)  # pieces lost at random
    assert halved.completeness == pytest.approx(0.6, rel=1e-6)


def test_the_law_s_own_mean_masses_count_by_their_ratios():
    counts = exact(1.0)
    half = SegmentMasses(tuple(0.5 * r for r in SEGMENTS.relative), SEGMENTS.masses)
    assert fit_counts(counts, segments=half).scale == pytest.approx(2.0, rel=1e-6)
    two = SegmentMasses(2 * SEGMENTS.relative, 2 * SEGMENTS.masses, rounds=2)
    fit = fit_counts(counts, segments=two)
    assert fit.scale == pytest.approx(1.0, rel=1e-6)
    assert fit.recovered == pytest.approx(fit.in_range, rel=1e-6)


def test_a_law_that_does_not_fit_is_rejected_and_widens_the_error():
    generator = np.random.default_rng(3)
    masses = np.exp(generator.normal(math.log(8e-3), 0.6, 2500))
    fit = fit_counts(grouped(masses, OPEN), segments=SEGMENTS)
    assert fit.probability < 1e-6
    widened = math.sqrt(fit.chi_square / fit.degrees)
    assert fit.standard_error == pytest.approx(widened * fit.curvature_error)
    assert widened > 2.0


def test_chi_square_joins_groups_of_few_pieces_by_hand():
    """From the heaviest on to five expected pieces or more; what is left joins the lightest group."""
    chi_square, degrees = _chi_square(np.array([2.0, 30.0, 6.0, 3.0, 1.0]), np.array([3.0, 28.0, 5.5, 4.0, 2.0]))
    assert chi_square == pytest.approx(2.0**2 / 6.0 + 0.5**2 / 5.5 + 1.0 / 31.0)
    assert degrees == 1


def test_weighed_pieces_are_taken_as_weighed():
    generator = np.random.default_rng(4)
    masses = pieces(1.0, generator)
    group = np.digitize(masses, OPEN) - 1
    weighed = tuple(masses[group == one].sum() for one in range(len(OPEN)))
    fit = fit_counts(grouped(masses, OPEN, mass=weighed), segments=SEGMENTS)
    assert fit.recovered == pytest.approx(sum(weighed) / sum(SEGMENTS.masses), rel=1e-12)
    unweighed = fit_counts(grouped(masses, OPEN), segments=SEGMENTS)
    assert unweighed.scale == fit.scale
    assert unweighed.recovered == pytest.approx(fit.recovered, rel=0.03)


def test_a_segment_that_stays_whole_is_one_piece():
    solid = SegmentMasses((*SEGMENTS.relative, math.inf), (*SEGMENTS.masses, 2.0))
    law = MottLaw.from_mean(1.0)
    number = expected_numbers(np.array([0.0, np.inf]), 1.0, np.array(solid.relative), np.array(solid.masses), law)
    apart = sum(m / r for r, m in zip(SEGMENTS.relative, SEGMENTS.masses, strict=True))
    assert number.sum() == pytest.approx(apart + 1.0)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"edges": (1e-3, 2e-3), "number": (15.0, 4.0)}, "fragments by mass: 19 pieces; at least 20 are needed"),
        ({"edges": (1e-3, 2e-3), "number": (50.0, 0.0)}, "all pieces lie in one group of mass"),
        ({"edges": (2e-3, 1e-3), "number": (50.0, 4.0)}, "masses must rise from group to group"),
        ({"edges": (-1e-3, 1e-3), "number": (50.0, 4.0)}, "from 0 or more upwards"),
        ({"edges": (1e-3, math.inf), "number": (50.0, 4.0)}, "masses must rise"),
        ({"edges": (1e-3, 2e-3), "number": (50.0, -4.0)}, "number of group 2 is -4; needed: 0 or more"),
        ({"edges": (1e-3, 2e-3), "number": (50.0, math.nan)}, "number of group 2 is nan"),
        ({"edges": (1e-3,), "number": (50.0, 4.0)}, "1 edges for 2 groups; allowed: as many, or one more"),
        ({"edges": (1e-3, 2e-3), "number": (50.0, 4.0), "rounds": 0.0}, "rounds is 0; a number above zero"),
        ({"edges": (1e-3, 2e-3), "number": (50.0, 4.0), "mass": (0.3, 0.02)},
         "50 pieces of 0.001 to 0.002 kg weigh 0.3 kg together; allowed: 0.05 to 0.1 kg"),
        ({"edges": (1e-3, 2e-3), "number": (50.0, 4.0), "mass": (0.07,)}, "1 masses for 2 groups"),
    ],
)  # fmt: skip
def test_counts_at_fault_are_refused(values, message):
    with pytest.raises(InputError) as caught:
        FragmentCounts("pit.csv", **values)
    assert message in str(caught.value)


@pytest.mark.parametrize(
    ("counts", "message"),
    [
        (
            FragmentCounts("pit.csv", (1e-3, 2e-3, 4e-3, 8e-3), (10.0, 20.0, 40.0)),
            "these counts determine no mean mass",
        ),
        (of_many_rounds(1.11), "of the mass of its 10000 rounds (31 kg each); allowed: at most 110%"),
        (of_many_rounds(0.495), "in this range of masses; allowed: at least 50% of that"),
    ],
)
def test_counts_that_do_not_fit_the_round_are_refused(counts, message):
    with pytest.raises(InputError) as caught:
        fit_counts(counts, segments=SEGMENTS)
    assert message in str(caught.value)
    assert "pit.csv" in str(caught.value)


@pytest.mark.parametrize("share", [1.09, 0.505])
def test_counts_that_just_fit_the_round_are_taken(share):
    assert fit_counts(of_many_rounds(share), segments=SEGMENTS).completeness == pytest.approx(share, rel=1e-6)
    assert FragmentCounts("pit.csv", (1e-3, 2e-3), (15.0, 5.0)).pieces == 20.0


SMALL = Tube(radial_cells=1, around=16, axial=20)


@pytest.fixture(scope="module")
def snapshot(tmp_path_factory):
    return SMALL.read(tmp_path_factory.mktemp("counts") / "s.h5")


@pytest.fixture(scope="module")
def counted(snapshot):
    """Fragments of two realisations with 1.4 times the mean masses of Eq. 21, counted above 1 g."""
    finer = BreakUp(snapshot, BreakUpSettings(prefactor=5.6))
    masses = np.concatenate([finer.fragments(11, number).mass for number in range(2)])
    return grouped(masses, np.geomspace(1e-3, 0.2, 10), rounds=2.0)


def test_the_break_up_has_the_table_s_mean(snapshot, counted):
    broken = BreakUp(snapshot, BreakUpSettings(mean_mass=counted))
    assert broken.fit.scale == pytest.approx(1.4, abs=3.0 * 1.4 * broken.fit.standard_error)
    assert broken.fit.completeness == pytest.approx(1.0, abs=0.1)
    lightest, of_table = counted.edges[0], BreakUp(snapshot, BreakUpSettings(prefactor=5.6))
    ours, theirs = (
        np.concatenate([one.fragments(seed, number).mass for number in range(8)])
        for one, seed in ((broken, 1), (of_table, 11))
    )
    mean, wanted = ours[ours > lightest].mean(), theirs[theirs > lightest].mean()
    # Above a cut c the mean of Mott's law is c + 2 sqrt(mu c) + 2 mu: it follows the scale a little less than 1 to 1.
    assert mean == pytest.approx(wanted, rel=3.0 * broken.fit.standard_error)
    usual = BreakUp(snapshot, BreakUpSettings())
    for fitted, plain in zip(broken.laws, usual.laws, strict=True):
        assert fitted.law.mean == pytest.approx(min(broken.fit.scale * plain.law.mean, plain.mass), rel=1e-12)


def test_fit_forgets_the_prefactor_and_keeps_what_studies_vary(snapshot, counted):
    usual, other = (BreakUp(snapshot, BreakUpSettings(mean_mass=counted, prefactor=c)) for c in (4.0, 2.0))
    assert other.fit.scale == pytest.approx(2.0 * usual.fit.scale, rel=1e-6)
    assert [one.law.mean for one in other.laws] == pytest.approx([one.law.mean for one in usual.laws], rel=1e-6)
    varied = BreakUp(snapshot, BreakUpSettings(mean_mass=replace(counted, scale=1.2)))
    assert varied.fit.scale == usual.fit.scale
    assert varied.laws[1].law.mean == pytest.approx(1.2 * usual.laws[1].law.mean, rel=1e-12)


def test_summary_states_the_fit(snapshot, counted):
    broken = BreakUp(snapshot, BreakUpSettings(mean_mass=counted))
    part = broken.realisation(1).summary["mean_mass"]
    fit = broken.fit
    assert (part["law"], part["factor"], part["outside_data"]) == ("fitted", math.exp(fit.standard_error), [])
    assert part["factor_source"] == (
        f"fitted to pit.csv, {counted.pieces:.0f} pieces above 1 g, standard error {100 * fit.standard_error:.2g} %"
    )
    assert part["test"]["scale"] == fit.scale
    assert part["test"]["recovered_fraction"] == fit.recovered
    assert sum(part["test"]["expected"]) == pytest.approx(counted.pieces)
    given = BreakUp(snapshot, BreakUpSettings(mean_mass=counted, mean_mass_factor=1.3)).realisation(1)
    assert (given.summary["mean_mass"]["factor"], given.summary["mean_mass"]["factor_source"]) == (1.3, "input")


def test_settings_alone_take_one_law_for_all_pieces(counted):
    factor, source = BreakUpSettings(mean_mass=counted).factor
    fit = fit_counts(counted)
    assert (factor, source) == (fit.factor, fit.label)
    assert fit.recovered is None


def test_rounds_that_differ_take_no_table_of_one(counted, tmp_path):
    tube = Tube(radial_cells=1, around=16, axial=20, places=((0.0, 0.0, 0.0), (0.4, 0.0, 0.0)))
    pair = tube.read(tmp_path / "pair.h5")
    assert BreakUp(pair, BreakUpSettings(mean_mass=counted)).fit.completeness == pytest.approx(1.0, abs=0.1)

    def other(share):
        changed = replace(pair, mass=np.where(pair.round == 1, share, 1.0) * pair.mass)
        return BreakUp(changed, BreakUpSettings(mean_mass=counted))

    for share in (0.981, 1.019):
        assert len(other(share).rounds) == 2
    for share in (0.979, 1.021):
        with pytest.raises(InputError, match="the fragments of one kind of round, and the rounds here are of several"):
            other(share)
