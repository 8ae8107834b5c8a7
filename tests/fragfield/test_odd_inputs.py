"""Inputs as people bring them, odd ones among them: each is right, or refused in one line before anything runs.

Every entry: the files of a folder, the command there, its exit code, and words that it says.
"""
# ruff: noqa: E501 - an input a line

from __future__ import annotations

import json
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import openpyxl
import pytest
from openpyxl.comments import Comment

import flight
from fragfield.hazard.verdict import part_of_criterion
from fragfield.results.site import ExposedSite
from tests.fragfield import maps
from tests.fragfield.drawn_shells import write_dxf
from tests.fragfield.short_run import invoke
from tests.fragfield.test_places import at

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    File = str | bytes | Callable[..., object]


class Input(NamedTuple):
    """What is given, and what is said."""

    files: Mapping[str, File]
    command: tuple[str, ...]
    code: int
    words: tuple[str, ...]
    never: tuple[str, ...] = ()


ROUND = (
    '[burst]\ncell_size = "12 mm"\nconvergence = "off"\n[[round]]\nname = "shell"\nprofile = "m107"\n'
    'explosive = "tnt"\ncasing = "steel_m107"\nattitude = "upright"\nposition = ["0 m", "0 m", "1 m"]\n'
)
SITE = '[site]\nlatitude = "51.5 deg"\nlongitude = "7 deg"\nbearing = "90 deg"\n'


def table(of, **keys):
    """A table of a case; lists and texts are written alike in TOML and JSON."""
    return f"[[{of}]]\n" + "".join(f"{key} = {json.dumps(value, ensure_ascii=False)}\n" for key, value in keys.items())


def place(*points):
    return [[f"{x} m", f"{y} m"] for x, y in points]


def exposed(points=None, **keys):
    return table("exposed", name="spot", **({"points": place(*points)} if points else {}), **keys)


def wall(start, end, height=3, name="w", kind="wall", **keys):
    ends = {"start": [f"{v} m" for v in start], "end": [f"{v} m" for v in end]}
    return table("obstacle", name=name, kind=kind, height=f"{height} m", **ends, **keys)


def ring(away, height):
    sides = ((-1, 1, 1, 1), (-1, -1, 1, -1), (-1, -1, -1, 1), (1, -1, 1, 1))
    walls = (wall((away * a, away * b), (away * c, away * d), height, f"w{n}") for n, (a, b, c, d) in enumerate(sides))
    return '[hazard]\nprotective_works = ["w0", "w1", "w2", "w3"]\n' + "".join(walls)


def checked(text, code, *words, never=(), **files):
    return Input({"case.toml": text, **files}, ("check", "case.toml"), code, words, tuple(never))


def flown(data, code, *words, text=ROUND):
    return Input({"case.toml": text, "t.csv": data}, ("check", "case.toml", "--fragments", "t.csv"), code, words)


def imported(data, code, *words, name="t.xlsx"):
    return Input({name: data}, ("import", name), code, words)


def grid(height, half=2000, cell=50):
    along = np.arange(-half, half + cell / 2, cell)
    rows = "\n".join(" ".join(f"{height(x, y):g}" for x in along) for y in along[::-1])
    head = f"ncols {len(along)}\nnrows {len(along)}\nxllcenter {-half}\nyllcenter {-half}\ncellsize {cell}\n"
    return f"{head}NODATA_value -9999\n{rows}\n"


def ground(beyond="level", file="m.asc", site=(0, 0)):
    return (
        f'[flight.ground]\nmap = "{file}"\nsite = ["{site[0]} m", "{site[1]} m"]\nricochet = "none"\n'
        f'beyond = "{beyond}"\n'
    )


def geotiff(change, **options):
    def write(path):
        heights = maps.slope(*maps.north_up(50.0, 2000.0))
        change(heights)
        maps.write(path, heights.astype("float32"), maps.metres(cell=50.0, half=2000.0), **options)

    return write


def hole(value):
    def change(heights):
        heights[10:13, 10:13] = value

    return change


def kml(*marks):
    return f'<kml xmlns="http://www.opengis.net/kml/2.2"><Document>{"".join(marks)}</Document></kml>'


def mark(name, *points, more="", **data):
    values = "".join(f'<Data name="{key}"><value>{value}</value></Data>' for key, value in data.items())
    kind = "Point" if len(points) == 1 else "LineString"
    where = " ".join("{},{}".format(*at(*point)) for point in points)
    geometry = f"<{kind}><coordinates>{where}</coordinates></{kind}>"
    return f"<Placemark><name>{name}</name>{more}<ExtendedData>{values}</ExtendedData>{geometry}</Placemark>"


