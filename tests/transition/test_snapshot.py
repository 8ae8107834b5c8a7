"""Reading the burst's snapshot: what is refused, and how."""

from __future__ import annotations

import numpy as np
import pytest

from tests.transition.synthetic import Tube, fill, sealed
from transition import InputError, Snapshot, break_up

SMALL = Tube(radial_cells=1, around=8, axial=10)


@pytest.fixture
def path(tmp_path):
    return SMALL.write(tmp_path / "burst_snapshot.h5", case="title = 'x'", seed="1")


def test_reads_what_the_burst_stage_writes(path):
    snapshot = Snapshot.read(path)
    assert snapshot.casing.size == 80
    assert snapshot.time == pytest.approx(1.2e-4)
    assert snapshot.provenance == {"case": "title = 'x'", "seed": "1"}
    assert [segment.kind for segment in snapshot.rounds[0].segments] == ["nose", "wall", "wall", "base"]
    assert snapshot.rounds[0].segments[1].name == "wall 1"
    assert snapshot.rounds[0].explosive == "TNT"


def test_no_such_file(tmp_path):
    with pytest.raises(InputError, match=r"none.h5: no such file; the burst stage writes burst_snapshot.h5"):
        break_up(tmp_path / "none.h5")


@pytest.mark.parametrize("kept", [0.0, 0.1, 0.98])
def test_cut_off(path, kept):
    """Of what is no HDF5 file at all nothing is kept."""
    whole = path.read_bytes()
    path.write_bytes(whole[: int(kept * len(whole))] or b"mass,velocity\n1,2\n")
    with pytest.raises(InputError, match=r"burst_snapshot.h5: cut off, or not an HDF5 file"):
        Snapshot.read(path)


def drop(name):
    return lambda file: file.__delitem__(name)


def put(name, value):
    return lambda file: (file.__delitem__(name), file.__setitem__(name, value))


def mark(place, name, value):
    return lambda file: file[place].attrs.__setitem__(name, value)


@pytest.mark.parametrize(
    ("act", "message"),
    [
        (
            mark("/", "format", "fragfield fragments"),
            "format is 'fragfield fragments', needed 'fragfield burst snapshot'",
        ),
        (mark("/", "format_version", 2), "format_version is 2, this program reads 1"),
        (lambda file: file.attrs.__delitem__("time"), "attribute time is missing"),
        (mark("/", "time", "soon"), "attribute time is .*soon.*; a number is needed"),
        (drop("nodes/velocity"), "nodes/velocity is missing"),
        (drop("cells"), "cells/nodes is missing"),
        (drop("rounds"), "rounds is missing"),
        (drop("rounds/0/segments"), "rounds/0: segments is missing"),
        (
            lambda file: file["rounds/0"].attrs.__delitem__("casing_density"),
            "rounds/0: attribute casing_density is missing",
        ),
        (mark("rounds/0", "axis", [0.0, 1.0]), r"rounds/0: attribute axis is \[0.0, 1.0\]; three finite numbers"),
        (put("cells/mass", np.ones(3)), r"mass has shape \(3,\), needed \(240,\)"),
        (fill("nodes/velocity", (5, 1), np.nan), "velocity holds a value that is not finite"),
        (fill("cells/mass", 7, 0.0), "casing cell 7 has the mass 0 kg; above zero is needed"),
        (fill("cells/nodes", (0, 0), 10**6), "cells name nodes outside 0..439"),
        (fill("cells/round", 0, 3), "cells name rounds outside 0..0"),
        (fill("cells/segment", 0, 9), "casing cells name segments that /rounds/<i>/segments does not list"),
        (fill("cells/part", slice(None), 1), "no casing cell"),
        (
            put("rounds/0/segments", np.zeros(1, dtype=[("start", "f8")])),
            "segments: no column name, kind, end, outer_radius",
        ),
    ],
)
def test_refused(path, act, message):
    with pytest.raises(InputError, match=message):
        Snapshot.read(sealed(path, act))


def test_unknown_kind_of_segment(tmp_path):
    tube = Tube(radial_cells=1, around=8, axial=10, kinds=("tip", "wall", "wall", "base"))
    with pytest.raises(InputError, match="kind is 'tip'; allowed: nose, wall, base"):
        tube.read(tmp_path / "s.h5")
