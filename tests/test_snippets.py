"""Python snippets of the texts: run as they stand, and their hazard distance is the command's, to the last digit.

The page on Python is run by `tests/test_examples.py`, other pages of the guide by `tests/test_docs.py`.
"""

from __future__ import annotations

import contextlib
import csv
import io
import json
import re
from pathlib import Path

import numpy as np
import pytest

from tests.fragfield.short_run import invoke

ROOT = Path(__file__).resolve().parent.parent
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```\n", re.MULTILINE | re.DOTALL)
NUMBER = re.compile(r"\d+(?:\.\d+)?")


def blocks(name: str, begin: str = "", end: str = "\n## ") -> list[tuple[str, str]]:
    """Languages and texts of the fenced blocks of a page, or of its part from a heading to the next."""
    text = (ROOT / name).read_text(encoding="utf-8")
    if begin:
        text = text[text.index(f"{begin}\n") :]
        text = text[: text.index(end, len(begin))]
    return BLOCK.findall(text)


def run_snippets(codes: list[str], folder: Path, **replaced: str) -> tuple[dict[str, object], str]:
    """Run blocks as one program in a folder: its names, and what it printed."""
    names: dict[str, object] = {"__name__": "__main__"}
    output = io.StringIO()
    with contextlib.chdir(folder), contextlib.redirect_stdout(output):
        for code in codes:
            for old, new in replaced.items():
                code = code.replace(old, new)
            exec(compile(code, "snippet", "exec"), names)
    return names, output.getvalue()


def assert_printed(printed: str, shown: str) -> None:
    """The same words, and numbers to one in a thousand (or in their last digit)."""
    assert NUMBER.sub("", printed) == NUMBER.sub("", shown)
    ours, theirs = ([float(one) for one in NUMBER.findall(text)] for text in (printed, shown))
    assert ours == pytest.approx(theirs, rel=1e-3, abs=0.06)


def write_fragments(path: Path, generator: np.random.Generator) -> None:
    """Fragments of a test, evenly over the upper half of the sphere."""
    direction = generator.normal(size=(300, 3))
    direction[:, 2] = np.abs(direction[:, 2])
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    with path.open("w", newline="", encoding="utf-8") as file:
        table = csv.writer(file)
        table.writerow(["mass_kg", "vx_m_s", "vy_m_s", "vz_m_s", "x_m", "y_m", "z_m"])
        rows = zip(generator.exponential(0.01, size=300), direction, strict=True)
        table.writerows([mass, *(1000.0 * one), 0.0, 0.0, 1.5] for mass, one in rows)


def write_cookbook_test(folder: Path) -> None:
    """The file test.csv that the cookbook flies."""
    write_fragments(folder / "test.csv", np.random.default_rng(1))


def write_tests(folder: Path) -> None:
    """Fragments of three tests."""
    generator = np.random.default_rng(2)
    for name in ("first", "second", "third"):
        write_fragments(folder / f"{name}.csv", generator)


def command(folder: Path, name: str, case: str, fragments: str) -> dict[str, object]:
    """The part hazard that `fragfield fly` writes into a folder of this name for a case and a file of fragments."""
    (folder / f"{name}.toml").write_text(case, encoding="utf-8")
    with contextlib.chdir(folder):
        done = invoke("fly", f"{name}.toml", "--fragments", fragments, "--out", name)
    assert done.exit_code == 0, done.output
    return json.loads((folder / name / "summary.json").read_text(encoding="utf-8"))["hazard"]


KEYS = ("expected", "upper", "standard_error", "direction_deg", "distance_ground", "distance_normal", "max_bias")


def numbers_of(found) -> list[float | None]:
    """What `KEYS` name, of a distance of the library."""
    return [found.distance, found.upper, found.standard_error, found.direction, found.ground, found.normal,
            found.max_bias]  # fmt: skip


def test_the_cookbook_flies_a_test_to_the_number_of_the_command(tmp_path):
    """Its case file and its snippet: one number, and the one that it shows."""
    parts = blocks("docs/guide/cookbook.md", "## Fly the fragments of a test")
    codes = [text for language, text in parts if language == "python"]
    (case,) = (text for language, text in parts if language == "toml")
    (shown,) = (text for language, text in parts if language == "output")
    write_cookbook_test(tmp_path)
    names, printed = run_snippets(codes, tmp_path)
    hazard = command(tmp_path, "cookbook", case, "test.csv")
    assert numbers_of(names["found"]) == [hazard[key] for key in KEYS]
    short = names["found"].without_ricochet
    assert [short.distance, short.upper] == [hazard["without_ricochet"][key] for key in ("expected", "upper")]
    assert hazard["expected"] > 100.0
    assert_printed(printed, shown)


def test_the_library_and_the_command_agree_where_nothing_is_said(tmp_path):
    """An empty case and a call without arguments; and with wind, another ground and another criterion in both."""
    import flight
    from flight.hazard import Criteria

    write_tests(tmp_path)
    fragments = flight.Fragments.read(tmp_path / "first.csv")
    hazard = command(tmp_path, "plain", 'title = "as it comes"\n', "first.csv")
    assert numbers_of(flight.hazard_distance(fragments)) == [hazard[key] for key in KEYS]
    case = (
        'title = "otherwise"\n[flight]\nwind = { speed = "9 m/s", towards = "90 deg" }\n'
        'ground = { ricochet = "rock" }\n'
        'air = { model = "constant", density = "1.1 kg/m^3" }\n[hazard]\nenergy = "120 J"\nkernel = "15 deg"\n'
    )
    hazard = command(tmp_path, "other", case, "first.csv")
    found = flight.hazard_distance(
        fragments, Criteria(energy=120.0), kernel=15.0, wind=flight.Wind.constant(9.0, 90.0), ricochet="rock",
        air=flight.ConstantAir(1.1, 340.294),
    )  # fmt: skip
    assert numbers_of(found) == [hazard[key] for key in KEYS]


def test_the_library_readme_prints_what_it_shows(tmp_path):
    """A screen of text, run as it stands."""
    page = (ROOT / "flight" / "README.md").read_text(encoding="utf-8")
    assert page.count("\n") <= 70
    texts = dict(blocks("flight/README.md"))
    _, printed = run_snippets([texts["python"]], tmp_path)
    assert_printed(printed, texts["text"])


def test_the_page_of_the_flight_runs_from_its_first_line_to_its_last(tmp_path):
    pytest.importorskip("pandas")
    write_tests(tmp_path)
    parts = blocks("docs/guide/flight.md")
    names, printed = run_snippets([text for language, text in parts if language == "python"], tmp_path)
    (shown,) = (text for language, text in parts if language == "text")
    assert_printed(printed[printed.index("barricade") :], shown)
    assert names["ensemble"].expected.distance > 0.0


@pytest.mark.slow
@pytest.mark.dolfinx
def test_the_readme_runs_a_case_to_the_number_of_its_summary(tmp_path):
    pytest.importorskip("pandas")
    (tmp_path / "cases").symlink_to(ROOT / "cases")
    (code,) = (text for language, text in blocks("README.md") if language == "python")
    assert "6 mm" in code
    coarse = {'"burst.cell_size": "6 mm"': '"burst.cell_size": "12 mm", "burst.convergence": "off"'}
    names, printed = run_snippets([code], tmp_path, **coarse)
    summary = json.loads((tmp_path / "runs" / "m107" / "summary.json").read_text(encoding="utf-8"))
    assert printed.startswith(str(names["run"].hazard.recommended))
    assert names["run"].hazard.recommended == summary["hazard"]["recommended"]


@pytest.mark.dolfinx
def test_a_map_of_the_guide_is_read_as_the_page_shows(tmp_path):
    """Its case file, what `check` prints of the map, and the snippet, with a GeoTIFF in decimetres on UTM."""
    pytest.importorskip("rasterio")
    from tests.fragfield.maps import metres, north_up, slope, write

    heights = np.rint(10.0 * slope(*north_up(half=2000.0))).astype("i2")
    write(tmp_path / "terrain.tif", heights, metres(half=2000.0), scales=(0.1,))
    parts = blocks("docs/guide/your_map.md")
    (case,), (shown,), codes = ([text for kind, text in parts if kind == one] for one in ("toml", "output", "python"))
    tube = (ROOT / "cases" / "tube.toml").read_text(encoding="utf-8")
    (tmp_path / "case.toml").write_text(tube.replace('cell_size = "6 mm"', 'cell_size = "12 mm"') + case, "utf-8")
    done = invoke("check", tmp_path / "case.toml")
    assert done.exit_code == 0, done.stderr
    printed = done.stdout[done.stdout.index("ground: ") : done.stdout.index("ricochet off")]
    printed = printed.replace(f"{tmp_path}/", "")
    assert_printed(printed, shown)
    names, said = run_snippets(codes, tmp_path)
    assert "WGS 84 / UTM zone 32N" in said
    assert names["ground"].datum == pytest.approx(float(re.search(r"z = 0 at ([\d.]+) m\n", shown)[1]), abs=0.06)
