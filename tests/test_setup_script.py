"""What `setup.sh` does before it changes anything: which Python it takes, and every refusal with its cure.

The script runs in a copy of the project with a PATH that holds a few harmless tools and stand-ins for those that
would change the machine (apt-get, sudo), or whose answer is the case under test (id, dpkg-query, python3).
"""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.acts import ACTS, pytest_options

ROOT = Path(__file__).resolve().parent.parent
HARMLESS = ["cat", "cksum", "cut", "dirname", "env", "grep", "rm", "sed", "sh"]

DOLFINX_PYTHON = """
case "$*" in
    *find_spec*) echo "{dolfinx} {python}" ;;
    *ensurepip*) exit {without_venv} ;;
    *"-m venv"*) for place in "$@"; do :; done; mkdir -p "$place/bin" "$place/lib" && cp "$0" "$place/bin/python" ;;
    *"-m pip"*) echo "Could not find a version" >&2; exit 1 ;;
esac
"""


class Machine:
    """A copy of the project and a PATH of stand-ins."""

    def __init__(self, folder: Path) -> None:
        self.project = folder / "project with spaces"
        self.tools = folder / "tools"
        self.release = folder / "os-release"
        self.variables: dict[str, str] = {}
        self.project.mkdir()
        self.tools.mkdir()
        (self.project / "flight").mkdir()
        for name in ("setup.sh", "dependencies.txt", "pyproject.toml", "flight/pyproject.toml"):
            shutil.copy(ROOT / name, self.project / name)
        shutil.copytree(ROOT / "constraints", self.project / "constraints")
        for name in [*HARMLESS, "cp", "mkdir"]:
            (self.tools / name).symlink_to(shutil.which(name) or "/bin/false")
        self.debian("12")
        self.tool("id", "echo 0")
        self.tool("dpkg-query", "printf installed")
        self.tool("apt-get", 'echo "apt-get $*" >>"${0%/*}/../apt-calls"')

    def tool(self, name: str, script: str) -> Path:
        """Put a stand-in on the PATH."""
        path = self.tools / name
        path.write_text(f"#!/bin/sh\n{script}\n")
        path.chmod(0o755)
        return path

    def debian(self, version: str, name: str = "debian") -> None:
        """Say which release the machine runs."""
        self.release.write_text(f'ID={name}\nVERSION_ID="{version}"\n')

    def dolfinx(self, version: str, python: str = "3.12.1", without_venv: int = 0) -> None:
        """Put a python3 on the PATH that says it has dolfinx."""
        self.tool("python3", DOLFINX_PYTHON.format(dolfinx=version, python=python, without_venv=without_venv))

    def run(self, *arguments: str) -> subprocess.CompletedProcess[str]:
        """Call the script without a terminal."""
        environment = {"PATH": str(self.tools), "HOME": str(self.tools), "OS_RELEASE": str(self.release)}
        return subprocess.run(
            ["/bin/sh", str(self.project / "setup.sh"), *arguments],
            env=environment | self.variables,
            stdin=subprocess.DEVNULL,
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )

    def refusal(self, *arguments: str) -> str:
        """Call the script, expect it to refuse in a few lines, return them joined by spaces."""
        done = self.run(*arguments)
        assert done.returncode == 1, done.stdout + done.stderr
        return " ".join(done.stderr.split())

    @property
    def apt_calls(self) -> list[str]:
        """What was asked of apt-get."""
        record = self.tools.parent / "apt-calls"
        return record.read_text().splitlines() if record.exists() else []


@pytest.fixture
def machine(tmp_path: Path) -> Machine:
    return Machine(tmp_path)


def test_unknown_act_gets_the_known_ones_listed(machine: Machine) -> None:
    done = machine.run("instal")
    assert done.returncode == 2
    assert 'unknown act "instal"' in done.stderr
    for act in ("install", *ACTS):
        assert f"\n  {act} " in done.stderr


def test_help_needs_no_set_up(machine: Machine) -> None:
    done = machine.run("help")
    assert done.returncode == 0
    assert "FRAGFIELD_PYTHON" in done.stdout


