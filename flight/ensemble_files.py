"""The files of an ensemble: ensemble.h5 with its CSV tables, and the fragments of further realisations.

ensemble.h5 holds, beside provenance and the criteria as attributes:

/counts
    what landed where, by realisation, sector and distance cell (`flight.tally.Tally`): all else follows from it;
/realisations
    one value a realisation of every distance (m);
/bands/NAME
    median, low (5 %), high (95 %), pooled, standard errors and verdict of every distance, as attributes;
/by_sector, /by_distance
    median, low, high and pooled by sector (azimuth in degrees) and by distance (m);
/expected
    the hazard distance (`flight.expected.ExpectedDistance`): numbers as attributes, by direction and by distance;
/all_round
    densities over all azimuths by group of realisations (`flight.expected.DensityGroups`);
/witness/I
    hits on every witness surface by realisation and sector (`flight.witness_hazard.SECTOR_HITS`).
"""

from __future__ import annotations

from dataclasses import asdict, fields
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.ensemble import EnsembleHazard, assess_ensemble
from flight.errors import InputError
from flight.expected import DensityGroups, Directions, ExpectedDistance
from flight.fragments import ARRAYS, Fragments, check_possible
from flight.hdf5 import open_checked, write_attributes
from flight.polar_grid import PolarGrid
from flight.tally import Criteria, Tally
from flight.text_tables import write_columns
from flight.witness_hazard import SECTOR_HITS
from fragfield_base.arrays import numbers, texts
from fragfield_base.hdf5_files import creating

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    import h5py
    from numpy.typing import NDArray

    from flight.ensemble import Curve

__all__ = ["CSV_FILES", "read_ensemble", "read_fragment_ensemble", "write_ensemble", "write_fragment_ensemble"]

FORMAT, FRAGMENTS_FORMAT, FORMAT_VERSION, FRAGMENTS_VERSION = (
    "fragfield ensemble", "fragfield ensemble of fragments", 2, 1,
)  # fmt: skip
CSV_FILES = ("ensemble.csv", "hazard_by_distance.csv", "hazard_by_sector.csv")
_COUNTS = ("edges", "landings", "tracks", "fragments", "hazardous", "throw")
_GRID = ("sectors", "cuts", "cell", "cells")
_CRITERIA = ("energy", "density", "person_area", "person_height")


def write_ensemble(
    found: EnsembleHazard,
    witnesses: Mapping[str, NDArray[Any]],
    folder: str | Path,
    provenance: Mapping[str, str] | None = None,
) -> list[Path]:
    """Write ensemble.h5 and its CSV tables into a folder; return the paths.

    Parameters
    ----------
    found : EnsembleHazard
        Hazard over the realisations.
    witnesses : mapping from a surface's name to (n, s) structured arrays of dtype SECTOR_HITS
        Hits by realisation and sector.
    folder : path
        Where to; it must be there.
    provenance : mapping
        Goes into every file.
    """
    folder, stamp = Path(folder), dict(provenance or {})
    path = folder / "ensemble.h5"
    with creating(path, InputError) as file:
        write_attributes(file, FORMAT, FORMAT_VERSION, stamp)
        for name in _CRITERIA:
            file.attrs[name] = getattr(found.criteria, name)
        file.attrs["tolerance"] = found.tolerance
        file.attrs["undetermined"] = found.undetermined
        if found.expected is not None:
            _put_expected(file.create_group("expected"), found.expected)
        if found.all_round is not None:
            _put_groups(file.create_group("all_round"), found.all_round)
        for name in _COUNTS:
            _put(file, f"counts/{name}", getattr(found.counts, name))
        for name, values in found.each.items():
            _put(file, f"realisations/{name}", values)
        for name, band in found.bands.items():
            group = file.create_group(f"bands/{name}")
            group.attrs.update({key: value for key, value in asdict(band).items() if value is not None})
        _put(file, "by_sector/azimuth", found.azimuth)
        _put(file, "by_distance/distance", found.distance)
        for where, curves in (("by_sector", found.by_sector), ("by_distance", found.by_distance)):
            for key, values in _columns(curves):
                _put(file, f"{where}/{key}", values)
        for number, (name, table) in enumerate(witnesses.items()):
            group = file.create_group(f"witness/{number}")
            group.attrs["name"] = name
            for field in SECTOR_HITS.names or ():
                _put(group, field, np.ascontiguousarray(table[field]))
    tables: tuple[dict[str, NDArray[Any]], ...] = (
        {"realisation": np.arange(found.realisations), **found.each},
        {"distance_m": found.distance, **_flat(found.by_distance)},
        {"azimuth_deg": found.azimuth, **_flat(found.by_sector)},
    )
    return [path, *(write_columns(folder / name, table, stamp) for name, table in zip(CSV_FILES, tables, strict=True))]


