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
apt_packages="python3-dolfinx-real python3-h5py python3-h5py-mpi python3-venv openmpi-bin ca-certificates gcc libc6-dev
libegl1 libgl1 libglu1-mesa libxrender1 libxcursor1 libxfixes3 libxft2 libfontconfig1 libxinerama1"
kernel_packages="python3-venv python3-numpy ca-certificates"  # what compiling kernels needs of them
apt_megabytes=2300
venv_megabytes=1850

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
  lint       ruff, mypy, import-linter, the list of words that are not used
  attack     generated cases, damaged files, signals and full disks for 30 minutes; arguments: MINUTES SEED
  validate   the slow tests and the validation cases; arguments go to python -m validation
  bench      the benchmarks; arguments go to python -m benchmarks
  docs       the documentation, into build/docs; arguments go to mkdocs build; "pictures": first README's picture of a report
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

leave_own_venv() {  # an activated .venv of ours must not be taken for the environment below it
    if [ "${VIRTUAL_ENV:-}" = "$venv" ]; then unset VIRTUAL_ENV; fi
    PATH=$(printf '%s' "$PATH" | sed -e "s|^$venv/bin:||" -e "s|:$venv/bin||g")
}

read_release() {  # an own shell, since os-release sets names of its own
    # shellcheck disable=SC1090
    (. "${OS_RELEASE:-/etc/os-release}" 2>/dev/null && printf '%s %s' "${ID:-unknown}" "${VERSION_ID:-unnumbered}") ||
        printf 'unknown unnumbered'
}

choose_python() {
    release=$(read_release)
    if [ -n "${FRAGFIELD_PYTHON:-}" ]; then
        python=$(command -v "$FRAGFIELD_PYTHON" || true)
        probe "${python:-false}" >/dev/null ||
            refuse "FRAGFIELD_PYTHON=$FRAGFIELD_PYTHON is not a Python that has dolfinx." \
                "Name one for which \`import dolfinx\` works, or unset FRAGFIELD_PYTHON."
        origin=environment
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
    python=/usr/bin/python3
    case $release in
        "debian 12" | "debian 13") origin=debian ;;
        *)
            probe "$python" >/dev/null || refuse \
                "this is $release, not Debian 12 or 13, and no Python here has dolfinx." \
                "Activate an environment that has it and call again, for instance" \
                "  conda create -n fragfield -c conda-forge python=3.12 fenics-dolfinx mpich h5py" \
                "  conda activate fragfield" \
                "or start the official image: docker run -it -v \"\$PWD:/root/fragfield\" dolfinx/dolfinx:stable"
            origin=environment
            ;;
    esac
}

check_versions() {  # sets dolfinx_version and python_version
    versions=$(probe "$python") || refuse "$python cannot find dolfinx." \
        "On Debian, mend it by: apt-get install --reinstall python3-dolfinx-real"
    dolfinx_version=${versions% *}
    python_version=${versions#* }
    series=$(printf '%s' "$dolfinx_version" | cut -d. -f1-2)
    case " $supported_dolfinx " in
        *" $series "*) ;;
        *) refuse "dolfinx $dolfinx_version ($python) is not supported; known are $supported_dolfinx." \
            "Debian 12 brings 0.5, Debian 13 brings 0.9; or: conda create -n fragfield -c conda-forge fenics-dolfinx=0.9 mpich h5py" ;;
    esac
    case $python_version in
        3.[0-9].* | 3.10.*) refuse "$python is Python $python_version; 3.11 or newer is needed." \
            "Use an environment with a newer Python, for instance Debian 12 or newer." ;;
    esac
}

# --- apt ----------------------------------------------------------------------------------------------------

# missing_packages NAME...
missing_packages() {
    for package in "$@"; do
        [ "$(dpkg-query -W -f='${db:Status-Status}' "$package" 2>/dev/null)" = installed ] || printf '%s ' "$package"
    done
}

# need_space MEGABYTES FOLDER WHAT
need_space() {
    free=$(df -Pk "$2" | awk 'NR == 2 { print int($4 / 1024) }')
    [ "$free" -ge "$1" ] || refuse "too little disk space: $3 need $1 MB under $2, $free MB are free." \
        "Free some space (apt-get clean, old files in runs/) and call again."
}

# as_root COMMAND...: proxies are handed on by name, since sudo drops them.
as_root() {
    if [ "$(id -u)" -eq 0 ]; then
        env DEBIAN_FRONTEND=noninteractive "$@"
    else
        sudo env DEBIAN_FRONTEND=noninteractive ${http_proxy:+"http_proxy=$http_proxy"} \
            ${https_proxy:+"https_proxy=$https_proxy"} ${no_proxy:+"no_proxy=$no_proxy"} "$@"
    fi
}

