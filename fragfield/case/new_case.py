"""`fragfield new`: a commented case file to start from."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, get_args

from fragfield.errors import InputError, nearest
from fragfield_base.inputs import Quantity, Vector
from fragfield_base.writing import write_text

if TYPE_CHECKING:
    from collections.abc import Iterable
    from pathlib import Path

    from pydantic import BaseModel

__all__ = ["write_new_case"]

_USUAL_CASING = "steel_paper"
_HEAD = """\
# A case for fragfield. Values with a dimension are strings with their unit: "155 mm", "1.71 g/cm^3", "25 ft".
# A line that begins with # and a key shows a default: take the # away to change it.
#
#     fragfield check {name}          reads it, with masses, speeds, cost and warnings
#     fragfield run {name}            runs it, into runs/{stem}

"""


def write_new_case(
    path: Path, profile: str, explosive: str, *, casing: str | None = None, stack: str | None = None,
    lying: bool = False, every_key: bool = False,
) -> Path:  # fmt: skip
    """Write a case of one round, or of a stack of it, with every key explained.

    Parameters
    ----------
    path : Path
        File to write; ".toml" is added where it is missing.
    profile, explosive, casing : str
        Built-in names; the casing left out: the one made for the profile, else the paper's steel.
    stack : str, optional
        Arrangement of copies of the round, as `stack.arrangement`.
    lying : bool
        The round lies on the ground, its axis along y, so that a row of them stands side by side along x.
    every_key : bool
        With the sub-tables of every table.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    InputError
        A name is unknown, or there is such a file, or it cannot be written.
    """
    from fragfield.case.template import commented_case

    path = path if path.suffix == ".toml" else path.with_name(f"{path.name}.toml")
    if path.exists() or path.is_symlink():
        raise InputError(f"{path}: is there already; nothing was written, choose another name")
    chosen = _chosen(profile, explosive, casing, stack, lying=lying)
    text = _HEAD.format(name=path.name, stem=path.stem) + commented_case(chosen, every_key=every_key)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror})") from None
    return write_text(path, text, InputError)


def _chosen(
    profile: str, explosive: str, casing: str | None, stack: str | None, *, lying: bool = False
) -> dict[str, Any]:
    """The keys that are set, with the schema's own examples as values."""
    from burst_fenicsx.geometry.files import profile_names
    from burst_fenicsx.materials.library import casing_names, explosive_names
    from fragfield.case.tables.burst import BurstTable
    from fragfield.case.tables.flight import HazardTable
    from fragfield.case.tables.round import RoundTable
    from fragfield.case.tables.stack import StackTable

    _require("--round", profile, profile_names())
    _require("--explosive", explosive, explosive_names())
    casing = casing or _casing_for(profile, casing_names())
    _require("--casing", casing, casing_names())
    chosen: dict[str, Any] = {
        "title": f"{profile}, {explosive}" + (f", {stack}" if stack else ""),
        "seed": 1,
        "burst": {"cell_size": _example(BurstTable, "cell_size")},
        "round": [
            {
                "name": "round",
                "profile": profile,
                "explosive": explosive,
                "casing": casing,
                "attitude": "upright",
                "position": _example(RoundTable, "position"),
            }
        ],
        "break_up": {"realisations": 20},
        "flight": {},
        "witness": [{"name": "ring", "kind": "cylinder", "radius": "25 ft"}],
        "hazard": {name: _example(HazardTable, name) for name in ("energy", "density")},
    }
    if lying:
        chosen["title"] += ", lying"
        chosen["round"][0] |= _lying(profile)
    if stack is not None:
        _require("--stack", stack, get_args(StackTable.model_fields["arrangement"].annotation))
        number = {"counts": [2, 2, 1]} if stack == "pallet" else {"count": 2}
        chosen["stack"] = {"arrangement": stack, **number, "gap": _example(StackTable, "gap")}
    return chosen


def _lying(profile: str) -> dict[str, Any]:
    """Position and attitude of a round that lies on the ground along y, its length halved by the plane y = 0."""
    from burst_fenicsx.geometry.files import load_profile

    found = load_profile(profile)
    height = math.ceil(1e3 * found.max_radius - 1e-6)  # whole millimetres, not into the ground
    return {
        "position": ["0 m", f"{-500.0 * found.length:.10g} mm", f"{height} mm"],
        "attitude": "lying",
        "azimuth": "90 deg",
    }


def _require(option: str, name: str, allowed: Iterable[str]) -> None:
    names = list(allowed)
    if name not in names:
        raise InputError(f'{option}: found "{name}"{nearest(name, names)}; allowed: {", ".join(names)}')


def _casing_for(profile: str, casings: Iterable[str]) -> str:
    """The casing that shares a word with the profile's name ("steel_m107" with "m107"), else the paper's steel."""
    words = set(profile.split("_"))
    return next((casing for casing in casings if words & set(casing.split("_"))), _USUAL_CASING)


def _example(model: type[BaseModel], name: str) -> Any:  # noqa: ANN401 - a string or a list of strings
    """The example that the schema gives for a field."""
    import tomllib

    for mark in model.model_fields[name].metadata:
        if isinstance(mark, Quantity):
            return mark.example
        if isinstance(mark, Vector):
            return tomllib.loads(f"value = {mark.example}")["value"]
    message = f"{name} has no example"
    raise LookupError(message)
