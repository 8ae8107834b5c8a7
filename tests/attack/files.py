"""Files of a run that are cut, flipped or replaced: refused with their name, or read as what they were."""

from __future__ import annotations

import hashlib
import os
import pickle
import random
import shutil
import time
from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

# All that the readers need is loaded here, so that the process of each trial, a fork of this one, loads nothing.
from flight import Fragments
from flight.files.ensemble import read_ensemble, read_fragment_ensemble
from flight.files.hdf5 import read_table
from fragfield.errors import InputError, exit_code_of
from fragfield.files.run_directory import RunDirectory
from fragfield_base.xdmf import times_of_xdmf
from transition.snapshot import Snapshot

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["READERS", "attack", "damaged", "outcome"]


def _burst(path: Path) -> Any:
    folder = path.parent if path.suffix == ".xdmf" else path.parent.parent
    return list(times_of_xdmf(folder / "burst.xdmf", InputError, "run `fragfield burst` again"))


def _snapshot(path: Path) -> Any:
    found = Snapshot.read(path)
    return [found.time, found.position, found.velocity, found.cells, found.part, found.mass, repr(found.rounds)]


def _fragments(path: Path) -> Any:
    found = Fragments.read(path)
    return [found.mass, found.position, found.velocity, found.shape_factor, found.round_names]


def _ensemble_fragments(path: Path) -> Any:
    return [[one.mass, one.velocity] for one in read_fragment_ensemble(path)]


def _landing(path: Path) -> Any:
    return read_table(path, "landing")[0]


def _hits(path: Path) -> Any:
    return read_table(path, "hits")


def _ensemble(path: Path) -> Any:
    found, witnesses = read_ensemble(path)
    return [found.counts.throw, repr(found.headline), witnesses]


def _case(path: Path) -> Any:
    return repr(RunDirectory(path.parent).stored_case())


def _summary(path: Path) -> Any:
    return repr(RunDirectory(path.parent).summary())


READERS: dict[str, Callable[[Path], Any]] = {
    "burst/0000.h5": _burst,
    "burst.xdmf": _burst,
    "burst_snapshot.h5": _snapshot,
    "fragments.h5": _fragments,
    "ensemble_fragments.h5": _ensemble_fragments,
    "landing.h5": _landing,
    "hits.h5": _hits,
    "ensemble.h5": _ensemble,
    "case.toml": _case,
    "summary.json": _summary,
}
"""What the program reads of a run directory, and by what."""


def damaged(data: bytes, generator: random.Random, others: list[bytes]) -> tuple[str, bytes]:
    """The content of a file after one damage, and its name."""
    kind = generator.choice(["cut", "flipped", "flipped", "flipped", "zeroed", "replaced", "doubled", "emptied"])
    changed = bytearray(data)
    if kind == "cut":
        changed = changed[: generator.randrange(len(data))]
    elif kind == "flipped":
        for _ in range(generator.choice([1, 1, 1, 3, 30])):
            changed[generator.randrange(len(data))] ^= 1 << generator.randrange(8)
    elif kind == "zeroed":
        start = generator.randrange(len(data))
        changed[start : start + 4096] = bytes(len(changed[start : start + 4096]))
    elif kind == "replaced":
        changed = bytearray(
            generator.choice([*others, generator.randbytes(len(data) // 2 + 1), b"\x89HDF\r\n\x1a\n" + data[8:]])
        )
    elif kind == "doubled":
        changed += data
    else:
        changed = bytearray()
    return kind, bytes(changed)


def _digest(value: Any) -> str:
    def plain(one: Any) -> Any:
        if isinstance(one, np.ndarray):
            return (str(one.dtype), one.shape, one.tobytes() if one.dtype.kind != "O" else repr(one.tolist()))
        if isinstance(one, (list, tuple)):
            return [plain(entry) for entry in one]
        return [(key, plain(entry)) for key, entry in one.items()] if isinstance(one, dict) else one

    return hashlib.sha256(pickle.dumps(plain(value))).hexdigest()


def outcome(path: Path) -> str:
    """Digest of what is read of a file, or "refused", or what is wrong; in a process of its own that may crash."""
    reader = READERS.get(path.name, _burst)
    back, forth = os.pipe()
    child = os.fork()
    if child == 0:
        found = "crashed"
        try:
            found = _digest(reader(path))
        except Exception as error:  # noqa: BLE001 - which it is decides
            known = exit_code_of(error) == 2
            found = "refused" if known and (path.name in str(error) or path.stem in str(error)) else repr(error)[:300]
        finally:
            os.write(forth, found.encode()[:1000])
            os._exit(0)
    os.close(forth)
    with os.fdopen(back, "rb") as stream:
        found = stream.read().decode()
    _, status = os.waitpid(child, 0)
    return found or f"crashed with status {status}"


def attack(run: Path, folder: Path, seed: int, trials: int, until: float) -> list[str]:
    """Damage files of a finished run; what was neither refused nor harmless."""
    generator, counts, wrong = random.Random(seed), Counter[str](), []
    work = folder / "damaged_run"
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir()
    names = [name for name in READERS if (run / name).is_file()]
    shutil.copytree(run / "burst", work / "burst")
    for name in names:
        shutil.copy(run / name, work / name)
    whole = {name: (run / name).read_bytes() for name in names}
    right = {name: outcome(work / name) for name in names}
    assert all(len(found) == 64 for found in right.values()), right
    for number in range(trials):
        if time.monotonic() > until:
            break
        name = names[number % len(names)]
        kind, data = damaged(whole[name], generator, [whole[other] for other in names if other != name])
        (work / name).write_bytes(data)
        found = outcome(work / name)
        if found == "refused":
            counts["refused"] += 1
        elif found == right[name]:
            counts["harmless"] += 1
        else:
            counts["wrong"] += 1
            wrong.append(f"{name} {kind} (trial {number}): {found}")
        (work / name).write_bytes(whole[name])
    print(f"damaged files, seed {seed}: {dict(counts)}", flush=True)
    return wrong
