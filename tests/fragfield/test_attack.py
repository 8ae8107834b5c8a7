"""A small part of `sh setup.sh attack`, with fixed seeds, and property tests of all kinds of foreign files."""

from __future__ import annotations

import math
import os
import random
import shutil

import h5py
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from flight import Fragments
from flight.drag import Drag
from flight.errors import InputError as FlightInputError
from flight.files.text_tables import read_columns, write_columns
from fragfield.places.maps import read_map
from tests.attack import disk, exits, files, signals
from tests.attack.__main__ import generated_cases

FEW = settings(max_examples=150, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))


def test_generated_cases_are_taken_or_refused_with_their_key(tmp_path):
    assert generated_cases(tmp_path, 18, 40, math.inf) == []


@pytest.mark.dolfinx
def test_damaged_files_of_a_run_are_refused_or_harmless(whole_run, tmp_path):
    assert files.attack(whole_run[0], tmp_path, 18, 25, math.inf) == []


@pytest.fixture(scope="module")
def left_alone(tmp_path_factory):
    """A run of all stages that nothing disturbed."""
    return signals.Reference(tmp_path_factory.mktemp("attacked"))


@pytest.mark.slow
@pytest.mark.dolfinx
@pytest.mark.mpi
@pytest.mark.parametrize("ranks", [1, 2])
def test_signals_in_every_stage_change_no_result(left_alone, tmp_path, ranks):
    plan = ("burst", "break-up", "fly", "report") if ranks == 1 else ("burst", "fly")
    assert signals.attack(tmp_path, 18 + ranks, 3 * len(plan), math.inf, left_alone, ranks, plan) == []


@pytest.mark.slow
@pytest.mark.dolfinx
@pytest.mark.skipif(os.geteuid() != 0 or shutil.which("mount") is None, reason="small disks are mounted by root")
def test_full_disks_in_every_stage_change_no_result(left_alone, tmp_path):
    assert disk.attack(tmp_path, 18, 4, math.inf, left_alone, ("burst", "break-up", "fly", "report")) == []


@pytest.mark.slow
@pytest.mark.dolfinx
def test_commands_in_which_a_call_fails_end_in_good_order(left_alone, tmp_path):
    assert exits.attack(left_alone.whole, tmp_path, 18, 12) == []


ASCII_GRID = "ncols 3\nnrows 3\nxllcorner -15\nyllcorner -15\ncellsize 10\n1 2 3\n4 5 6\n7 8 9\n"
DRAG = "# a source\nmach,cd\n0,1.0\n1,1.4\n3,1.1\n"
OWN = "mass_kg,vx_m_s,vy_m_s,vz_m_s\n0.01,900,0,100\n0.02,800,10,100\n"
WORDS = st.sampled_from(
    ["nan", "inf", "-inf", "-2", "0", "1e300", "1e-300", "", "x", "99999999999999999999", "1,2", "\x00", "é"]
)


@st.composite
def mutated(draw, text):
    """A text with some of its words replaced, removed or repeated."""
    words = [line.replace(",", " , ").split(" ") for line in text.splitlines()]
    for _ in range(draw(st.integers(1, 4))):
        line = words[draw(st.integers(0, len(words) - 1))]
        place = draw(st.integers(0, len(line) - 1))
        match draw(st.integers(0, 3)):
            case 0:
                line[place] = draw(WORDS)
            case 1:
                line.insert(place, draw(WORDS))
            case 2 if len(line) > 1:
                del line[place]
            case _:
                words.insert(draw(st.integers(0, len(words))), list(line))
    return "\n".join(" ".join(line).replace(" , ", ",") for line in words)


def _read_or_refused(read, path):
    """What a reader gives, or None for a refusal that names the file."""
    refused = None
    try:
        return read(path)
    except FlightInputError as error:
        refused = str(error)
    assert path.name in refused
    return None


