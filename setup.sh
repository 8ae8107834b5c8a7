#!/bin/sh
# Set fragfield up on this machine, then do one thing with it. `sh setup.sh help` says what.
#
# Where the Python with dolfinx comes from, first match:
#   1. FRAGFIELD_PYTHON, the path of an interpreter;
#   2. the active conda or virtual environment, or the python3 that PATH finds (the official image), if it has dolfinx;
#   3. Debian 12 or 13: apt's packages and /usr/bin/python3.
# Everything that pip installs goes to .venv beside this file; an environment that is already there is not changed.
# pip's and apt's own configuration (mirrors, proxies, certificates) is used as it is.
set -eu

supported_dolfinx="0.5 0.9 0.10 0.11"
apt_packages="python3-dolfinx-real python3-h5py python3-h5py-mpi python3-rasterio python3-pyproj proj-bin python3-venv openmpi-bin
ca-certificates gcc libc6-dev libegl1 libgl1 libglu1-mesa libxrender1 libxcursor1 libxfixes3 libxft2 libfontconfig1 libxinerama1"

say() { printf 'setup: %s\n' "$*"; }

# refuse FAULT CURE...: say both on stderr, one line each, and stop.
refuse() {
    printf 'setup: %s\n' "$1" >&2
    shift
    for cure in "$@"; do printf '       %s\n' "$cure" >&2; done
    exit 1
}

usage() {
    cat <<'END'
usage: sh setup.sh [ACT] [ARGUMENT...]

  install    set up only (default)
  demo       the demonstration: cases/grenade_155_tnt.toml with coarse cells, into runs/demo
  examples   the scripts of examples/, with their pictures, into runs/examples; "pictures": also into the gallery of docs/
  test       the tests, on two cores or more side by side; arguments go to pytest (-n 0: one after the other)
  processors the tests twice, with code for processors with AVX2 and with SSE4 alone; arguments as of test
  lint       ruff, mypy, import-linter, the list of words that are not used
  attack     generated cases, damaged files, signals and full disks for 30 minutes; arguments: MINUTES SEED
  validate   the slow tests and the validation cases; arguments go to python -m validation
  bench      the benchmarks; arguments go to python -m benchmarks
  docs       the documentation, into build/docs; arguments go to mkdocs build; "pictures": first README's pictures of a report and a page
  help       this text

Each act sets up first what is missing; a set-up that is complete costs no time.
FRAGFIELD_PYTHON=/path/to/python3 names an interpreter that has dolfinx.
END
}

# --- the Python with dolfinx --------------------------------------------------------------------------------

# probe PYTHON: print "dolfinx-version python-version", or fail. Looks the version up without importing dolfinx.
probe() {
    "$1" -c '
import importlib.metadata, importlib.util, platform, sys
if importlib.util.find_spec("dolfinx") is None:
    sys.exit(1)
try:
    version = importlib.metadata.version("fenics-dolfinx")
except importlib.metadata.PackageNotFoundError:
    import dolfinx
    version = dolfinx.__version__
print(version, platform.python_version())
' 2>/dev/null
}

choose_python() {
    # A shell of its own, since os-release sets names of its own, and ends the shell where it is missing.
    release=$( (. "${OS_RELEASE:-/etc/os-release}" 2>/dev/null && echo "$ID ${VERSION_ID:-unnumbered}") || echo unknown)
    if [ -n "${FRAGFIELD_PYTHON:-}" ]; then
        python=$(command -v "$FRAGFIELD_PYTHON" || echo false) origin=environment
        probe "$python" >/dev/null || refuse "FRAGFIELD_PYTHON=$FRAGFIELD_PYTHON is not a Python that has dolfinx." \
            "Name one for which \`import dolfinx\` works, or unset FRAGFIELD_PYTHON."
        return
    fi
    for python in "${VIRTUAL_ENV:+$VIRTUAL_ENV/bin/python}" "${CONDA_PREFIX:+$CONDA_PREFIX/bin/python}" \
        "$(command -v python3 || true)"; do
        [ -x "$python" ] && [ "$python" != /usr/bin/python3 ] && [ "$python" != /bin/python3 ] || continue
        if probe "$python" >/dev/null; then
            origin=environment
            return
        fi
    done
    python=/usr/bin/python3 origin=debian
    case $release in
        "debian 12" | "debian 13") ;;
        *)
            origin=environment
            probe "$python" >/dev/null || refuse \
                "this is $release, not Debian 12 or 13, and no Python here has dolfinx." \
                "Make an environment that has it, activate it and call again:" \
                "  conda env create -f environment.yml && conda activate fragfield" \
                "or build and start the image: docker build -t fragfield . && docker run -it fragfield"
            ;;
    esac
}

