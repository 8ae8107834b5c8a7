"""The tables [[exposed]] and [document]: what is refused, and what places become."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import gamma

from flight.fluence import PolarGrid
from flight.hazard.density.expected import ExpectedDistance
from flight.hazard.exposed import COUNTS
from flight.scene.targets import signed_area
from fragfield.case import load_case
from fragfield.case.conversion.exposed_sites import exposed_sites_of
from fragfield.case.conversion.surroundings import direction_words, site_of
from fragfield.case.load import case_from_document
from fragfield.checking.check import describe_exposed
from fragfield.hazard.exposed import ExposedCounts, ExposedSums, share_bound
from fragfield.hazard.places import Places, PlaceSums, sum_bound
from fragfield.hazard.verdict import no_margin, verdict_of
from fragfield.results.part import to_json, value_at
from fragfield.results.site import ExposedSite
from tests.fragfield.example_results import example

SITE = '[site]\nlatitude = "51.5 deg"\nlongitude = "7 deg"\nbearing = "30 deg"\n'


def load(tmp_path, text):
    path = tmp_path / "case.toml"
    path.write_text(text, encoding="utf-8")
    return load_case(path, burst=False)


def test_places_on_earth_lie_where_contours_would_put_them(tmp_path):
    case = load(
        tmp_path,
        '[flight]\norigin = ["10 m", "-5 m"]\n' + SITE + '[[exposed]]\nname = "a"\nlatitude = "51.5027 deg"\n'
        'longitude = "7.0031 deg"\n',
    )  # fmt: skip
    x, y = case.exposed[0].position
    away = np.array([x - 10.0, y + 5.0])
    back = site_of(case).coordinates(np.degrees(np.arctan2(away[1], away[0])), np.hypot(*away))[0]
    assert back == pytest.approx([7.0031, 51.5027], abs=2e-9)
    # bearing 30 deg: +x lies 30 degrees clockwise of north; the place lies about 35 degrees from north
    east, north = 0.0031 * np.cos(np.radians(51.5)) * 111_200.0, 0.0027 * 111_200.0
    assert np.hypot(*away) == pytest.approx(np.hypot(east, north), rel=3e-3)
    turn = np.degrees(np.arctan2(away[1], away[0]))
    assert turn == pytest.approx(30.0 - np.degrees(np.arctan2(east, north)), abs=0.3)


def test_convex_pieces_cover_a_road_and_an_area(tmp_path):
    case = load(
        tmp_path,
        '[[exposed]]\nname = "road"\nkind = "road"\npoints = [["-100 m", "50 m"], ["40 m", "50 m"]]\nwidth = "6 m"\n'
        '[[exposed]]\nname = "yard"\nkind = "area"\npoints = [["50 m", "0 m"], ["90 m", "0 m"], ["70 m", "50 m"]]\n',
    )  # fmt: skip
    road, yard = exposed_sites_of(case)
    assert [abs(signed_area(piece)) for piece in road.pieces] == pytest.approx([140.0 * 6.0])
    assert [abs(signed_area(piece)) for piece in yard.pieces] == pytest.approx([1000.0])


def test_the_outline_of_a_road_goes_round_its_bends(tmp_path):
    """Two metres wide, with a bend of 90 degrees: its corners are where both sides meet."""
    table = '[[exposed]]\nname = "road"\nkind = "road"\nwidth = "2 m"\npoints = '
    (road,) = exposed_sites_of(load(tmp_path, f'{table}[["30 m", "0 m"], ["40 m", "0 m"], ["40 m", "10 m"]]\n'))
    expected = [(30, -1), (41, -1), (41, 10), (39, 10), (39, 1), (30, 1)]
    assert road.outline == pytest.approx(np.array(expected))


def test_the_document_changes_nothing_that_is_computed(tmp_path):
    from fragfield.case import differences

    place = '[[exposed]]\nname = "a"\nposition = ["9 m", "0 m"]\n'
    first = load(tmp_path, place + '[document]\nrevision = "A"\nchanges = ["one"]\n')
    second = load(tmp_path, place + '[document]\nrevision = "B"\n')
    moved = load(tmp_path, place.replace("9 m", "10 m"))
    assert not list(differences(first, second))
    assert any("exposed[1].position" in line for line in differences(first, moved))


OPEN = '[[exposed]]\nname = "yard"\nposition = ["{x} m", "{y} m"]\n'
BANK = (
    '[[obstacle]]\nname = "bank"\nkind = "barricade"\nstart = ["-20 m", "12 m"]\nend = ["20 m", "12 m"]\n'
    'height = "3 m"\n'
)


@pytest.mark.parametrize(
    ("table", "reason"),
    [
        (OPEN.format(x=0, y=60), "shelter decides: behind bank"),
        (OPEN.format(x=30, y=60), "shelter decides: behind bank"),
        (OPEN.format(x=60, y=0), ""),
        (OPEN.format(x=0, y=-60), ""),
        (OPEN.format(x=0, y=4), ""),  # before the foot of the bank
        (OPEN.format(x=60, y=0) + 'max_density = "1 / (100 m^2)"\n', "has a density, energy or height of its own"),
        (OPEN.format(x=60, y=0) + "max_hits = 2.0\n", "judged by the expected hits, not by the density"),
    ],
)
def test_a_margin_is_given_where_density_decides_and_nothing_stands_between(tmp_path, table, reason):
    case = load(tmp_path, BANK + table)
    found = no_margin(case, exposed_sites_of(case)[0])
    assert found.startswith(reason) if reason else found == ""


def test_check_shows_bearings_where_there_is_a_site(tmp_path):
    without, within = (next(describe_exposed(load(tmp_path, more + OPEN.format(x=0, y=60)))) for more in ("", SITE))
    assert without.azimuth_deg == within.azimuth_deg
    assert without.bearing_deg is None
    assert (within.azimuth_deg + within.bearing_deg) % 360.0 == pytest.approx(30.0)
    assert direction_words(90.0, None) == "azimuth 90°"
    assert direction_words(90.0, 300.0) == "bearing 300° (WNW)"
    assert direction_words(90.1, 359.6, whole=True) == "bearing 0° (N)"


# --- Exposed sites: bounds against exact ones, their coverage, and every value of a site by hand


@pytest.mark.parametrize(("count", "exact"), [(0, 2.9957), (1, 4.7439), (5, 10.5130), (20, 29.0620)])
def test_equal_weights_give_the_poisson_bound(count, exact):
    # upper 95 % limits of a Poisson mean (chi-square quantiles over two)
    assert sum_bound(count, count, np.array(1.0)) == pytest.approx(exact, rel=1e-4)
    assert sum_bound(3.0 * count, 9.0 * count, np.array(3.0)) == pytest.approx(3.0 * exact, rel=1e-4)


def test_share_bound_is_that_of_clopper_and_pearson():
    assert share_bound(0, 100) == pytest.approx(1.0 - 0.05**0.01, rel=1e-9)
    assert share_bound(100, 100) == 1.0
    bound = share_bound(5, 50)  # by definition: so many or fewer with this probability in 5 % of trials
    below = sum(math.comb(50, k) * bound**k * (1.0 - bound) ** (50 - k) for k in range(6))
    assert below == pytest.approx(0.05, rel=1e-9)


@pytest.mark.parametrize("mean", [0.5, 4.0, 40.0])
def test_coverage_of_unequal_weights(mean):
    generator, trials, held = np.random.default_rng(7), 3000, 0
    for _ in range(trials):
        weights = generator.uniform(0.0, 2.0, generator.poisson(mean))
        held += sum_bound(weights.sum(), (weights**2).sum(), np.array(2.0)) >= mean
    assert held / trials >= 0.95 - 1.64 * np.sqrt(0.05 * 0.95 / trials)


@pytest.mark.slow
@pytest.mark.parametrize("bundle", [1, 10, 100])
def test_coverage_where_hits_come_in_bundles(bundle):
    """Of 64 realisations each has 0.05 events on average, every one of so many hits: 96 % of bounds hold."""
    grid, trials, realisations, events = PolarGrid(8, 1, 10.0, 1), 2000, 64, 0.05
    generator = np.random.default_rng(11)
    held = 0
    for _ in range(trials):
        sums = PlaceSums(grid, 1.8)
        for number in generator.poisson(events, realisations):
            field = np.zeros(grid.shape)
            field[0, -1] = bundle * number
            sums.add(field, 0.0 * field)
        here = sums.places.of_cells[0, -1]
        (ground, _), _, _ = sums.worst(
            [sums.places.centre(here) + np.array([[0.0, 0.0], [1e-3, 0.0], [0.0, 1e-3]])], []
        )
        held += ground.upper * sums.places.area[here] >= bundle * events
    assert held / trials >= 0.95 - 2.0 * np.sqrt(0.05 * 0.95 / trials), held / trials


POISSON_NONE = 2.995732  # upper 95 % limit of the mean where nothing was counted
FOUR_OF_SIX = (2, 1, 1, 2)  # counts of four realisations, less scattered than Poisson's
BY_PAIRS = gamma.ppf(0.95, 64.0 / 10.0, scale=10.0 / 8.0)  # of the mean 6 + 2 and the variance 6 + 2 x 2
ALL_AT_ONCE = (6, 0, 0, 0)
BY_BUNDLE = gamma.ppf(0.95, 144.0 / 72.0, scale=72.0 / 12.0)  # of the mean 6 + 6 and the variance 4 x 9 + 6 x 6
SHELL = {"name": "shell", "profile": "m107", "explosive": "tnt", "casing": "steel_m107", "attitude": "upright",
         "position": ["0 m", "0 m", "1 m"]}  # fmt: skip
PERSON = {"name": "person", "position": ["80 m", "0 m"], "extent": "5 m"}
ROAD = {"name": "road", "kind": "road", "points": [["-20 m", "60 m"], ["20 m", "60 m"]], "width": "6 m",
        "target_area": "10 m^2", "number": 2}  # fmt: skip
OFFICE = {"name": "office", "kind": "building", "position": ["0 m", "-60 m"], "length": "9 m", "width": "9 m",
          "height": "3 m", "wall": {"material": "steel", "thickness": "9 mm"}}  # fmt: skip


GRID = PolarGrid.of(72, 10.0, 10.0, 200.0)


def assessed(entry, counts=None, fields=None, *, expected=None, alike=False):
    """Entry of summary.json of one site, by counts {name: in every realisation} or fields of every realisation."""
    case = case_from_document(
        {"title": "t", "burst": {"cell_size": "12 mm"}, "round": [SHELL], "exposed": [entry]}, source="case",
        folder=None,
    )  # fmt: skip
    (site,) = exposed_sites_of(case)
    sums = ExposedSums(case, [site], GRID, 10.0, alike=alike)
    for number in range(4):
        row = np.zeros(1 if site.prism is not None else 0, dtype=COUNTS)
        for name, values in (counts or {}).items():
            row[name] = values[number]
        empty = np.zeros(GRID.shape)
        sums.add(ExposedCounts({(site.energy, site.height): (empty, empty) if fields is None else fields[number]}, row))
    found = SimpleNamespace(expected=expected, undetermined="" if expected else "no flight", without_ricochet=None)
    return sums.assess(found)[0]


@pytest.mark.parametrize(
    ("counts", "bound"), [((0, 0, 0, 0), POISSON_NONE), (FOUR_OF_SIX, BY_PAIRS), (ALL_AT_ONCE, BY_BUNDLE)]
)
def test_densities_of_a_site_by_hand(counts, bound):
    """Landings over area, lengths over volume: mean, standard error of the mean, and the bound of the sum."""
    places = Places(GRID)
    (here,) = places.touched([np.array([[80.0, 0.9], [80.1, 0.9], [80.0, 1.0]])])
    turn, cell = np.argwhere(places.of_cells == here)[0]
    corners = places.corners[here]
    longest = np.hypot(max(np.hypot(*(one - other)) for one in corners for other in corners), 1.8) / 1.8
    fields = []
    for number in counts:
        landings = np.zeros(GRID.shape)
        landings[turn, cell] = number
        fields.append((landings, longest * landings))
    entry = assessed(PERSON | {"position": ["80 m", "0.9 m"], "extent": "0.1 m"}, fields=fields)
    area = places.area[here]
    mean, error = np.mean(counts), np.std(counts, ddof=1) / 2.0
    for name, unit in (("density_ground", area), ("density_normal", area / longest)):
        found = [value_at(entry, f"{name}.{key}") * unit for key in ("expected", "upper", "standard_error")]
        assert found == pytest.approx([mean, bound / 4.0, error], rel=1e-5), name
    assert entry.places == 1
    assert entry.worst_place == pytest.approx([80.0, 0.9], abs=5.0)


def test_every_target_on_a_road_counts():
    landings = np.zeros(GRID.shape)
    landings[:, 40:] = 0.05
    entry = assessed(ROAD, fields=4 * [(landings, landings)])
    hits = 2 * 10.0 * entry.density_normal.expected
    assert hits > 0.0
    assert entry.expected_hits.expected == pytest.approx(hits)
    assert entry.probability.expected == pytest.approx(1.0 - math.exp(-hits))


def test_hits_on_a_building_by_hand():
    """Three realisations of four hit, two through the wall; bounds 0.95^(1/4) of three in four, 0.9024 of two."""
    shadow = 9.0 * 3.0
    weights = np.array((2, 2, 2, 0)) / shadow
    counts = {"hits": (2, 2, 2, 0), "through": (1, 0, 1, 0), "fluence": weights, "fluence_squares": weights / shadow}
    entry = assessed(OFFICE, counts)
    assert entry.expected_hits.upper == pytest.approx(BY_PAIRS / 4.0, rel=1e-5)
    assert entry.density_normal.upper == pytest.approx(BY_PAIRS / 4.0 / shadow, rel=1e-5)
    assert to_json(entry.probability) == {"expected": 0.75, "upper": pytest.approx(0.95**0.25)}
    assert to_json(entry.not_stopped.probability) == {"expected": 0.5, "upper": pytest.approx(0.9024, abs=1e-4)}


def test_where_all_azimuths_are_alike_the_curve_is_taken_at_the_nearest_edge():
    """Its bootstrap's deviation is 0.1 of ten groups: 1.8331 by Student and (10 / 9)^(1/2) of it are the bound."""
    radius = np.geomspace(10.0, 500.0, 400)
    curve = np.stack([radius**-3.0, 2.0 * radius**-3.0])
    one, factor = np.array([110.0]), 1.8331 * math.sqrt(10.0 / 9.0)
    expected = ExpectedDistance(
        100.0, 110.0, 2.0, 90.0, 100.0, "all_azimuths", None, 10, 10, None, (), 0.0, np.zeros(1), one, one, radius,
        curve, curve * math.exp(-0.1 * factor), curve * math.exp(0.1 * factor),
    )  # fmt: skip
    entry = assessed(PERSON, expected=expected)
    for name, density in (("density_ground", 77.5**-3.0), ("density_normal", 2.0 * 77.5**-3.0)):
        found = [value_at(entry, f"{name}.{key}") / density for key in ("expected", "upper", "standard_error")]
        assert found == pytest.approx([1.0, math.exp(0.1 * factor), 0.1], rel=1e-4)
    assert entry.margin == pytest.approx(77.5 - 110.0, abs=0.01)
    own = assessed(PERSON | {"energy": "100 J"}, expected=expected)
    assert own.density_ground.expected == 0.0, "a site with an energy of its own takes what was counted for it"


