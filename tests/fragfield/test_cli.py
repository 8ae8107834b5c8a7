"""The command line as a user meets it."""

from __future__ import annotations

import itertools
import json
import os
import re
import subprocess
import sys
import tomllib
from contextlib import chdir
from pathlib import Path

import pytest

import fragfield
from fragfield.case import CaseTable, load_case, plain
from fragfield.errors import exit_code_of
from tests.fragfield.case_documents import flat
from tests.fragfield.short_run import ROOT, invoke, python

CASES = sorted((ROOT / "cases").glob("*.toml"))
COMMANDS = (
    "new", "check", "run", "report", "view", "tables", "info", "app", "convert", "import", "sweep", "limit",
    "uncertainty", "burst", "break-up", "fly", "warm-up", "help",
)  # fmt: skip
HEAVY = ("dolfinx", "mpi4py", "petsc4py", "vtkmodules", "pyvista", "matplotlib", "gmsh")


@pytest.mark.parametrize("option", ["--version", "-V"])
def test_the_version_is_reported(option):
    done = invoke(option)
    assert done.exit_code == 0
    assert done.stdout.strip() == f"fragfield {fragfield.__version__}"


def test_help_names_every_command_and_loads_nothing_heavy():
    """So that it comes at once."""
    done = python(
        "import atexit, sys; sys.argv = ['fragfield', '--help']; "
        f"heavy = {(*HEAVY, 'numpy', 'numba', 'pint', 'h5py')!r}; "
        "atexit.register(lambda: print([name for name in heavy if name in sys.modules], file=sys.stderr)); "
        "from fragfield.cli import main; main()"
    )
    assert done.returncode == 0
    assert done.stderr.strip() == "[]"
    places = [done.stdout.index(f"\u2502 {command} ") for command in COMMANDS]
    assert places == sorted(places), "in the order of use"
    heads = ("A case and its result", "Files of others", "Studies of many runs", "Stages of a run", "This machine")
    assert all(f" {head} " in done.stdout for head in heads)


def test_help_is_a_command_too():
    assert invoke("help").stdout == invoke("--help").stdout
    assert invoke("help", "check").stdout == invoke("check", "--help").stdout
    assert "Did you mean 'check'?" in invoke("help", "chek").stderr


def test_help_shows_brackets_and_fills_its_lines():
    assert "tables [[exposed]] and [[obstacle]]" in " ".join(_help("convert").split())
    assert "those of the table [uncertainty] and of the default set" in " ".join(_help("uncertainty").split())
    for command in ("sweep", "limit", "uncertainty"):
        lines = [line.strip() for line in _help(command).splitlines()]
        text = lines[: next(at for at, line in enumerate(lines) if line.startswith("\u256d"))]
        broken = [
            (line, after)
            for line, after in itertools.pairwise(text)
            if line and after and len(line) + 1 + len(after.split()[0]) < 76
        ]
        assert broken == [], "a line ends though the next word has room in it"


def _help(command):
    """In 80 columns, as wherever there is no terminal."""
    code = f"sys.argv = ['fragfield', {command!r}, '--help']\nfrom fragfield.cli import main\nmain()"
    return python(f"import sys\n{code}").stdout


@pytest.mark.parametrize(
    ("words", "completed"),
    [
        ("fragfield un", ["uncertainty"]),
        ("fragfield sweep --j", ["--jobs", "--json"]),
        ("fragfield uncertainty --jo", ["--jobs"]),
    ],
)
def test_a_shell_completes_commands_and_options(words, completed):
    known = {"_FRAGFIELD_COMPLETE": "complete_bash", "COMP_WORDS": words, "COMP_CWORD": str(words.count(" "))}
    done = subprocess.run(
        [sys.executable, "-m", "fragfield"],
        env=os.environ | known,
        capture_output=True,
        text=True,
        check=False,
        cwd=ROOT,
    )
    assert done.stdout.split() == completed
    assert done.stderr == ""


def test_check_needs_no_dolfinx():
    blocked = "import sys\nfor name in ('dolfinx', 'mpi4py', 'petsc4py'): sys.modules[name] = None\n"
    code = f"sys.argv = ['fragfield', 'check', {str(ROOT / 'cases' / 'tube.toml')!r}, '--json']\n"
    done = python(blocked + code + "from fragfield.cli import main\nmain()")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["mesh"]["cells"] > 500


