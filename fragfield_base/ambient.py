"""Variables that this program sets for its libraries before they are loaded: one process of MPI, pictures, threads.

`settle` is called once, by the command line and by every process that it starts.
"""

from __future__ import annotations

import atexit
import gc
import os
import re
import sys
import warnings

from fragfield_base.cores import affinity, cores

_AVX512 = "AVX512F AVX512CD AVX512_SKX AVX512_CLX AVX512_CNL AVX512_ICL X86_V4"
_PROCESSORS = {
    "avx2": ("haswell", _AVX512),
    "sse4": ("nehalem", f"AVX F16C FMA3 AVX2 X86_V3 {_AVX512}"),
}
"""Processors as LLVM and OpenBLAS name them, and what numpy must not use there, in the names of all its versions."""
_COUNT = (r"[1-9]\d{0,3}", "a whole number of 1 to 9999")
_CHECKED = {
    "FRAGFIELD_PROCESSOR": ("|".join(_PROCESSORS), " or ".join(_PROCESSORS)),
    "NUMBA_NUM_THREADS": _COUNT,
    "OMP_NUM_THREADS": (r"[1-9]\d{0,3}(,[1-9]\d{0,3})*", "a whole number of 1 to 9999, or several"),
    "OPENBLAS_NUM_THREADS": _COUNT,
}
"""Variables of the user whose values libraries would not survive, or refuse in words of their own."""
_OF_MPI = re.compile(r"(FI|I_MPI|MPICH|MPIR_CVAR|OMPI|OPAL|ORTE|PMI|PMI2|PMIX|PRTE|PSM|PSM2|UCX)_.*")
_SIZES = ("OMPI_COMM_WORLD_SIZE", "PMI_SIZE")
_RANKS = ("OMPI_COMM_WORLD_RANK", "PMI_RANK", "PMIX_RANK")
_FORCED = {
    "HDF5_USE_FILE_LOCKING": "FALSE",  # files are written whole, then read: some file systems have no locks
    "MATPLOTLIBRC": os.devnull,
    "MPLBACKEND": "agg",
    "PETSC_OPTIONS": "-no_signal_handler",  # PETSc would take SIGHUP for itself, and end the process at once
    "UCX_DEBUG_SIGNO": "0",  # UCX, below MPICH and Open MPI, takes SIGHUP for its debugger
}
_ALONE = {
    # A single process needs no network, and no daemon of Open MPI's, which asks for ssh and for a temporary folder.
    "OMPI_MCA_btl": "self",
    "OMPI_MCA_ess_singleton_isolated": "1",
    "OMPI_MCA_pml": "ob1",
    "UCX_TLS": "self",
}
_OBJECTS = 50_000
"""New objects between two searches for garbage; each looks through all that was imported and compiled."""


def settle(error: type[Exception]) -> None:
    """Set the variables of this process; `error` is raised for one of the user's that holds what it must not."""
    gc.set_threshold(_OBJECTS)
    atexit.register(gc.freeze)  # else Python takes its modules apart object by object, for half a second
    # For terminals of Windows alone; numba, where it finds it, lets it end our output, JSON too, with a colour code.
    sys.modules.setdefault("colorama", None)  # type: ignore[arg-type]
    launched = is_launched()
    if not launched:
        leave_launch()
    check_variables(error)
    os.environ.update(_FORCED if launched else _FORCED | _ALONE)
    narrow()
    if cores() < affinity():  # libraries count the cores alone, not the time that a container has of them
        for name in ("NUMBA_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
            os.environ.setdefault(name, str(cores()))


def leave_launch() -> None:
    """Drop the variables of MPI: a process that a rank starts is none of the ranks."""
    for name in os.environ.keys() - own_environment().keys():
        del os.environ[name]


def own_environment() -> dict[str, str]:
    """The variables without those of MPI and its launchers."""
    return {name: value for name, value in os.environ.items() if not _OF_MPI.fullmatch(name)}


def check_variables(error: type[Exception]) -> None:
    """Raise `error` for a variable with a value that is not allowed; an empty one is dropped, as shells unset it."""
    for name, (pattern, allowed) in _CHECKED.items():
        value = os.environ.get(name)
        if value == "":
            del os.environ[name]
        elif value is not None and not re.fullmatch(pattern, value, re.IGNORECASE):
            raise error(f"{name}: found {value!r} in the environment; allowed: {allowed}, or to unset it")


def narrow() -> None:
    """Have libraries that are loaded from now on compute as on the processor that FRAGFIELD_PROCESSOR names."""
    if not (chosen := os.environ.get("FRAGFIELD_PROCESSOR")):
        return
    name, without = _PROCESSORS[chosen.lower()]
    os.environ |= {
        "NPY_DISABLE_CPU_FEATURES": without,
        "NUMBA_CPU_FEATURES": "",  # else this processor's
        "NUMBA_CPU_NAME": name,
        "OPENBLAS_CORETYPE": name.capitalize(),
    }
    # What another version or the processor does not know cannot be disabled, as numpy says.
    warnings.filterwarnings("ignore", "During parsing environment variable 'NPY_DISABLE", RuntimeWarning)


def is_launched() -> bool:
    """Whether an MPI launcher has started this process beside others.

    One rank alone needs no launcher, which would let MPI begin but once: a script of two commands would lose one.
    """
    return not any(os.environ.get(name) == "1" for name in _SIZES) and any(name in os.environ for name in _RANKS)


def kept_variables() -> dict[str, str]:
    """The user's variables on which last digits and speed depend, for the provenance."""
    return {name: os.environ[name] for name in _CHECKED if os.environ.get(name)}
