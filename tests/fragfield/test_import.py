"""Tables of tests as people have them: the same fragments from every dialect, questions where two numbers may be meant.

The small inputs are of kinds that public reports describe; each has its source.
"""

from __future__ import annotations

import io
import json
import os
import zipfile

import numpy as np
import openpyxl
import pytest
from odf.opendocument import OpenDocumentSpreadsheet
from odf.table import Table, TableCell, TableRow
from odf.text import P

import flight
import fragfield
from flight.arena import ArenaTable
from tests.fragfield.short_run import invoke

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


def german(path):
    head = [
        "Arenasprengung Nr. 12;;;;;;;", "Datum: 03.05.2024;;;;;;;", "",
        ("Winkel von (°);Winkel bis (°);Masse von [g];Masse bis [g];Stückzahl;mittlere Masse [g];"
         "mittlere Geschwindigkeit [m/s];v max [m/s]"),
    ]  # fmt: skip
    total = shown(sum(row[4] for row in rows()), ",", ".")
    text = lines(head, ";", ",", ".", "\r\n") + f"Summe;;;;{total};;;\r\n"
    path.write_bytes(text.encode("cp1252"))


def french(path):
    head = [
        "sep=;", ("Angle de;Angle à;Masse inférieure;Masse supérieure;Nombre d'éclats;Masse moyenne;"
                  "Vitesse moyenne;Vitesse maximale"), "°;°;g;g;;g;m/s;m/s",
    ]  # fmt: skip
    path.write_bytes(lines(head, ";", ",", "\u202f").encode("utf-8-sig"))


def excel_text(path):
    head = "\t".join([
        "Polar angle from", "Polar angle to", "Mass from (g)", "Mass to (g)", "Number of fragments", "Mean mass (g)",
        "Mean speed (m/s)", "Max speed (m/s)",
    ])  # fmt: skip
    path.write_bytes(lines([head], "\t").encode("utf-16"))


def quoted(path):
    """Ranges with units in the cells, a name over two lines, masses in kg, speeds in km/s; as an old Mac writes it."""
    text = ['"zone";"mass group";"Stückzahl";"m\nmittel (kg)";"v0 (km/s)";"vmax (km/s)"']
    for zone, to, low, high, number, mean, speed, largest in rows():
        cells = [
            f"{zone}-{to}°", f"{shown(low, ',')} bis {shown(high, ',')} g", shown(number, ","),
            shown(mean / 1000.0, ","), shown(speed / 1000.0, ","), shown(largest / 1000.0, ","),
        ]  # fmt: skip
        text.append(";".join(f'"{cell}"' for cell in cells))
    path.write_bytes("\r".join([*text, ""]).encode("mac_roman"))


def excel(path):
    """Groups of columns above the names, merged cells, zones once for all their rows."""
    book = openpyxl.Workbook()
    sheet = book.active
    names = ["von", "bis", "von (g)", "bis (g)", "Anzahl", "Masse mittel (g)", "v mittel (m/s)", "v max (m/s)"]
    for row in (["Arena 12"], [], ["Zone", "", "Masse", "", "", "", "Geschwindigkeit", ""], names):
        sheet.append(row)
    for at, row in enumerate(rows()):
        first = at % len(GROUPS) == 0
        sheet.append(["" if at < 2 and not first else cell for at, cell in enumerate(row)])
    for cells in ("A3:B3", "C3:D3", "G3:H3"):
        sheet.merge_cells(cells)
    book.save(path)


def ods(path):
    document, table = OpenDocumentSpreadsheet(), Table(name="Blatt1")
    document.spreadsheet.addElement(table)
    head = ["Winkel von [Grad]", "Winkel bis [Grad]", "Masse von [g]", "Masse bis [g]", "Stück", "Masse mittel [g]",
            "v [m/s]", "vmax [m/s]"]  # fmt: skip
    for row in [head, *rows()]:
        line = TableRow()
        table.addElement(line)
        for value in row:
            words = isinstance(value, str)
            cell = TableCell(valuetype="string") if words else TableCell(valuetype="float", value=repr(float(value)))
            cell.addElement(P(text=str(value)))
            line.addElement(cell)
    empty = TableRow(numberrowsrepeated=1_048_550)  # as spreadsheets end a sheet
    empty.addElement(TableCell(numbercolumnsrepeated=16_384))
    table.addElement(empty)
    document.save(str(path))


