"""Token, cookie, Host and Origin."""

import stat
from concurrent.futures import ThreadPoolExecutor

import pytest

from robotont_teleop.web.access import Access, host_allowed, is_loopback, origin_allowed, read_or_make_token


@pytest.mark.parametrize("token, mode, words", [
    ("a-token-of-its-own", 0o644, "found mode 644, allowed: 600"),
    ("fifteen-letters", 0o600, "found 15 characters, allowed: 16"),
    ("\0" * 23, 0o600, "found 23 characters"), ("two words in a line", 0o600, "without blanks")])
def test_a_token_that_others_can_read_or_that_is_none_is_refused(tmp_path, token, mode, words):
    path = tmp_path / "token"
    path.write_text(token)
    path.chmod(mode)
    with pytest.raises(ValueError, match=words):
        read_or_make_token(path)


@pytest.mark.parametrize("left", [False, True])
def test_all_who_start_at_once_have_the_same_token_which_is_their_owners_only(tmp_path, left):
    """left: an empty file, as after a loss of power."""
    with ThreadPoolExecutor(16) as starts:
        for number in range(50):
            path = tmp_path / str(number) / "token"
            if left:
                path.parent.mkdir()
                path.touch(0o644)
            token, *others = set(starts.map(read_or_make_token, [path] * 16))
            assert token == path.read_text().strip()
            assert (len(token) >= 20, others, stat.S_IMODE(path.stat().st_mode)) == (True, [], 0o600)


def test_the_right_token_and_its_cookie_come_in():
    access = Access("secret-secret")
    assert access.knows("secret-secret")
    assert not access.knows("wrong")
    assert access.admits(access.cookie)
    assert "secret-secret" not in access.cookie
    assert Access("secret-secret").admits(access.cookie), "a restart of the server must not ask again"
    assert not Access("another-secret").admits(access.cookie)
    assert not any(map(access.admits, (None, "", "secret-secret", "ä", "0" * 64)))


@pytest.mark.parametrize("host, own, names, allowed", [
    ("127.0.0.1:8100", "127.0.0.1", (), True), ("localhost:8100", "127.0.0.1", (), True),
    ("[::1]:8100", "::1", (), True), ("localhost", "192.168.1.5", (), False),
    ("192.168.1.5:8100", "192.168.1.5", (), True), ("192.168.1.5:8100", "::ffff:192.168.1.5", (), True),
    ("robot.local:8100", "192.168.1.5", ("robot.local",), True),
    ("ROBOT.local:8100", "192.168.1.5", ("robot.local",), True),
    ("evil.example:8100", "127.0.0.1", ("robot.local",), False), ("localhost.evil.example", "127.0.0.1", (), False),
    (None, "127.0.0.1", (), False), ("[::1", "127.0.0.1", (), False)])
def test_hosts(host, own, names, allowed):
    assert host_allowed(host, own, names) is allowed


@pytest.mark.parametrize("origin, allowed", [
    ("http://localhost:8100", True), ("https://localhost:8100", False), ("http://localhost", False),
    ("http://evil.example", False), ("null", False), ("", False), (None, False)])
def test_origins(origin, allowed):
    assert origin_allowed(origin, "http", "localhost:8100") is allowed


def test_addresses_that_only_this_computer_reaches():
    assert [is_loopback(address) for address in ("127.0.0.1", "localhost", "::1", "0.0.0.0", "", "10.0.0.1")] \
        == [True, True, True, False, False, False]
