"""`fragfield check --drawing`: dimensioned drawings of a case's rounds, before anything is computed."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fragfield.errors import InputError

if TYPE_CHECKING:
    from pathlib import Path

    from fragfield.case import CaseTable

__all__ = ["write_drawings"]

_KINDS = ("svg", "png")


def write_drawings(case: CaseTable, path: Path) -> list[Path]:
    """Write the drawing of a resolved case's round; of several different rounds one each, numbered.

    Raises
    ------
    InputError
        The file's ending is none of .svg and .png, there are no rounds, one is a mesh, or it cannot be written.
    """
    from fragfield.report.figures.drawing import drawing_style, to_bytes
    from fragfield.report.figures.round_drawing import draw_round, drawn_rounds, expected_masses
    from fragfield_base.writing import write_bytes

    kind = path.suffix.lower().lstrip(".")
    if kind not in _KINDS:
        raise InputError(f"--drawing: found {path.name}; allowed: a name that ends in .svg or .png")
    if not case.round:
        raise InputError("--drawing: found a case without [[round]]; allowed: a case with a round")
    different = drawn_rounds(case)
    written = []
    for number, (item, expected) in enumerate(zip(different, expected_masses(case), strict=True), start=1):
        target = path if len(different) == 1 else path.with_name(f"{path.stem}_{number}{path.suffix}")
        with drawing_style():
            drawn = to_bytes(draw_round(item, expected), kind)
        written.append(write_bytes(target, drawn, InputError))
    return written
