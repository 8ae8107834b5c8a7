"""One writer at a time in a folder, and file systems that have no locks."""

from __future__ import annotations

import errno
import fcntl

import pytest

from fragfield_base.errors import InputError
from fragfield_base.locking import has_locks, locked


def test_a_folder_is_held_by_one(tmp_path):
    with locked(tmp_path, InputError):
        assert has_locks(tmp_path)
        with pytest.raises(InputError, match=r"another command .*is writing into it"), locked(tmp_path, InputError):
            pass
    with locked(tmp_path, InputError):
        pass


@pytest.mark.parametrize("code", [errno.ENOLCK, errno.EOPNOTSUPP, 524])  # Lustre, NFS; 524: DVS of Cray
@pytest.mark.parametrize("warn", [True, False])
def test_a_file_system_without_locks_is_used_and_said(tmp_path, monkeypatch, caplog, code, warn):
    def refused(*_):
        raise OSError(code, "No locks available")

    monkeypatch.setattr(fcntl, "flock", refused)
    with locked(tmp_path, InputError, warn=warn):
        assert not has_locks(tmp_path)
    assert ("this file system has no locks" in caplog.text) == warn
