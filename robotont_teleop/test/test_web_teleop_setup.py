"""What the page's node makes of its parameters before it serves: certificate, QR code, names."""

import contextlib
import socket
import ssl
import subprocess
from unittest import mock

import numpy as np
import pytest
from PIL import Image

from robotont_teleop.web.access import Access
from robotont_teleop.web.page_setup import (
    LIGHT_ON_BLACK,
    RESET,
    SetUpError,
    host_names,
    invitation,
    make_tls,
    own_address,
)
from robotont_teleop.web.web_teleop_node import report
from robotont_testing.harness import tool_module, wait_for

TOKEN = "dGhlIHRva2Vu-_123456"
ACCESS = Access(TOKEN, file="/home/robot/token")


@pytest.mark.parametrize("encryption, words", [(["-nodes"], ""), (["-passout", "pass:secret"], "key is encrypted")])
def test_a_certificate_is_taken_but_none_whose_key_is_asked_for_on_the_terminal(tmp_path, encryption, words):
    file = tmp_path / "page.pem"
    subprocess.run(["openssl", "req", "-x509", "-newkey", "rsa:2048", *encryption, "-subj", "/CN=robot",
                    "-keyout", file, "-out", file], check=True, stdin=subprocess.DEVNULL, capture_output=True)
    with pytest.raises(SetUpError, match=words) if words else contextlib.nullcontext():
        assert make_tls(str(file)).minimum_version >= ssl.TLSVersion.TLSv1_2
    with pytest.raises(SetUpError, match="No such file"):
        make_tls(str(tmp_path / "other.pem"))


HALVES = {"█": (255, 255), "▀": (255, 0), "▄": (0, 255), " ": (0, 0)}  # brightness of upper and lower half


def read_qr(lines):
    """Text of the QR code among the lines of a dark terminal, as a phone's camera reads it."""
    rows = [line.replace(LIGHT_ON_BLACK, "").replace(RESET, "") for line in lines]
    rows = [row for row in rows if row and set(row) <= set(HALVES)]
    modules = [[HALVES[sign][half] for sign in row] for row in rows for half in (0, 1)]
    picture = np.kron(np.pad(np.array(modules, np.uint8), 4), np.ones((6, 6), np.uint8))
    found, = tool_module("zxingcpp").read_barcodes(Image.fromarray(picture, "L"))
    return found.text


def test_the_qr_code_on_the_terminal_leads_in():
    url = "https://a-rather-long-name-of-a-robot.in-a-network.example:8100/"
    lines = invitation(url, ACCESS, terminal=True)
    assert all(line.startswith(LIGHT_ON_BLACK) and line.endswith(RESET) for line in lines if "█" in line)
    assert read_qr(lines) == f"{url}#token={TOKEN}"
    assert max(map(len, lines)) <= 100


def test_without_a_terminal_the_token_stays_in_its_file():
    """What is printed there goes into the journal, and into a report."""
    assert invitation("http://10.0.0.5:8100/", ACCESS, terminal=False) == [
        "token, asked for once: cat /home/robot/token (sudo cat, if another user's)"]
    assert invitation("http://127.0.0.1:8100/", Access(None), terminal=True) == []


def test_who_may_read_the_diagnostics_is_told_how_to_get_in_but_not_the_token():
    server = mock.Mock(pages=[], seat=mock.Mock(held=()), access=ACCESS)
    words = report(server, "http://10.0.0.5:8100/")[1]
    assert words == "http://10.0.0.5:8100/, open pages: 0; its token: in /home/robot/token"
    server.access = Access(None)
    assert "token" not in report(server, "http://127.0.0.1:8100/")[1]


def test_names_under_which_browsers_may_come():
    with mock.patch("socket.getfqdn", return_value="Robot7.lab.example"), \
            mock.patch("socket.gethostname", return_value="robot7"):
        names = host_names(" Robot.Example ,second")
        wait_for(lambda: "robot7.lab.example" in names, "the full name")
    assert names == {"robot.example", "second", "robot7", "robot7.local", "robot7.lab.example"}


def test_a_robot_on_its_own_access_point_without_a_default_route_shows_its_address(tmp_path, monkeypatch):
    (tmp_path / "hostname").write_text("#!/bin/sh\necho '10.42.0.1 192.168.7.2 '\n")
    (tmp_path / "hostname").chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=":")
    monkeypatch.setattr(socket.socket, "connect", mock.Mock(side_effect=OSError("Network is unreachable")))
    assert own_address() == "10.42.0.1"