GATE = mark("gate", (80, 0), kind="person")
HIDDEN = "<visibility> 0 </visibility>"


def bank(more="", height="4 m"):
    return mark("bank", (40, -20), (40, 20), more=more, kind="barricade", height=height)


def placed(file, code, *words, never=()):
    return checked(f'{ROUND}{SITE}places = "p.kml"\n', code, *words, never=never, **{"p.kml": file})


def drawn(change, code, *words):
    contour = 'contour = { file = "d.dxf", charge_front = "50 mm", fuze = "0.192 kg" }'
    text = ROUND.replace('profile = "m107"', contour).replace("steel_m107", "steel_paper")
    return checked(text, code, *words, **{"d.dxf": lambda path: write_dxf(path, change)})


def outline(document, corners, **attributes):
    space = document.modelspace()
    space.add_lwpolyline([tuple(one) for one in corners], format="xyb", close=True,
                         dxfattribs={"layer": "CASING", **attributes})  # fmt: skip


def beside(draw):
    """A drawing with the outline, and something more."""

    def made(document, corners):
        outline(document, corners)
        draw(document, corners)

    return made


def book(change):
    def write(path):
        made = openpyxl.Workbook()
        for line in (
            ["zone", "number", "mean mass (g)", "speed (m/s)"],
            ["0-90", 300, 15, 800],
            ["90-180", 400, 22.5, 900],
        ):
            made.active.append(line)
        change(made.active)
        made.save(path)

    return write


def hidden(dimensions, which):
    return lambda sheet: setattr(getattr(sheet, dimensions)[which], "hidden", True)


ARENA = "zone_from_deg,zone_to_deg,mass_from_kg,mass_to_kg,number,mean_mass_kg,mean_speed_m_s,max_speed_m_s\n"


def arena(number=90, mass=0.03, unit=1.0, zones=12, group=(0.001, 0.2)):
    edges = np.linspace(0, 180, zones + 1)
    low, high = group[0] * unit, group[1] * unit
    rows = (f"{a:g},{b:g},{low},{high},{number},{mass * unit},900,1200" for a, b in pairwise(edges))
    return ARENA + "\n".join(rows) + "\n"


def pieces(mass, x=0):
    return f"mass_kg,vx_m_s,vy_m_s,vz_m_s,x_m,y_m,z_m\n{mass},500,0,100,{x},0,1\n{mass},0,500,100,{x},0,1\n"


def mesh(tags, names=("casing", "charge"), kind=5, corners="1 2 3 4 5 6 7 8"):
    """A cube in a file of gmsh, once for each tag of a physical volume."""
    cube = ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1))
    parts = {
        "MeshFormat": ["2.2 0 8"],
        "PhysicalNames": [len(names), *(f'3 {number} "{name}"' for number, name in enumerate(names, 1))],
        "Nodes": [len(cube), *("{} {} {} {}".format(number, *node) for number, node in enumerate(cube, 1))],
        "Elements": [len(tags), *(f"{number} {kind} 2 {tag} 1 {corners}" for number, tag in enumerate(tags, 1))],
    }
    return "".join(
        f"${name}\n" + "".join(f"{line}\n" for line in lines) + f"$End{name}\n" for name, lines in parts.items()
    )


def meshed(data, *words):
    return checked(ROUND.replace('profile = "m107"', 'mesh = "m.msh"\nmesh_unit = "mm"'), 2, *words, **{"m.msh": data})


def ranged(*words, said):
    stack = '[stack]\narrangement = "row"\ncount = 4\ngap = "50 mm"\n'
    return Input({"case.toml": ROUND + stack}, (words[0], "case.toml", *words[1:]), 2, (said,))


MASSES = "zone;number;mean mass (g);speed (m/s)\n"
HALL = {"kind": "building", "length": "9 m", "width": "9 m", "height": "3 m"}

