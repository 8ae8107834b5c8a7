"""The one reader of a run directory: each file is read once, when it is asked for."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.errors import InputError
from fragfield.files.run_directory import STAGES, RunDirectory, read_stamped_json, stored_case_text
from fragfield_base.hdf5_files import reading
from fragfield_base.paths import absolute

if TYPE_CHECKING:
    import os
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from flight import Fragments
    from flight.hazard.ensemble import EnsembleHazard
    from fragfield.case import CaseTable
    from fragfield.case.tables.flight import HazardTable
    from fragfield.case.tables.surroundings import DocumentTable
    from fragfield.interface.burst import Burst, RoundTables
    from fragfield.results.summary import Summary
    from fragfield.results.uncertainty import UncertaintyResult


_FILES = {"burst": "burst_snapshot.h5", "break-up": "fragments.h5", "flight": "landing.h5"}
"""File that shows that a stage has been run, as the report names stages."""
_LANDED = 1  # of flight's Status
_NO_PROVENANCE = ("format", "format_version", "time", "geometry")


class StoredRun:
    """What a run directory holds, in SI.

    Parameters
    ----------
    path : path
        The directory.
    """

    def __init__(self, path: str | os.PathLike[str]) -> None:
        self.path = absolute(path, InputError)
        self._directory = RunDirectory(self.path)

    @cached_property
    def summary(self) -> Summary:
        """summary.json by attribute, as `summary.hazard.recommended`; a part is None before its stage has run.

        The page "Output files" of the guide explains them.
        """
        return self._directory.results()

    @property
    def stages(self) -> dict[str, bool]:
        """Whether each stage is done."""
        return {name: self._directory.complete(stage) for name, stage in STAGES.items()}

    @property
    def report(self) -> Path:
        """The report, an HTML page; raises InputError where it is not written."""
        return self._file("report.html", "report")

    @property
    def log(self) -> str:
        """Text of run.log; empty where there is none."""
        path = self._directory.log_file
        return path.read_text(encoding="utf-8", errors="replace") if path.is_file() else ""

    @property
    def burst(self) -> Burst:
        """The burst: casing and charge at its end, and histories; raises InputError where it has not been run."""
        self._file("burst_snapshot.h5", "burst")
        if self.snapshot is None or self.snapshot.part is None:
            raise InputError(f"{self.path}: summary.json has no burst; run `fragfield burst` again")
        return self.snapshot

    @property
    def fragments(self) -> Fragments:
        """Fragments of the first realisation at launch."""
        self._file("fragments.h5", "break-up")
        assert self.launched is not None
        return self.launched

    @property
    def realisations(self) -> Sequence[Fragments]:
        """Fragments of every realisation of the break-up; those after the first are read one by one."""
        from flight.files.ensemble import read_fragment_ensemble
        from fragfield.pipeline.stages import WithFirst

        others = self.path / "ensemble_fragments.h5"
        return WithFirst(self.fragments, read_fragment_ensemble(others) if others.is_file() else ())

    @cached_property
    def landing(self) -> NDArray[Any]:
        """End of every fragment's flight, a structured array of dtype `flight.LANDING`; first realisation."""
        from flight.files.hdf5 import read_table

        return read_table(self._file("landing.h5", "fly"), "landing")[0]

    @property
    def hits(self) -> NDArray[Any]:
        """Crossings of the witness surfaces, a structured array of dtype `flight.HITS`; first realisation."""
        from flight.files.hdf5 import read_table

        return read_table(self._file("hits.h5", "fly"), "hits")[0]

    def _file(self, name: str, stage: str) -> Path:
        path = self.path / name
        if not path.is_file():
            raise InputError(f"{path}: no such file; run `fragfield {stage}` first")
        return path

    def require(self) -> None:
        """Raise InputError where there is no such directory, or it holds nothing of a run."""
        if not self.path.is_dir():
            raise InputError(f"{self.path}: no such run directory; give a directory written by `fragfield run`")
        known = ["case.toml", "summary.json", *_FILES.values()]
        if not any((self.path / name).is_file() for name in known):
            raise InputError(f"{self.path}: not a run directory, it contains none of the files ({', '.join(known)})")

    @cached_property
    def values(self) -> CaseTable | None:
        """The resolved case with every default; None where the directory holds none."""
        return self._directory.stored_case() if self._directory.exists else None

    @property
    def case_text(self) -> str:
        """Text of case.toml."""
        return stored_case_text(self._directory.case_file)

    @cached_property
    def snapshot(self) -> Burst | None:
        """The end of the burst; None where it has not been run."""
        from fragfield.interface.burst import read_burst

        path = self.path / _FILES["burst"]
        return read_burst(path, self.summary.burst) if path.is_file() else None

    @property
    def rounds(self) -> list[RoundTables]:
        """The rounds at the end of the burst; none before."""
        return [] if self.snapshot is None else self.snapshot.rounds

    @cached_property
    def history(self) -> dict[str, NDArray[np.float64]]:
        """Of the burst, over `time` (s); empty before it."""
        return {} if self.snapshot is None else self.snapshot.history

    @cached_property
    def launched(self) -> Fragments | None:
        """As `fragments`; None where there was no break-up."""
        from flight import Fragments

        path = self.path / _FILES["break-up"]
        return Fragments.read(path) if path.is_file() else None

    @cached_property
    def landed(self) -> NDArray[Any]:
        """Rows of the landings that reached the ground; none while the flight has not been run."""
        there = (self.path / _FILES["flight"]).is_file()
        return self.landing[self.landing["status"] == _LANDED] if there else np.empty(0)

    @cached_property
    def _ensembles(self) -> tuple[EnsembleHazard | None, dict[str, NDArray[Any]]]:
        from flight.files.ensemble import read_ensemble

        path = self.path / "ensemble.h5"
        return read_ensemble(path) if path.is_file() else (None, {})

    @cached_property
    def ensemble(self) -> EnsembleHazard | None:
        """Densities and distances by realisation, azimuth and distance; None before the flight."""
        return self._ensembles[0]

    @property
    def witness_ensemble(self) -> dict[str, NDArray[Any]]:
        """Hits by realisation and sector, by the name of the witness surface."""
        return self._ensembles[1]

    @cached_property
    def study(self) -> UncertaintyResult | None:
        """Of a study of uncertainty of this run."""
        from fragfield.results.uncertainty import UncertaintyResult

        if not (path := self.path / "uncertainty.json").is_file():
            return None
        try:
            return UncertaintyResult.of_stage(read_stamped_json(path))
        except InputError as error:
            raise InputError(f"{path}: another version wrote it ({error}); run `fragfield uncertainty` again") from None

    @cached_property
    def provenance(self) -> dict[str, str]:
        """Program, versions, seed and date, as the files of the stages have them."""
        known: dict[str, str] = {}
        for path in (self.path / name for name in _FILES.values()):
            if path.is_file():
                with reading(path, InputError, "run the stage that writes it again") as file:
                    for key, value in file.attrs.items():
                        known.setdefault(key, value.decode() if isinstance(value, bytes) else str(value))
        return {key: value for key, value in known.items() if key not in _NO_PROVENANCE}

    @property
    def expected_stages(self) -> list[str]:
        """Stages that the report is of: the flight alone where the fragments are from a file."""
        return ["flight"] if self.fragments_file is not None else list(_FILES)

    @property
    def missing(self) -> list[str]:
        """Those that have not been run."""
        return [stage for stage in self.expected_stages if not (self.path / _FILES[stage]).is_file()]

    @property
    def title(self) -> str:
        """Title of the case, else the folder's name."""
        own = self.values.title if self.values is not None else ""
        return own or self.summary.title or self.path.name

    @property
    def criteria(self) -> HazardTable:
        """What counts as hazardous; the schema's defaults where the directory holds no case."""
        from fragfield.case.tables.flight import HazardTable

        return self.values.hazard if self.values is not None else HazardTable()

    @property
    def document(self) -> DocumentTable:
        """Number, revision and names; empty texts where the directory holds no case."""
        from fragfield.case.tables.surroundings import DocumentTable

        return self.values.document if self.values is not None else DocumentTable()

    @property
    def fragments_file(self) -> str | None:
        """Name of the file whose fragments were flown instead of those of a burst; None of a run with its own."""
        return (self.summary.flight and self.summary.flight.fragments_file) or None
