#!/bin/sh
# Set fragfield up on this machine, then do one thing with it. `sh setup.sh help` says what; tests/acts.py does it.
#
# Where dolfinx comes from, first match:
#   1. FRAGFIELD_PYTHON, the active environment, or the python3 that PATH finds (the official image), if it has dolfinx;
#   2. Debian 12 or 13: apt's packages and /usr/bin/python3, if they are there or you may install them;
#   3. PyPI's wheel, for a Python of 3.12 or newer on x86-64 with glibc 2.34.
# What pip installs goes to .venv beside this file; an environment that is there is not changed. pip's and apt's own settings are used.
set -eu

supported_dolfinx="0.5 0.9 0.10 0.11"
extras="app,terrain,tables,drawings"
tools="test,lint,docs"  # for whoever changes the program
apt_packages="python3-dolfinx-real python3-h5py python3-h5py-mpi python3-rasterio python3-pyproj proj-bin python3-venv openmpi-bin
ca-certificates gcc libc6-dev libgl1 libglu1-mesa libxrender1 libxcursor1 libxfixes3 libxft2 libfontconfig1 libxinerama1"

say() { printf 'setup: %s\n' "$*"; }

refuse() {  # FAULT CURE...: say both on stderr, one line each, and stop
    printf 'setup: %s\n' "$1" >&2
    shift && for cure in "$@"; do printf '       %s\n' "$cure" >&2; done
    exit 1
}

usage() {
    cat <<'END'
usage: sh setup.sh [ACT] [ARGUMENT...]

  install    set up only (default), without what acts below demo and examples add for tests, lint and docs
  demo       the demonstration: cases/grenade_155_tnt.toml with coarse cells, into runs/demo
  examples   the scripts of examples/, with their pictures, into runs/examples; "pictures": also into the gallery of docs/
  test       the tests, on two cores or more side by side; arguments go to pytest (-n 0: one after the other)
  matrix     the tests on debian-12, debian-13 and wheel; arguments: those wanted of them, then those of pytest
  processors the tests twice, with code for AVX2 and for SSE4 alone; arguments as of test
  lint       ruff, mypy, import-linter, the list of words that are not used
  attack     generated cases, damaged files, signals and full disks for 30 minutes; arguments: MINUTES SEED
  validate   the slow tests and the validation cases; arguments go to python -m validation
  bench      the benchmarks; arguments go to python -m benchmarks
  docs       the documentation, into build/docs; arguments go to mkdocs build; "pictures": first README's pictures of a report and a page
  help       this text

Each sets up first what is missing, which costs no time where nothing is. FRAGFIELD_PYTHON names an interpreter that has dolfinx.
END
}

probe() {  # PYTHON: print "dolfinx-version python-version distribution", or fail; dolfinx is imported only where pip does not know it
    "$1" -c '
import importlib.metadata as known, importlib.util, platform, sys
if importlib.util.find_spec("dolfinx") is None:
    sys.exit(1)
names = {one.name: one.version for one in known.distributions() if one.name in ("dolfinx-solver-real", "fenics-dolfinx")}
name, version = min(names.items(), default=("", ""))
print(version or __import__("dolfinx").__version__, platform.python_version(), name)' 2>/dev/null
}

takes_wheel() {  # PYTHON: whether dolfinx has a wheel for it
    "$1" -c '
import platform, sys
libc, version = platform.libc_ver()
fits = libc == "glibc" and tuple(map(int, version.split("."))) >= (2, 34) and platform.machine() == "x86_64"
sys.exit(not (fits and sys.version_info >= (3, 12)))' 2>/dev/null
}

