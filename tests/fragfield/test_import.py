"""Tables of tests as people have them: the same fragments from every dialect, other kinds, the command."""

from __future__ import annotations

import hashlib

import numpy as np
import openpyxl
import pytest

import flight
import fragfield
from flight.arena import ArenaTable
from tests.fragfield.short_run import invoke
from tests.fragfield.test_import_reports import ARENA, NUMBERS
from tests.fragfield.test_import_workbooks import HEAD, workbook

ZONES = range(0, 180, 30)
GROUPS = ((0.1, 0.5), (0.5, 2.0), (2.0, 10.0), (10.0, 1000.0))  # g


def rows():
    """Zone (degrees), group (g), number, mean mass (g), mean and largest speed (m/s) of an arena test."""
    draw = np.random.default_rng(36)
    return [
        (zone, zone + 30, low, high, int(draw.integers(0, 90)) + (0.5 if low == 2.0 else 0.0),
         round(low * (high / low) ** 0.4, 3), 900.5 + zone, 1100 + zone)
        for zone in ZONES for low, high in GROUPS
    ]  # fmt: skip


def shown(value, decimal=".", thousands=""):
    """A number as a spreadsheet of some country writes it."""
    text = f"{value:,.10g}" if thousands else f"{value:.10g}"
    return text.replace(",", "\0").replace(".", decimal).replace("\0", thousands)


def lines(head, separator, decimal=".", thousands="", end="\n"):
    body = [separator.join(shown(cell, decimal, thousands) for cell in row) for row in rows()]
    return end.join([*head, *body, ""])


def english(path):
    head = "zone_from_deg,zone_to_deg,mass_from_g,mass_to_g,number,mean_mass_g,mean_speed_m_s,max_speed_m_s"
    path.write_text(lines([head], ","), encoding="utf-8")


def excel_of_decimal_commas(path):
    head = [
        "Arena test 12;;;;;;;", "Date: 03.05.2024;;;;;;;", "",
        "Angle from (°);Angle to (°);Mass from [g];Mass to [g];Number;Mean mass [g];Mean velocity [m/s];v max [m/s]",
    ]  # fmt: skip
    path.write_bytes(lines(head, ";", ",", ".", "\r\n").encode("utf-8-sig"))


def excel_text(path):
    head = "\t".join([
        "Polar angle from", "Polar angle to", "Mass from (g)", "Mass to (g)", "Number of fragments", "Mean mass (g)",
        "Mean speed (m/s)", "Max speed (m/s)",
    ])  # fmt: skip
    path.write_bytes(lines([head], "\t").encode("utf-16"))


NAMES = ["angle from (deg)", "angle to (deg)", "mass from (g)", "mass to (g)", "number", "mean mass (g)",
         "v mean (m/s)", "v max (m/s)"]  # fmt: skip


def excel(path):
    """Merged cells: zones once for all their rows."""
    book = openpyxl.Workbook()
    sheet = book.active
    for row in (["Arena 12"], [], NAMES):
        sheet.append(row)
    for at, row in enumerate(rows()):
        first = at % len(GROUPS) == 0
        sheet.append(["" if at < 2 and not first else cell for at, cell in enumerate(row)])
    book.save(path)


DIALECTS = {
    "points.csv": english, "commas.csv": excel_of_decimal_commas, "excel.txt": excel_text, "merged.xlsx": excel,
}  # fmt: skip