@pytest.mark.parametrize(("name", "version"), [("debian", "11"), ("debian", "14"), ("fedora", "42")])
def test_other_releases_are_refused_with_conda_and_docker_as_cure(machine: Machine, name: str, version: str) -> None:
    machine.variables["PYTHONHOME"] = "/nowhere"  # keeps a dolfinx that this machine may have out of sight
    machine.debian(version, name)
    message = machine.refusal()
    assert f"this is {name} {version}, not Debian 12 or 13" in message
    assert "conda env create -f environment.yml" in message
    assert "docker build" in message


@pytest.mark.parametrize(
    ("tools", "words"),
    [
        (
            {"dpkg-query": 'case "$*" in *libgl1) exit 1 ;; *) printf installed ;; esac', "id": "echo 1000"},
            (
                "not root, and sudo is not there or did not let you in",
                "apt-get install --no-install-recommends libgl1 then call again",
            ),
        ),
        (
            {"dpkg-query": "exit 1", "id": "echo 1000", "sudo": "exit 1"},
            ("sudo is not there or did not let you in", "apt-get install --no-install-recommends python3-dolfinx-real"),
        ),
    ],
    ids=["no root and no sudo", "sudo refuses"],
)
def test_what_is_in_the_way_of_missing_packages_is_seen_before_apt(
    machine: Machine, tools: dict[str, str], words: tuple[str, ...]
) -> None:
    for name, script in tools.items():
        machine.tool(name, script)
    message = machine.refusal()
    assert all(text in message for text in words), message
    assert not machine.apt_calls


def test_apt_is_asked_for_the_missing_packages_only(machine: Machine) -> None:
    machine.tool("dpkg-query", 'case "$*" in *libgl1 | *openmpi-bin*) exit 1 ;; *) printf installed ;; esac')
    machine.tool("apt-get", 'echo "$*" >>"${0%/*}/../apt-calls"; case "$*" in *install*) exit 100 ;; esac')
    machine.refusal()
    update, install = machine.apt_calls
    assert update.endswith("update")
    assert install.endswith("--no-install-recommends openmpi-bin libgl1")


def test_a_python_that_is_named_and_has_no_dolfinx_is_refused(machine: Machine) -> None:
    machine.dolfinx("0.9.0")
    machine.variables["FRAGFIELD_PYTHON"] = str(machine.tool("other", "exit 1"))
    assert "is not a Python that has dolfinx" in machine.refusal()


def test_a_machine_without_a_release_is_refused(machine: Machine) -> None:
    machine.variables |= {"PYTHONHOME": "/nowhere", "OS_RELEASE": "/nowhere"}
    done = machine.run()
    assert done.returncode == 1
    assert "this is unknown, not Debian 12 or 13" in done.stderr


@pytest.mark.parametrize("version", ["0.4.1", "0.7.3", "0.12.0", "1.0.0"])
def test_unsupported_dolfinx(machine: Machine, version: str) -> None:
    machine.dolfinx(version)
    message = machine.refusal()
    assert f"dolfinx {version} " in message
    assert "known are 0.5 0.9 0.10 0.11" in message
    assert "conda env create" in message


def test_pip_without_network(machine: Machine) -> None:
    machine.dolfinx("0.9.0")
    message = machine.refusal()
    assert "pip could not install the Python packages" in message
    assert "PIP_INDEX_URL" in message
    assert not (machine.project / ".venv" / ".stamp").exists(), "a set-up that failed must be tried again"


@pytest.mark.parametrize("variable", ["CONDA_PREFIX", "VIRTUAL_ENV"])
def test_active_environment_comes_before_debian(machine: Machine, variable: str) -> None:
    machine.dolfinx("0.11.0.post0")
    environment = machine.tools.parent / "environment" / "bin"
    environment.mkdir(parents=True)
    (machine.tools / "python3").rename(environment / "python")
    machine.variables[variable] = str(environment.parent)
    done = machine.run()
    assert f"dolfinx 0.11.0.post0 of {environment / 'python'}" in done.stdout
    assert not machine.apt_calls


