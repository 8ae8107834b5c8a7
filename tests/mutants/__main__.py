"""`sh setup.sh mutants [N] [SEED] [MINUTES]`: N small faults in the physics, and the share that the tests notice.

Each fault goes into a copy of the project under build/mutants, one at a time. Results are kept there by seed and by the
state of the sources: a run that was interrupted, or whose minutes are over, goes on where it stopped, and a larger N
takes the first ones from it. After a change of tests alone a fault is tried again if it had survived, or if the file
that had caught it has changed. Faults that were looked at and change nothing that could be noticed stand in
`equivalent.tsv` with the reason; they are not seeded. Ends with 1 if less than 95 % are caught.

`sh setup.sh mutants chosen [WORD]`: the faults of `chosen.tsv` (whose module or description holds the word), each by
the tests named there; ends with 1 if any survives.
"""

from __future__ import annotations

import csv
import json
import math
import random
import sys
import time
from itertools import islice, zip_longest
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tests.mutants.faults import KINDS, Fault, faults_of
from tests.mutants.targets import AREAS, files_of, modules_of, on_ranks
from tests.mutants.workshop import Workshop, shared_digest, test_files

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

__all__ = ["chosen_faults"]

_ROOT = Path(__file__).parents[2]
_FOLDER = _ROOT / "build" / "mutants"
_WANTED = 0.95


def equivalents() -> set[tuple[str, str, str, str]]:
    """Module, its line, and text before and after (white space joined) of faults that cannot be noticed."""
    with (Path(__file__).parent / "equivalent.tsv").open(newline="") as file:
        rows = csv.DictReader(file, delimiter="\t")
        return {(row["module"], row["line"], row["before"], row["after"]) for row in rows}


def name_of(module: str, source: str, fault: Fault) -> tuple[str, str, str, str]:
    """By what a fault stands in `equivalent.tsv`: `-1 -> 1` is one fault in one line and another in the next."""
    line = source.splitlines()[fault.line - 1]
    return module, *(" ".join(text.split()) for text in (line, fault.before, fault.after))


def chosen_faults(root: Path, seed: int) -> Iterator[tuple[str, str, Fault]]:
    """Area, module and fault until there are no more: the areas in turn, in each the kinds in turn, there at random."""
    known, sources = equivalents(), dict[str, str]()
    faults = []
    for number, area in enumerate(AREAS):
        piles: dict[str, list[tuple[str, str, Fault]]] = {kind: [] for kind in KINDS}
        for module in modules_of(area, root):
            sources[module] = (root / module).read_text()
            for fault in faults_of(sources[module]):
                piles[fault.kind].append((area.name, module, fault))
        generator = random.Random(1000 * seed + number)
        for pile in piles.values():
            generator.shuffle(pile)
        kinds = list(KINDS)
        generator.shuffle(kinds)
        # Left out after the draw, so that one more known fault leaves the order of the others.
        drawn = in_turn([piles[kind] for kind in kinds])
        faults.append([item for item in drawn if name_of(item[1], sources[item[1]], item[2]) not in known])
    yield from in_turn(faults)


def in_turn(piles: Sequence[Iterable[Any]]) -> Iterator[Any]:
    """The first of each pile, the second of each, ..., the shorter ones dropping out."""
    nothing = object()
    for row in zip_longest(*piles, fillvalue=nothing):
        yield from (item for item in row if item is not nothing)


def interval(caught: int, number: int) -> tuple[float, float]:
    """Wilson's interval of 95 % for the share of all faults that would be caught (Wilson 1927, J. Am. Stat. Assoc.)."""
    if number == 0:
        return 0.0, 1.0
    z, share = 1.959964, caught / number
    centre = share + z * z / (2.0 * number)
    half = z * math.sqrt(share * (1.0 - share) / number + z * z / (4.0 * number * number))
    return (centre - half) / (1.0 + z * z / number), (centre + half) / (1.0 + z * z / number)


