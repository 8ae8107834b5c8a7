"""The command line as a user meets it."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from typer.testing import CliRunner

import fragfield
from fragfield.case import Case, load_case, plain
from fragfield.cli import app
from fragfield.errors import exit_code_of

ROOT = Path(__file__).parents[2]
CASES = sorted((ROOT / "cases").glob("*.toml"))
COMMANDS = ("check", "run", "burst", "break-up", "fly", "report", "view", "info", "new", "compare", "sweep")
HEAVY = ("dolfinx", "mpi4py", "petsc4py", "vtkmodules", "pyvista", "matplotlib", "gmsh")


def _python(code):
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env=environment, timeout=120, check=False
    )


def _invoke(*arguments):
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def test_the_version_is_reported():
    done = _invoke("--version")
    assert done.exit_code == 0
    assert done.stdout.strip() == f"fragfield {fragfield.__version__}"


def test_help_names_every_command_and_loads_nothing_heavy():
    """So that it comes at once."""
    done = _python(
        "import atexit, sys; sys.argv = ['fragfield', '--help']; "
        f"heavy = {(*HEAVY, 'numpy', 'numba', 'pint', 'h5py')!r}; "
        "atexit.register(lambda: print([name for name in heavy if name in sys.modules], file=sys.stderr)); "
        "from fragfield.cli import main; main()"
    )
    assert done.returncode == 0
    assert done.stderr.strip() == "[]"
    for command in COMMANDS:
        assert f" {command} " in done.stdout


@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_explains_itself(command):
    done = _invoke(command, "--help")
    assert done.exit_code == 0
    assert "--json" in done.stdout


def test_the_command_line_itself_loads_nothing_heavy():
    done = _python(
        "import sys; import fragfield.cli; "
        f"print([name for name in ({HEAVY!r} + ('numpy', 'numba', 'pint', 'pydantic', 'h5py')) if name in sys.modules])"
    )
    # typer itself brings pydantic in its later releases
    assert set(json.loads(done.stdout.replace("'", '"'))) <= {"pydantic"}, done.stderr


def test_check_needs_no_dolfinx():
    blocked = "import sys\nfor name in ('dolfinx', 'mpi4py', 'petsc4py'): sys.modules[name] = None\n"
    code = f"sys.argv = ['fragfield', 'check', {str(ROOT / 'cases' / 'tube.toml')!r}, '--json']\n"
    done = _python(blocked + code + "from fragfield.cli import main\nmain()")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["mesh"]["cells"] > 500


def test_an_unknown_option_or_command_is_an_input_error():
    for arguments in (["run"], ["run", "x.toml", "--cellsize", "3 mm"], ["rnu"], ["run", "x.toml", "--threads", "0"]):
        assert _invoke(*arguments).exit_code == 2


@pytest.mark.parametrize("command", ["check", "run", "burst", "break-up", "fly", "report"])
def test_a_missing_case_file_is_an_input_error(command, tmp_path):
    done = _invoke(command, tmp_path / "none.toml")
    assert done.exit_code == 2
    assert "none.toml: no such case file" in done.stderr


def test_json_of_an_error_is_one_object(tmp_path):
    done = _invoke("check", tmp_path / "none.toml", "--json")
    assert done.exit_code == 2
    error = json.loads(done.stdout)["error"]
    assert error["exit_code"] == 2
    assert "no such case file" in error["message"]


def test_a_folder_that_is_no_run_is_refused(tmp_path):
    for command in ("break-up", "fly", "report", "info", "view"):
        done = _invoke(command, tmp_path)
        assert done.exit_code == 2, command
        assert str(tmp_path) in done.stderr


def test_a_stage_without_its_input_says_which_command_makes_it(tmp_path):
    for command, maker in (("break-up", "burst"), ("fly", "break-up")):
        done = _invoke(command, ROOT / "cases" / "tube.toml", "--out", tmp_path / "run")
        assert done.exit_code == 2
        assert f"run `fragfield {maker}` first" in done.stderr
        assert not (tmp_path / "run").exists()


def test_a_cell_size_on_the_command_line_needs_its_unit_too():
    done = _invoke("check", CASES[0], "--cell-size", "6")
    assert done.exit_code == 2
    assert 'with --cell-size: burst.cell_size: found "6" without a unit' in done.stderr


@pytest.mark.parametrize("command", ["check", "run", "burst"])
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
        (["burst.cell_size=8 mm", "--cell-size"], "--cell-size and --set burst.cell_size both given"),
    ],
)
def test_a_setting_that_cannot_be_used_is_an_input_error(command, settings, message, tmp_path):
    arguments = [word for setting in settings if "--" not in setting for word in ("--set", setting)]
    arguments += ["--cell-size", "9 mm"] if "--cell-size" in settings else []
    arguments += [] if command == "check" else ["--out", tmp_path / "run"]
    done = _invoke(command, ROOT / "cases" / "tube.toml", *arguments)
    assert done.exit_code == 2
    assert message in done.stderr
    assert not (tmp_path / "run").exists()


def test_check_shows_the_case_with_its_settings():
    settings = ("burst.cell_size=8 mm", "round.0.explosive=comp_b", "seed=7", "flight.origin=['1 m', '2 m']")
    words = [word for setting in settings for word in ("--set", setting)]
    done = _invoke("check", ROOT / "cases" / "tube.toml", *words, "--json")
    assert done.exit_code == 0, done.stderr
    case = json.loads(done.stdout)["case"]
    assert (case["burst"]["cell_size"], case["seed"], case["flight"]["origin"]) == (0.008, 7, [1.0, 2.0])
    assert case["round"][0]["explosive"]["name"] == "comp_b"
    plain = json.loads(_invoke("check", ROOT / "cases" / "tube.toml", "--json").stdout)["case"]
    assert case["title"] == plain["title"]


def test_exit_codes_of_errors():
    from burst_fenicsx.errors import InputError as BurstInputError
    from burst_fenicsx.errors import NumericalStop
    from flight import InputError as FlightInputError
    from fragfield.errors import InputError
    from transition import InputError as BreakUpInputError

    for error in (InputError(""), BurstInputError(""), FlightInputError(""), BreakUpInputError("")):
        assert exit_code_of(error) == 2
    assert exit_code_of(NumericalStop("ledger open", 1e-6)) == 3
    assert exit_code_of(KeyboardInterrupt()) == 130
    assert exit_code_of(ValueError("ours")) == 4


@pytest.mark.parametrize(
    ("raised", "code", "reported"),
    [
        ("burst_fenicsx.errors.NumericalStop('cell 7 is lost', 3e-6)", 3, "fragfield: cell 7 is lost (at 3.00 us)\n"),
        ("KeyboardInterrupt()", 130, "fragfield: interrupted; what was written stays, --resume goes on from there\n"),
    ],
)
def test_stops_and_interruptions_have_their_codes(raised, code, reported, tmp_path):
    done = _python(
        "import sys, burst_fenicsx.errors, fragfield.pipeline.chain\n"
        f"def stop(*_, **__): raise {raised}\n"
        "fragfield.pipeline.chain.perform = stop\n"
        f"sys.argv = ['fragfield', 'run', {str(ROOT / 'cases' / 'tube.toml')!r}, '--out', {str(tmp_path / 'run')!r}]\n"
        "from fragfield.cli import main\nmain()"
    )
    assert done.returncode == code
    assert done.stderr == reported
    assert (tmp_path / "run" / "case.toml").is_file()


@pytest.mark.parametrize("path", CASES, ids=lambda path: path.stem)
def test_check_derives_masses_speeds_and_costs(path):
    done = _invoke("check", path, "--cell-size", "8 mm", "--json")
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
    assert found["expected"]["steps"] * found["expected"]["mean_time_step"] >= found["expected"]["end_time"]


def test_check_for_people_shows_the_case_and_the_numbers():
    done = _invoke("check", ROOT / "cases" / "tube.toml")
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
    done = _invoke("check", ROOT / "cases" / "m107_tnt.toml", "--resolved")
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
    again = flat(plain(Case.model_validate(tomllib.loads(text))))
    for key, value in flat(plain(load_case(ROOT / "cases" / "m107_tnt.toml"))).items():
        assert again[key] == (pytest.approx(value, rel=1e-9) if isinstance(value, float) else value), key


def flat(tables, key=()):
    """Values by their dotted keys."""
    pairs = tables.items() if isinstance(tables, dict) else enumerate(tables)
    found = {}
    for name, value in pairs:
        found |= flat(value, (*key, name)) if isinstance(value, (dict, list)) else {(*key, name): value}
    return found


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
    warnings = json.loads(_invoke("check", path, "--json").stdout)["warnings"]
    assert any('cuts barricade "bank"' in line for line in warnings) == warned, warnings


@pytest.mark.parametrize(
    ("old", "new", "warning"),
    [
        ('end_time = "120 us"', 'end_time = "120 us"\nproducts = "landau"', "1.2 times the work rho Q"),
        ('end_time = "120 us"', 'end_time = "20 us"', "ends before the front has passed (4.32e-05 s)"),
        ('cell_size = "6 mm"', 'cell_size = "15 mm"', "the thinnest wall, 22.5 mm, has 1.5 cells"),
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
def test_check_warns_of_what_is_doubtful(old, new, warning, tmp_path):
    text = (ROOT / "cases" / "tube.toml").read_text()
    assert old in text
    path = tmp_path / "case.toml"
    path.write_text(text.replace(old, new))
    found = json.loads(_invoke("check", path, "--json").stdout)
    assert any(warning in line for line in found["warnings"]), found["warnings"]
    assert not any(
        warning in line
        for line in json.loads(_invoke("check", ROOT / "cases" / "tube.toml", "--json").stdout)["warnings"]
    )