def test_an_unknown_option_or_command_is_an_input_error():
    for arguments in (["run"], ["run", "x.toml", "--cellsize", "3 mm"], ["rnu"], ["run", "x.toml", "--threads", "0"]):
        assert invoke(*arguments).exit_code == 2


@pytest.mark.parametrize("command", ["check", "run", "report"])
def test_a_missing_case_file_is_an_input_error(command, tmp_path):
    done = invoke(command, tmp_path / "none.toml")
    assert done.exit_code == 2
    assert "none.toml: no such case file" in done.stderr
    error = json.loads(invoke(command, tmp_path / "none.toml", "--json").stdout)["error"]
    assert error["exit_code"] == 2
    assert "no such case file" in error["message"]


def test_a_folder_that_is_no_run_is_refused(tmp_path):
    for command in ("break-up", "fly", "report", "info", "view"):
        done = invoke(command, tmp_path)
        assert done.exit_code == 2, command
        assert str(tmp_path) in done.stderr


def test_a_stage_without_its_input_says_which_command_makes_it(tmp_path):
    for command, maker in (("break-up", "burst"), ("fly", "break-up")):
        done = invoke(command, ROOT / "cases" / "tube.toml", "--out", tmp_path / "run")
        assert done.exit_code == 2
        assert f"run `fragfield {maker}` first" in done.stderr
        assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("command", ["check", "run"])
@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (["burst.cell_sise=8 mm"], 'burst.cell_sise: unknown key (did you mean "cell_size"?)'),
        (["burst.cell_size=8"], "burst.cell_size: found the bare number 8"),
        (["burst.cell_size=8 mm,6 mm"], "burst.cell_size: "),
        (["burst.cell_size"], "found --set 'burst.cell_size'; needed: KEY=VALUE, for example --set burst.cell_size="),
        (["=8 mm"], "found --set '=8 mm'; needed: KEY=VALUE"),
        (["seed=1", "seed=2"], "--set seed is given twice"),
        (["round.7.explosive=tnt"], "round.7.explosive: there is no entry 7"),
    ],
)
def test_a_setting_that_cannot_be_used_is_an_input_error(command, settings, message, tmp_path):
    arguments = [word for setting in settings for word in ("--set", setting)]
    arguments += [] if command == "check" else ["--out", tmp_path / "run"]
    done = invoke(command, ROOT / "cases" / "tube.toml", *arguments)
    assert done.exit_code == 2
    assert message in done.stderr
    assert not (tmp_path / "run").exists()


def test_check_shows_the_case_with_its_settings():
    settings = ("burst.cell_size=8 mm", "round.0.explosive=comp_b", "seed=7", "flight.origin=['1 m', '2 m']")
    words = [word for setting in settings for word in ("--set", setting)]
    done = invoke("check", ROOT / "cases" / "tube.toml", *words, "--json")
    assert done.exit_code == 0, done.stderr
    case = json.loads(done.stdout)["case"]
    assert (case["burst"]["cell_size"], case["seed"], case["flight"]["origin"]) == (0.008, 7, [1.0, 2.0])
    assert case["round"][0]["explosive"]["name"] == "comp_b"
    plain = json.loads(invoke("check", ROOT / "cases" / "tube.toml", "--json").stdout)["case"]
    assert case["title"] == plain["title"]


def test_exit_codes_of_errors():
    from burst_fenicsx.errors import NumericalStop

    assert exit_code_of(MemoryError()) == 2
    assert exit_code_of(NumericalStop("ledger open", 1e-6)) == 3
    assert exit_code_of(KeyboardInterrupt()) == 130
    assert exit_code_of(ValueError("ours")) == 4


