"""Who comes in to the page's server, and what it gives out."""

import pytest
from tornado.httpclient import HTTPClientError
from web_client import TOKEN

FORM = {"Content_Type": "application/x-www-form-urlencoded"}


def test_without_a_token_one_gets_the_login_page_only(guarded):
    status, _, body = guarded.request("GET", "/")
    assert (status, b'name="token"' in body, b'id="stop"' in body) == (401, True, False)
    assert guarded.request("GET", "/login")[1]["Location"] == "/", "its words are for a wrong token"
    for path in ("/map.png", "/camera.jpg", "/metrics", "/?token=" + TOKEN):
        assert guarded.request("GET", path)[0] == 401
    with pytest.raises(HTTPClientError, match="401"):
        guarded.page()


def test_prometheus_shows_the_token_as_a_bearer_token(guarded):
    status, headers, body = guarded.request("GET", "/metrics", Authorization="Bearer " + TOKEN)
    assert (status, headers["Content-Type"]) == (200, "text/plain; version=0.0.4; charset=utf-8")
    assert b'robotont_diagnostic{key="level",robot="r1",task="link"} 0.0\n' in body
    assert guarded.request("GET", "/metrics", Authorization="Bearer wrong")[0] == 401


def test_the_token_gives_a_cookie_that_opens_and_no_other_one(guarded):
    origin = f"http://127.0.0.1:{guarded.port}"
    status, headers, _ = guarded.request("POST", "/login", "token=" + TOKEN, Origin=origin, **FORM)
    cookie = headers["Set-Cookie"]
    assert status == 303
    assert all(word in cookie for word in ("HttpOnly", "SameSite=Strict", "Path=/"))
    assert TOKEN not in str(headers)
    value = cookie.partition(";")[0]
    assert b'id="stop"' in guarded.request("GET", "/", Cookie=value)[2]
    assert guarded.ready_page(Cookie=value)
    with pytest.raises(HTTPClientError, match="401"):
        guarded.page(Cookie=value[:-1] + "x")
    assert guarded.request("POST", "/login", "token=wrong", Origin=origin, **FORM)[0] == 401


def test_foreign_origins(served, guarded):
    for origin in (None, "http://evil.example"):
        with pytest.raises(HTTPClientError, match="403"):
            served.page(Origin=origin)
    assert guarded.request("POST", "/login", "token=" + TOKEN, Origin="http://evil.example", **FORM)[0] == 403
    assert guarded.request("POST", "/login", "token=" + TOKEN, **FORM)[0] == 403


def test_foreign_hosts(served):
    for host in ("evil.example", "192.168.1.1"):
        assert served.request("GET", "/", Host=host)[0] == 403
        with pytest.raises(HTTPClientError, match="403"):
            served.page(Host=host, Origin=f"http://{host}")
    for host in ("localhost", "robot.local:8100", "127.0.0.1"):
        assert served.request("GET", "/", Host=host)[0] == 200


def test_headers(served):
    _, headers, _ = served.request("GET", "/")
    policy = headers["Content-Security-Policy"]
    assert policy.startswith("default-src 'none'; script-src 'self';")
    assert "unsafe" not in policy
    assert "frame-ancestors 'none'" in policy
    assert headers["X-Content-Type-Options"] == "nosniff"
    assert "Server" not in headers


def test_no_other_files(served):
    for path in ("/../setup.py", "/..%2fsetup.py", "/web/", "/app.py", "/%00", "//etc/passwd", "/" + "a" * 4000):
        assert served.request("GET", path)[0] == 404, path
