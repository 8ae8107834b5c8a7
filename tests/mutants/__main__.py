"""`sh setup.sh mutants [N] [SEED] [MINUTES]`: N small faults in the physics, and the share that the tests notice.

Each fault goes into a copy of the project under build/mutants, one at a time. Results are kept there by seed and by the
state of the sources: a run that was interrupted, or whose minutes are over, goes on where it stopped, and a larger N
takes the first ones from it. Faults that were looked at and change nothing that could be noticed stand in
`equivalent.tsv` with the reason; they are not seeded. Ends with 1 if less than 95 % are caught.

`sh setup.sh mutants chosen [WORD]`: the faults of `chosen.tsv` (whose module or description holds the word), each by
the tests named there; ends with 1 if any survives.
"""

from __future__ import annotations

import csv
import hashlib
import json
import random
import sys
import time
from itertools import islice, zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tests.mutants.faults import KINDS, Fault, faults_of
from tests.mutants.targets import AREAS, files_of, modules_of
from tests.mutants.workshop import Workshop

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

__all__ = ["chosen_faults"]

_ROOT = Path(__file__).parents[2]
_FOLDER = _ROOT / "build" / "mutants"
_WANTED = 0.95


def equivalents() -> set[tuple[str, str, str]]:
    """Module, text before and after (white space joined) of faults that cannot be noticed."""
    with (Path(__file__).parent / "equivalent.tsv").open(newline="") as file:
        return {(row["module"], row["before"], row["after"]) for row in csv.DictReader(file, delimiter="\t")}


def chosen_faults(root: Path, seed: int) -> Iterator[tuple[str, str, Fault]]:
    """Area, module and fault until there are no more: the areas in turn, in each the kinds in turn, there at random."""
    known = equivalents()
    faults = []
    for number, area in enumerate(AREAS):
        piles: dict[str, list[tuple[str, str, Fault]]] = {kind: [] for kind in KINDS}
        for module in modules_of(area, root):
            for fault in faults_of((root / module).read_text()):
                if (module, " ".join(fault.before.split()), " ".join(fault.after.split())) not in known:
                    piles[fault.kind].append((area.name, module, fault))
        generator = random.Random(1000 * seed + number)
        for pile in piles.values():
            generator.shuffle(pile)
        kinds = list(KINDS)
        generator.shuffle(kinds)
        faults.append(in_turn([piles[kind] for kind in kinds]))
    yield from in_turn(faults)


def in_turn(piles: Sequence[Iterable[Any]]) -> Iterator[Any]:
    """The first of each pile, the second of each, ..., the shorter ones dropping out."""
    nothing = object()
    for row in zip_longest(*piles, fillvalue=nothing):
        yield from (item for item in row if item is not nothing)


def sources_digest(root: Path) -> str:
    """Names the state of the program and its tests."""
    found = hashlib.sha256()
    for package in ("burst_fenicsx", "transition", "flight", "fragfield_base", "tests"):
        for path in sorted((root / package).rglob("*.py")):
            found.update(path.read_bytes())
    return found.hexdigest()[:12]


def report(results: list[dict[str, str]]) -> float:
    """Print the share caught, by area, and the survivors; the share."""
    survivors = [item for item in results if item["state"] == "passed"]
    for area in AREAS:
        own = [item for item in results if item["area"] == area.name]
        caught = sum(item["state"] != "passed" for item in own)
        print(f"{area.name:32s} {caught:4d} of {len(own):4d} caught")
    share = 1.0 - len(survivors) / max(len(results), 1)
    late = sum(item["state"] == "time" for item in results)
    print(f"{len(results) - len(survivors)} of {len(results)} caught: {share:.1%} ({late} by running past their time)")
    for item in survivors:
        print(f"SURVIVED {item['module']} {item['fault']}")
    return share


def chosen_by_hand(root: Path, word: str = "") -> list[dict[str, str]]:
    """Rows of `chosen.tsv`: module, text before and after, the fault in words, and the tests that catch it.

    Raises
    ------
    ValueError
        The text before does not stand in the module exactly once.
    """
    with (Path(__file__).parent / "chosen.tsv").open(newline="") as file:
        rows = [
            {key: text.replace("\\n", "\n") for key, text in row.items()}
            for row in csv.DictReader(file, delimiter="\t")
        ]
    for row in rows:
        if (root / row["module"]).read_text().count(row["before"]) != 1:
            raise ValueError(f"chosen.tsv: {row['module']} does not hold once: {row['before']}")
    return [row for row in rows if word in row["module"] + " " + row["fault"]]


def try_chosen(workshop: Workshop, word: str) -> int:
    """Put in the faults of `chosen.tsv` one by one."""
    survived = 0
    rows = chosen_by_hand(workshop.tree, word)
    for number, row in enumerate(rows, start=1):
        tests = row["tests"].split()
        if workshop.without_fault(tests).state != "passed":
            print(f"without a fault {' '.join(tests)} fails", file=sys.stderr)
            return 1
        text = (workshop.tree / row["module"]).read_text().replace(row["before"], row["after"])
        outcome = workshop.with_fault(row["module"], text, tests)
        survived += outcome.state == "passed"
        print(
            f"{number:3d} {outcome.state:6s} {outcome.seconds:4.0f} s  {row['module']}: {row['fault']}  {outcome.test}",
            flush=True,
        )
    print(f"{len(rows) - survived} of {len(rows)} caught")
    return 1 if survived else 0


def main() -> int:
    """Seed faults until there are enough, or the time is over."""
    digest = sources_digest(_ROOT)
    if sys.argv[1:2] == ["chosen"]:
        return try_chosen(Workshop(_ROOT, _FOLDER, digest), " ".join(sys.argv[2:]))
    number = int(sys.argv[1]) if len(sys.argv) > 1 else 300
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else random.SystemRandom().randrange(10**6)
    minutes = float(sys.argv[3]) if len(sys.argv) > 3 else float("inf")
    end = time.monotonic() + 60.0 * minutes
    record = _FOLDER / f"seed_{seed}_{digest}.jsonl"
    workshop = Workshop(_ROOT, _FOLDER, digest)
    results = [json.loads(line) for line in record.read_text().splitlines()] if record.is_file() else []
    print(f"{number} faults, seed {seed}, {len(results)} done before; results in {record}", flush=True)
    for area, module, fault in islice(chosen_faults(workshop.tree, seed), len(results), number):
        if time.monotonic() > end:
            print("the time is over: the same call goes on from here")
            break
        tests = files_of(module)
        usual = workshop.without_fault(tests)
        if usual.state != "passed":
            print(f"without a fault: {usual.test} ({usual.state}); nothing can be said of {module}", file=sys.stderr)
            return 1
        outcome = workshop.with_fault(module, fault.applied((workshop.tree / module).read_text()), tests)
        results.append({
            "area": area, "module": module, "kind": fault.kind, "fault": str(fault), "state": outcome.state,
            "test": outcome.test, "seconds": round(outcome.seconds, 1),
        })  # fmt: skip
        with record.open("a") as file:
            file.write(json.dumps(results[-1]) + "\n")
        print(
            f"{len(results):4d} {outcome.state:6s} {outcome.seconds:5.0f} s  {module} {fault}  {outcome.test}",
            flush=True,
        )
    share = report(results[:number])
    print(f"seed {seed}, {len(results)} faults")
    return 0 if share >= _WANTED else 1


if __name__ == "__main__":
    sys.exit(main())
