"""The files of an ensemble: ensemble.h5 with its CSV tables, and the fragments of further realisations.

ensemble.h5 holds, beside provenance and the criteria as attributes:

/expected
    the hazard distance (`flight.hazard.ExpectedDistance`): numbers as attributes, by direction, and the density over
    distance in the direction that decides (radius, density, density_low, density_high), in every direction without its
    certainty (density_by_direction);
/without_ricochet
    the same without what follows the first impact on the ground, where fragments ricochet;
/counts
    numbers and throws by realisation and sector (`flight.hazard.density.sectors.Tally`);
/realisations
    distance of every realisation alone (m), by the same estimate;
/witness/I
    hits on every witness surface by realisation and sector (`flight.hazard.density.sectors.SECTOR_HITS`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import MISSING, dataclass, fields
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

import numpy as np

from flight.errors import InputError
from flight.files.hdf5 import open_checked, put, put_texts, write_attributes
from flight.files.text_tables import write_columns
from flight.fragments import ARRAYS, Fragments
from flight.hazard.criteria import Criteria, hit_probability
from flight.hazard.density.expected import KINDS, ExpectedDistance
from flight.hazard.density.sectors import SECTOR_HITS, Tally
from flight.hazard.ensemble import EnsembleHazard
from fragfield_base.arrays import numbers, texts
from fragfield_base.hdf5_files import creating

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    import h5py
    from numpy.typing import NDArray


FORMAT, FRAGMENTS_FORMAT, FORMAT_VERSION, FRAGMENTS_VERSION = (
    "fragfield ensemble", "fragfield ensemble of fragments", 4, 1,
)  # fmt: skip
CSV_FILES = ("ensemble.csv", "hazard_by_distance.csv", "hazard_by_sector.csv")
_AGAIN = "break the casing up again"
_COUNTS = ("fragments", "hazardous", "throw")
_CRITERIA = ("energy", "density", "person_area", "person_height")


def write_ensemble(
    found: EnsembleHazard,
    witnesses: Mapping[str, NDArray[Any]],
    folder: str | Path,
    provenance: Mapping[str, str] | None = None,
) -> list[Path]:
    """Write ensemble.h5 and its CSV tables into a folder that is there; return the paths.

    `witnesses` holds, by the name of a surface, the hits by realisation and sector: (n, s) arrays of dtype SECTOR_HITS.
    """
    folder, stamp = Path(folder), dict(provenance or {})
    path = folder / "ensemble.h5"
    with creating(path, InputError) as file:
        write_attributes(file, FORMAT, FORMAT_VERSION, stamp)
        for name in _CRITERIA:
            file.attrs[name] = getattr(found.criteria, name)
        file.attrs["tolerance"] = found.tolerance
        file.attrs["undetermined"] = found.undetermined
        _put_expected(file, "expected", found.expected)
        for name in _COUNTS:
            put(file, f"counts/{name}", getattr(found.counts, name))
        put(file, "realisations/distance", found.events)
        for number, (name, table) in enumerate(witnesses.items()):
            group = file.create_group(f"witness/{number}")
            group.attrs["name"] = name
            put(group, "hits", table)
    return [path, *(write_columns(folder / name, table) for name, table in ensemble_columns(found).items())]


def ensemble_columns(found: EnsembleHazard) -> dict[str, dict[str, NDArray[Any]]]:
    """Columns of the three CSV files, by the name of the file: one row a realisation, a distance and a sector.

    Distances that are not determined are NaN.
    """
    expected, counts = found.expected, found.counts
    known = np.nan if found.undetermined else 1.0
    directions = np.round(found.azimuth / 360.0 * len(expected.azimuth)).astype(int) % len(expected.azimuth)
    density = np.maximum(expected.density, 0.0)  # smoothed over azimuth, it is below zero by round-off where none is
    densities: dict[str, NDArray[Any]] = {}
    for kind, name in enumerate(KINDS):
        densities[f"{name}_density_1_m2"] = density[kind]
        if expected.density_low.size:
            densities[f"{name}_density_low_1_m2"] = expected.density_low[kind]
            densities[f"{name}_density_high_1_m2"] = expected.density_high[kind]
    tables: tuple[dict[str, NDArray[Any]], ...] = (
        {
            "realisation": np.arange(found.realisations),
            "distance_m": known * found.events,
            "max_throw_m": found.throw,
            "fragments": counts.fragments.sum(axis=1),
            "hazardous": counts.hazardous.sum(axis=1),
        },
        {
            "distance_m": expected.radius,
            **densities,
            "probability": hit_probability(density[1], found.criteria.person_area),
        },
        {
            "azimuth_deg": found.azimuth,
            "distance_m": known * expected.by_direction[directions],
            "upper_m": known * expected.upper_by_direction[directions],
            **{
                f"{name}_{key}{'_m' if name == 'max_throw' else ''}": values
                for name, curve in found.by_sector.items()
                for key, values in vars(curve).items()
            },
        },
    )
    return dict(zip(CSV_FILES, tables, strict=True))


def read_ensemble(path: str | Path) -> tuple[EnsembleHazard, dict[str, NDArray[Any]]]:
    """Read ensemble.h5 back: the hazard over the realisations, and hits by realisation and sector on every surface.

    Raises InputError: no such file, another format, or data cut off.
    """
    with open_checked(Path(path), FORMAT, FORMAT_VERSION) as file:
        try:
            found = EnsembleHazard(
                Tally(**{name: file[f"counts/{name}"][...] for name in _COUNTS}),
                Criteria(**{name: float(file.attrs[name]) for name in _CRITERIA}),
                float(file.attrs["tolerance"]), _expected(file, "expected"), file["realisations/distance"][...],
                str(file.attrs["undetermined"]),
            )  # fmt: skip
            groups = [file["witness"][name] for name in sorted(file.get("witness", {}), key=int)]
            witnesses = {str(group.attrs["name"]): np.asarray(group["hits"], dtype=SECTOR_HITS) for group in groups}
        except (KeyError, OSError, ValueError) as error:
            raise InputError(f"{path}: data cut off or damaged ({error}); fly the fragments again") from None
    return found, witnesses


def _put_expected(file: h5py.File | h5py.Group, name: str, found: ExpectedDistance) -> None:
    group = file.create_group(name)
    for entry in fields(found):
        value = getattr(found, entry.name)
        if isinstance(value, ExpectedDistance):
            _put_expected(group, entry.name, value)
        elif isinstance(value, np.ndarray):
            put(group, entry.name, value)
        elif value is not None:
            group.attrs[entry.name] = value


def _expected(file: h5py.File | h5py.Group, name: str) -> ExpectedDistance:
    group = file[name]
    values: dict[str, Any] = {}
    for entry in fields(ExpectedDistance):
        if entry.name == "without_ricochet":
            values[entry.name] = _expected(group, entry.name) if entry.name in group else None
        elif entry.name in group:
            values[entry.name] = group[entry.name][...]
        elif entry.default_factory is MISSING:  # an array that earlier versions did not write keeps its default
            value = group.attrs.get(entry.name)
            values[entry.name] = value.item() if isinstance(value, np.generic) else value
    values["mirrors"] = tuple(float(one) for one in np.atleast_1d(values["mirrors"]))
    return ExpectedDistance(**values)


def write_fragment_ensemble(
    realisations: Sequence[Fragments], path: str | Path, provenance: Mapping[str, str] | None = None, *, first: int = 1
) -> Path:
    """Write the fragments of many realisations, one after the other, into one HDF5 file.

    Under /fragments lie the arrays of `Fragments` end to end; `offset` (n + 1,) parts them, and the attribute `first`
    is the number of the first realisation: number 0 is that of fragments.h5.
    """
    path = Path(path)
    with creating(path, InputError) as file:
        write_attributes(file, FRAGMENTS_FORMAT, FRAGMENTS_VERSION, provenance or {})
        file.attrs["first"] = first
        first_of_all = realisations[0]
        offset = np.cumsum([0, *(len(one) for one in realisations)])
        put(file, "offset", offset)
        for name in ARRAYS:
            like = getattr(first_of_all, name)
            shape = (int(offset[-1]), *like.shape[1:])
            file.create_dataset(f"fragments/{name}", shape=shape, dtype=like.dtype)
        for one, (start, end) in zip(realisations, pairwise(offset.tolist()), strict=True):
            for name in ARRAYS:  # one after the other: together they may be half of the memory
                file[f"fragments/{name}"][start:end] = getattr(one, name)
        put_texts(file, "round_names", first_of_all.round_names)
    return path


def read_fragment_ensemble(path: str | Path) -> FragmentEnsemble:
    """The realisations that `write_fragment_ensemble` wrote; raises InputError for another file or data cut off."""
    where = str(path)
    with open_checked(Path(path), FRAGMENTS_FORMAT, FRAGMENTS_VERSION, _AGAIN) as file:
        offset = numbers(file, "offset", InputError, where, kind="whole numbers", shape=(None,), minimum=0)
        sound = offset.size > 0 and offset[0] == 0 and bool((np.diff(offset) > 0).all())
        if not sound or any(len(file[f"fragments/{name}"]) != offset[-1] for name in ARRAYS):
            raise InputError(f"{path}: data cut off; {_AGAIN}")
        names = texts(file, "round_names", InputError, where)
    return FragmentEnsemble(Path(path), tuple(offset.tolist()), tuple(names))


@dataclass(frozen=True)
class FragmentEnsemble(Sequence[Fragments]):
    """Realisations in a file, read when they are asked for: thousands of them would fill the memory."""

    path: Path
    """The file."""
    offset: tuple[int, ...]
    """tuple of int, (n + 1,): rows at which realisations begin and end."""
    round_names: tuple[str, ...]
    """Names of the rounds."""

    def __len__(self) -> int:
        return len(self.offset) - 1

    @overload
    def __getitem__(self, number: int) -> Fragments: ...
    @overload
    def __getitem__(self, number: slice) -> list[Fragments]: ...
    def __getitem__(self, number: int | slice) -> Fragments | list[Fragments]:
        """Read one realisation, or some; raises InputError where the file has changed."""
        if isinstance(number, slice):
            return self.some(range(*number.indices(len(self))))
        return self.some([range(len(self))[number]])[0]

    def some(self, numbers: Iterable[int]) -> list[Fragments]:
        """Read realisations by their numbers."""
        found = []
        with open_checked(self.path, FRAGMENTS_FORMAT, FRAGMENTS_VERSION, _AGAIN) as file:
            for number in numbers:
                rows = slice(self.offset[number], self.offset[number + 1])
                arrays = {name: file[f"fragments/{name}"][rows] for name in ARRAYS}
                try:
                    found.append(Fragments(**arrays, round_names=self.round_names))
                except InputError as error:
                    raise InputError(f"{self.path}: {error}") from None
        return found