INPUTS = {
    # areas, roads, places
    "an area with a notch": checked(ROUND + exposed([(60, 0), (100, 0), (100, 20), (80, 20), (80, 40), (60, 40)], kind="area"), 2, "exposed[1].points: found a polygon that is not convex"),
    "an area as a bow tie": checked(ROUND + exposed([(60, 0), (100, 0), (60, 40), (100, 40)], kind="area"), 2, "not convex"),
    "an area drawn clockwise": checked(ROUND + exposed([(60, 0), (60, 40), (100, 40), (100, 0)], kind="area"), 0, "exposed spot: area, 60.0 m at azimuth 0°"),
    "an area around the rounds": checked(ROUND + exposed([(-60, -60), (60, -60), (60, 60), (-60, 60)], kind="area"), 2, 'round "shell" stands in it'),
    "a road of one point": checked(ROUND + exposed([(60, 0)], kind="road"), 2, "exposed[1].points: found", "allowed: a list of at least 2"),
    "a road that stands still": checked(ROUND + exposed([(60, 0), (60, 0), (80, 10)], kind="road"), 2, "two points of the road are the same"),
    "latitude and longitude exchanged": checked(ROUND + SITE + exposed(latitude="7 deg", longitude="51.5 deg"), 2, "it lies 6,397 km from the origin of distances", "are latitude and longitude exchanged?"),
    "a person by the centre": checked(ROUND + exposed(centre=["60 m", "0 m"]), 2, 'exposed[1].centre: unknown key (did you mean "position"?)'),
    "a building by the centre": checked(ROUND + table("obstacle", name="hall", centre=["60 m", "0 m"], **HALL), 2, 'obstacle[1].centre: unknown key (did you mean "position"?)'),
    # numbers and units
    "a blank between thousands": checked(ROUND + exposed(position=["1 200 m", "0 m"]), 2, 'exposed[1].position: component 1: found "1 200 m", which has two numbers side by side'),
    "a narrow blank between thousands": checked(ROUND.replace("12 mm", "0.012\u202f000 m"), 2, "which has two numbers side by side; a number has no space between thousands"),
    "a decimal comma": checked(ROUND.replace("12 mm", "12,5 mm"), 2, 'burst.cell_size: found "12,5 mm", which has a comma'),
    "a no-break space before the unit": checked(ROUND + exposed(position=["60\u00a0m", "0 m"]), 0, "exposed spot: person, 57.5 m"),
    "the casing in grams": checked(ROUND.replace("attitude", 'expected = { casing = "34530 g" }\nattitude'), 0, "34.53"),
    "the casing a thousand times too heavy": checked(ROUND.replace("attitude", 'expected = { casing = "34530 kg" }\nattitude'), 2, "give 34.53 kg, 1000 times less"),
    "a name of dollars and brackets": checked(ROUND.replace('"shell"', '"a [red]b[/red] {0} $a^{b$"'), 0, "a [red]b[/red] {0} $a^{b$"),
    "a wind by bearing": checked(ROUND + SITE + '[flight.wind]\nmodel = "constant"\nspeed = "36 km/h"\ntowards = "90 deg"\n', 0, "wind: 10 m/s towards bearing 0° (N) at all heights", never=("360°",)),
    "a round that lies by bearing": checked(ROUND.replace('"upright"', '"lying"\nbearing = "90 deg"'), 2, "round[1].bearing: unknown key (directions are azimuths here, from +x counter-clockwise); allowed here:", "azimuth"),
    "a wind whose heights fall": checked(ROUND + '[flight.wind]\nmodel = "profile"\nheights = ["0 m", "50 m", "10 m"]\nspeeds = ["1 m/s", "5 m/s", "3 m/s"]\ndirections = ["0 deg", "0 deg", "0 deg"]\n', 2, "flight.wind.heights: found [0.0, 50.0, 10.0]"),
    # works and obstacles
    "works close by": checked(ROUND + ring(3, 4.5), 0, "at least 204 m (disposal in the open, incomplete)", "Apply 1,185 m unless the authority agrees"),
    "works that are low": checked(ROUND + ring(3, 2), 2, "which close 0 of 360 degrees around the rounds up to 30 degrees over them"),
    "works far off": checked(ROUND + ring(300, 4.5), 2, "which close 0 of 360 degrees"),
    "walls that are no works": checked(ROUND + ring(3, 4.5).partition("[[")[2].join(["[[", ""]), 0, "1,185 m (disposal in the open)", never=("incomplete",)),
    "works that are exposed": checked(ROUND + '[hazard]\nprotective_works = ["spot"]\n' + exposed(position=["60 m", "0 m"], **HALL), 2, 'hazard.protective_works: found "spot"; allowed: none'),
    "a wall in the burst's way": checked(ROUND + wall((0.25, -5), (0.25, 5)), 0, "whose casing grows to about 0.2", "a run whose fragments start inside it is refused"),
    "a wall through the round": checked(ROUND + wall((0, -5), (0, 5)), 2, "1 rounds start inside it"),
    # maps of heights
    "a bank over a gully": checked(ROUND + wall((20, -50), (20, 50), 4, kind="barricade") + ground(), 0, "its top 4 m over the ground below", **{"m.asc": grid(lambda x, y: -8.0 * (abs(y) < 13), cell=20)}),
    "a bank whose base lies below the ground": checked(ROUND + wall((20, -50), (20, 50), 4, kind="barricade", base="-6 m") + ground(), 2, "its top at -2 m is not above the ground there, 0 m", **{"m.asc": grid(lambda x, y: 0)}),
    "a map too small for images": checked(ROUND.replace('["0 m", "0 m", "1 m"]', '["0.2 m", "0.2 m", "1 m"]') + "".join(table("plane", name=n, kind="symmetry", normal=normal, point=["0 m", "0 m", "0 m"]) for n, normal in (("x", [1, 0, 0]), ("y", [0, 1, 0]))) + ground("refuse"), 2, "fragments may fly up to about 1084 m", **{"m.asc": grid(lambda x, y: 0, 1040, 20)}),
    "a hole filled by zeros": checked(ROUND + ground(file="m.tif", site=maps.SITE), 0, "warning: flight.ground.map: neighbours rise", "is a hole filled by a number?", **{"m.tif": geotiff(hole(0.0))}),
    "a hole that is not declared": checked(ROUND + ground(file="m.tif", site=maps.SITE), 2, "9 of 6561 heights are beyond -500 to 9000 m", **{"m.tif": geotiff(hole(-9999.0))}),
    "a hole that is declared": checked(ROUND + ground(file="m.tif", site=maps.SITE), 2, "9 of 6561 nodes have no height", **{"m.tif": geotiff(hole(-9999.0), nodata=-9999)}),
    # places of a map
    "a bank that is hidden": placed(kml(GATE, bank(HIDDEN)), 0, "1 placemarks switched off in the file (visibility 0) left out", never=("obstacle bank",)),
    "a folder that is hidden": placed(kml(GATE, f"<Folder><name>old</name>{HIDDEN}{bank()}</Folder>"), 0, "1 placemarks switched off", never=("obstacle bank",)),
    "a map of hidden places": placed(kml(mark("gate", (80, 0), more=HIDDEN, kind="person")), 2, "found no placemark", "1 placemarks switched off"),
    "a bank with a decimal comma": placed(kml(GATE, bank(height="4,5 m")), 2, 'placemark 2 ("bank"): height: found "4,5 m", which has a comma'),
    "a map with longitude second": placed(kml(GATE.replace("{},{}".format(*at(80, 0)), "51.5,7")), 2, "are exchanged; allowed: longitude first"),
    # drawings
    "a circle of no radius": drawn(beside(lambda d, c: d.modelspace().add_circle((0, 0), 0.0, dxfattribs={"layer": "CASING"})), 0, "11.73", "no contour: 1 CIRCLE of no length"),
    "an outline drawn twice": drawn(beside(outline), 0, "11.73", "that were there twice left out"),
    "an outline that is invisible": drawn(lambda d, c: outline(d, c, invisible=1), 2, "only 1 on a layer that is off or frozen, or invisible"),
    "an empty drawing": drawn(lambda d, c: None, 2, "found no line, arc, circle, ellipse, spline or polyline in the model space"),
    # meshes of others, ranges of studies
    "a mesh of tetrahedra": meshed(mesh([1], kind=4, corners="1 2 3 5"), "1 cells of type 'tetra' in group 'casing'"),
    "a volume in two groups": meshed(mesh([1, 2]), "1 hexahedra belong to the physical volumes 'casing' and 'charge'"),
    "a group of another name": meshed(mesh([1], names=("shell",)), "physical volume 'shell' is unknown"),
    "an empty mesh": meshed("", "m.msh: not a readable gmsh mesh (found no $MeshFormat)"),
    "a limit without a unit": ranged("limit", "stack.count=1..4", "--distance", "300", said='--distance: found "300" without a unit'),
    "a limit that falls": ranged("limit", "stack.count=4..1", "--distance", "300 m", said="needed: a range that rises"),
    "a sweep of bare numbers": ranged("sweep", "burst.cell_size=8,6", said="burst.cell_size: found the bare number 8 without a unit"),
    # tables of tests
    "a hidden column": imported(book(hidden("column_dimensions", "C")), 0, "total mass: 13.5 kg"),
    "a filtered row": imported(book(hidden("row_dimensions", 3)), 0, "pieces: 700"),
    "a comment": imported(book(lambda sheet: setattr(sheet["B2"], "comment", Comment("1", "me"))), 0, "pieces: 700"),
    "decimal commas": imported(f"{MASSES}0-90;300;15,5;800\n90-180;400;22,5;900\n", 0, "total mass: 13.65 kg", name="t.csv"),
    "a point that may part thousands": imported(f"{MASSES}0-90;1.300;15;800\n90-180;400;22;900\n", 2, "'1.300' is 1.300 or 1300", name="t.csv"),
    "no masses": imported("zone;number;speed (m/s)\n0-90;300;800\n90-180;400;900\n", 2, "mean_mass missing", name="t.csv"),
    "more than the casing": flown(arena(900), 2, "938 % of the 34.53 kg of the casing"),
    "a table of one zone": flown(arena(zones=1, number=1080), 2, "zones of at most 30 degrees"),
    "a table of coarse zones": flown(arena(), 0, "the arena table holds 32.4 kg of fragments, 93.8 % of the 34.53 kg"),
    "a table in grams": flown(arena(unit=1e3), 2, "3.24e+04 kg of fragments, 9.38e+04 % of the 34.53 kg"),
    "a mean mass outside its group": flown(arena(mass=0.3), 2, "outside its own group of mass; allowed: 0.001 to 0.2 kg"),
    "fragments in grams": flown(pieces(20), 2, "116 % of the 34.53 kg of the casings, the heaviest of 20 kg"),
    "fragments in a wall": flown(pieces(0.02, 5), 2, "t.csv: obstacle w: 2 fragments start inside it", text=wall((5, -5), (5, 5))),
    "two fragments": flown(pieces(0.02), 0, "0.116 % of the 34.53 kg of the casings: densities and distances are those of these alone"),
}  # fmt: skip


