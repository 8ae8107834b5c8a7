"""Tables whose numbers may be meant in two ways: small inputs of kinds that public reports describe, with source."""

from __future__ import annotations

import pytest

import fragfield

ARENA = "Angle from;Angle to;Number;mean mass (g);velocity (m/s)\n"
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
        ("Angle from;Angle to;Number;mean mass (g);v (m/s);Prüfer\n" + NUMBERS).encode("cp1252"),
        {},
        "not text in UTF-8; say which: --encoding cp1252 or --encoding latin-1",
    ),
    "the same, answered in part": (
        ("Angle from;Angle to;Number;mean mass (g);v (m/s);Prüfer\n" + NUMBERS).encode("cp1252"),
        {"encoding": "cp1252"},
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
        "line 3, cell 1 (zone): '3-May' is no range of zone; allowed: from and to, as 5-10",
    ),
    "mres.uni-potsdam.de (numbers to dates)": (
        ARENA + "0;90;3;03.05.2024;800\n90;180;4;2,25;900\n",
        {},
        "line 2, cell 4 (mean mass (g)): '03.05.2024' is not a number",
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
        ARENA.replace("mean ", "") + NUMBERS,
        {},
        '--column mean_mass="mass (g)" or --column total_mass="mass (g)"',
    ),
    "the same, of all": (
        ARENA.replace("mean ", "") + NUMBERS,
        {"columns": {"total_mass": "mass (g)"}},
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
        "column mean_mass=Mase (allowed: Angle from, Angle to, Number, mean mass (g)",
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
        "'m > (g)' is not a number; give the lines without it: --rows",
    ),
    "the same, the second": (
        ARENA + NUMBERS + "\nm > (g);N\n1;70\n2;40\n5;10\n",
        {"rows": "5:8"},
        {"pieces": 70.0, "lightest": 0.001},
    ),
    "one angle a zone": (
        "Angle;Number;mean mass (g);v (m/s)\n0;3;1,5;800\n90;4;2,25;900\n",
        {},
        "--zone-angle from or --zone-angle centre or --zone-angle to",
    ),
    "the same, from": (
        "Angle;Number;mean mass (g);v (m/s)\n0;3;1,5;800\n90;4;2,25;900,5\n",
        {"zone_angle": "from"},
        {**TWO, "most_mass_deg": [90.0, 180.0]},
    ),
    "one row a piece, from the base": (
        "Angle (°);Mass (g);v (m/s)\n90;1,5;800\n30;2;900\n",
        {"from_base": True},
        {"pieces": 2.0, "most_mass_deg": [150.0, 155.0]},
    ),
    "of four rounds": (ARENA + NUMBERS, {"number_of_rounds": 4.0}, {"pieces": 1.75}),
    "rounds above the table": (
        "Number of tests: 3\n" + ARENA + NUMBERS,
        {},
        "'Number of tests: 3' stands above the table: its numbers are of one round, or of all; say which",
    ),
    "rounds in a comment": ("# rounds = 4\n" + ARENA + NUMBERS, {}, {"pieces": 1.75}),
    "one column, decimal commas": (
        "Mass (g)\n1,0\n1,1\n",
        {},
        "2 cells below 1 names; name every column, and say --separator semicolon",
    ),
    "commas for everything": (
        ARENA.replace(";", ",") + NUMBERS.replace(";", ","),
        {},
        "line 2: 6 cells below 5 names; name every column",
    ),
    "numbers per degree": (ARENA.replace("Number", "N/°") + NUMBERS, {}, "number missing; found the columns"),
    "a row of units": (
        "zone from;zone to;number;mean mass;speed\n°;°;1;g;m/s\n" + NUMBERS,
        {"kind": "arena"},
        "zone_from, zone_to missing; found the columns '°', '°'",
    ),
    "the same, left out": (
        "zone from;zone to;number;mean mass;speed\n°;°;1;g;m/s\n" + NUMBERS,
        {"rows": "1,3:4", "units": {"mass": "g", "speed": "m/s"}},
        TWO,
    ),
    "masses in per cent": (ARENA.replace("(g)", "(%)") + NUMBERS, {}, "mean_mass missing; found the columns"),
    "a row of sums by its name": (ARENA + NUMBERS + "Total;;7;;\n", {}, "'Total' is not a number; give the lines"),
    "numbers of zones": (
        "Zone;Number;mean mass (g);v (m/s)\n1;3;1,5;800\n2;4;2,25;900\n",
        {"units": {"angle": "deg"}},
        "zone: one angle a zone, 1, 2; say which: --zone-angle from",
    ),
    "an empty mass": (
        ARENA + "0;90;3;;800\n90;180;4;2,25;900\n",
        {},
        "line 2, cell 4 (mean mass (g)): empty; needed: mean_mass in every row",
    ),
    "a million columns": ("x;" * 1_000_000 + "\n", {}, "a row has 1000000 cells"),
    "two thousand columns": (
        ";".join(map(str, range(2000))) + "\n",
        {},
        "a row has 2000 cells; allowed: at most 1000 columns",
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