check_root() {
    [ "$(id -u)" -ne 0 ] || return 0
    if ! command -v sudo >/dev/null; then
        refuse "Debian packages are missing, you are not root, and there is no sudo." \
            "Let an administrator run, once:" "  apt-get install --no-install-recommends $1" "then call again."
    fi
    # Without a terminal sudo could not ask for the password.
    if [ -t 0 ]; then sudo -v; else sudo -n true 2>/dev/null; fi || refuse \
        "Debian packages are missing and sudo did not let you in." \
        "Let an administrator run, once:" "  sudo apt-get install --no-install-recommends $1" "then call again."
}

# apt LOG ARGUMENT...: apt-get with all its words in LOG, and on stdout how far it is, so that minutes are not silent.
apt() {
    apt_log=$1
    shift
    rm -f "$apt_log.failed"
    { as_root apt-get -q -y "$@" 2>&1 || : >"$apt_log.failed"; } | awk -v log_file="$apt_log" '
        { print >>log_file; fflush(log_file) }
        /^Need to get/ { sub("Need to get ", ""); sub(" of archives.*", ""); print "setup:   downloading " $0 }
        /newly installed/ { total = $3 }
        /^Get:/ { if (++got % 25 == 0) print "setup:   downloaded " got (total ? " of " total : "") " packages" }
        /^Unpacking / { if (++unpacked % 25 == 0) print "setup:   unpacked " unpacked (total ? " of " total : "") }
        /^Setting up / { if (++ready % 25 == 0) print "setup:   set up " ready (total ? " of " total : "") }
        { fflush() }'
    if [ -e "$apt_log.failed" ]; then
        rm -f "$apt_log.failed"
        return 1
    fi
}

install_debian_packages() {
    # shellcheck disable=SC2086  # lists of names
    missing=$(missing_packages $apt_packages) first=$(missing_packages $kernel_packages)
    [ -n "$missing" ] || return 0
    check_root "$missing"
    need_space "$apt_megabytes" /usr "Debian's packages"
    log=$(mktemp)
    say "Debian packages to install: $missing"
    # A broken third-party source must not stop us: only the installation itself has to work.
    say "apt-get update"
    apt "$log" update || true
    say "apt-get install (about $apt_megabytes MB with all they need, a few minutes)"
    if [ -w "$root" ]; then
        [ -z "$first" ] || apt_install "$log" "$first"
        python_version=$("$python" -c 'import platform; print(platform.python_version())')
        compile_beside
    fi
    apt_install "$log" "$missing"
    rm -f "$log"
}

# apt_install LOG PACKAGES
apt_install() {
    # shellcheck disable=SC2086  # a list of names
    apt "$1" -o DPkg::Lock::Timeout=300 install --no-install-recommends $2 || {
        tail -n 15 "$1" >&2
        refuse "apt could not install the packages; its last words stand above, all of them in $1." \
            "No network? Check that apt reaches a mirror (/etc/apt/sources.list*, and Acquire::http::Proxy behind a proxy)." \
            "Packages unknown? Debian's component \"main\" must be among the sources." \
            "Another fault: \`dpkg --configure -a\` and \`apt-get -f install\` mend a broken state. Then call again."
    }
}

# The tests of the report in a browser want one. It is nothing that the program needs: without it they are skipped.
install_browser() {
    if command -v chromium >/dev/null && command -v pdftotext >/dev/null; then return 0; fi
    [ "$(id -u)" -eq 0 ] || sudo -n true 2>/dev/null || {
        say "no chromium here, and no root to install it: the tests in a browser are skipped"
        return 0
    }
    say "apt-get install chromium poppler-utils (for the tests of the report)"
    log=$(mktemp)
    apt "$log" update || true
    apt "$log" -o DPkg::Lock::Timeout=300 install --no-install-recommends chromium poppler-utils ||
        say "apt could not install chromium ($log): the tests in a browser are skipped"
}

# --- pip ----------------------------------------------------------------------------------------------------

# The pins in force. In an environment what dolfinx was built with keeps its version; only our direct needs are pinned.
write_constraints() {
    if [ "$origin" = debian ]; then
        cat "constraints/debian-${release#debian }.txt"
        return
    fi
    "$python" - constraints/environment.txt <<'END'
import importlib.metadata, sys
print(open(sys.argv[1]).read())
for name in ("numpy", "scipy", "cffi", "mpi4py", "petsc4py"):
    try:
        print(f"{name}=={importlib.metadata.version(name)}")
    except importlib.metadata.PackageNotFoundError:
        continue
END
}

