"""Extras, pins, the recipe for conda and the container files agree with pyproject.toml and setup.sh."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest
import yaml
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

import fragfield

ROOT = Path(__file__).resolve().parent.parent
SETUP = (ROOT / "setup.sh").read_text(encoding="utf-8")
PROJECTS = {
    "fragfield": tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"],
    "fragfield-flight": tomllib.loads((ROOT / "flight" / "pyproject.toml").read_text(encoding="utf-8"))["project"],
}
DEPENDENCIES = [
    line.partition("#")[0].strip()
    for line in (ROOT / "dependencies.txt").read_text(encoding="utf-8").splitlines()
    if not line.startswith("#")
]
CONDA_NAMES = {"gmsh": "python-gmsh", "matplotlib": "matplotlib-base"}
"""Names on PyPI, and those of conda-forge where they differ."""


def needs(project: str, *extras: str) -> dict[str, Requirement]:
    """What a distribution asks for, and its extras, by normal name."""
    lines = PROJECTS[project].get("dependencies") or ["fragfield-flight", *DEPENDENCIES]
    for extra in extras:
        lines += PROJECTS[project]["optional-dependencies"][extra]
    return {canonicalize_name(one.name): one for one in map(Requirement, lines)}


def pins(name: str) -> set[str]:
    """Names that a file of constraints pins."""
    lines = (ROOT / "constraints" / name).read_text(encoding="utf-8").splitlines()
    return {canonicalize_name(line.partition("==")[0]) for line in lines if "==" in line}


def test_the_changelog_has_the_version_with_the_date_of_the_citation():
    released = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))["date-released"]
    assert f"\n## [{fragfield.__version__}] - {released}\n" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")


def test_extras_that_are_named_exist():
    """In the pages and in the messages of the program."""
    named = re.compile(r"(fragfield-flight|fragfield|\./flight|['\" ]\.)\[([a-z0-9, ]+)\]")
    found = 0
    files = [*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md"), ROOT / "flight" / "README.md"]
    for package in ("burst_fenicsx", "transition", "flight", "fragfield", "fragfield_base"):
        files += (ROOT / package).rglob("*.py")
    for path in files:
        for name, extras in named.findall(path.read_text(encoding="utf-8")):
            project = "fragfield-flight" if "flight" in name else "fragfield"
            for extra in extras.split(","):
                assert extra.strip() in PROJECTS[project]["optional-dependencies"], f"{path}: {name}[{extra}]"
                found += 1
    assert found >= 4


@pytest.mark.parametrize("name", ["debian-12.txt", "debian-13.txt", "wheel.txt"])
def test_all_that_is_installed_is_pinned(name):
    extras = re.findall(r'^(?:extras|tools)="([a-z,]+)"', SETUP, re.MULTILINE)
    assert len(extras) == 2
    of_debian = set(re.findall(r"\bpython3-(rasterio|pyproj)\b", SETUP))  # of the libraries that dolfinx uses
    names = ",".join(extras).split(",")
    if name == "wheel.txt":
        of_debian, names = set(), [*names, "dolfinx"]
    assert not set(needs("fragfield", *names)) - pins(name) - of_debian - {"fragfield-flight"}
    assert not of_debian & pins(name)


@pytest.mark.parametrize(
    ("project", "added"), [("fragfield-flight", {"h5py"}), ("fragfield", {"h5py", "fenics-dolfinx", "__linux"})]
)
def test_the_recipe_asks_for_what_pip_asks_for(project, added):
    output = next(one for one in recipe()["outputs"] if one["package"]["name"] == project)
    asked = {}
    for line in output["requirements"]["run"]:
        pinned = re.match(r"\$\{\{ pin_subpackage\(\"([a-z-]+)\", exact=True\)", line)
        name, _, versions = (pinned[1] if pinned else line).partition(" ")
        asked[name] = versions
    wanted = {
        CONDA_NAMES.get(name, name): "" if name == "fragfield-flight" else str(one.specifier)
        for name, one in needs(project).items()
    }
    python = asked.pop("python")
    assert python == PROJECTS[project]["requires-python"]
    assert set(asked) - set(wanted) == added
    assert wanted == {name: asked[name] for name in wanted}


def recipe() -> dict:
    """The recipe for conda."""
    return yaml.safe_load((ROOT / "conda-recipe" / "recipe.yaml").read_text(encoding="utf-8"))


def test_conda_gets_the_dolfinx_that_setup_accepts():
    known = re.search(r'^supported_dolfinx="([\d. ]+)"', SETUP, re.MULTILINE)
    assert known
    newest = int(known[1].split()[-1].partition(".")[2])
    span = f"fenics-dolfinx>=0.9,<0.{newest + 1}"
    environment = yaml.safe_load((ROOT / "environment.yml").read_text(encoding="utf-8"))["dependencies"]
    asked = next(one for one in recipe()["outputs"] if one["package"]["name"] == "fragfield")["requirements"]["run"]
    assert span in environment
    assert span.replace("x>", "x >") in asked


def container_files() -> dict[str, dict[str, str]]:
    """What both container files say: base, copied, run, environment, start."""
    docker = dict(re.findall(r"^(FROM|COPY|RUN|ENV|ENTRYPOINT) (.+)$", (ROOT / "Dockerfile").read_text(), re.MULTILINE))
    apptainer = (ROOT / "fragfield.def").read_text(encoding="utf-8")
    sections = {name: text.strip() for name, text in re.findall(r"^%(\w+)\n((?:    .*\n)+)", apptainer, re.MULTILINE)}
    base = re.search(r"^From: (.+)$", apptainer, re.MULTILINE)
    assert base
    return {
        "Dockerfile": {
            "base": docker["FROM"],
            "copied": docker["COPY"].split()[0],
            "run": docker["RUN"],
            "environment": docker["ENV"],
            "start": docker["ENTRYPOINT"].strip('[]"'),
        },
        "fragfield.def": {
            "base": base[1],
            "copied": sections["files"].split()[0],
            "run": sections["post"].removeprefix("cd /fragfield\n").strip(),
            "environment": sections["environment"].removeprefix("export "),
            "start": sections["runscript"].removeprefix("exec ").removesuffix(' "$@"'),
        },
    }


def test_both_container_files_do_the_same_and_leave_all_else_to_setup():
    docker, apptainer = container_files().values()
    assert docker == apptainer
    assert docker["run"].startswith("sh setup.sh install && rm -rf ")
    assert not re.search(r"\b(apt|apt-get|pip|conda) ", docker["run"])
    assert docker["base"].partition(":")[0] == "debian"


def test_the_image_gets_no_environment_of_the_host():
    ignored = (ROOT / ".dockerignore").read_text(encoding="utf-8").split()
    assert {".git", ".venv", "runs", "build"} <= set(ignored)
