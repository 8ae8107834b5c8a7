"""Snapshots of a tube and of a pair of tubes, which most tests of the break-up read."""

from __future__ import annotations

import pytest

from tests.transition.synthetic import Tube


@pytest.fixture(scope="session")
def snapshot(tmp_path_factory):
    return Tube().read(tmp_path_factory.mktemp("burst") / "burst_snapshot.h5")


@pytest.fixture(scope="session")
def pair(tmp_path_factory):
    tube = Tube(around=24, axial=20, places=((0.0, 0.0, 0.0), (0.2, 0.0, 0.0)))
    return tube.read(tmp_path_factory.mktemp("burst") / "pair.h5")
