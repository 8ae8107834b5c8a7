"""The documentation: built without a warning, its command lines and case files real, its examples run."""

from __future__ import annotations

import contextlib
import importlib
import importlib.util
import inspect
import json
import math
import os
import re
import shlex
import subprocess
import sys
import tomllib
from dataclasses import dataclass
from html.parser import HTMLParser
from pathlib import Path

import pytest
from typer.main import get_command

import fragfield
from burst_fenicsx.materials.library import load_explosive
from fragfield.case import load_case
from fragfield.case.keys import paths_of
from fragfield.case.schema import CaseTable
from fragfield.cli import app
from fragfield_base.substances import is_substance
from tests.fragfield.drawn_shells import write_dxf
from tests.fragfield.maps import metres, north_up, slope, write
from tests.fragfield.plain_reports import leave_out_figures
from tests.fragfield.short_run import invoke
from tests.test_snippets import write_cookbook_test

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
PAGES = sorted(path.relative_to(DOCS).as_posix() for path in DOCS.rglob("*.md"))
GUIDE = [page for page in PAGES if page.startswith("guide/")]
BUILDER = importlib.util.find_spec("mkdocs") is not None and importlib.util.find_spec("latex2mathml") is not None
BLOCK = re.compile(r"(?:^<!-- (run(?: slow)?) -->\n)?^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
TUBE = """
round = [{ name = "tube", profile = "tube", explosive = "tnt", casing = "steel_paper", axis = [0, 0, 1] }]
burst = { cell_size = "14 mm", end_time = "120 us" }
"""


@dataclass(frozen=True)
class Block:
    """A fenced block of a page: its language, text, and mark."""

    language: str
    text: str
    mark: str


def blocks(page: str) -> list[Block]:
    """Fenced blocks of a page in order."""
    text = (DOCS / page).read_text(encoding="utf-8")
    return [Block(language, body, mark or "") for mark, language, body in BLOCK.findall(text)]


def command_lines(text: str) -> list[list[str]]:
    """Arguments of every fragfield command in a text of shell lines."""
    found = []
    for line in text.splitlines():
        words = shlex.split(line, comments=True)
        places = [i for i, word in enumerate(words) if word == "fragfield" or word.endswith("/fragfield")]
        # Not a name that another command is given, as in `conda create -n fragfield`.
        if places and (places[0] == 0 or words[0] in ("mpirun", "srun")):
            found.append(words[places[0] + 1 :])
    return found


def parse(arguments: list[str]) -> None:
    """Give arguments to the real command line without running anything."""
    name, *rest = arguments
    commands = get_command(app).commands
    assert name in commands, f"there is no command {name}; there are {', '.join(commands)}"
    commands[name].make_context(name, rest)


def shown_pages() -> list[str]:
    """Texts in which a user finds command lines."""
    return [*(f"docs/{page}" for page in PAGES), "README.md", "CONTRIBUTING.md"]


@pytest.mark.parametrize("page", shown_pages())
def test_every_command_line_is_one_that_the_program_takes(page):
    text = (ROOT / page).read_text(encoding="utf-8")
    for _, language, body in BLOCK.findall(text):
        if language not in ("sh", "text"):
            continue
        for arguments in command_lines(body):
            if arguments and arguments[0] not in ("--help", "--version"):
                parse(arguments)


PLACE = (
    '{"type": "Feature", "properties": {"kind": "person"}, "geometry": {"type": "Point", "coordinates": [7, 51.501]}}'
)
PIT = "# rounds = 2\nmass_above_g;number\n0.5;1880\n2;1470\n8;885\n32;330\n128;47\n"


@pytest.mark.parametrize("page", GUIDE)
def test_every_case_file_is_read(page, tmp_path):
    """Whole ones as they stand; parts of one over a tube, beside the fragments of two such tubes; and an explosive."""
    (tmp_path / "pit.csv").write_text(PIT, encoding="utf-8")
    write_dxf(tmp_path / "shell.dxf")
    write(tmp_path / "terrain.tif", slope(*north_up(half=2000.0)), metres(half=2000.0))
    (tmp_path / "places.geojson").write_text(PLACE, encoding="utf-8")
    for number, block in enumerate(block for block in blocks(page) if block.language == "toml"):
        named = re.match(r"# (\w+\.toml)\n", block.text)
        path = tmp_path / (named[1] if named else f"part_{number}.toml")
        path.write_text(block.text if named else TUBE + block.text, encoding="utf-8")
        if is_substance(tomllib.loads(block.text)):
            assert load_explosive(path).models
            continue
        case = load_case(path, burst="[burst]" in path.read_text(encoding="utf-8"))
        # Every table that the page writes has come into the case.
        tables = set(tomllib.loads(block.text))
        assert tables
        assert tables <= case.model_fields_set


def test_the_guide_has_case_files():
    """So that the test above reads something: of the pages some have whole cases, and some parts of one."""
    texts = [block.text for page in GUIDE for block in blocks(page) if block.language == "toml"]
    whole = [text for text in texts if re.match(r"# (\w+\.toml)\n", text)]
    assert len(whole) >= 1
    assert len(texts) - len(whole) >= 3


def run_page(page: str, folder: Path, *, slow: bool) -> int:
    """Run what a page marks to run, in order, in a folder; returns the number of blocks that ran."""
    environment = {
        **os.environ,
        "PYTHONPATH": str(ROOT),
        "NUMBA_NUM_THREADS": os.environ.get("NUMBA_NUM_THREADS", "1"),
    }
    ran, python = 0, []
    for block in blocks(page):
        named = re.match(r"# (\w+\.toml)\n", block.text)
        if block.language == "toml" and named:
            (folder / named[1]).write_text(block.text, encoding="utf-8")
            continue
        if block.language == "python" and (slow or not needs_a_run(block.text)):
            python.append(block.text)  # blocks of a page are one program
            commands = [[sys.executable, "-c", "\n".join(python)]]
        elif block.language == "sh" and (block.mark == "run" or (slow and block.mark == "run slow")):
            commands = [[sys.executable, "-m", "fragfield", *arguments] for arguments in command_lines(block.text)]
            if not slow:  # by the same program in this process, which need not load it for every line
                for _, _, _, *arguments in commands:
                    with contextlib.chdir(folder):
                        result = invoke(*arguments)
                    assert result.exit_code == 0, f"{page}: {' '.join(arguments)}\n{result.output}"
                    ran += 1
                continue
        else:
            continue
        for command in commands:
            done = subprocess.run(
                command, cwd=folder, env=environment, capture_output=True, text=True, timeout=900, check=False
            )
            assert done.returncode == 0, f"{page}: {' '.join(command)}\n{done.stdout}\n{done.stderr}"
            ran += 1
    return ran


def needs_a_run(text: str) -> bool:
    """Whether a Python block reads what a whole run has written."""
    return '"runs/' in text


@pytest.mark.dolfinx
@pytest.mark.parametrize(
    "page",
    [
        "guide/installation.md",
        "guide/first_run.md",
        "guide/cookbook.md",
        "guide/your_test_data.md",
        "guide/rounds.md",
        "guide/your_sites.md",
    ],
)
def test_what_is_marked_runs(page, tmp_path):
    """Beside the drawing, the map of sites and the fragments that the pages name."""
    write_cookbook_test(tmp_path)
    write_dxf(tmp_path / "shell.dxf")
    (tmp_path / "places.geojson").write_text(PLACE, encoding="utf-8")
    assert run_page(page, tmp_path, slow=False) > 0


@pytest.mark.slow
@pytest.mark.dolfinx
def test_the_first_run_as_written(tmp_path):
    """The whole page, and the reading of its summary."""
    assert run_page("guide/first_run.md", tmp_path, slow=True) > 0
    assert (tmp_path / "runs" / "first" / "report.html").is_file()
    assert (tmp_path / "runs" / "staged" / "report.html").is_file()
    assert list((tmp_path / "runs" / "first" / "figures").glob("*.svg"))
    assert run_page("guide/output.md", tmp_path, slow=True) == 1


@pytest.mark.slow
@pytest.mark.dolfinx
def test_the_cookbook_as_written(tmp_path):
    write_cookbook_test(tmp_path)
    assert run_page("guide/cookbook.md", tmp_path, slow=True) > 0
    assert (tmp_path / "runs" / "test" / "report.html").is_file()


class _Loads(HTMLParser):
    """What a page loads, and the formulas in it."""

    def __init__(self) -> None:
        super().__init__()
        self.loaded: list[str] = []
        self.formulas = 0

    def handle_starttag(self, tag, attrs):
        values = dict(attrs)
        if tag in ("script", "img", "iframe", "source"):
            self.loaded.append(values.get("src") or "")
        if tag == "link":
            self.loaded.append(values.get("href") or "")
        self.formulas += tag == "math"


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The built pages."""
    if not BUILDER and not os.environ.get("FRAGFIELD_REQUIRE_ALL"):
        pytest.skip("mkdocs or latex2mathml is not here; `pip install .[docs]`")
    folder = tmp_path_factory.mktemp("site")
    done = subprocess.run(
        [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)],
        cwd=ROOT,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "WARNING" not in done.stderr
    return folder


def test_pages_load_nothing_from_the_network(site):
    for path in site.rglob("*.html"):
        page = _Loads()
        page.feed(path.read_text(encoding="utf-8"))
        outside = [address for address in page.loaded if re.match(r"(https?:)?//", address)]
        assert not outside, f"{path.name} loads {outside}"


def test_the_search_finds_without_a_server(site):
    """The index holds every page as a script, which a browser loads from a folder too."""
    text = (site / "search" / "index.js").read_text(encoding="utf-8")
    pages = json.loads(text.removeprefix("window.pages = ").rstrip().removesuffix(";"))
    places = {page["location"].partition("#")[0] for page in pages}
    built = {str(path.relative_to(site)) for path in site.rglob("*.html")} - {"404.html", "search.html"}
    assert built <= places | {"index.html"}
    assert any("Gurney" in page["text"] for page in pages)
    html = (site / "search.html").read_text(encoding="utf-8")
    assert 0 < html.index("/search/index.js") < html.index("/search.js")
    assert "search/main.js" not in html, "MkDocs' own search needs a server"


def test_the_reference_prints_every_public_name(site):
    for package in ("fragfield", "flight"):
        module = importlib.import_module(package)
        text = (site / "reference" / f"{package}.html").read_text(encoding="utf-8")
        for name in module.__all__:
            found = getattr(module, name)
            if (inspect.isclass(found) or callable(found)) and inspect.getdoc(found):
                assert re.search(rf'<h2 id="[\w-]+">{name}</h2>', text), name


def test_the_readme_is_short():
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    assert len(text.splitlines()) <= 200
    assert text.count("<!-- begin ") == 1, "one table; the others stand in validation/README.md"


def test_formulas_are_mathml(site):
    for path in sorted((site / "theory").glob("*.html")):
        text = path.read_text(encoding="utf-8")
        page = _Loads()
        page.feed(text)
        assert page.formulas > 0, path.name
        assert "$" not in re.sub(r"<(script|code|math).*?</\1>", "", text, flags=re.DOTALL), path.name


def test_an_unknown_formula_is_refused():
    pytest.importorskip("latex2mathml")
    from docs.hooks.mathematics import formula

    assert "<mfrac>" in formula(r"\frac{a}{b}", display=True)
    with pytest.raises(ValueError, match="nosuchsymbol"):
        formula(r"a + \nosuchsymbol", display=False)


def test_the_case_reference_has_every_key_of_the_schema(site):
    text = (site / "guide" / "case_file.html").read_text(encoding="utf-8")
    keys = {path.rpartition(".")[2] for path in paths_of(CaseTable) if "." in path}  # tables of the top are headings
    assert not {key for key in keys if f"<code>{key}</code>" not in text}


def test_the_command_reference_has_every_option(site):
    text = (site / "guide" / "commands.html").read_text(encoding="utf-8")
    for command in get_command(app).commands.values():
        for parameter in command.params:
            if parameter.param_type_name == "option":
                assert parameter.opts[0] in text


def test_the_words_of_the_first_page_s_picture_are_those_of_today():
    from docs.hooks.first_page import example, shown_words, stored

    found = stored()
    assert shown_words(found) == found["words"], "run `sh setup.sh docs pictures`"
    page = example()
    terms = [float(number) for number in re.findall(r"([0-9.]+)\^2", page)]
    base, total = (float(re.search(pattern, page)[1]) for pattern in (r"\$([0-9.]+) \+", r"= ([0-9.]+)\$"))
    assert total == pytest.approx(base + math.hypot(*terms), abs=0.15)


@pytest.mark.slow
def test_the_numbers_of_the_first_page_s_picture_are_those_of_today(tmp_path, monkeypatch):
    from docs.hooks.first_page import CASE, stored

    leave_out_figures(monkeypatch)
    found, shown = fragfield.run(CASE, out=tmp_path / "run", progress=False).summary, stored()
    for part in ("expected", "randomness", "grid"):
        assert getattr(found.hazard.parts, part) == pytest.approx(shown["hazard"]["parts"][part], abs=0.3)
    assert found.distance_to_apply.line == shown["distance_to_apply"]["line"]