choose_python() {  # sets python and origin
    # A shell of its own, since os-release sets names of its own, and ends the shell where it is missing.
    release=$( (. "${OS_RELEASE:-/etc/os-release}" 2>/dev/null && echo "$ID ${VERSION_ID:-unnumbered}") || echo unknown)
    origin=environment
    if [ -n "${FRAGFIELD_PYTHON:-}" ]; then
        python=$(command -v "$FRAGFIELD_PYTHON" || echo false)
        probe "$python" >/dev/null || refuse "FRAGFIELD_PYTHON=$FRAGFIELD_PYTHON is not a Python that has dolfinx." \
            "Name one for which \`import dolfinx\` works, or unset FRAGFIELD_PYTHON."
        return
    fi
    missing="" && case $release in "debian 12" | "debian 13") debian=yes ;; *) debian="" ;; esac
    for python in "${VIRTUAL_ENV:+$VIRTUAL_ENV/bin/python}" "${CONDA_PREFIX:+$CONDA_PREFIX/bin/python}" "$(command -v python3 || true)"; do
        case $debian$python in yes/usr/bin/python3 | yes/bin/python3) continue ;; esac
        if [ -x "$python" ] && probe "$python" >/dev/null; then return; fi
    done
    if [ -n "$debian" ]; then
        python=/usr/bin/python3 origin=debian
        missing=$(for name in $apt_packages; do
            [ "$(dpkg-query -W -f='${db:Status-Status}' "$name" 2>/dev/null)" = installed ] || printf ' %s' "$name"
        done)
        # Without a terminal sudo could not ask for the password.
        if [ -z "$missing" ] || [ "$(id -u)" -eq 0 ] || { command -v sudo >/dev/null && { [ -t 0 ] || sudo -n true 2>/dev/null; }; }; then return; fi
    fi
    origin=wheel
    for name in "${VIRTUAL_ENV:-/nowhere}/bin/python" python3 python3.14 python3.13 python3.12; do
        if python=$(command -v "$name") && takes_wheel "$python"; then return; fi
    done
    [ -z "$missing" ] || refuse "Debian packages are missing, you are not root, and sudo is not there or did not let you in." \
        "Let an administrator run, once:" "  apt-get install --no-install-recommends$missing" "then call again."
    refuse "this is $release, not Debian 12 or 13, and no Python here has dolfinx or takes its wheel (3.12 or newer, x86-64, glibc 2.34)." \
        "Install such a Python and call again, or make an environment that has dolfinx, activate it and call again:" \
        "  conda env create -f environment.yml && conda activate fragfield" \
        "or build and start the image: docker build -t fragfield . && docker run -it fragfield"
}

check_dolfinx() {  # sets versions: "dolfinx python"
    if [ "$origin" = wheel ]; then
        versions="0.11 $("$python" -c 'import platform; print(platform.python_version())') dolfinx-solver-real"
    else
        versions=$(probe "$python") || refuse "$python cannot find dolfinx." "On Debian, mend it by: apt-get install --reinstall python3-dolfinx-real"
    fi
    case $versions in *dolfinx-solver-real) extras=dolfinx,$extras ;; esac
    versions=$(printf '%s' "$versions" | cut -d' ' -f1-2)
    case " $supported_dolfinx " in
        *" $(printf '%s' "${versions% *}" | cut -d. -f1-2) "*) ;;
        *) refuse "dolfinx ${versions% *} ($python) is not supported; known are $supported_dolfinx." \
            "Debian 12 brings 0.5, Debian 13 brings 0.9; or: conda env create -f environment.yml" ;;
    esac
}

