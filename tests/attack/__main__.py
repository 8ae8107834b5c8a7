"""`sh setup.sh attack [MINUTES] [SEED]`: generated cases, damaged files, signals and full disks, for half an hour.

Prints its seeds: a fault is found again with the same one. Ends with 1 if anything was wrong.
"""

from __future__ import annotations

import os
import random
import sys
import tempfile
import time
from pathlib import Path

from hypothesis import HealthCheck, Phase, given, seed, settings

from tests.attack import disk, exits, files, signals
from tests.attack.cases import documents, fault_of, to_text
from tests.fragfield.short_run import invoke
from tests.memory import peak_since_reset, reset_peak

_SLOW = 10.0  # s of processor time
_MOST_MEMORY = 10**9  # B beyond what the process holds


def generated_cases(folder: Path, chosen: int, number: int, until: float) -> list[str]:
    """Cases by the schema through `check`; what was wrong with how they were taken."""
    wrong: dict[str, str] = {}
    done = {0: 0, 2: 0}
    slowest = 0.0

    @seed(chosen)
    @settings(
        max_examples=number, deadline=None, database=None, phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )  # fmt: skip
    @given(documents())
    def check(document):
        nonlocal slowest
        if time.monotonic() > until:
            return
        path = folder / "generated.toml"
        path.write_bytes(to_text(document).encode("utf-8", "replace"))
        began = time.process_time()
        result = invoke("check", path)
        spent = time.process_time() - began
        slowest = max(slowest, spent)
        fault = fault_of(result.exit_code, result.stdout, result.stderr, str(path))
        if fault is None and spent > _SLOW:
            fault = f"{spent:.1f} s of processor time"
        done[result.exit_code] = done.get(result.exit_code, 0) + 1
        if fault is not None:
            kept = folder / f"wrong_{chosen}_{len(wrong)}.toml"
            kept.write_bytes(path.read_bytes())
            wrong.setdefault(fault[-100:], f"{kept}: {fault}")

    reset_peak()
    before = peak_since_reset()
    check()
    taken = peak_since_reset() - before
    if taken > _MOST_MEMORY:
        wrong["memory"] = f"generated cases, seed {chosen}: {taken / 1e9:.2f} GB of memory"
    print(
        f"generated cases, seed {chosen}: exit codes {done}, slowest {slowest:.1f} s, at most {taken / 1e9:.2f} GB; "
        f"{len(wrong)} wrong",
        flush=True,
    )
    return list(wrong.values())


def main() -> int:
    """Attack until the time is over."""
    minutes = float(sys.argv[1]) if len(sys.argv) > 1 else 30.0
    first = int(sys.argv[2]) if len(sys.argv) > 2 else random.SystemRandom().randrange(10**6)
    began = time.monotonic()
    end = began + 60.0 * minutes
    folder = Path(tempfile.mkdtemp(prefix="fragfield-attack-"))
    print(f"attacks for {minutes:g} minutes, seed {first}, in {folder}", flush=True)
    wrong: list[str] = []
    made = signals.Reference(folder)
    rounds = 0
    while time.monotonic() < end:
        here, rounds = first + 1000 * rounds, rounds + 1
        plan = random.Random(here).sample(signals.PLAN, len(signals.PLAN))
        wrong += generated_cases(folder, here, 400, end)
        wrong += files.attack(made.whole, folder, here + 1, 200, end)
        wrong += signals.attack(folder / "signals", here + 2, 9, end, made, plan=plan)
        wrong += signals.attack(folder / "ranks", here + 3, 3, end, made, ranks=2, plan=plan)
        wrong += exits.attack(made.whole, folder / "exits", here + 5, 20)
        if os.geteuid() == 0:
            wrong += disk.attack(folder / "full", here + 4, 5, end, made)
    for line in wrong:
        print(f"WRONG {line}", flush=True)
    print(f"{len(wrong)} wrong in {(time.monotonic() - began) / 60.0:.0f} minutes, seed {first}", flush=True)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
