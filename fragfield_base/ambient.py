"""What surrounds a process and is none of its input: variables, settings of the user's, the places of modules.

Libraries read variables and files of their own, and some change results, pictures or how the process ends:
`PETSC_OPTIONS`, `MPLBACKEND`, a `matplotlibrc`, a `string.py` in the working folder. `settle` is called once, before
any library is loaded, by the command line and by every process that it starts. It drops what is not known to be
harmless, checks what it keeps, and remembers both for the provenance.
"""

from __future__ import annotations

import atexit
import gc
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, cast

from fragfield_base.cores import affinity, cores

if TYPE_CHECKING:
    from types import ModuleType


OURS = Path(__file__).resolve().parent.parent
"""The folder that holds the packages of this program."""
_COUNT = (r"[1-9]\d{0,3}", "a whole number of 1 to 9999")
_ANY = (r".*", "any text")
_AVX512 = "AVX512F AVX512CD AVX512_SKX AVX512_CLX AVX512_CNL AVX512_ICL X86_V4"
_PROCESSORS = {
    "avx2": ("haswell", _AVX512),
    "sse4": ("nehalem", f"AVX F16C FMA3 AVX2 X86_V3 {_AVX512}"),
}
"""Processors as LLVM and OpenBLAS name them, and what numpy must not use there, in the names of all its versions."""
_KEPT = {
    "FRAGFIELD_PROCESSOR": ("|".join(_PROCESSORS), " or ".join(_PROCESSORS)),
    "MPLCONFIGDIR": _ANY,
    "NUMBA_CACHE_DIR": _ANY,
    "NUMBA_NUM_THREADS": _COUNT,
    "OMP_NUM_THREADS": (r"[1-9]\d{0,3}(,[1-9]\d{0,3})*", "a whole number of 1 to 9999, or several"),
    "OPENBLAS_NUM_THREADS": _COUNT,
}
"""Variables taken from the user, and their values: they decide on speed, FRAGFIELD_PROCESSOR on last digits."""
_PLACES = ("MPLCONFIGDIR", "NUMBA_CACHE_DIR")
_DROPPED = re.compile(
    r"(BLIS|DOLFINX|FFCX|GMSH|H5PY|HDF5|MATPLOTLIB|MKL|MPL|NPY|NUMBA|NUMEXPR|OPENBLAS|PETSC|PYVISTA|SLEPC|TRAME|TYPER|"
    r"VECLIB|VTK)_.*|MATPLOTLIBRC|MPL(BACKEND|CONFIGDIR)|PYTHON(BREAKPOINT|INSPECT|STARTUP|WARNINGS)"
)
"""Variables of libraries that read them when they are loaded, and of Python."""
_OF_MPI = re.compile(r"(FI|I_MPI|MPICH|MPIR_CVAR|OMPI|OPAL|ORTE|PMI|PMI2|PMIX|PRTE|PSM|PSM2|UCX)_.*")
"""Variables of MPI and its launchers; those of a launch are kept, and a single process needs none."""
_OF_A_JOB = re.compile(r"SLURM_.*")
_LAUNCHES = (
    ("OMPI_COMM_WORLD_RANK", ("OMPI_COMM_WORLD_SIZE",)),
    ("PMI_RANK", ("PMI_SIZE", "PMI_FD", "PMI_PORT")),
    ("PMIX_RANK", ("PMIX_NAMESPACE",)),
)
"""Variables that hold the rank, each with those of which its launcher sets one at least beside it."""
_SIZES = ("OMPI_COMM_WORLD_SIZE", "PMI_SIZE")
_FORCED = {
    "HDF5_USE_FILE_LOCKING": "FALSE",  # files are written whole, then read: some file systems have no locks
    "MATPLOTLIBRC": os.devnull,
    "MPLBACKEND": "agg",
    "PETSC_OPTIONS": "-no_signal_handler",  # PETSc would take SIGHUP for itself, and end the process at once
    "PYTHONSAFEPATH": "1",
    "UCX_DEBUG_SIGNO": "0",  # UCX, below MPICH and Open MPI, takes SIGHUP for its debugger
}
_ALONE = {
    # A single process needs no network, and no daemon of Open MPI's, which asks for ssh and for a temporary folder.
    "OMPI_MCA_btl": "self",
    "OMPI_MCA_ess_singleton_isolated": "1",
    "OMPI_MCA_pml": "ob1",
    "UCX_TLS": "self",
}
_INSTALLED = ("site-packages", "dist-packages")
_OBJECTS = 50_000
"""New objects between two searches for garbage; each looks through all that was imported and compiled."""
_found: dict[str, list[str]] = {}


