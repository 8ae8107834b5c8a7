"""Exposed sites beside rounds of any attitude: densities from fields in all directions, and the worst of attitudes."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import gamma

from flight.fluence import PolarGrid
from flight.hazard.exposed import COUNTS
from fragfield.case.conversion.exposed_sites import exposed_sites_of
from fragfield.case.load import case_from_document
from fragfield.hazard.exposed import ExposedCounts, ExposedSums, worst_of_attitudes
from fragfield.hazard.places import Places
from fragfield.hazard.verdict import part_of_criterion
from fragfield.results.site import ExposedSite
from tests.fragfield.example_results import example

GRID, KERNEL = PolarGrid.of(72, 10.0, 10.0, 400.0), 10.0
AREA = 55.7


def sites(azimuth: float) -> ExposedSums:
    """A person, a road and an area around this azimuth (degrees), in one attitude."""
    turn = np.radians(azimuth)
    along, across = np.array([np.cos(turn), np.sin(turn)]), np.array([-np.sin(turn), np.cos(turn)])

    def points(*pairs: tuple[float, float]) -> list[list[str]]:
        return [[f"{value:.12g} m" for value in x * along + y * across] for x, y in pairs]

    exposed = [
        {"name": "person", "position": points((80.0, 0.0))[0], "extent": "5 m"},
        {"name": "road", "kind": "road", "points": points((60.0, -90.0), (60.0, 90.0))},
        {"name": "area", "kind": "area", "points": points((90.0, -40.0), (140.0, -40.0), (140.0, 40.0), (90.0, 40.0))},
    ]
    shell = {"name": "shell", "profile": "m107", "explosive": "tnt", "casing": "steel_m107", "attitude": "any",
             "position": ["0 m", "0 m", "1 m"]}  # fmt: skip
    case = case_from_document({"title": "t", "burst": {"cell_size": "12 mm"}, "round": [shell], "exposed": exposed},
                              source="case", folder=None)  # fmt: skip
    return ExposedSums(case, exposed_sites_of(case), GRID, KERNEL, turned=True)


def add(sums: ExposedSums, landings: np.ndarray, paths: np.ndarray) -> None:
    site = sums.sites[0]
    sums.add(ExposedCounts({(site.energy, site.height): (landings, paths)}, np.zeros(0, dtype=COUNTS)))


def cell_areas() -> np.ndarray:
    return 0.5 * np.radians(GRID.width) * np.diff(GRID.edges**2)


def entries(sums: ExposedSums) -> list[dict]:
    from flight.hazard.density.expected import ExpectedDistance
    from flight.hazard.ensemble import EnsembleHazard

    one = np.array([100.0])
    expected = ExpectedDistance(100.0, 110.0, 2.0, 90.0, 100.0, "worst_direction", 0.0, 10, 10, KERNEL, (), 0.0,
                                np.zeros(1), one, one, one, np.zeros((2, 1)))  # fmt: skip
    found = object.__new__(EnsembleHazard)
    for name, value in (("expected", expected), ("undetermined", "")):
        object.__setattr__(found, name, value)
    return sums.assess(found)


def test_an_even_density_is_found_at_every_site() -> None:
    sums = sites(20.0)
    landings = 0.3 / AREA * np.broadcast_to(cell_areas(), GRID.shape)
    for _ in range(10):
        add(sums, landings, 2.0 * landings)
    for entry in entries(sums):
        assert AREA * entry.density_ground.expected == pytest.approx(0.3, rel=1e-9)
        assert AREA * entry.density_normal.expected == pytest.approx(0.6, rel=1e-9)
        assert entry.largest_energy is None
        assert AREA * entry.density_ground.upper > 0.3


def test_the_direction_of_the_nose_is_the_worst_whatever_the_azimuth_of_a_site() -> None:
    """A beam of fragments 30 degrees wide on one side of the rounds meets every site, wherever it stands."""
    beam = np.zeros(GRID.shape)
    beam[:8] = 5.0 / AREA * cell_areas()
    found = []
    for azimuth in (0.37 * GRID.width, 2.37 * GRID.width, 35.37 * GRID.width):  # no point on the edge of a cell
        sums = sites(azimuth)
        add(sums, beam, 0.0 * beam)
        found.append([AREA * entry.density_ground.expected for entry in entries(sums)])
    for person, road, area in found:
        assert (person, road) == pytest.approx(found[0][:2], rel=1e-9)
        assert (person, area) == pytest.approx((5.0, 5.0), rel=1e-2), "wider than kernel and pieces, however cut"
    assert entries(sums)[0].verdict == "not met"


@pytest.mark.parametrize("alike", [False, True])
def test_bounds_of_a_person_by_hand(alike: bool) -> None:
    """What a single landing may add at most is found by trying every azimuth: Poisson's bounds are multiples of it."""
    every = sites(0.0)
    places = Places(GRID)
    rings = places.ring[places.touched(every.sites[0].pieces)]
    cell = int(np.flatnonzero(np.isin(places.ring[places.of_cells[0]], rings))[0])

    def person(counts: tuple[int, ...], turn: int = 0) -> ExposedSite:
        sums = ExposedSums(every.case, every.sites[:1], GRID, KERNEL, turned=True, alike=alike)
        for number in counts:
            field = np.zeros(GRID.shape)
            field[turn, cell] = number
            add(sums, field, field)
        return entries(sums)[0]

    most = max(person((1,), turn).density_ground.expected for turn in range(GRID.azimuth_cells))
    found = person((2, 1, 1, 2)).density_ground
    wanted = {"expected": 1.5 * most, "upper": gamma.ppf(0.95, 6.4, scale=1.25) / 4.0 * most}
    assert {key: getattr(found, key) for key in wanted} == pytest.approx(wanted, rel=0.03), (
        "a little more: of smaller places"
    )
    assert found.standard_error == pytest.approx(most / np.sqrt(12.0), rel=1e-4)
    assert person((0,)).density_ground.upper >= 2.9957 * most * (1.0 - 1e-4)


def test_of_attitudes_the_one_nearest_to_the_criterion_counts() -> None:
    def entry(upper: float | None) -> ExposedSite:
        density = None if upper is None else {"expected": 0.5 * upper, "upper": upper, "standard_error": 0.0}
        limit = {"quantity": "density", "limit": 1.0}
        return example(ExposedSite, criterion=limit, density_normal=density, density_ground=density)

    rows = [((0.0, 0.0), [entry(0.2)]), ((90.0, 30.0), [entry(0.9)]), ((180.0, 0.0), [entry(0.4)])]
    (worst,) = worst_of_attitudes(rows)
    assert part_of_criterion(worst) == 0.9
    assert (worst.worst_inclination_deg, worst.worst_roll_deg) == (90.0, 30.0)
    (open_,) = worst_of_attitudes([*rows, ((60.0, 0.0), [entry(None)])])
    assert open_.worst_inclination_deg == 60.0, "what is not determined in one attitude is not determined"
