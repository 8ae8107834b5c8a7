"""Journal of finished samples: one line of JSON for each, so that an interrupted study can continue."""

from __future__ import annotations

import json
import os
from typing import TYPE_CHECKING, Any

from fragfield.errors import InputError
from fragfield.files.stamped import read_stamped_json, stamped_json
from fragfield_base.reading import read_text
from fragfield_base.writing import described, refuse_link, write_text

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path
    from typing import Self


IDENTITY, SAMPLES = "study.json", "samples.jsonl"
_MOST = 1 << 31


class Journal:
    """The samples of a study that have ended, in its folder; used as a context that closes its file.

    Parameters
    ----------
    folder : Path
        The study's.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.rows: dict[int, dict[str, Any]] = {}
        self._file: Any = None

    @property
    def exists(self) -> bool:
        """Whether the folder holds a study."""
        return (self.folder / IDENTITY).is_file()

    def begin(self, identity: Mapping[str, Any], *, resume: bool, overwrite: bool) -> None:
        """Make the folder ready, and with `resume` read the samples that have ended.

        Raises InputError: the folder holds a study and neither `resume` nor `overwrite` is asked for, or it is another
        study.
        """
        path, samples = self.folder / IDENTITY, self.folder / SAMPLES
        if self.exists and not (resume or overwrite):
            raise InputError(
                f"{self.folder}: holds a study of uncertainty; allowed: --resume to continue it, --overwrite to "
                "compute it again, or another --out"
            )
        if self.exists and resume:
            stored = read_stamped_json(path)
            changed = [key for key, value in identity.items() if stored.get(key) != json.loads(json.dumps(value))]
            if changed:
                raise InputError(
                    f"{self.folder}: --resume continues the same study only; this one differs in "
                    f"{', '.join(changed)}; use another --out, or --overwrite to replace it"
                )
            self.rows = self._read(samples)
        else:
            samples.unlink(missing_ok=True)
        write_text(path, stamped_json(identity), InputError)

    def __enter__(self) -> Self:
        """Open the file for further lines."""
        path = self.folder / SAMPLES
        refuse_link(path, InputError)
        try:
            self._file = path.open("a", encoding="utf-8")
            if path.stat().st_size and not path.read_bytes().endswith(b"\n"):
                self._file.write("\n")  # a line that was cut off; its sample is made again
        except OSError as error:
            raise InputError(described(path, error)) from None
        return self

    def __exit__(self, *_: object) -> None:
        """Close it."""
        self._file.close()

    def add(self, number: int, row: Mapping[str, Any]) -> None:
        """Keep what a sample gave: on the disk when this returns."""
        self.rows[number] = dict(row)
        try:
            self._file.write(json.dumps({"sample": number, **row}, allow_nan=False) + "\n")
            self._file.flush()
            os.fsync(self._file.fileno())
        except OSError as error:
            raise InputError(described(self.folder / SAMPLES, error, "samples that have ended are kept")) from None

    def _read(self, path: Path) -> dict[int, dict[str, Any]]:
        """Samples that gave results, by number; lines that were cut off and failures are left out, and made again."""
        if not path.is_file():
            return {}
        found: dict[int, dict[str, Any]] = {}
        for line in read_text(path, InputError, most=_MOST).splitlines():
            try:
                row = json.loads(line)
                number = int(row.pop("sample"))
            except (ValueError, KeyError, AttributeError, TypeError):
                continue
            if row.get("exit_code") == 0:
                found[number] = row
        return found