def settle(error: type[Exception]) -> None:
    """Free this process of its surroundings, and with it those that it starts.

    `error`: raised, with one message, for a variable that is kept and holds what it must not, or a rank without a
    launcher.
    """
    if _found:
        return
    gc.set_threshold(_OBJECTS)
    atexit.register(gc.freeze)  # else Python takes its modules apart object by object, for half a second
    _arrange_modules()
    launched = is_launched(error)
    _found["ignored"] = sorted(name for name in os.environ if _is_dropped(name, launched=launched))
    for name in _found["ignored"]:
        del os.environ[name]
    check_variables(error)
    for name in _PLACES:
        if place := os.environ.get(name):  # the working folder is left
            os.environ[name] = str(Path(place).absolute())
    _found["kept"] = [f"{name}={os.environ[name]}" for name in sorted(_KEPT) if os.environ.get(name)]
    os.environ.update(_with_program(_FORCED if launched else _FORCED | _ALONE))
    narrow()
    if cores() < affinity():  # libraries count the cores alone, not the time that a container has of them
        for name in ("NUMBA_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
            os.environ.setdefault(name, str(cores()))


def settle_child(error: type[Exception]) -> None:
    """As `settle`, in a process that this program has started by `multiprocessing`, which hands on all variables."""
    known = own_environment()
    os.environ.clear()
    os.environ.update(known)
    os.chdir("/")
    settle(error)


def surroundings() -> dict[str, list[str]]:
    """Variables that were `ignored`, and those that were `kept` with their values; empty where nothing was settled."""
    return {key: list(value) for key, value in _found.items() if value}


def check_variables(error: type[Exception]) -> None:
    """Raise `error` for a variable whose value its library would refuse in words of its own, or not survive.

    An empty one is dropped: most shells' way to unset it.
    """
    for name, (_, allowed) in _KEPT.items():
        value = os.environ.get(name)
        if value == "":
            del os.environ[name]
        elif value is not None and not _is_valid(name):
            raise error(f"{name}: found {value!r} in the environment; allowed: {allowed}, or to unset it")


def narrow() -> None:
    """Have libraries that are loaded from now on compute as on the processor that FRAGFIELD_PROCESSOR names."""
    chosen = os.environ.get("FRAGFIELD_PROCESSOR")
    if not chosen:
        return
    import warnings

    name, without = _PROCESSORS[chosen.lower()]
    os.environ |= {
        "NPY_DISABLE_CPU_FEATURES": without,
        "NUMBA_CPU_FEATURES": "",  # else this processor's
        "NUMBA_CPU_NAME": name,
        "OPENBLAS_CORETYPE": name.capitalize(),
    }
    # What another version or the processor does not know cannot be disabled, as numpy says.
    warnings.filterwarnings("ignore", "During parsing environment variable 'NPY_DISABLE", RuntimeWarning)


def is_launched(error: type[Exception]) -> bool:
    """Whether an MPI launcher has started this process beside others; `error` for a rank that none has given.

    One rank alone needs no launcher, which would let MPI begin but once: a script of two commands would lose one.
    """
    if any(os.environ.get(name) == "1" for name in _SIZES):
        return False
    launched = any(name in os.environ and any(one in os.environ for one in others) for name, others in _LAUNCHES)
    for name, others in () if launched else _LAUNCHES:
        if name in os.environ:
            raise error(
                f"{name}: found {os.environ[name]!r} in the environment, but no {' or '.join(others)}, which a "
                "launcher of MPI sets with it: ranks would not know of each other; start by mpirun or srun, or unset it"
            )
    return launched


def own_environment() -> dict[str, str]:
    """Variables for a process that this one starts: as this one has them, without those of an MPI launch or a job."""
    known = {
        name: value
        for name, value in os.environ.items()
        if (_is_valid(name) if name in _KEPT else not _is_dropped(name, launched=False))
        and not _OF_A_JOB.fullmatch(name)
    }
    return _with_program(known | _FORCED | _ALONE)


def _with_program(variables: dict[str, str]) -> dict[str, str]:
    """Variables by which another Python finds this program, also in a source tree that is known by the folder alone."""
    named = variables.get("PYTHONPATH", os.environ.get("PYTHONPATH", ""))
    if OURS.name in _INSTALLED or str(OURS) in named.split(os.pathsep):
        return variables
    return {**variables, "PYTHONPATH": os.pathsep.join(filter(None, (str(OURS), named)))}


def _is_valid(name: str) -> bool:
    return bool(re.fullmatch(_KEPT[name][0], os.environ[name], re.IGNORECASE | re.DOTALL))


def _is_dropped(name: str, *, launched: bool) -> bool:
    if name in _KEPT:
        return False
    return bool(_DROPPED.fullmatch(name)) or (not launched and bool(_OF_MPI.fullmatch(name)))


def _arrange_modules() -> None:
    """Look for modules only in folders that were named, and in the user's own after those of the installation.

    Dropped is the working folder, where any `string.py` would be executed, unless this program lies there.
    The user's packages (`~/.local`) may hold a numpy that is not the one for which dolfinx was built.
    """
    named = os.environ["PYTHONPATH"].split(os.pathsep) if "PYTHONPATH" in os.environ else []
    wanted = [text for text in named if Path(text).is_absolute() or (text and Path(text).absolute() == OURS)]
    try:
        here = str(Path.cwd())
    except OSError:
        here = ""
    late = getattr(sys.modules.get("site"), "USER_SITE", None)
    kept = [  # the first is where a script lies or `python -m` began, then come those of PYTHONPATH
        place
        for number, place in enumerate(sys.path)
        if number > len(named) or place not in ("", here) or place in (str(OURS), *wanted)
    ]
    after = [place for place in kept if place == late != str(OURS)]
    sys.path[:] = [place for place in kept if place not in after] + after
    if named:
        os.environ["PYTHONPATH"] = os.pathsep.join(str(Path(text).absolute()) for text in wanted)
    # For terminals of Windows alone; numba, where it finds it, lets it end our output, JSON too, with a colour code.
    cast("dict[str, ModuleType | None]", sys.modules).setdefault("colorama", None)


_FOLDER = "/"


def run_function(
    module: str, name: str, *arguments: str, timeout: float | None = None
) -> subprocess.CompletedProcess[bytes]:
    """Run a function by this interpreter and wait for its end; its result is the exit code.

    Files among its arguments are absolute paths. Returned is what it wrote to its two streams; raises TimeoutExpired
    after `timeout` (s).
    """
    return subprocess.run(
        _command(module, name, arguments), stdin=subprocess.DEVNULL, capture_output=True, timeout=timeout,
        env=own_environment(), cwd=_FOLDER, check=False,
    )  # fmt: skip


def start_function(module: str, name: str, *arguments: str) -> subprocess.Popen[bytes]:
    """Start a function as `run_function` does, without waiting for it; its output is dropped."""
    return subprocess.Popen(
        _command(module, name, arguments), stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL, env=own_environment(), cwd=_FOLDER,
    )  # fmt: skip


def _command(module: str, name: str, arguments: tuple[str, ...]) -> list[str]:
    code = (
        "import sys; arguments = sys.argv[1:]; sys.argv[1:] = []; "
        "from fragfield_base.ambient import settle; settle(RuntimeError); "
        f"from {module} import {name}; sys.exit({name}(*arguments))"
    )
    return [sys.executable, "-P", *(["-s"] if sys.flags.no_user_site else []), "-c", code, *arguments]