check_versions() {  # sets versions and python_version
    versions=$(probe "$python") || refuse "$python cannot find dolfinx." \
        "On Debian, mend it by: apt-get install --reinstall python3-dolfinx-real"
    python_version=${versions#* }
    case " $supported_dolfinx " in
        *" $(printf '%s' "$versions" | cut -d. -f1-2) "*) ;;
        *) refuse "dolfinx ${versions% *} ($python) is not supported; known are $supported_dolfinx." \
            "Debian 12 brings 0.5, Debian 13 brings 0.9; or: conda env create -f environment.yml" ;;
    esac
    case $python_version in
        3.[0-9].* | 3.10.*) refuse "$python is Python $python_version; 3.11 or newer is needed." \
            "Use an environment with a newer Python, for instance Debian 12 or newer." ;;
    esac
}

# --- apt ----------------------------------------------------------------------------------------------------

apt() {  # apt-get as root; proxies are handed on by name, since sudo drops them
    if [ "$(id -u)" -eq 0 ]; then set -- env "$@"; else
        set -- sudo env ${http_proxy:+"http_proxy=$http_proxy"} ${https_proxy:+"https_proxy=$https_proxy"} "$@"
    fi
    "$@"
}

install_debian_packages() {
    missing=""
    for package in $apt_packages; do
        [ "$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null)" = installed ] || missing="$missing $package"
    done
    [ -n "$missing" ] || return 0
    # Without a terminal sudo could not ask for the password.
    [ "$(id -u)" -eq 0 ] || { command -v sudo >/dev/null && { [ -t 0 ] || sudo -n true 2>/dev/null; }; } || refuse \
        "Debian packages are missing, you are not root, and sudo is not there or did not let you in." \
        "Let an administrator run, once:" "  apt-get install --no-install-recommends$missing" "then call again."
    say "apt-get install$missing (2.3 GB with all they need, a few minutes)"
    # A broken third-party source must not stop us: only the installation itself has to work.
    apt DEBIAN_FRONTEND=noninteractive apt-get -q -y update || true
    # shellcheck disable=SC2086  # a list of names
    apt DEBIAN_FRONTEND=noninteractive apt-get -q -y -o DPkg::Lock::Timeout=300 install --no-install-recommends $missing ||
        refuse "apt could not install the packages; its last words stand above." \
            "No network? Check that apt reaches a mirror (/etc/apt/sources.list*, and Acquire::http::Proxy behind a proxy)." \
            "Packages unknown? Debian's component \"main\" must be among the sources." \
            "Another fault: \`dpkg --configure -a\` and \`apt-get -f install\` mend a broken state. Then call again."
}

# --- pip ----------------------------------------------------------------------------------------------------

create_venv() {  # one made here on the same interpreter is kept: others may be working in it; its scripts hold its path
    if grep -qx "home = ${python%/*}" "$venv/pyvenv.cfg" 2>/dev/null && grep -qF " $venv" "$venv/pyvenv.cfg" &&
        grep -qx "version = $python_version" "$venv/pyvenv.cfg"; then return 0; fi
    say "virtual environment .venv on $python ($python_version)"
    "$python" -m venv --clear --system-site-packages "$venv" || refuse "cannot create $venv." \
        "Is the folder writable? On Debian and Ubuntu: apt-get install python3-venv"
    # A venv sees the packages of the base interpreter only; those of a virtual environment are joined by hand: as plain
    # paths, which pip keeps out of its isolated builds.
    "$python" - "$venv" <<'END'
import pathlib, site, sys
if sys.prefix != sys.base_prefix:
    folder = pathlib.Path(sys.argv[1], "lib", f"python{sys.version_info[0]}.{sys.version_info[1]}", "site-packages")
    (folder / "environment_below.pth").write_text("\n".join(site.getsitepackages()) + "\n")
END
}

