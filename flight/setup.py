"""fragfield_base is beside this folder in the repository, and within the source archive."""

from __future__ import annotations

import runpy
import shutil
from pathlib import Path

from setuptools import setup
from setuptools.command.sdist import sdist

INSIDE, BESIDE = Path("fragfield_base"), Path("../fragfield_base")


class SourceArchive(sdist):
    """With fragfield_base inside, which its own list of files would put outside the archive."""

    def make_release_tree(self, base_dir: str, files: list[str]) -> None:
        """Copy what belongs to the archive."""
        super().make_release_tree(base_dir, [name for name in files if not name.startswith("..")])
        if not INSIDE.exists():
            shutil.copytree(BESIDE, Path(base_dir, INSIDE), ignore=shutil.ignore_patterns("__pycache__"))


base = INSIDE if INSIDE.exists() else BESIDE
setup(
    version=runpy.run_path(str(base / "version.py"))["__version__"],
    script_name="setup.py",  # which is then no module of flight
    package_dir={"flight": ".", "fragfield_base": str(base)},
    cmdclass={"sdist": SourceArchive},
)