def report(results: list[dict[str, str]]) -> float:
    """Print the share caught, by area, and the survivors; the share."""
    survivors = [item for item in results if item["state"] == "passed"]
    for area in AREAS:
        own = [item for item in results if item["area"] == area.name]
        caught = sum(item["state"] != "passed" for item in own)
        print(f"{area.name:32s} {caught:4d} of {len(own):4d} caught")
    share = 1.0 - len(survivors) / max(len(results), 1)
    late = sum(item["state"] == "time" for item in results)
    low, high = interval(len(results) - len(survivors), len(results))
    print(
        f"{len(results) - len(survivors)} of {len(results)} caught: {share:.1%} "
        f"(95 % interval {low:.1%} to {high:.1%}; {late} by running past their time)"
    )
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
        text = (workshop.tree / row["module"]).read_text().replace(row["before"], row["after"])
        outcome = workshop.with_fault(row["module"], text, row["tests"].split(), row["tests"].split())
        survived += outcome.state == "passed"
        print(
            f"{number:3d} {outcome.state:6s} {outcome.seconds:4.0f} s  {row['module']}: {row['fault']}  {outcome.test}",
            flush=True,
        )
    print(f"{len(rows) - survived} of {len(rows)} caught")
    return 1 if survived else 0


def main() -> int:
    """Seed faults until there are enough, or the time is over."""
    if sys.argv[1:2] == ["chosen"]:
        return try_chosen(Workshop(_ROOT, _FOLDER), " ".join(sys.argv[2:]))
    number = int(sys.argv[1]) if len(sys.argv) > 1 else 300
    seed = int(sys.argv[2]) if len(sys.argv) > 2 else random.SystemRandom().randrange(10**6)
    minutes = float(sys.argv[3]) if len(sys.argv) > 3 else float("inf")
    end = time.monotonic() + 60.0 * minutes
    record = _FOLDER / f"seed_{seed}_{shared_digest(_ROOT, tests=False)}.jsonl"
    workshop = Workshop(_ROOT, _FOLDER)
    lines = record.read_text().splitlines() if record.is_file() else []
    before = {(line["module"], line["fault"], line["begin"], line["digest"]): line for line in map(json.loads, lines)}
    results: list[dict[str, Any]] = []
    print(f"{number} faults, seed {seed}; results in {record}", flush=True)
    for area, module, fault in islice(chosen_faults(workshop.tree, seed), number):
        tests = files_of(module)
        if known := known_result(before, workshop, module, fault, [*tests, *on_ranks(module)]):
            results.append(known)
            continue
        if time.monotonic() > end:
            print("the time is over: the same call goes on from here")
            break
        try:
            text = fault.applied((workshop.tree / module).read_text())
            outcome = workshop.with_fault(module, text, tests, on_ranks(module))
        except RuntimeError as error:
            print(f"{error}; nothing can be said of {module}", file=sys.stderr)
            return 1
        caught_by = [outcome.test.partition("::")[0]] if "::" in outcome.test else [*tests, *on_ranks(module)]
        results.append({
            "area": area, "module": module, "kind": fault.kind, "fault": str(fault), "begin": fault.begin,
            "state": outcome.state, "test": outcome.test, "seconds": round(outcome.seconds, 1), "plain": outcome.plain,
            "digest": workshop.digest_of(caught_by),
        })  # fmt: skip
        with record.open("a") as file:
            file.write(json.dumps(results[-1]) + "\n")
        print(
            f"{len(results):4d} {outcome.state:6s} {outcome.seconds:5.0f} s  {module} {fault}  {outcome.test}",
            flush=True,
        )
    share = report(results)
    print(f"seed {seed}, {len(results)} faults")
    return 0 if share >= _WANTED else 1


def known_result(
    before: dict[tuple[str, str, int, str], dict[str, Any]],
    workshop: Workshop,
    module: str,
    fault: Fault,
    tests: list[str],
) -> dict[str, Any] | None:
    """What an earlier call has found of a fault, if the tests that decided it are as they were."""
    for state in (tests, *([test] for test in test_files(workshop.tree, tests))):
        if found := before.get((module, str(fault), fault.begin, workshop.digest_of(state))):
            return found
    return None


if __name__ == "__main__":
    sys.exit(main())