@pytest.mark.parametrize(
    ("cores", "arguments", "options"),
    [
        (1, "", ""),
        (2, "", "-n 2 --dist loadgroup"),
        (16, "-k mott", "-n 4 --dist loadgroup -k mott"),
        (4, "-n 0", "-n 0"),
        (4, "--pdb", "--pdb"),
        (4, "tests/a.py::test_x", "tests/a.py::test_x"),
    ],
)
def test_tests_run_side_by_side_on_up_to_four_cores(cores: int, arguments: str, options: str) -> None:
    """One process where pytest's arguments say how many, or ask for a single test or the debugger."""
    assert pytest_options(arguments.split(), cores) == options.split()


def test_an_act_gets_its_arguments(machine: Machine) -> None:
    machine.dolfinx("0.9.0")
    python = machine.tools / "python3"
    pip = '*"-m pip"*) echo "Could not find a version" >&2; exit 1 ;;'
    python.write_text(python.read_text().replace(pip, '*"-m tests.acts"*) echo "called $*" ;;'))
    done = machine.run("test", "-k", "mott")
    assert done.stdout.splitlines()[-1] == "called -m tests.acts test -k mott", done.stdout + done.stderr


def test_tools_are_installed_for_the_acts_that_need_them(machine: Machine) -> None:
    """The demonstration goes without packages of tests and documentation; those that are there stay."""
    machine.dolfinx("0.9.0")
    python, asked = machine.tools / "python3", machine.tools.parent / "asked"
    fails = '*"-m pip"*) echo "Could not find a version" >&2; exit 1 ;;'
    python.write_text(python.read_text().replace(fails, f'*"-m pip"*) echo "$*" >>"{asked}" ;;'))
    for act, calls in (("demo", 1), ("install", 1), ("lint", 2), ("examples", 2), ("test", 2)):
        done = machine.run(act)
        assert done.returncode == 0, done.stderr
        assert len(asked.read_text().splitlines()) == calls, act
    first, second = (line.rsplit(".[", 1)[1] for line in asked.read_text().splitlines())
    assert first == "app,terrain,tables,drawings]"
    assert second == "app,terrain,tables,drawings,test,lint,docs]"


def test_every_act_that_the_script_knows_is_one(machine: Machine) -> None:
    known = re.search(r"^    (install \| demo [a-z| ]+)\) ;;$", (ROOT / "setup.sh").read_text(), re.MULTILINE)
    assert known
    assert known[1].split(" | ") == ["install", *ACTS]
    assert len((ROOT / "setup.sh").read_text().splitlines()) < 200


@pytest.mark.parametrize(
    ("release", "root"), [(("42", "fedora"), True), (("13", "debian"), False)], ids=["another system", "no root"]
)
def test_the_wheel_of_dolfinx_is_taken_where_debian_has_no_packages_to_give(
    machine: Machine, release: tuple[str, str], *, root: bool
) -> None:
    """By a Python that it fits; one that is too old, or on another processor, is passed over."""
    machine.debian(*release)
    if not root:
        machine.tool("id", "echo 1000")
        machine.tool("dpkg-query", "exit 1")
    machine.dolfinx("")
    new = (machine.tools / "python3").rename(machine.tools / "python3.13")
    new.write_text(
        new.read_text()
        .replace("*find_spec*) echo", "*find_spec*) exit 1; echo")
        .replace("case", 'case "$*" in *python_version\\(\\)*) echo 3.13.1 ;; esac\ncase', 1)
    )
    machine.tool("python3", "exit 1")
    done = machine.run()
    assert f"dolfinx 0.11 of {new}, Python 3.13.1" in done.stdout, done.stdout + done.stderr
    asked = (machine.project / ".venv" / "constraints.txt").read_text()
    assert "dolfinx-solver-real==" in asked
    assert not machine.apt_calls


def test_an_environment_made_elsewhere_is_made_again(machine: Machine) -> None:
    """One copied along with the folder: its scripts start the Python of the old place."""
    machine.dolfinx("0.9.0")
    folder = machine.project / ".venv"
    folder.mkdir()
    for place, made in (("/elsewhere/.venv", True), (folder, False)):
        command = f"command = {machine.tools}/python3 -m venv {place}"
        (folder / "pyvenv.cfg").write_text(f"home = {machine.tools}\nversion = 3.12.1\n{command}\n")
        assert ("setup: virtual environment" in machine.run().stdout) == made