@FEW
@given(text=mutated(ASCII_GRID))
def test_a_height_map_is_finite_or_refused(tmp_path_factory, text):
    path = tmp_path_factory.mktemp("map") / "heights.asc"
    path.write_text(text, encoding="utf-8")
    grid = _read_or_refused(lambda one: read_map(one, datum=0.0), path)
    if grid is not None:
        assert grid.heights.shape[0] >= 2
        assert min(grid.step) > 0.0
        assert np.isfinite(grid.corner).all()


@FEW
@given(text=mutated(DRAG))
def test_a_drag_table_rises_or_is_refused(tmp_path_factory, text):
    path = tmp_path_factory.mktemp("drag") / "drag.csv"
    path.write_text(text, encoding="utf-8")
    drag = _read_or_refused(Drag.read, path)
    if drag is not None:
        _read_or_refused(lambda _: drag.table(), path)
        assert (np.diff(drag.mach) > 0.0).all()
        assert (drag.coefficient >= 0.0).all()


@FEW
@given(text=mutated(OWN))
def test_fragments_of_a_table_are_possible_or_refused(tmp_path_factory, text):
    path = tmp_path_factory.mktemp("own") / "own.csv"
    path.write_text(text, encoding="utf-8")
    found = _read_or_refused(Fragments.read, path)
    if found is not None:
        assert (found.mass > 0.0).all()
        assert (found.speed < 1e5).all()


@settings(FEW, max_examples=20)  # each is looked through by a process of its own
@given(data=st.data())
def test_fragments_of_a_foreign_hdf5_file_are_possible_or_refused(tmp_path_factory, data):
    """Right and wrong types, shapes and numbers under the right names."""
    path = tmp_path_factory.mktemp("own") / "own.h5"
    number = data.draw(st.integers(0, 3))
    shapes = st.sampled_from([(number,), (number, 3), (number + 1,), (), (3,), (number, 2)])
    kinds = st.sampled_from(["f8", "f4", "i4", "u1", "S3", "c16"])
    with h5py.File(path, "w") as file:
        file.attrs["format"] = data.draw(st.sampled_from(["fragfield fragments", "else", 3]))
        file.attrs["format_version"] = data.draw(st.sampled_from([1, 2, "one", [1, 1]]))
        for name, usual in (
            ("mass", 1),
            ("position", 3),
            ("velocity", 3),
            ("shape_factor", 1),
            ("round", 1),
            ("segment", 1),
        ):
            if data.draw(st.integers(0, 9)) == 0:
                file.create_group(f"fragments/{name}")
                continue
            right = data.draw(st.integers(0, 3)) > 0
            shape = ((number, 3) if usual == 3 else (number,)) if right else data.draw(shapes)
            value = data.draw(st.sampled_from([1.0, 0.0, -1.0, 1e200, math.nan, math.inf, 5.0]))
            kind = "f8" if right else data.draw(kinds)
            with np.errstate(all="ignore"):
                file[f"fragments/{name}"] = np.full(shape, value if kind[0] in "fc" else 1).astype(kind)
    found = _read_or_refused(Fragments.read, path)
    if found is not None:
        assert np.isfinite(found.velocity).all()


def test_texts_in_csv_files_are_quoted_and_never_formulas(tmp_path):
    import csv

    names = ["plain", "a,b", "two\nlines", 'a "quoted" one', "=1+1", "@SUM(A1)", "-wall", "+x", "é"]
    random.Random(1).shuffle(names)
    write_columns(tmp_path / "hits.csv", {"name": np.array(names), "x": np.arange(len(names))})
    with (tmp_path / "hits.csv").open(newline="") as file:
        rows = list(csv.reader(line for line in file if not line.startswith("#")))
    assert rows[0] == ["name", "x"]
    assert [row[1] for row in rows[1:]] == [str(number) for number in range(len(names))]
    for name, row in zip(names, rows[1:], strict=True):
        assert row[0] in (name, f"'{name}")
        assert not row[0].startswith(("=", "+", "-", "@"))
    (tmp_path / "numbers.csv").write_text("a,b\n1,2\n")
    assert read_columns(tmp_path / "numbers.csv")["b"][0] == 2.0
