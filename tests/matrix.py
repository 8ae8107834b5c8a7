"""The tests on Debian 12, Debian 13 and PyPI's wheel of dolfinx: `sh setup.sh matrix [NAME...] [ARGUMENT...]`.

Each runs on a copy of the sources, in its own environment in `build/matrix`: a chroot made by debootstrap, which needs
root, with the pinned packages; for the wheel a virtual environment of the newest Python here that takes it, with the
newest packages. The last line of pytest goes into `build/matrix/NAME.txt`; arguments go to pytest.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from datetime import UTC, datetime
from pathlib import Path

__all__ = ["main", "wheel_python"]

ROOT = Path(__file__).resolve().parent.parent
PLACE = ROOT / "build" / "matrix"
RELEASES = {"debian-12": "bookworm", "debian-13": "trixie"}
NAMES = (*RELEASES, "wheel")
_PYTHONS = ("python3.14", "python3.13", "python3.12", "python3")
_TAKES = "import platform, sys; sys.exit(not (sys.version_info >= (3, 12) and platform.machine() == 'x86_64'))"
_EXTRAS = "dolfinx,app,terrain,tables,drawings,cluster,test"
_CERTIFICATES = Path("/etc/ssl/certs/ca-certificates.crt")


def _sources(folder: Path) -> None:
    """A copy of what git knows here, without what was built."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    for name in filter(None, listed.split("\0")):
        if (ROOT / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(ROOT / name, folder / name)


def wheel_python() -> str | None:
    """The newest Python here that takes the wheel."""
    pythons = [path for name in _PYTHONS if (path := shutil.which(name))]
    pythons += map(str, sorted(Path.home().glob(".pyenv/versions/3.1[2-9]*/bin/python3"), reverse=True))
    fit = (
        one for one in pythons if subprocess.run([one, "-c", _TAKES], capture_output=True, check=False).returncode == 0
    )
    return next(fit, None)


def _in_wheel(arguments: list[str]) -> list[str]:
    found = wheel_python()
    if found is None:
        sys.stderr.write("matrix: wheel: no Python of 3.12 or newer is here\n")
        return []
    place = PLACE / "wheel"
    _sources(place / "fragfield")
    python = place / "venv" / "bin" / "python"
    subprocess.run([found, "-m", "venv", place / "venv"], check=True)
    packages = ["-e", "./flight", "-e", f".[{_EXTRAS}]"]
    subprocess.run([python, "-m", "pip", "install", "-q", *packages], cwd=place / "fragfield", check=True)
    return [str(python), "-m", "pytest", *arguments]


def _in_debian(name: str, arguments: list[str]) -> list[str]:
    place = PLACE / name
    if os.geteuid() or shutil.which("debootstrap") is None:
        sys.stderr.write(f"matrix: {name}: needs root and debootstrap\n")
        return []
    if not (place / "etc" / "debian_version").exists():
        subprocess.run(["debootstrap", "--variant=minbase", RELEASES[name], place], check=True)
        subprocess.run(["chroot", place, "apt-get", "-q", "-y", "install", "ca-certificates"], check=True)
    for source in (Path("/etc/resolv.conf"), _CERTIFICATES):  # of this machine, with those of its proxy
        shutil.copy(source, place / source.relative_to("/"))
    for kind, folder in (("proc", "proc"), ("sysfs", "sys")):
        if not os.path.ismount(place / folder):
            subprocess.run(["mount", "-t", kind, kind, place / folder], check=True)
    if not os.path.ismount(place / "dev"):
        subprocess.run(["mount", "--rbind", "/dev", place / "dev"], check=True)
    _sources(place / "root" / "fragfield")
    words = " ".join(f"'{one}'" for one in arguments)
    return ["chroot", str(place), "sh", "-c", f"cd /root/fragfield && sh setup.sh test {words}"]


def main(arguments: list[str]) -> int:
    """Run the tests in the environments named, all by default; the largest exit code, 1 where one cannot be made."""
    names = [one for one in arguments if one in NAMES] or list(NAMES)
    rest = [one for one in arguments if one not in NAMES]
    codes = []
    for name in names:
        command = _in_wheel(rest) if name == "wheel" else _in_debian(name, rest)
        if not command:
            codes.append(1)
            continue
        folder = PLACE / "wheel" / "fragfield" if name == "wheel" else ROOT
        variables = {one: value for one, value in os.environ.items() if one not in ("PYTHONPATH", "VIRTUAL_ENV")}
        with subprocess.Popen(command, cwd=folder, env=variables, stdout=subprocess.PIPE, text=True) as process:
            assert process.stdout is not None
            last = ""
            for line in process.stdout:
                sys.stdout.write(line)
                last = line.strip() if re.search(r"\d+ (passed|failed|error)", line) else last
        (PLACE / f"{name}.txt").write_text(f"{datetime.now(UTC):%Y-%m-%d} {name}: {last}\n")
        codes.append(process.returncode)
    print(*(path.read_text().strip() for path in sorted(PLACE.glob("*.txt"))), sep="\n")
    return max(codes)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
