"""Who is refused: no token, a wrong one, foreign origins and hosts, and requests that are too large."""

from __future__ import annotations

import asyncio

import pytest

from fragfield.app.server import MOST_UPLOADED, guarded

TOKEN, HOST = "a" * 32, "127.0.0.1:8123"


class _Pages:
    """Stands for the pages: reads the whole request."""

    def __init__(self) -> None:
        self.taken = 0
        self.reached = False

    async def __call__(self, scope, receive, send):
        self.reached = True
        if scope["type"] == "http":
            while (message := await receive())["type"] == "http.request":
                self.taken += len(message["body"])
                if not message.get("more_body"):
                    break
            await send({"type": "http.response.start", "status": 200, "headers": []})
            await send({"type": "http.response.body", "body": b"page"})


def ask(*, kind="http", query="", headers=None, body=(b"",), hosts=()):
    """What the guard answers: the messages sent, and the pages behind it."""
    pages, sent, parts = _Pages(), [], list(body)
    given = {"host": HOST, **(headers or {})}
    scope = {
        "type": kind, "path": "/round", "query_string": query.encode(),
        "headers": [(name.encode(), value.encode("latin-1")) for name, value in given.items()],
    }  # fmt: skip

    async def receive():
        if kind == "websocket":
            return {"type": "websocket.connect"}
        return {"type": "http.request", "body": parts.pop(0), "more_body": bool(parts)}

    async def send(message):
        sent.append(message)

    asyncio.run(guarded(pages, token=TOKEN, port=8123, hosts=hosts)(scope, receive, send))
    return sent, pages


COOKIE = {"cookie": f"fragfield-8123={TOKEN}"}


@pytest.mark.parametrize(
    ("query", "headers"),
    [
        ("", {}),
        ("token=wrong", {}),
        ("token=", COOKIE | {"cookie": "fragfield-8123=wrong"}),
        ("", {"cookie": f"fragfield-9999={TOKEN}"}),
        ("", {"cookie": "\xff;;;="}),
        ("", COOKIE | {"origin": "http://evil.example"}),
        ("", COOKIE | {"origin": "null"}),
        ("", COOKIE | {"origin": "http://127.0.0.1:9999"}),
        ("", COOKIE | {"host": "evil.example:8123"}),
        ("", COOKIE | {"host": ""}),
    ],
)
@pytest.mark.parametrize("kind", ["http", "websocket"])
def test_refused(kind, query, headers):
    sent, pages = ask(kind=kind, query=query, headers=headers)
    assert not pages.reached
    assert sent[0]["status"] == (400 if "host" in headers else 403)
    assert kind == "http" or sent[0]["type"] == "websocket.http.response.start"


def test_the_token_goes_into_a_cookie_and_out_of_the_address():
    sent, pages = ask(query=f"case=a%20b.toml&token={TOKEN}")
    headers = {name.decode(): value.decode() for name, value in sent[0]["headers"]}
    assert (sent[0]["status"], headers["location"]) == (303, "/round?case=a+b.toml")
    assert all(word in headers["set-cookie"] for word in (TOKEN, "HttpOnly", "SameSite=lax"))
    assert not pages.reached


def test_own_pages_are_answered_and_reach_no_other_machine():
    sent, pages = ask(headers=COOKIE | {"origin": f"http://{HOST}"})
    headers = dict(sent[0]["headers"])
    assert (pages.reached, sent[0]["status"]) == (True, 200)
    assert b"connect-src 'self'" in headers[b"content-security-policy"]
    assert headers[b"x-content-type-options"] == b"nosniff"


def test_in_a_container_other_hosts_may_be_named_but_need_the_token():
    assert ask(headers=COOKIE | {"host": "container:80"}, hosts=("*",))[1].reached
    assert not ask(headers={"host": "container:80"}, hosts=("*",))[1].reached


@pytest.mark.parametrize("length", [str(1 << 30), "9" * 400, "-1", "x"])
def test_an_upload_that_says_it_is_huge_is_refused_at_once(length):
    sent, pages = ask(headers=COOKIE | {"content-length": length})
    assert (sent[0]["status"], pages.reached) == (413, False)


def test_an_upload_that_does_not_say_so_is_cut_off():
    part = b"x" * (1 << 22)
    _, pages = ask(headers=COOKIE, body=[part] * (2 * MOST_UPLOADED // len(part)))
    assert pages.taken <= MOST_UPLOADED
