"""The version of fragfield_base, and that this distribution needs the flight of the same."""

from __future__ import annotations

import runpy
from pathlib import Path

from setuptools import setup

HERE = Path(__file__).parent
VERSION = runpy.run_path(str(HERE / "fragfield_base" / "version.py"))["__version__"]
LINES = [
    line.partition("#")[0].strip() for line in (HERE / "dependencies.txt").read_text(encoding="utf-8").splitlines()
]
setup(version=VERSION, install_requires=[f"fragfield-flight=={VERSION}", *filter(None, LINES)])
