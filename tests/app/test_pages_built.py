"""Every page is built on the server, of a case and of none, where no browser is there."""

from __future__ import annotations

import pytest

from fragfield.app.document import Session
from fragfield.app.workspace import Workspace
from tests.app.conftest import with_cases

PAGES = ("start", "round", "arrangement", "site", "run", "result")


def test_every_page_is_built(tmp_path):
    pytest.importorskip("nicegui")
    from fastapi.testclient import TestClient

    from fragfield.app.server import application

    case = "m107_pair_site.toml"
    with_cases(tmp_path, case, "m107_pair_site.asc")
    session = Session(Workspace(tmp_path))
    app = application(session, token="t" * 32, port=80)
    with TestClient(app, base_url="http://127.0.0.1:80", cookies={"fragfield-80": "t" * 32}) as client:
        for name in PAGES:
            answer = client.get(f"/{name}", params={} if name == "start" else {"case": case})
            assert answer.status_code == 200, name
            assert "Check and run" in answer.text if name != "start" else case in answer.text, name
        session.open(case).set(("round",), "nonsense")
        for name in PAGES[1:]:
            assert client.get(f"/{name}", params={"case": case}).status_code == 200, name
    log = session.space.state("app.log")
    assert not log.exists() or not log.read_text(encoding="utf-8")
