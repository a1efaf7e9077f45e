"""What the page's node makes of its parameters before it serves: certificate, QR code, names."""

import ssl
import subprocess

import pytest
from qr_on_terminal import read_qr

from robotont_teleop.web_teleop_node import LIGHT_ON_BLACK, RESET, SetUpError, host_names, invitation, make_tls

TOKEN = "dGhlIHRva2Vu-_123456"


def openssl(*words):
    subprocess.run(["openssl", *map(str, words)], check=True, stdin=subprocess.DEVNULL, capture_output=True)


@pytest.fixture(scope="module")
def certificate(tmp_path_factory):
    """(certificate, key): signed by itself."""
    folder = tmp_path_factory.mktemp("certificate")
    paths = folder / "cert.pem", folder / "key.pem"
    openssl("req", "-x509", "-newkey", "rsa:2048", "-nodes", "-subj", "/CN=robot", "-out", paths[0],
            "-keyout", paths[1])
    return paths


def test_the_users_certificate(certificate):
    context = make_tls(*map(str, certificate))
    assert context.minimum_version >= ssl.TLSVersion.TLSv1_2
    assert make_tls("", "") is None


def test_wrong_certificates_are_named(certificate, tmp_path):
    cert, key = certificate
    encrypted, other = tmp_path / "encrypted.pem", tmp_path / "other.pem"
    openssl("pkey", "-in", key, "-aes256", "-passout", "pass:secret", "-out", encrypted)
    openssl("genpkey", "-algorithm", "RSA", "-out", other)
    for paths, words in (((tmp_path / "none.pem", key), "No such file"), ((cert, encrypted), "key is encrypted"),
                         ((cert, other), "MISMATCH"), ((key, key), "~certificate")):
        with pytest.raises(SetUpError) as refusal:
            make_tls(*map(str, paths))
        assert words.lower() in str(refusal.value).lower()


@pytest.mark.parametrize("url", ["http://10.0.0.5:8100/", "https://[2001:db8::12:3]:65535/",
                                 "https://a-rather-long-name-of-a-robot.in-a-network.example:8100/"])
@pytest.mark.parametrize("colours", [False, True])
def test_the_qr_code_on_the_terminal_leads_in(url, colours):
    lines = invitation(url, TOKEN, colours)
    assert url in lines[0]
    assert all(line.startswith(LIGHT_ON_BLACK) and line.endswith(RESET) for line in lines if "█" in line) or not colours
    assert read_qr(lines) == f"{url}#token={TOKEN}"
    assert max(map(len, lines)) <= 100


def test_without_a_token_there_is_no_qr_code():
    lines = invitation("http://127.0.0.1:8100/", None)
    assert not any("█" in line or "token" in line for line in lines)


def test_names_under_which_browsers_may_come():
    names = host_names(" Robot.Example ,second")
    assert {"robot.example", "second"} <= set(names)
    assert "" not in names