# A .venv on the same interpreter is kept: others may be working in it.
venv_fits() {
    for line in "home = ${python%/*}" "include-system-site-packages = true" "version = $python_version"; do
        grep -qx "$line" "$venv/pyvenv.cfg" 2>/dev/null || return 1
    done
}

create_venv() {
    if venv_fits; then return 0; fi
    "$python" -c 'import ensurepip, venv' 2>/dev/null || refuse "$python has no venv module." \
        "On Debian and Ubuntu: apt-get install python3-venv"
    [ -d "$venv/lib" ] || need_space "$venv_megabytes" "$root" "the Python packages"
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

# pip_install ARGUMENT...: pinned, also while pip builds a package. The path is relative since pip splits it at spaces.
pip_install() {
    PIP_CONSTRAINT=.venv/constraints.txt${PIP_CONSTRAINT:+ $PIP_CONSTRAINT} \
        "$venv/bin/python" -m pip install --quiet --no-user --disable-pip-version-check "$@"
}

install_python_packages() {
    say "Python packages, pinned by constraints/ (about $venv_megabytes MB, a few minutes)"
    pip_install --editable ".[view,test,lint,docs]" || refuse \
        "pip could not install the Python packages; its reason stands above." \
        "No network? pip needs https://pypi.org or a mirror (PIP_INDEX_URL); behind a proxy set https_proxy." \
        "Certificates? PIP_CERT names the file to trust. Disk full? About $venv_megabytes MB are needed here."
}

# Kernels of a default run are compiled while apt and pip fetch the rest: Python, numpy and numba are all that it takes.
# What goes wrong here is done again by pip and by the first run.
compile_beside() {
    if [ -n "$compiling" ]; then return 0; fi
    create_venv
    write_constraints >"$venv/constraints.txt"
    say "compiling the kernels of a default run meanwhile"
    rm -f "$venv/numba.ready"
    (
        pip_install numba || :
        touch "$venv/numba.ready"
        exec nice "$venv/bin/python" -m fragfield.compile_ahead axisymmetric
    ) >"$venv/kernels.log" 2>&1 &
    compiling=$!
    trap 'kill "$compiling" 2>/dev/null || :' EXIT
    trap 'exit 130' INT
    trap 'exit 143' TERM
}

# Two of pip at once would write the same files.
wait_for_numba() {
    while [ ! -e "$venv/numba.ready" ] && kill -0 "$compiling" 2>/dev/null; do sleep 0.2; done
}

wait_for_kernels() {
    wait "$compiling" || say "the kernels are left to the first run; why stands in .venv/kernels.log"
    trap - EXIT INT TERM
}

# h5py must share its HDF5 with dolfinx: PyPI's wheel brings another one, with which both fail.
install_h5py() {
    if "$venv/bin/python" -c 'import sys, importlib.util as u; sys.exit(u.find_spec("h5py") is None)'; then return 0; fi
    say "h5py is missing beside this dolfinx: building it against the same HDF5"
    HDF5_DIR=${HDF5_DIR:-${CONDA_PREFIX:-}}
    if [ -z "$HDF5_DIR" ]; then unset HDF5_DIR; else export HDF5_DIR; fi
    # Serial, as Debian's; mpicc since a parallel HDF5 needs MPI's headers. The build brings its own pins.
    CC=mpicc "$venv/bin/python" -m pip install --quiet --no-user --disable-pip-version-check --no-deps \
        --no-binary h5py "$(grep '^h5py==' constraints/environment.txt)" || refuse \
        "h5py could not be built against dolfinx's HDF5; pip's reason stands above." \
        "In conda: conda install -c conda-forge h5py" \
        "Elsewhere: HDF5_DIR must name the folder with HDF5's include and lib, and mpicc must be there. Then call again."
}

check_imports() {
    say "checking that dolfinx, h5py, numba, gmsh and VTK live together"
    (cd "$venv" && "$venv/bin/python" -c '
import dolfinx, h5py, numba, gmsh, meshio, pyvista, vtk, flight, fragfield') || refuse \
        "the packages do not load together; Python's reason stands above." \
        "Does a folder in PYTHONPATH or ~/.local hold other versions (h5py, numpy)? Remove them there, or set PYTHONNOUSERSITE=1." \
        "Otherwise remove .venv and call again."
}

set_up() {
    choose_python
    if [ "$origin" = debian ]; then install_debian_packages; fi
    check_versions
    stamp="$root $python $versions $(cat setup.sh pyproject.toml constraints/*.txt | cksum)"
    if [ "$(cat "$venv/.stamp" 2>/dev/null)" = "$stamp" ]; then return 0; fi
    begin=$(date +%s)
    say "dolfinx $dolfinx_version of $python, Python $python_version"
    [ -w "$root" ] || refuse "$root is not writable, and .venv is missing or out of date there." \
        "Let the folder's owner call \`sh setup.sh install\`, or copy the folder to a place of your own."
    rm -f "$venv/.stamp"
    create_venv
    compile_beside
    wait_for_numba
    install_python_packages
    install_h5py
    check_imports
    wait_for_kernels
    printf '%s\n' "$stamp" >"$venv/.stamp"
    say "complete after $(($(date +%s) - begin)) s"
}

# --- running ------------------------------------------------------------------------------------------------

prepare_running() {
    if [ "$(id -u)" -eq 0 ]; then  # Open MPI refuses root otherwise
        export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
    fi
    if [ ! -w "$root" ]; then  # someone else's installation: compiled kernels go to a folder of one's own
        NUMBA_CACHE_DIR=${NUMBA_CACHE_DIR:-${XDG_CACHE_HOME:-$HOME/.cache}/fragfield/numba}
        export NUMBA_CACHE_DIR
    fi
}

# count_workers ARGUMENT...: processes for the tests, four at most since each takes up to 2 GB; 1 where pytest's arguments
# say how many, or name what one process is done with soon.
count_workers() {
    for argument in "$@"; do
        case $argument in
            -n* | --numprocesses* | --dist* | --pdb | --collect-only | --co | -h | --help | *::*)
                echo 1
                return
                ;;
        esac
    done
    cores=$(nproc 2>/dev/null || echo 1)
    if [ "$cores" -gt 4 ]; then cores=4; fi
    echo "$cores"
}

act=${1:-install}
[ $# -eq 0 ] || shift
case $act in
    install | demo | examples | test | lint | attack | validate | bench | docs) ;;
    help | -h | --help) usage && exit 0 ;;
    *)
        printf 'setup: unknown act "%s".\n\n' "$act" >&2
        usage >&2
        exit 2
        ;;