@pytest.mark.parametrize("name", INPUTS)
def test_an_input_is_right_or_refused_in_one_line(tmp_path, name):
    given = INPUTS[name]
    for file, data in given.files.items():
        if callable(data):
            data(tmp_path / file)
        else:
            (tmp_path / file).write_bytes(data if isinstance(data, bytes) else data.encode())
    done = invoke(*(tmp_path / word if word in given.files else word for word in given.command))
    said = done.stdout + done.stderr
    assert done.exit_code == given.code, said
    for words in given.words:
        assert words in said
    assert not any(words in said for words in given.never), said
    if given.code:
        assert done.stdout == ""
        assert len(done.stderr.strip().splitlines()) == 1


def test_a_power_law_blows_over_low_ground_as_over_high():
    landed = []
    for height in (0.0, -200.0, 300.0):
        shot = flight.Fragments([0.02, 0.05], (0.0, 0.0, height + 1.0), [[500.0, 0.0, 300.0], [-300.0, 400.0, 200.0]])
        wind, air = flight.Wind.power_law(20.0, 0.0), flight.ConstantAir(1.2)
        found = flight.fly(shot, ground=height, wind=wind, air=air, ricochet="none").landing["position"]
        landed.append(found - (0.0, 0.0, height))
    assert landed[0] == pytest.approx(landed[1], abs=1e-3)
    assert landed[0] == pytest.approx(landed[2], abs=1e-3)


@pytest.mark.slow
def test_a_larger_site_is_never_safer_than_the_one_within_it(tmp_path):
    sites = ([(60, -20), (100, -20), (100, 20), (60, 20)], [(60, -700), (1460, -700), (1460, 700), (60, 700)])
    text = ROUND + "[hazard]\nmax_realisations = 8\n[break_up]\nrealisations = 8\n" + wall((-300, -5), (-300, 5))
    for number, points in enumerate(sites):
        text += exposed(points, kind="area").replace("spot", f"meadow {number}")
    text += exposed([(60, -20), (60, 20)], kind="road") + exposed([(60, -900), (60, 900)], kind="road").replace(
        "place", "all"
    )
    (tmp_path / "case.toml").write_text(text)
    (tmp_path / "t.csv").write_text(arena())
    done = invoke("fly", tmp_path / "case.toml", "--fragments", tmp_path / "t.csv", "--out", tmp_path / "run", "--json")
    small, large, short, long = (part_of_criterion(ExposedSite.read(one)) for one in json.loads(done.stdout)["exposed"])
    assert 1.0 < small <= large
    assert 1.0 < short <= long