@pytest.mark.parametrize("path", CASES, ids=lambda path: path.stem)
def test_check_derives_masses_speeds_and_costs(path):
    done = invoke("check", path, "--set", "burst.cell_size=8 mm", "--json")
    assert done.exit_code == 0, done.stderr
    found = json.loads(done.stdout)
    entry = found["rounds"][0]
    assert len(found["rounds"]) == {"m107_pair": 2, "m107_row4": 4, "m107_pallet_2x4": 8}.get(path.stem, 1)
    comp_b = (34.53, 6.863 * 1710 / 1630)
    of_comp_b = ("comp_b", "pair", "pair_mirrored", "pair_site", "row4", "pallet_2x4")
    expected = {
        "grenade_155_tnt": (40.0, 8.0),
        "m107_tnt": (34.53, 6.863),
        **dict.fromkeys((f"m107_{name}" for name in of_comp_b), comp_b),
        "tube": (7800 * 0.3 * 3.14159265 * (0.0775**2 - 0.055**2), 1630 * 0.3 * 3.14159265 * 0.055**2),
    }[path.stem]
    assert (entry["casing_mass"], entry["charge_mass"]) == pytest.approx(expected, rel=2e-3)
    assert all(abs(error) < 0.005 for error in entry["mass_error_of_mesh"].values())
    ratio = expected[1] / expected[0]
    detonation_velocity = 7990 if expected is comp_b else 6940
    assert entry["gurney_speed"] == pytest.approx(
        (520 + 0.28 * detonation_velocity) * (ratio / (1 + ratio / 2)) ** 0.5, rel=5e-3
    )
    share = {"landau": 1 / 8, "landau_cj": 27 / 256}[found["case"]["burst"]["products"]]
    density = found["case"]["round"][0]["explosive"]["density"]
    assert entry["P0"] == pytest.approx(share * density * detonation_velocity**2)
    assert found["mesh"]["min_scaled_jacobian"] >= 0.2
    end = found["expected"]["end_time"]
    assert 1e-5 < end < 1e-3 if end is not None else len(found["rounds"]) > 1


def test_check_for_people_shows_the_case_and_the_numbers():
    done = invoke("check", ROOT / "cases" / "tube.toml")
    assert done.exit_code == 0
    for part in (
        "charge ratio C/M",
        "Gurney speed, Eq. 23",
        "smallest scaled Jacobian",
        "expected: about",
    ):
        assert part in done.stdout
    assert "cell_size" not in done.stdout, "the case itself is shown by --resolved"
    assert len(done.stdout.splitlines()) < 60
    assert not re.search(r"\d{9}", done.stdout)


def test_check_shows_the_resolved_case_where_asked():
    """In everyday units, which a case file takes: read again it is the same case, to ten digits."""
    done = invoke("check", ROOT / "cases" / "m107_tnt.toml", "--resolved")
    assert done.exit_code == 0
    text = done.stdout.partition("\nthe case as resolved:\n")[2]
    for part in (
        'cell_size = "6 mm"',
        'friction_angle = "20 deg"',
        'direction_scatter = "6 deg"',
        'cohesion = "5 MPa"',
    ):
        assert part in text
    assert not re.search(r"\d{12}", text)
    again = flat(plain(CaseTable.model_validate(tomllib.loads(text))))
    for key, value in flat(plain(load_case(ROOT / "cases" / "m107_tnt.toml"))).items():
        assert again[key] == (pytest.approx(value, rel=1e-9) if isinstance(value, float) else value), key


@pytest.mark.parametrize(("radius", "warned"), [("9.5 m", False), ("11 m", True), ("25 m", True), ("32 m", False)])
def test_a_witness_ring_that_cuts_a_barricade_is_warned_of(radius, warned, tmp_path):
    """The foot of a bank, 24 m long and from y = 9.5 to 27.5 m, lies 9.5 to 30.0 m from the ring's centre."""
    text = (ROOT / "cases" / "tube.toml").read_text().replace('radius = "25 ft"', f'radius = "{radius}"')
    bank = (
        '[[obstacle]]\nname = "bank"\nkind = "barricade"\nstart = ["-12 m", "18.5 m"]\nend = ["12 m", "18.5 m"]\n'
        'height = "4 m"\ncrest_width = "2 m"\nslope = 2.0\n'
    )
    path = tmp_path / "case.toml"
    path.write_text(f"{text}\n{bank}")
    warnings = json.loads(invoke("check", path, "--json").stdout)["warnings"]
    assert any('cuts barricade "bank"' in line for line in warnings) == warned, warnings


@pytest.fixture(scope="module")
def plain_warnings():
    return json.loads(invoke("check", ROOT / "cases" / "tube.toml", "--json").stdout)["warnings"]


