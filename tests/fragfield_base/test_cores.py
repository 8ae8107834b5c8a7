"""Cores that a process may use: by affinity, and by the quotas of control groups."""

from __future__ import annotations

import errno
import fcntl
import os

import pytest

from fragfield_base import cores as module
from fragfield_base.errors import InputError
from fragfield_base.writing import locked


def written(folder, files):
    for name, text in files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return folder


@pytest.mark.parametrize(
    ("groups", "files", "granted"),
    [
        ("0::/\n", {"cpu.max": "max 100000\n"}, None),
        ("0::/\n", {"cpu.max": "250000 100000\n"}, 2.5),  # docker run --cpus 2.5, groups of its own
        ("0::/pod/one\n", {"pod/cpu.max": "150000 100000\n", "pod/one/cpu.max": "max 100000\n"}, 1.5),
        ("0::/pod/one\n", {"pod/cpu.max": "400000 100000\n", "pod/one/cpu.max": "200000 100000\n"}, 2.0),
        ("0::/../../host/one\n", {"cpu.max": "300000 100000\n"}, 3.0),  # names of the host's, which are not there
        ("0::/\n", {"cpu.max": "nonsense"}, None),
        ("0::/\n", {"cpu.max": "100000 0\n"}, None),
        ("", {}, None),
    ],
)  # fmt: skip
def test_quota_of_control_groups(tmp_path, groups, files, granted):
    mounted = written(tmp_path / "mounted", files)
    (tmp_path / "groups").write_text(groups)
    assert module.quota.__wrapped__(tmp_path / "groups", mounted) == granted


def test_no_control_groups(tmp_path):
    assert module.quota.__wrapped__(tmp_path / "none", tmp_path) is None


@pytest.mark.parametrize(
    ("allowed", "granted", "cores"), [(8, None, 8), (8, 2.5, 2), (8, 0.5, 1), (2, 16.0, 2), (1, 1.0, 1)]
)
def test_cores_are_the_fewer_of_both_and_at_least_one(monkeypatch, allowed, granted, cores):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(allowed)))
    monkeypatch.setattr(module, "quota", lambda: granted)
    assert module.cores() == cores


# --- One writer at a time in a folder, and file systems that have no locks


def test_a_folder_is_held_by_one(tmp_path):
    said = "another command is writing into it"
    with locked(tmp_path, InputError), pytest.raises(InputError, match=said), locked(tmp_path, InputError):
        pass
    with locked(tmp_path, InputError):
        pass


@pytest.mark.parametrize("code", [errno.ENOLCK, errno.EOPNOTSUPP, 524])  # Lustre, NFS; 524: DVS of Cray
def test_a_file_system_without_locks_is_used_and_said(tmp_path, monkeypatch, caplog, code):
    def refused(*_):
        raise OSError(code, "No locks available")

    monkeypatch.setattr(fcntl, "flock", refused)
    with locked(tmp_path, InputError):
        pass
    assert "this file system has no locks" in caplog.text
