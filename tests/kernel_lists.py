"""`python -m tests.kernel_lists`: record which kernels the stages of default runs compile.

Each stage runs in a process of its own with an empty cache, and what it compiles for a call from Python is listed with
its types: the pair of shells in three dimensions, and one shell's meridian. A stage's list leaves out what the stages
before it need: the flight's convergence bursts again.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

from fragfield.compile_ahead import FOLDER, list_of, merged

__all__ = ["CASES", "recorded"]

_ROOT = Path(__file__).parent.parent
CASES = {
    "3d": ("cases/m107_pair.toml", "--cell-size", "12 mm"),
    "axisymmetric": ("cases/m107_tnt.toml", "--cell-size", "8 mm"),
}
_RECORD = """
import atexit, json, sys, time
from numba.core import event
from fragfield_base.kernel_lists import as_text, name_of

class Watch(event.Listener):
    depth, found = 0, {}
    def on_start(self, happened):
        self.depth += 1
        if self.depth == 1:
            self.began = time.process_time()
    def on_end(self, happened):
        self.depth -= 1
        kernel = happened.data["dispatcher"]
        if self.depth or ".kernels." not in kernel.__module__ or name_of(kernel) is None:
            return
        entry = self.found.setdefault(name_of(kernel), {"kernel": name_of(kernel), "arguments": [], "seconds": 0.0})
        try:
            entry["arguments"].append([as_text(kind) for kind in happened.data["args"]])
        except TypeError as error:
            print(kernel, error, file=sys.stderr)
        entry["seconds"] = round(entry["seconds"] + time.process_time() - self.began, 1)

watch = Watch()
event.register("numba:compile", watch)
target = sys.argv[1]
def write():
    found = sorted(watch.found.values(), key=lambda one: one["kernel"])
    open(target, "w").write(json.dumps(found))
atexit.register(write)
import fragfield.pipeline.chain
from fragfield.cli import main
fragfield.pipeline.chain.compile_ahead = lambda *arguments: 0
sys.argv[:2] = ["fragfield"]
main()
"""


def recorded(folder: Path, stage: str, *arguments: str) -> list[dict[str, object]]:
    """What a stage of the command line compiles with an empty cache and without kernels compiled ahead."""
    listed = folder / f"{stage}.json"
    variables = {**os.environ, "NUMBA_CACHE_DIR": str(folder / f"cache-{stage}")}
    subprocess.run(
        [sys.executable, "-c", _RECORD, str(listed), stage, *arguments, "--quiet"],
        check=True, cwd=_ROOT, env=variables,
    )  # fmt: skip
    found: list[dict[str, object]] = json.loads(listed.read_text())
    return found


def main() -> int:
    """Record all lists."""
    FOLDER.mkdir(exist_ok=True)
    lists: dict[Path, list[str]] = {}
    for geometry, (case, *options) in CASES.items():
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            out = ("--out", str(folder / "run"))
            known: set[object] = set()
            for stage in ("burst", "break-up", "fly"):
                first = (case, *options, *out) if stage == "burst" else (str(folder / "run"),)
                kernels = recorded(folder, stage, *first)
                new = [kernel for kernel in kernels if kernel["kernel"] not in known]
                known |= {kernel["kernel"] for kernel in new}
                lists.setdefault(list_of(stage, geometry), []).append(json.dumps(new))
    for path, texts in lists.items():
        kernels = merged(texts)
        path.write_text("[\n" + ",\n".join(json.dumps(kernel) for kernel in kernels) + "\n]\n")
        sys.stderr.write(f"{path.name}: {len(kernels)} kernels\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