@pytest.mark.parametrize(
    ("old", "new", "warning"),
    [
        ('end_time = "120 us"', 'end_time = "120 us"\nproducts = "landau"', "1.2 times the work rho Q"),
        ('end_time = "120 us"', 'end_time = "20 us"', "ends before the front has passed (4.32e-05 s)"),
        (
            'cell_size = "6 mm"',
            'cell_size = "15 mm"',
            "22.5 mm at 0 mm from the nose, is 1.5 cells of 15 mm thick; 3 or more resolve its bending",
        ),
        ('end_time = "120 us"', 'burn = "time"', "does not give a steady front"),
        (
            'end_time = "120 us"',
            "leakage = { radius_ratio = 3.0 }",
            "radius_ratio = 3: unusual; usual: 1.59 to 2.1 (published radii of venting",
        ),
        ('end_time = "120 us"', "leakage = { enabled = false }", "upper bounds"),
        ('end_time = "120 us"', 'time_step = { fixed = "1 us" }', "the first stable step is about"),
        ('radius = "25 ft"', 'radius = "10 cm"', "may reach it before break-up"),
    ],
)
def test_check_warns_of_what_is_doubtful(old, new, warning, tmp_path, plain_warnings):
    text = (ROOT / "cases" / "tube.toml").read_text()
    assert old in text
    path = tmp_path / "case.toml"
    path.write_text(text.replace(old, new))
    found = json.loads(invoke("check", path, "--json").stdout)
    assert any(warning in line for line in found["warnings"]), found["warnings"]
    assert not any(warning in line for line in plain_warnings)


# --- Malformed inputs: exit code 2 and one clear message

HERE = Path(__file__).parent / "malformed"


def here(*arguments, cwd=Path()):
    """The command in this process."""
    with chdir(cwd):
        return invoke(*arguments)


def _assert_one_message(done, *parts):
    assert done.exit_code == 2, done.stderr
    assert done.stdout == ""
    assert "Traceback" not in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1, done.stderr
    assert done.stderr.startswith("fragfield: ")
    for part in parts:
        assert part in done.stderr, done.stderr


@pytest.mark.parametrize(
    ("name", "parts"),
    [
        ("unknown_key", ["burst.cell_sise: unknown key", 'did you mean "cell_size"?']),
        (
            "missing_unit",
            ["burst.cell_size: found the bare number 8 without a unit", "a length with its unit", '"6 mm"'],
        ),
        ("wrong_unit", ['burst.cell_size: found "8 kg", which is a mass', "a length", '"6 mm"']),
        ("negative_wall", ["round[1].profile", "-22.5 mm", "must be positive"]),
        ("crossing_contours", ["round[1].profile", "the cavity crosses the outer contour", "station 300 mm"]),
        ("small_heat", ["round[1].explosive.heat_of_detonation: found Q = 3 MJ/kg", "more than D^2/16 = 3.01 MJ/kg"]),
        ("no_ignition", ["round[1].ignition: found no ignition point", "at least one point"]),
        ("ignition_outside", ["round[1].ignition[2].station: found 350 mm, outside the charge", "0 mm to 300 mm"]),
    ],
)
def test_a_malformed_case_ends_with_one_message(name, parts, tmp_path):
    path = HERE / f"{name}.toml"
    done = here("run" if name in ("wrong_unit", "small_heat") else "check", path, cwd=tmp_path)
    _assert_one_message(done, str(path), *parts)
    assert list(tmp_path.iterdir()) == [], "a refused case leaves nothing behind"


def test_an_output_folder_that_cannot_be_made_is_refused(tmp_path):
    (tmp_path / "file").write_text("not a folder")
    done = here("run", HERE / "sound.toml", "--out", tmp_path / "file" / "run")
    _assert_one_message(done, str(tmp_path / "file" / "run"), "the output folder cannot be made")


@pytest.mark.skipif(
    os.geteuid() == 0 and not Path("/proc/version").exists(), reason="needs a folder closed to root too"
)
def test_an_output_folder_that_cannot_be_written_is_refused():
    closed = "/proc" if os.geteuid() == 0 else "/usr"  # /proc refuses new entries even to root
    done = here("run", HERE / "sound.toml", "--out", closed)
    _assert_one_message(done, closed, "cannot be written")