install_debian_packages() {  # NAME...
    [ $# -gt 0 ] || return 0
    say "apt-get install $* (all in all 2.3 GB, a few minutes)"
    if [ "$(id -u)" -eq 0 ]; then as_root=""; else as_root=sudo; fi  # which drops proxies: they are handed on by name
    as_root="$as_root env DEBIAN_FRONTEND=noninteractive ${http_proxy:+http_proxy=$http_proxy} ${https_proxy:+https_proxy=$https_proxy} apt-get -q -y"
    $as_root update || true  # a broken third-party source must not stop us
    $as_root -o DPkg::Lock::Timeout=300 install --no-install-recommends "$@" || refuse "apt could not install the packages; its last words stand above." \
        "No network? Check that apt reaches a mirror (/etc/apt/sources.list*, and Acquire::http::Proxy behind a proxy)." \
        "Packages unknown? Debian's component \"main\" must be among the sources." \
        "Another fault: \`dpkg --configure -a\` and \`apt-get -f install\` mend a broken state. Then call again."
}

create_venv() {  # one made here on the same interpreter is kept: others may be working in it; its scripts hold its path
    if grep -qx "home = ${python%/*}" "$venv/pyvenv.cfg" 2>/dev/null && grep -qF " $venv" "$venv/pyvenv.cfg" &&
        grep -qx "version = ${versions#* }" "$venv/pyvenv.cfg"; then return 0; fi
    [ ! -L "$venv" ] || refuse "$venv is a link; the environment that it leads to, made elsewhere, would be emptied." "Remove the link and call again."
    say "virtual environment .venv on $python (${versions#* })"
    if [ "$origin" = wheel ]; then set -- "$venv"; else set -- --system-site-packages "$venv"; fi
    "$python" -m venv --clear "$@" || refuse "cannot create $venv." "Is the folder writable? On Debian and Ubuntu: apt-get install python3-venv"
    [ "$origin" = environment ] || return 0
    # A venv sees the base interpreter's packages; a virtual environment's are joined as plain paths, which pip's isolated builds ignore.
    "$python" - "$venv" <<'END'
import pathlib, site, sys
if sys.prefix != sys.base_prefix:
    folder = pathlib.Path(sys.argv[1], "lib", f"python{sys.version_info[0]}.{sys.version_info[1]}", "site-packages")
    (folder / "environment_below.pth").write_text("\n".join(site.getsitepackages()) + "\n")
END
}

write_constraints() {  # in an environment what dolfinx was built with keeps its version; our direct needs are pinned
    case $origin in debian) name=debian-${release#debian } ;; *) name=$origin ;; esac
    cat "constraints/$name.txt"
    [ "$origin" != environment ] || "$python" -c '
from importlib.metadata import distributions
for one in distributions():
    if one.name in ("numpy", "scipy", "cffi", "mpi4py", "petsc4py"):
        print(f"{one.name}=={one.version}")'
}

set_up() {
    choose_python
    # shellcheck disable=SC2086  # a list of names
    if [ "$origin" = debian ]; then install_debian_packages $missing; fi
    check_dolfinx
    stamp="$root $python $versions $(cat setup.sh dependencies.txt pyproject.toml flight/pyproject.toml constraints/*.txt | cksum)"
    case $act in install | demo | examples) ;; *) stamp="$stamp $tools" extras=$extras,$tools ;; esac
    case $(cat "$venv/.stamp" 2>/dev/null) in "$stamp" | "$stamp $tools") return 0 ;; esac
    say "dolfinx ${versions% *} of $python, Python ${versions#* }"
    [ -w "$root" ] || refuse "$root is not writable, and .venv is missing or out of date there." \
        "Let the folder's owner call \`sh setup.sh install\`, or copy the folder to a place of your own."
    rm -f "$venv/.stamp"
    create_venv
    write_constraints >"$venv/constraints.txt"
    say "Python packages, pinned by constraints/ (0.6 GB, with $tools 2 GB; a few minutes)"
    # Pinned also while pip builds a package; the path is relative since pip splits it at spaces.
    PIP_CONSTRAINT=.venv/constraints.txt${PIP_CONSTRAINT:+ $PIP_CONSTRAINT} "$venv/bin/python" -m pip install --quiet --no-user \
        --use-pep517 --disable-pip-version-check --editable ./flight --editable ".[$extras]" || refuse \
        "pip could not install the Python packages; its reason stands above." \
        "No network? pip needs https://pypi.org or a mirror (PIP_INDEX_URL); behind a proxy set https_proxy." \
        "Certificates? PIP_CERT names the file to trust. Disk full? Up to 2 GB are needed here."
    (cd "$venv" && bin/python -c 'from burst_fenicsx import compat; import gmsh, meshio, flight, fragfield') || refuse \
        "the packages do not load together; Python's reason stands above." \
        "No h5py? It must share dolfinx's HDF5: conda install -c conda-forge h5py; elsewhere CC=mpicc pip install --no-binary h5py h5py" \
        "Does a folder in PYTHONPATH or ~/.local hold other versions (h5py, numpy)? Remove them there, or set PYTHONNOUSERSITE=1." \
        "Otherwise remove .venv and call again."
    printf '%s\n' "$stamp" >"$venv/.stamp"
}

act=${1:-install} && [ $# -eq 0 ] || shift
case $act in
    install | demo | examples | test | matrix | processors | lint | attack | validate | bench | docs) ;;
    help | -h | --help) usage && exit 0 ;;
    *) { printf 'setup: unknown act "%s".\n\n' "$act" && usage; } >&2 && exit 2 ;;
esac

root=$(cd -P -- "$(dirname -- "$0")" && pwd) && cd "$root"
venv=$root/.venv bin=$root/.venv/bin
# An activated .venv of ours must not be taken for the environment below it.
if [ "${VIRTUAL_ENV:-}" = "$venv" ]; then unset VIRTUAL_ENV; fi
PATH=$(printf '%s' "$PATH" | sed -e "s|^$bin:||" -e "s|:$bin||g")
if [ "$(id -u)" -eq 0 ]; then export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1; fi
set_up
case "$act ${1:-} $origin" in  # the browser of tests of the application and of pictures; without it those tests are skipped
    "validate "*" debian" | "docs pictures debian") command -v chromium >/dev/null || install_debian_packages chromium ;;
esac
if [ "$act" = install ]; then say "ready: .venv/bin/fragfield --help"; else exec "$bin/python" -m tests.acts "$act" "$@"; fi