write_constraints() {  # in an environment what dolfinx was built with keeps its version; our direct needs are pinned
    if [ "$origin" = debian ]; then cat "constraints/debian-${release#debian }.txt" && return; fi
    cat constraints/environment.txt
    "$python" -c '
from importlib.metadata import distributions
for one in distributions():
    if one.name in ("numpy", "scipy", "cffi", "mpi4py", "petsc4py"):
        print(f"{one.name}=={one.version}")'
}

pip_install() {  # pinned, also while pip builds a package; the path is relative since pip splits it at spaces
    PIP_CONSTRAINT=.venv/constraints.txt${PIP_CONSTRAINT:+ $PIP_CONSTRAINT} \
        "$venv/bin/python" -m pip install --quiet --no-user --use-pep517 --disable-pip-version-check "$@"
}

# h5py must share its HDF5 with dolfinx: PyPI's wheel brings another one, with which both fail. Serial, as Debian's;
# mpicc since a parallel HDF5 needs MPI's headers. The build brings its own pins.
install_h5py() {
    if "$venv/bin/python" -c 'import sys, importlib.util as u; sys.exit(u.find_spec("h5py") is None)'; then return 0; fi
    say "h5py is missing beside this dolfinx: building it against the same HDF5"
    HDF5_DIR=${HDF5_DIR:-${CONDA_PREFIX:-}}
    if [ -z "$HDF5_DIR" ]; then unset HDF5_DIR; else export HDF5_DIR; fi
    CC=mpicc "$venv/bin/python" -m pip install --quiet --no-user --no-deps --no-binary h5py \
        "$(grep '^h5py==' constraints/environment.txt)" || refuse \
        "h5py could not be built against dolfinx's HDF5; pip's reason stands above." \
        "In conda: conda install -c conda-forge h5py" \
        "Elsewhere: HDF5_DIR must name the folder with HDF5's include and lib, and mpicc must be there. Then call again."
}

set_up() {
    choose_python
    if [ "$origin" = debian ]; then install_debian_packages; fi
    check_versions
    stamp="$root $python $versions $(cat setup.sh pyproject.toml flight/pyproject.toml constraints/*.txt | cksum)"
    if [ "$(cat "$venv/.stamp" 2>/dev/null)" = "$stamp" ]; then return 0; fi
    say "dolfinx ${versions% *} of $python, Python $python_version"
    [ -w "$root" ] || refuse "$root is not writable, and .venv is missing or out of date there." \
        "Let the folder's owner call \`sh setup.sh install\`, or copy the folder to a place of your own."
    rm -f "$venv/.stamp"
    create_venv
    write_constraints >"$venv/constraints.txt"
    install_h5py
    say "Python packages, pinned by constraints/ (2 GB, a few minutes)"
    pip_install --editable ./flight --editable ".[app,terrain,tables,drawings,test,lint,docs]" || refuse \
        "pip could not install the Python packages; its reason stands above." \
        "No network? pip needs https://pypi.org or a mirror (PIP_INDEX_URL); behind a proxy set https_proxy." \
        "Certificates? PIP_CERT names the file to trust. Disk full? About 2 GB are needed here."
    (cd "$venv" && bin/python -c 'import dolfinx, h5py, numba, gmsh, meshio, pyvista, vtk, flight, fragfield') || refuse \
        "the packages do not load together; Python's reason stands above." \
        "Does a folder in PYTHONPATH or ~/.local hold other versions (h5py, numpy)? Remove them there, or set PYTHONNOUSERSITE=1." \
        "Otherwise remove .venv and call again."
    say "compiling the kernels, once (a minute or two)"
    "$venv/bin/fragfield" warm-up || say "the kernels are left to the first run"
    printf '%s\n' "$stamp" >"$venv/.stamp"
}

