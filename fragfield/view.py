"""Pictures of a run as PNG; ParaView opens burst.xdmf and trajectories.xdmf for all else."""

from __future__ import annotations

from pathlib import Path

from fragfield.errors import InputError
from fragfield.report.figures.registered import FIGURES
from fragfield.results.run import StoredRun
from fragfield_base.writing import write_files


def view_run(run_directory: Path | str, folder: Path | str | None = None) -> list[Path]:
    """Write picture_of_burst.png and picture_of_fragments.png, as far as the run has data for them.

    `folder`: for the pictures; left out: `figures` in the run's.

    Raises InputError: neither burst nor break-up has been run, or a file is damaged.
    """
    run = StoredRun(run_directory)
    run.require()
    target = run.path / "figures" if folder is None else Path(folder)
    names = ("picture_of_burst", "picture_of_fragments")
    pictures = {target / f"{name}.png": data for name in names if (data := FIGURES[name].file(run, "png")) is not None}
    if not pictures:
        raise InputError(f"{run.path}: nothing to show; run `fragfield burst` or `fragfield break-up` first")
    target.mkdir(parents=True, exist_ok=True)
    write_files(pictures, InputError)
    return list(pictures)