esac

root=$(cd -P -- "$(dirname -- "$0")" && pwd)
cd "$root"
venv=$root/.venv
compiling=""  # the process that does so
leave_own_venv
set_up
if [ "$act $origin" = "test debian" ]; then install_browser; fi
prepare_running
bin=$venv/bin
case $act in
    install) say "ready: .venv/bin/fragfield --help" ;;
    demo)
        "$bin/fragfield" run cases/grenade_155_tnt.toml --cell-size "8 mm" --out runs/demo --overwrite "$@"
        "$bin/python" -m validation paper_3_1 --run runs/demo
        say "the report is runs/demo/report.html, the pictures are in runs/demo/figures"
        ;;
    examples)
        for example in examples/*.py; do
            say "$example"
            "$bin/python" "$example"
        done
        say "the pictures are in runs/examples"
        if [ "${1:-}" = pictures ]; then
            for example in examples/*.py; do
                name=$(basename "$example" .py)
                cp "runs/examples/$name/$name.png" "docs/pictures/example_$name.png"
            done
            say "the gallery's pictures, docs/pictures/example_*.png, are these"
        fi
        ;;
    test)
        workers=$(count_workers "$@")
        if [ "$workers" -gt 1 ]; then
            say "kernels are compiled first, then $workers processes test side by side"
            "$bin/python" -m tests.warm_up "$workers"
            set -- -n "$workers" --dist loadgroup "$@"
        fi
        # A missing dolfinx or mpirun must fail here, not be skipped.
        FRAGFIELD_REQUIRE_ALL=1 exec "$bin/python" -m pytest "$@"
        ;;
    lint)
        status=0
        for check in "ruff check" "ruff format --check" mypy lint-imports; do
            say "$check"
            # shellcheck disable=SC2086  # a command and its arguments
            set -- $check
            tool=$1
            shift
            "$bin/$tool" "$@" || status=1
        done
        say "vocabulary"
        "$bin/python" -m tests.vocabulary || status=1
        exit "$status"
        ;;
    attack) exec "$bin/python" -m tests.attack "$@" ;;
    validate)
        "$bin/python" -m pytest -m slow
        exec "$bin/python" -m validation "$@"
        ;;
    bench) exec "$bin/python" -m benchmarks "$@" ;;
    docs)
        if [ "${1:-}" = pictures ]; then
            shift
            "$bin/python" docs/hooks/first_page.py
        fi
        "$bin/python" -m mkdocs build --strict "$@"
        say "the documentation is build/docs/index.html"
        ;;
esac