def matrix(path):
    """Zones by groups of mass."""
    text = ["Zone (deg);" + ";".join(f"{shown(a, ',')}-{shown(b, ',')} g" for a, b in GROUPS) + ";v (m/s);vmax (m/s)"]
    means = [shown(row[5], ",") for row in rows()[: len(GROUPS)]]
    text.append("mean mass (g);" + ";".join(means) + ";;")
    for zone in ZONES:
        here = [row for row in rows() if row[0] == zone]
        numbers = [shown(row[4], ",") if row[4] else "" for row in here]
        text.append(f"{zone}-{zone + 30};" + ";".join(numbers) + f";{shown(here[0][6], ',')};{here[0][7]}")
    path.write_text("\n".join(text), encoding="utf-8")


DIALECTS = {
    "en.csv": english, "de.csv": german, "fr.csv": french, "excel.txt": excel_text, "mac.csv": quoted,
    "merged.xlsx": excel, "sheet.ods": ods, "matrix.csv": matrix,
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
def test_every_dialect_gives_the_same_fragments_bit_by_bit(name, expected, tmp_path):
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
    german(tmp_path / "de.csv")
    found = invoke("import", str(tmp_path / "de.csv"), "--casing-mass", "25 kg", "--out", str(tmp_path / "a.csv"))
    assert found.exit_code == 0, found.output
    for words in (
        "encoding: cp1252", "separator: semicolon", "decimal sign: comma", "column number: 'Stückzahl' (by its name)",
        "unit of mean_mass: g (in the column's name)", "left out: line 29: 'Summe |", "polar zones: 6",
        f"of it recovered: {expected.total_mass / 25.0:.1%}",
    ):  # fmt: skip
        assert words in found.output, found.output
    notes = json.loads((tmp_path / "csv-metadata.json").read_text())["tables"][0]["notes"][0]
    assert notes["source"] == "de.csv"
    assert "decimal sign: comma" in notes["concluded"]


ARENA = "Winkel von;Winkel bis;Anzahl;mittlere Masse (g);Geschwindigkeit (m/s)\n"
OWN = "zone_from_deg;zone_to_deg;number;mean_mass_g;mean_speed_m_s\n"
NUMBERS = "0;90;3;1,5;800\n90;180;4;2,25;900,5\n"
TWO = {"mass": 0.0135, "pieces": 7.0}
CASES = {
    # source of the kind: (content, options, numbers of the summary or part of the message)
    "github.com/dannymcc/may/issues/244": (ARENA + NUMBERS, {}, TWO),
    "github.com/jasp-stats/jasp-desktop/issues/403": (
        ARENA + "0;90;3;1,5;1.000,92\n90;180;4;2,25;900\n",
        {},
        {"mean_speeds": [900.0, 1000.92]},
    ),
    "github.com/harung1993/dollardollar/issues/55": (
        ARENA + "0;90;3;1,500;800\n90;180;4;2,250;900\n",
        {},
        "'1,500' is 1.500 or 1500, and no cell of the table shows which; say which: --decimal point or",
    ),
    "the same, answered": (ARENA + "0;90;3;1,500;800\n90;180;4;2,250;900\n", {"decimal": "comma"}, {"mass": 0.0135}),
    "github.com/invoice-x/invoice2data/pull/306": (
        ARENA + "0;90;1'203;1.5;800\n90;180;4;2.25;900\n",
        {},
        {"pieces": 1207.0},
    ),
    "github.com/SheetJS/ssf/issues/22": (
        'zone from,zone to,number,mean mass (g),speed (m/s)\n0,90,3,1.5,"1,237"\n90,180,4,2.25,900\n',
        {},
        {"mean_speeds": [900.0, 1237.0]},
    ),
    "github.com/pandas-dev/pandas/issues/47303": (("sep=|\n" + ARENA + NUMBERS).replace(";", "|"), {}, TWO),
    "github.com/onaio/onadata/issues/695": (
        ("Winkel von;Winkel bis;Stück;mittlere Masse (g);v (m/s)\n" + NUMBERS).encode("cp850"),
        {},
        TWO,
    ),
    "github.com/csvy/csvy.github.io/issues/4": (
        "LabVIEW Measurement;\nOperator;Smith\nSamples;2\n***End_of_Header***;\n" + ARENA + NUMBERS,
        {},
        TWO,
    ),
    "github.com/pandas-dev/pandas/issues/41304": (ARENA + NUMBERS.replace("\n", ";\n"), {}, TWO),
    "the same, without its name": (
        ARENA + NUMBERS + ";;7;2;900\n",
        {},
        "7 is the sum of all rows above it, as in a row of sums",
    ),
    "nowiknow.com/excel-has-bad-genes": (
        "zone;number;mean mass (g);speed (m/s)\n0-90;3;1.5;800\n3-May;4;2.25;900\n",
        {},
        "'3-May' is a date, what a spreadsheet makes of entries such as 3.5 or 5-10",
    ),
    "mres.uni-potsdam.de (numbers to dates)": (
        ARENA + "0;90;3;03.05.2024;800\n90;180;4;2,25;900\n",
        {},
        "line 2, cell 4 (mittlere Masse (g)): '03.05.2024' is a date",
    ),
    "github.com/OpenCompare/OpenCompare/issues/143": (
        'zone from,zone to,number,mean mass (g),speed (m/s)\n0,90,3,"1,5",800.5\n90,180,4,"2,25",900\n',
        {},
        "decimal signs contradict each other: '1,5' in line 2 (decimal comma) and '800.5' in line 2 (decimal point)",
    ),
    "mass without a unit": (
        ARENA.replace(" (g)", "") + NUMBERS,
        {},
        "its unit is not said; say which: --unit mass=g or --unit mass=kg or --unit mass=grain",
    ),
    "gr, of grams or grains": (
        ARENA.replace("(g)", "(gr)") + NUMBERS,
        {},
        "the unit 'gr' is g or grain; say which: --unit mass=g or --unit mass=grain",
    ),
    "Mg, as a title writes mg": (
        ARENA.replace("(g)", "(Mg)") + NUMBERS,
        {},
        "say which: --unit mass=mg or --unit mass=t",
    ),
    "feet per second": (ARENA.replace("(m/s)", "(fps)") + NUMBERS, {}, {"mean_speeds": [800 * 0.3048, 900.5 * 0.3048]}),
    "angles in radians, or not all": (
        ARENA + "0;1,57;3;1,5;800\n1,57;3,0;4;2,25;900\n",
        {},
        "say which: --unit angle=deg or --unit angle=rad",
    ),
    "mass of one or of all": (
        ARENA.replace("mittlere ", "") + NUMBERS,
        {},
        '--column mean_mass="Masse (g)" or --column total_mass="Masse (g)"',
    ),
    "the same, of all": (
        ARENA.replace("mittlere ", "") + NUMBERS,
        {"columns": {"total_mass": "Masse (g)"}},
        {"mass": 0.00375},
    ),
    "no names, by number": (
        NUMBERS,
        {
            "kind": "arena",
            "columns": {"zone_from": "1", "zone_to": "2", "number": "3", "mean_mass": "4", "mean_speed": "5"},
            "units": {"mass": "g", "speed": "m/s"},
        },
        TWO,
    ),
    "a name of no column": (
        ARENA + NUMBERS,
        {"columns": {"mean_mass": "Mase"}},
        "column mean_mass=Mase (allowed: Winkel von, Winkel bis, Anzahl, mittlere Masse (g)",
    ),
    "zones not measured": (
        ARENA + "0;90;3;1,5;800\n100;180;4;2,25;900\n",
        {},
        "no row for 90 to 100 degrees: nothing fell there",
    ),
    "the same, empty": (ARENA + "0;90;3;1,5;800\n100;180;4;2,25;900,5\n", {"empty_zones": True}, {**TWO, "zones": 3}),
    "two tables": (
        ARENA + NUMBERS + "\nm > (g);N\n1;70\n2;40\n5;10\n",
        {},
        "as the names of another table would; give the lines of one table",
    ),
    "the same, the second": (
        ARENA + NUMBERS + "\nm > (g);N\n1;70\n2;40\n5;10\n",
        {"rows": "5:8"},
        {"pieces": 70.0, "lightest": 0.001},
    ),
    "one angle a zone": (
        "Winkel;Anzahl;mittlere Masse (g);v (m/s)\n0;3;1,5;800\n90;4;2,25;900\n",
        {},
        "--zone-angle from or --zone-angle centre or --zone-angle to",
    ),
    "the same, from": (
        "Winkel;Anzahl;mittlere Masse (g);v (m/s)\n0;3;1,5;800\n90;4;2,25;900,5\n",
        {"zone_angle": "from"},
        {**TWO, "most_mass_deg": [90.0, 180.0]},
    ),
    "one row a piece, from the base": (
        "Winkel (°);Masse (g);v (m/s)\n90;1,5;800\n30;2;900\n",
        {"from_base": True},
        {"pieces": 2.0, "most_mass_deg": [150.0, 155.0]},
    ),
    "of four rounds": (ARENA + NUMBERS, {"number_of_rounds": 4.0}, {"pieces": 1.75}),
    "rounds above the table": (
        "Anzahl der Versuche: 3\n" + ARENA + NUMBERS,
        {},
        "'Anzahl der Versuche: 3' stands above the table: its numbers are of one round, or of all; say which",
    ),
    "rounds in a comment": ("# rounds = 4\n" + ARENA + NUMBERS, {}, {"pieces": 1.75}),
    "groups of columns": (
        ";Zone;;;Masse;v\nNr.;von;bis;Anzahl;Mittel (g);Mittel (m/s)\n1;0;90;3;1,5;800\n2;90;180;4;2,25;900,5\n",
        {"columns": {"mean_mass": "5", "mean_speed": "6"}},
        TWO,
    ),
    "one column, decimal commas": (
        "Masse (g)\n1,0\n1,1\n",
        {},
        "2 cells below 1 name: two columns, or one with decimal",
    ),
    "commas for everything": (
        ARENA.replace(";", ",") + NUMBERS.replace(";", ","),
        {},
        "line 2: 6 cells below 5 names; name every column",
    ),
    "numbers per degree": (ARENA.replace("Anzahl", "N/°") + NUMBERS, {}, "number missing; found the columns"),
    "masses in per cent, by the row of units": (
        "zone from;zone to;number;mean mass;speed\n°;°;1;%;m/s\n" + NUMBERS,
        {},
        "mean_mass missing; found the columns",
    ),
    "numbers of zones": (
        "Zone;Anzahl;mittlere Masse (g);v (m/s)\n1;3;1,5;800\n2;4;2,25;900\n",
        {"units": {"angle": "deg"}},
        "found 1, 2, ... 2, numbers of zones as it seems, not angles",
    ),
    "an empty mass": (
        ARENA + "0;90;3;;800\n90;180;4;2,25;900\n",
        {},
        "line 2, cell 4 (mittlere Masse (g)): empty; needed: mean_mass in every row",
    ),
    "a million columns": ("x;" * 1_000_000 + "\n", {}, "no table: field larger than field limit"),
    "two thousand columns": (
        ";".join(map(str, range(2000))) + "\n",
        {},
        "a row has more than 1000 cells; allowed: at most 1000 columns",
    ),
    "not a text": (b"\x00\x01\x02\x03" * 100, {}, "not a text: it holds bytes of zero"),
    "nothing": (b"", {}, "no table in it"),
}


@pytest.mark.parametrize("source", CASES)
def test_inputs_of_public_reports(source, tmp_path):
    content, options, wanted = CASES[source]
    path = tmp_path / "test.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    if isinstance(wanted, str):
        with pytest.raises(fragfield.InputError) as found:
            fragfield.import_table(path, **options)
        assert wanted in str(found.value)
        return
    found = fragfield.import_table(path, **options)
    for name, value in wanted.items():
        assert found.summary[name] == pytest.approx(value, rel=1e-12), (name, str(found))


def test_a_question_names_its_option_for_a_form(tmp_path):
    (tmp_path / "t.csv").write_text(ARENA.replace(" (g)", "") + NUMBERS)
    with pytest.raises(fragfield.QuestionError) as found:
        fragfield.import_table(tmp_path / "t.csv")
    assert (found.value.option, found.value.choices) == ("unit", ("mass=g", "mass=kg", "mass=grain"))


@pytest.mark.parametrize(
    ("text", "kind", "check"),
    [
        ("Masse (g);Anzahl\n1;40\n2;30\n5;10\n", "pit", lambda made: (made["mass_kg"] == [0.001, 0.002, 0.005]).all()),
        ("m > [g]\tN\n0.5\t296\n2\t100\n8\t20\n", "pit",
         lambda made: made["mass_above_kg"].tolist() == [5e-4, 2e-3, 8e-3]),
        ("class (grain),number\n1-10,50\n10-100,20\n>100,3\n", "pit", lambda made: np.isposinf(made["mass_to_kg"][-1])),
        ("Machzahl;cw\n0,5;0,8\n1,5;1,2\n", "drag", lambda made: made.coefficient.tolist() == [0.8, 1.2]),
        ("mass [g];v [m/s];az [deg];el [deg]\n10;1000;90;0\n5;500;0;90\n", "fragments",
         lambda made: np.allclose(made.velocity, [[0, 1000, 0], [0, 0, 500]], atol=1e-9)),
        ("m (g),vx (m/s),vy (m/s),vz (m/s),z (m)\n10,1,2,3.5,1.5\n", "fragments",
         lambda made: made.position.tolist() == [[0, 0, 1.5]] and made.mass.tolist() == [0.01]),
        ("Mauer;x1 (m);y1 (m);x2 (m);y2 (m);Höhe (cm);Dicke (mm)\nNord;0;10;5;10;250;300\n", "walls",
         lambda made: 'height = "2.5 m"' in made and 'thickness = "0.3 m"' in made),
    ],
)  # fmt: skip
def test_other_kinds_are_known_by_their_columns_and_read_back(text, kind, check, tmp_path):
    (tmp_path / "t.csv").write_text(text, encoding="utf-8")
    found = fragfield.import_table(tmp_path / "t.csv")
    assert found.kind == kind
    assert check(found.content)
    path = found.write(tmp_path / f"ours.{'toml' if kind == 'walls' else 'csv'}")
    case = f'title = "t"\n[flight]\n{f"drag = {path.name!r}" if kind == "drag" else ""}\n'
    if kind == "walls":
        case += path.read_text()
    (tmp_path / "case.toml").write_text(case)
    fragments = [] if kind not in ("fragments", "arena") else ["--fragments", str(path)]
    if kind != "pit":
        given = fragments or ["--fragments", str(tmp_path / "f.csv")]
        (tmp_path / "f.csv").write_text("mass_kg,vx_m_s,vy_m_s,vz_m_s\n0.01,500,0,10\n")
        checked = invoke("check", str(tmp_path / "case.toml"), *given)
        assert checked.exit_code == 0, checked.output


def test_pit_tables_of_several_rounds_say_so(tmp_path):
    from fragfield.case.conversion.mean_mass import read_counts

    (tmp_path / "t.csv").write_text("m > [g];N\n0,5;296\n2;100\n8;20\n")
    found = fragfield.import_table(tmp_path / "t.csv", number_of_rounds=2)
    counts = read_counts(found.write(tmp_path / "pit.csv"))
    assert (counts.rounds, counts.number) == (2.0, (196.0, 80.0, 20.0))


def workbook(path, *sheets, change=None):
    book = openpyxl.Workbook()
    book.remove(book.active)
    for name, lines in sheets:
        sheet = book.create_sheet(name)
        for row in lines:
            sheet.append(row)
    if change:
        change(book)
    book.save(path)
    return path


HEAD = ["zone", "number", "mean mass (g)", "speed (m/s)"]


@pytest.mark.parametrize(
    ("sheets", "options", "message"),
    [
        ([("a", [HEAD, ["0-90", 3, 1.5, 800], ["90-180", 4, "=B2*2", 900]])], {},
         "sheet 'a', cell C3 (mean mass (g)): '=B2*2' is a formula without a value"),
        ([("a", [HEAD, ["0-90", 3, __import__("datetime").date(2024, 5, 3), 800]])], {},
         "'2024-05-03 00:00:00' is a date, what a spreadsheet makes of entries such as 3.5"),
        ([("a", [HEAD, ["0-90", 3, 1, 800]]), ("b", [HEAD, ["0-90", 3, 1, 800]])], {},
         "say which: --sheet 'a' or --sheet 'b'"),
        ([("a", [HEAD]), ("b", [])], {"sheet": "c"}, "sheet 'c' (allowed: a, b)"),
        ([("a", [HEAD, ["0-90", "#DIV/0!", 1, 800], ["90-180", 2, 1, 800]])], {}, "'#DIV/0!' is not a number"),
        ([("a", [])], {}, "no cell of it holds anything"),
    ],
)  # fmt: skip
def test_what_a_spreadsheet_made_of_a_number_is_refused(sheets, options, message, tmp_path):
    path = workbook(tmp_path / "t.xlsx", *sheets)
    with pytest.raises(fragfield.InputError) as found:
        fragfield.import_table(path, **options)
    assert message in str(found.value)


def test_a_sheet_by_name_beside_a_hidden_one(tmp_path):
    rows_ = [HEAD, ["0-90", 3, 1.5, 800], ["90-180", 4, 2.25, 900.5]]
    hide = lambda book: setattr(book["notes"], "sheet_state", "hidden")  # noqa: E731
    path = workbook(tmp_path / "t.xlsx", ("Daten", rows_), ("notes", rows_), change=hide)
    assert fragfield.import_table(path).summary["mass"] == pytest.approx(0.0135)
    assert fragfield.import_table(path, sheet="1").summary["mass"] == pytest.approx(0.0135)


def test_a_workbook_by_another_name_and_a_pipe(tmp_path):
    workbook(tmp_path / "t.xlsx", ("a", [HEAD, ["0-180", 3, 1.5, 800]])).rename(tmp_path / "t.csv")
    assert fragfield.import_table(tmp_path / "t.csv").summary["mass"] == pytest.approx(0.0045)
    os.mkfifo(tmp_path / "pipe.csv")
    with pytest.raises(fragfield.InputError, match="not a regular file"):
        fragfield.import_table(tmp_path / "pipe.csv")


def packed(path, replaced):
    """A workbook with some of its parts replaced."""
    workbook(path, ("a", [HEAD, ["0-180", 3, 1.5, 800]]))
    source = zipfile.ZipFile(io.BytesIO(path.read_bytes()))
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as target:
        for entry in source.namelist():
            target.writestr(entry, replaced.get(entry, source.read(entry)))
    return path


LAUGHS = b'<?xml version="1.0"?><!DOCTYPE x [<!ENTITY a "ha"><!ENTITY b "&a;&a;">]><worksheet>&b;</worksheet>'


@pytest.mark.parametrize(
    ("replaced", "message"),
    [
        ({"xl/worksheets/sheet1.xml": LAUGHS}, "xl/worksheets/sheet1.xml declares a document type"),
        ({"xl/worksheets/sheet1.xml": b" " * (1 << 28)}, "unpacks to more than 268435456 bytes"),
        ({"xl/worksheets/sheet1.xml": b"<worksheet"}, "damaged, or not as spreadsheets write XLSX"),
        ({"xl/workbook.xml": b"<a/>"}, "no cell of it holds anything"),
    ],
)
def test_hostile_workbooks_are_refused_in_one_line(replaced, message, tmp_path):
    path = packed(tmp_path / "t.xlsx", replaced)
    with pytest.raises(fragfield.InputError) as found:
        fragfield.import_table(path)
    assert message in str(found.value)
    assert "\n" not in str(found.value)


def test_a_cut_ods_is_refused_and_not_read_in_part(tmp_path, capsys):
    """The library that reads ODS prints the first part and continues."""
    ods(tmp_path / "t.ods")
    source = zipfile.ZipFile(io.BytesIO((tmp_path / "t.ods").read_bytes()))
    with zipfile.ZipFile(tmp_path / "t.ods", "w") as target:
        for entry in source.namelist():
            content = source.read(entry)
            target.writestr(entry, content[: len(content) // 2] if entry == "content.xml" else content)
    with pytest.raises(fragfield.InputError, match=r"damaged: content\.xml is no whole XML"):
        fragfield.import_table(tmp_path / "t.ods")
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("t.xlsx", b"PK\x03\x04" + b"x" * 100, "not a workbook in XLSX or ODS"),
        ("t.xls", b"\xd0\xcf\x11\xe0" + b"x" * 100, "an old or encrypted Excel workbook; save it as .xlsx"),
        ("t.ods", b"no archive", "not a workbook in XLSX or ODS"),
    ],
)
def test_files_that_are_no_workbooks(name, content, message, tmp_path):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(fragfield.InputError, match=message):
        fragfield.import_table(tmp_path / name)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ((ARENA + NUMBERS).replace("Anzahl", "Stück").encode("cp1252"),
         "; another form is converted by: fragfield import {path} --out t_converted.csv"),
        ((OWN.replace(";", ",") + "0,90,3,1.5,800\n").encode(), "column mass_from_kg, mass_to_kg missing"),
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
