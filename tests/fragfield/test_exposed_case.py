"""The tables [[exposed]] and [document]: what is refused, and what places become."""

from __future__ import annotations

import numpy as np
import pytest

from fragfield.case import load_case
from fragfield.case.conversion.exposed_sites import describe_exposed, exposed_sites_of
from fragfield.case.conversion.surroundings import direction_words, site_of
from fragfield.errors import InputError
from fragfield.hazard.verdict import no_margin

SITE = '[site]\nlatitude = "51.5 deg"\nlongitude = "7 deg"\nbearing = "30 deg"\n'
ROUND = '[[round]]\nname = "a"\nprofile = "m107"\nexplosive = "tnt"\ncasing = "steel_m107"\nposition = ["0 m", "0 m", "1 m"]\n'  # noqa: E501

STORE = (
    '[[obstacle]]\nname = "store"\nkind = "building"\ncentre = ["40 m", "0 m"]\nlength = "9 m"\n'
    'width = "9 m"\nheight = "3 m"\n'
)
BUILDING = (
    '[[exposed]]\nname = "a"\nkind = "building"\nposition = ["40 m", "0 m"]\nlength = "9 m"\n'
    'width = "9 m"\nheight = "3 m"\n'
)


def load(tmp_path, text):
    path = tmp_path / "case.toml"
    path.write_text(text, encoding="utf-8")
    return load_case(path, burst=False)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            '[[exposed]]\nname = "a"\n',
            "exposed[1].position: found neither position and latitude and longitude; allowed: one",
        ),
        (
            '[[exposed]]\nname = "a"\nposition = ["9 m", "0 m"]\nmax_hits = 1.0\nmax_density = "1 m^-2"\n',
            "exposed[1].max_hits: found together with max_density; allowed: one criterion",
        ),
        ('[[exposed]]\nname = "a"\nlatitude = "5 deg"\nlongitude = "5 deg"\n', "found without a table [site]"),
        (
            SITE + '[[exposed]]\nname = "a"\nlatitude = "51.5 deg"\n',
            "found one of latitude and longitude; needed: both",
        ),
        (
            '[[exposed]]\nname = "a"\nkind = "building"\nposition = ["9 m", "0 m"]\n',
            "exposed[1].length: missing; a building",
        ),
        (
            '[[exposed]]\nname = "a"\nkind = "building"\nobstacle = "x"\n',
            'exposed[1].obstacle: found "x"; allowed: no [[obstacle]] of kind "building" is there',
        ),
        (
            '[[exposed]]\nname = "a"\nkind = "area"\npoints = [["0 m", "0 m"], ["9 m", "0 m"], ["2 m", "2 m"], ["0 m", "9 m"]]\n',  # noqa: E501
            "exposed[1].points: found a polygon that is not convex",
        ),
        (
            '[[exposed]]\nname = "a"\nkind = "road"\npoints = [["50 m", "0 m"], ["50 m", "9 m"]]\nmax_hits = 0.1\n',
            "exposed[1].target_area: missing; hits on a road need the area of a vehicle",
        ),
        (
            '[[exposed]]\nname = "a"\nposition = ["9 m", "0 m"]\n[[exposed]]\nname = "a"\nposition = ["8 m", "0 m"]\n',
            'exposed[2].name: found "a", the name of exposed[1]',
        ),
        ('[[exposed]]\nname = "a"\nplace = ["9 m", "0 m"]\n', 'exposed[1].place: this key is now called "position"'),
        (ROUND + '[[exposed]]\nname = "b"\nposition = ["0.2 m", "0 m"]\n', 'exposed "b": round "a" stands in it'),
        (
            BUILDING + 'wall = { material = "masonry", thickness = "24 cm" }\n',
            'found "masonry"',
        ),
        (
            STORE + '[[exposed]]\nname = "clerk"\nposition = ["42 m", "1 m"]\n',
            'exposed "clerk": it stands in obstacle "store", which lets nothing through',
        ),
        ('[document]\nnumer = "7"\n', "number"),
    ],
)
def test_faults_name_key_and_remedy(tmp_path, text, message):
    with pytest.raises(InputError) as caught:
        load(tmp_path, text)
    assert message in str(caught.value)


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


def test_pieces_cover_the_place_once(tmp_path):
    case = load(
        tmp_path,
        '[[exposed]]\nname = "road"\nkind = "road"\npoints = [["-100 m", "50 m"], ["40 m", "50 m"]]\nwidth = "6 m"\n'
        '[[exposed]]\nname = "yard"\nkind = "area"\npoints = [["50 m", "0 m"], ["90 m", "0 m"], ["70 m", "50 m"]]\n',
    )  # fmt: skip
    road, yard = exposed_sites_of(case)
    assert sum(prism.area for prism in road.prisms) == pytest.approx(140.0 * 6.0)
    assert sum(prism.area for prism in yard.prisms) == pytest.approx(1000.0, rel=0.01)
    assert sum(prism.area for prism in yard.prisms) <= 1000.0 + 1e-9
    assert len(road.prisms) == 14
    assert len(yard.prisms) <= 24


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
    without, within = (describe_exposed(load(tmp_path, more + OPEN.format(x=0, y=60)))[0] for more in ("", SITE))
    assert without["azimuth_deg"] == within["azimuth_deg"]
    assert without["bearing_deg"] is None
    assert (within["azimuth_deg"] + within["bearing_deg"]) % 360.0 == pytest.approx(30.0)
    assert direction_words(90.0, None) == "azimuth 90°"
    assert direction_words(90.0, 300.0) == "bearing 300° (WNW)"
    assert direction_words(90.1, 359.6, whole=True) == "bearing 0° (N)"