@pytest.fixture(scope="module")
def expected():
    """The table, by hand."""
    cells = [row for row in rows() if row[4] > 0]
    return ArenaTable.of_rows(
        np.arange(0.0, 181.0, 30.0), np.array([row[0] // 30 for row in cells]),
        *(np.array([float(f"{row[at] * scale:.15g}") for row in cells])
          for at, scale in ((2, 1e-3), (3, 1e-3), (4, 1.0), (5, 1e-3), (6, 1.0), (7, 1.0))),
    )  # fmt: skip


@pytest.mark.parametrize("name", DIALECTS)
def test_every_form_gives_the_same_fragments_bit_by_bit(name, expected, tmp_path):
    DIALECTS[name](tmp_path / name)
    found = fragfield.import_table(tmp_path / name)
    assert found.kind == "arena"
    written = ArenaTable.read(found.write(tmp_path / "ours.csv"))
    drawn = expected.realisation(7)
    for table in (found.content, written):
        for part in ("zones", "zone", "mass_from", "mass_to", "number", "mass", "speed", "max_speed"):
            assert np.array_equal(getattr(table, part), getattr(expected, part)), part
        again = table.realisation(7)
        assert again.mass.tobytes() == drawn.mass.tobytes()
        assert again.velocity.tobytes() == drawn.velocity.tobytes()


def test_the_command_shows_every_conclusion_and_the_mass(expected, tmp_path):
    excel_of_decimal_commas(tmp_path / "t.csv")
    found = invoke("import", str(tmp_path / "t.csv"), "--casing-mass", "25 kg", "--out", str(tmp_path / "a.csv"))
    assert found.exit_code == 0, found.output
    for words in (
        "encoding: utf-8", "separator: semicolon", "decimal sign: comma", "column number: 'Number' (by its name)",
        "unit of mean_mass: g (in the column's name)", "polar zones: 6",
        f"of it recovered: {expected.total_mass / 25.0:.1%}",
    ):  # fmt: skip
        assert words in found.output, found.output


def test_a_question_names_its_option_for_a_form(tmp_path):
    (tmp_path / "t.csv").write_text(ARENA.replace(" (g)", "") + NUMBERS)
    with pytest.raises(fragfield.QuestionError) as found:
        fragfield.import_table(tmp_path / "t.csv")
    assert (found.value.option, found.value.choices) == ("unit", ("mass=g", "mass=kg", "mass=grain"))


@pytest.mark.parametrize(
    ("text", "check"),
    [
        ("Mass (g);Number\n1;40\n2;30\n5;10\n", lambda made: (made["mass_kg"] == [0.001, 0.002, 0.005]).all()),
        ("m > [g]\tN\n0.5\t296\n2\t100\n8\t20\n", lambda made: made["mass_above_kg"].tolist() == [5e-4, 2e-3, 8e-3]),
        ("class (grain),number\n1-10,50\n10-100,20\n>100,3\n", lambda made: np.isposinf(made["mass_to_kg"][-1])),
    ],
)  # fmt: skip
def test_a_pit_test_is_known_by_its_columns_and_read_back(text, check, tmp_path):
    from fragfield.case.conversion.mean_mass import read_counts

    (tmp_path / "t.csv").write_text(text, encoding="utf-8")
    found = fragfield.import_table(tmp_path / "t.csv")
    assert found.kind == "pit"
    assert check(found.content)
    assert read_counts(found.write(tmp_path / "ours.csv")).rounds == 1.0


def test_pit_tables_of_several_rounds_say_so(tmp_path):
    from fragfield.case.conversion.mean_mass import read_counts

    (tmp_path / "t.csv").write_text("m > [g];N\n0,5;296\n2;100\n8;20\n")
    found = fragfield.import_table(tmp_path / "t.csv", number_of_rounds=2)
    counts = read_counts(found.write(tmp_path / "pit.csv"))
    assert (counts.rounds, counts.number) == (2.0, (196.0, 80.0, 20.0))


def test_the_file_says_where_it_is_from(tmp_path):
    source = tmp_path / "t.csv"
    source.write_text("m > [g];N\n0,5;296\n2;100\n8;20\n")
    written = fragfield.import_table(source).write(tmp_path / "pit.csv").read_text()
    assert f"# source: t.csv\n# source_sha256: {hashlib.sha256(source.read_bytes()).hexdigest()}\n" in written
    assert "# concluded: " in written


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ((ARENA + NUMBERS).replace("Number", "Stück").encode("cp1252"),
         "; another form is converted by: fragfield import {path} --out t_converted.csv"),
        (b"zone_from_deg,zone_to_deg,number,mean_mass_g,mean_speed_m_s\n0,90,3,1.5,800\n",
         "column mass_from_kg, mass_to_kg missing"),
        (b"Winkel von,Winkel bis,Anzahl\n0,90,3\n", "found the columns Winkel von, Winkel bis, Anzahl; needed"),
    ],
)  # fmt: skip
def test_a_foreign_file_in_a_case_names_the_command(content, words, tmp_path):
    path = tmp_path / "t.csv"
    path.write_bytes(content)
    (tmp_path / "case.toml").write_text('title = "t"\n[flight]\n')
    found = invoke("check", str(tmp_path / "case.toml"), "--fragments", str(path))
    assert found.exit_code == 2, found.output
    assert words.format(path=path) in found.output
    with pytest.raises(flight.InputError, match=r"neither fragments in HDF5 .* is converted by: fragfield import"):
        flight.Fragments.read(workbook(tmp_path / "t.xlsx", ("a", [HEAD])))


@pytest.mark.parametrize(("mass", "is_doubtful"), [(12.0, False), (8.0, True), (30.0, True), (11.0, False)])
def test_a_mass_that_no_flight_would_take_is_said_at_once(mass, is_doubtful, tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("zone;number;mean mass (g);speed (m/s)\n0-90;600;10;800\n90-180;600;10;900\n")
    words = str(fragfield.import_table(path, casing_mass=mass))
    assert ("less than 50% or more than 110% of the casing" in words) == is_doubtful
