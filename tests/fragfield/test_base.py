"""Rounds that stand or lie on the ground, and rounds that touch: placed so that no mesh reaches into the other."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import pytest

from fragfield.case import load_case
from fragfield.case.conversion.clearance import min_clearance
from fragfield.case.conversion.placing import meshed, placed
from fragfield.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path

    from fragfield.case import Case

ROUND = """
[burst]
cell_size = "8 mm"
[[round]]
name = "shell"
profile = "m107"
explosive = "tnt"
casing = "steel_m107"
attitude = "{attitude}"
position = ["20 m", "0 m", "{z}"]
base = "ground"
[flight]
origin = ["20 m", "0 m"]
{ground}
{more}
"""
PLANE = '[[plane]]\nname = "yard"\nkind = "ground"\nheight = "2 m"\n'
STACK = '[stack]\narrangement = "{arrangement}"\n{count}\ngap = "0 mm"\nbase = "ground"\n'


def read(folder: Path, attitude: str, *, ground: str = "", more: str = "", z: str = "0 m") -> Case:
    rows = "\n".join(" ".join(f"{0.01 * (x - 500.0):.3f}" for x in range(0, 1001, 100)) for _ in range(11))
    text = "ncols 11\nnrows 11\nxllcenter -500\nyllcenter -500\ncellsize 100\nNODATA_value -9999\n"
    (folder / "slope.asc").write_text(text + rows + "\n")
    path = folder / "case.toml"
    path.write_text(ROUND.format(attitude=attitude, ground=ground, more=more, z=z))
    return load_case(path)


def lowest(case: Case) -> list[float]:
    """Smallest height (m) of every round, and of its mesh where a plane is in the burst."""
    outsides = (placed, partial(meshed, cell_size=case.burst.cell_size))[: 2 if case.plane else 1]
    return [min(outside(one).reach((0.0, 0.0, 1.0))[0] for outside in outsides) for one in case.round]


@pytest.mark.parametrize("attitude", ["upright", "lying", "30 deg"])
@pytest.mark.parametrize(
    ("ground", "more", "height"),
    [
        ("", "", 0.0),
        ('[flight.ground]\nheight = "2 m"\n', PLANE, 2.0),
        ('[flight.ground]\nmap = "slope.asc"\nbeyond = "level"\n', "", 0.2),  # 1 % of 20 m
    ],
)
def test_a_round_stands_on_the_ground(tmp_path: Path, attitude: str, ground: str, more: str, height: float) -> None:
    case = read(tmp_path, attitude, ground=ground, more=more)
    assert lowest(case) == [pytest.approx(height, abs=1e-9)]
    assert case.round[0].base is None


@pytest.mark.parametrize(
    ("arrangement", "count", "number"),
    [("row", "count = 3", 3), ("triangle", "count = 2", 3), ("pallet", "counts = [2, 1, 2]", 4)],
)
@pytest.mark.parametrize("attitude", ["upright", "lying"])
def test_rounds_of_a_stack_may_touch(tmp_path: Path, attitude: str, arrangement: str, count: str, number: int) -> None:
    case = read(
        tmp_path, attitude, more=PLANE.replace("2 m", "0 m") + STACK.format(arrangement=arrangement, count=count)
    )
    assert len(case.round) == number
    assert min(lowest(case)) == pytest.approx(0.0, abs=1e-9)
    for outside in (placed, partial(meshed, cell_size=case.burst.cell_size)):
        _, _, gap = min_clearance([outside(one) for one in case.round])
        assert -1e-6 <= gap < 1e-3


def test_a_height_beside_a_base_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"round\[1\].base: found together with z = 1 m of position"):
        read(tmp_path, "upright", z="1 m")