browser() {  # Chromium, for the tests of the application and pictures of pages; without it those tests are skipped
    if [ "$origin" = debian ] && ! command -v chromium >/dev/null; then apt_packages=chromium && install_debian_packages; fi
}

# --- running ------------------------------------------------------------------------------------------------

act=${1:-install}
[ $# -eq 0 ] || shift
case $act in
    install | demo | examples | test | processors | lint | attack | validate | bench | docs) ;;
    help | -h | --help) usage && exit 0 ;;
    *)
        printf 'setup: unknown act "%s".\n\n' "$act" >&2
        usage >&2
        exit 2
        ;;
esac

root=$(cd -P -- "$(dirname -- "$0")" && pwd)
cd "$root"
venv=$root/.venv bin=$root/.venv/bin
# An activated .venv of ours must not be taken for the environment below it.
if [ "${VIRTUAL_ENV:-}" = "$venv" ]; then unset VIRTUAL_ENV; fi
PATH=$(printf '%s' "$PATH" | sed -e "s|^$bin:||" -e "s|:$bin||g")
if [ "$(id -u)" -eq 0 ]; then export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1; fi
set_up
# The mathematical functions of glibc are chosen when a process begins.
if [ "${FRAGFIELD_PROCESSOR:-}" = sse4 ]; then export GLIBC_TUNABLES=glibc.cpu.hwcaps=-AVX,-AVX2,-FMA,-FMA4; fi
case $act in
    install) say "ready: .venv/bin/fragfield --help" ;;
    demo)
        "$bin/fragfield" run cases/grenade_155_tnt.toml --set burst.cell_size="8 mm" --out runs/demo --overwrite "$@"
        say "the report is runs/demo/report.html, the pictures are in runs/demo/figures"
        ;;
    examples)
        for example in examples/*.py; do
            say "$example"
            "$bin/python" "$example"
            name=$(basename "$example" .py)
            if [ "${1:-}" = pictures ]; then cp "runs/examples/$name/$name.png" "docs/pictures/example_$name.png"; fi
        done
        say "the pictures are in runs/examples"
        ;;
    test)
        workers=$(nproc 2>/dev/null || echo 1)
        if [ "$workers" -gt 4 ]; then workers=4; fi  # each takes up to 2 GB
        case " $* " in *" -n"* | *" --pdb"* | *::*) workers=1 ;; esac
        if [ "$workers" -gt 1 ]; then
            "$bin/fragfield" warm-up || say "the kernels are left to the tests"
            set -- -n "$workers" --dist loadgroup "$@"
        fi
        # A missing dolfinx or mpirun must fail here, not be skipped.
        FRAGFIELD_REQUIRE_ALL=1 exec "$bin/python" -m pytest "$@"
        ;;
    processors)
        status=0
        for processor in avx2 sse4; do
            say "the tests with code for a processor with $processor"
            FRAGFIELD_PROCESSOR=$processor sh setup.sh test "$@" || status=1
        done
        exit "$status"
        ;;
    lint)
        status=0
        "$bin/ruff" check || status=1
        "$bin/ruff" format --check || status=1
        "$bin/mypy" || status=1
        "$bin/lint-imports" || status=1
        "$bin/python" -m tests.vocabulary || status=1
        exit "$status"
        ;;
    attack) exec "$bin/python" -m tests.attack "$@" ;;
    validate)
        browser
        "$bin/python" -m pytest -m slow
        exec "$bin/python" -m validation "$@"
        ;;
    bench) exec "$bin/python" -m benchmarks "$@" ;;
    docs)
        if [ "${1:-}" = pictures ]; then
            shift
            browser
            "$bin/python" docs/hooks/first_page.py
            "$bin/python" docs/hooks/application_page.py
        fi
        "$bin/python" -m mkdocs build --strict "$@"
        say "the documentation is build/docs/index.html"
        ;;
esac