def read_ensemble(path: str | Path) -> tuple[EnsembleHazard, dict[str, NDArray[Any]]]:
    """Read ensemble.h5 back: the hazard over the realisations, and hits by realisation and sector on every surface.

    Raises
    ------
    InputError
        No such file, another format, or data cut off.
    """
    with open_checked(Path(path), FORMAT, FORMAT_VERSION) as file:
        try:
            counts = Tally(**{name: file[f"counts/{name}"][...] for name in _COUNTS})
            criteria = Criteria(**{name: float(file.attrs[name]) for name in _CRITERIA})
            tolerance = float(file.attrs["tolerance"])
            expected = _expected(file["expected"]) if "expected" in file else None
            all_round = _groups(file["all_round"]) if "all_round" in file else None
            undetermined = str(file.attrs["undetermined"])
            groups = [file["witness"][name] for name in sorted(file.get("witness", {}), key=int)]
            witnesses = {str(group.attrs["name"]): _witness(group) for group in groups}
        except (KeyError, OSError, ValueError) as error:
            raise InputError(f"{path}: data cut off or damaged ({error}); fly the fragments again") from None
    found = assess_ensemble(
        counts, criteria, tolerance=tolerance, expected=expected, undetermined=undetermined, all_round=all_round
    )
    return found, witnesses


def _put_expected(group: h5py.Group, found: ExpectedDistance) -> None:
    for entry in fields(found):
        value = getattr(found, entry.name)
        if isinstance(value, np.ndarray):
            _put(group, entry.name, value)
        elif value is not None:
            group.attrs[entry.name] = value


def _expected(group: h5py.Group) -> ExpectedDistance:
    values: dict[str, Any] = {}
    for entry in fields(ExpectedDistance):
        if entry.name in group:
            values[entry.name] = group[entry.name][...]
        else:
            value = group.attrs.get(entry.name)
            values[entry.name] = value.item() if isinstance(value, np.generic) else value
    values["mirrors"] = tuple(float(one) for one in np.atleast_1d(values["mirrors"]))
    return ExpectedDistance(**values)


def _put_groups(group: h5py.Group, groups: DensityGroups) -> None:
    grid = groups.directions.grid
    for name in _GRID:
        group.attrs[name] = getattr(grid, name)
    _put(group, "sums", groups.sums)
    _put(group, "sizes", groups.sizes)


def _groups(group: h5py.Group) -> DensityGroups:
    grid = PolarGrid(**{name: group.attrs[name].item() for name in _GRID})
    return DensityGroups.of(Directions(grid), group["sums"][...], group["sizes"][...])


def write_fragment_ensemble(
    realisations: Sequence[Fragments], path: str | Path, provenance: Mapping[str, str] | None = None, *, first: int = 1
) -> Path:
    """Write the fragments of many realisations, one after the other, into one HDF5 file.

    Under /fragments lie the arrays of `Fragments` end to end; `offset` (n + 1,) parts them, and the attribute `first`
    is the number of the first realisation: number 0 is that of fragments.h5.
    """
    import h5py

    path = Path(path)
    with creating(path, InputError) as file:
        write_attributes(file, FRAGMENTS_FORMAT, FRAGMENTS_VERSION, provenance or {})
        file.attrs["first"] = first
        _put(file, "offset", np.cumsum([0, *(len(one) for one in realisations)]))
        for name in ARRAYS:
            _put(file, f"fragments/{name}", np.concatenate([getattr(one, name) for one in realisations]))
        names = realisations[0].round_names
        file.create_dataset("round_names", data=names, dtype=h5py.string_dtype(), shape=(len(names),))
    return path


def read_fragment_ensemble(path: str | Path) -> list[Fragments]:
    """Read what `write_fragment_ensemble` wrote; raises InputError for another file or data cut off."""
    advice = "break the casing up again"
    with open_checked(Path(path), FRAGMENTS_FORMAT, FRAGMENTS_VERSION, advice) as file:
        offset = numbers(file, "offset", InputError, str(path), kind="whole numbers", shape=(None,), least=0)
        data = {name: file[f"fragments/{name}"] for name in ARRAYS}
        sound = offset.size > 0 and offset[0] == 0 and bool((np.diff(offset) > 0).all())
        if not sound or any(len(values) != offset[-1] for values in data.values()):
            raise InputError(f"{path}: data cut off; {advice}")
        names = texts(file, "round_names", InputError, str(path))
        found = [
            Fragments.from_arrays(**{name: values[start:end] for name, values in data.items()}, round_names=names)
            for start, end in pairwise(offset.tolist())
        ]
    for one in found:
        check_possible(one, str(path))
    return found


def _put(file: h5py.File | h5py.Group, name: str, values: NDArray[Any]) -> None:
    # Most cells of a tally are empty.
    options = {"compression": "gzip", "compression_opts": 4} if values.ndim > 1 and values.size else {}
    file.create_dataset(name, data=values, **options)


def _witness(group: h5py.Group) -> NDArray[Any]:
    table = np.zeros(group["hits"].shape, dtype=SECTOR_HITS)
    for field in SECTOR_HITS.names or ():
        table[field] = group[field][...]
    return table


def _columns(curves: Mapping[str, Curve]) -> Iterator[tuple[str, NDArray[np.float64]]]:
    for name, curve in curves.items():
        for key, values in vars(curve).items():
            yield f"{name}/{key}", values


def _flat(curves: Mapping[str, Curve]) -> dict[str, NDArray[np.float64]]:
    return {key.replace("/", "_"): values for key, values in _columns(curves)}