@pytest.mark.parametrize(
    ("expected", "upper", "verdict"), [(0.9, 0.999, "met"), (0.9, 1.001, "not shown"), (1.001, 1.2, "not met")]
)
def test_the_bound_meets_a_criterion_and_the_estimate_fails_it(expected, upper, verdict):
    value = {"expected": 2.0 * expected, "upper": 2.0 * upper}
    less = {"expected": 0.0, "upper": 0.0}
    for kinds in ((value, less), (less, value)):
        entry = dict(zip(("density_normal", "density_ground"), kinds, strict=True))
        site = example(ExposedSite, **entry, criterion={"quantity": "density", "limit": 2.0})
        assert verdict_of(site) == verdict


def test_margin_and_nearest_edge_of_a_larger_area_are_never_better():
    """The nearest point of sides of 40 m and of 4 km is the same, and so is the distance to a line of 100 m there."""
    one = np.array([110.0])
    expected = ExpectedDistance(
        100.0, 110.0, 2.0, 90.0, 100.0, "worst_direction", 0.0, 10, 10, None, (), 0.0, np.zeros(1), one, one, one,
        np.zeros((2, 1)),
    )  # fmt: skip
    found = []
    for half in (20, 2000):
        corners = [[60, -half - 7], [60 + 2 * half, -half - 7], [60 + 2 * half, half], [60, half]]
        points = [[f"{x} m", f"{y} m"] for x, y in corners]
        entry = assessed({"name": "meadow", "kind": "area", "points": points}, expected=expected)
        found.append([entry.distance, entry.margin])
    assert found[1] == pytest.approx(found[0], abs=0.01)
    assert found[0] == pytest.approx([60.0, -50.0], abs=0.01)
