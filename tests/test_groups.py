"""Tests side by side: a file stays with one process, and tests that need several cores are not run two at a time."""

from __future__ import annotations

import pytest

from tests.conftest import WORKER

pytestmark = pytest.mark.skipif(not WORKER, reason="tests run one after the other")


def test_a_file_is_one_group(request):
    """By what xdist adds to a test's name; where it added nothing, each fixture of a file would be made twice."""
    assert request.node.nodeid.endswith("@tests/test_groups.py")


@pytest.mark.cores
def test_what_needs_several_cores_is_one_group(request):
    assert request.node.nodeid.endswith("@cores")
