"""What leaves the machine with a report holds no secrets, and everything else."""

import io

import pytest
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue
from rosgraph_msgs.msg import Log

from robotont_operations.privacy import clean_message, clean_parameters, clean_text, may_hold_secrets

TEXTS = [
    "password=hunter22", "wifi_password: hunter22", 'token = "hunter22"', "open http://robot:8080/?token=hunter22&x=1",
    "http://me:hunter22@robot/", "Authorization: Bearer hunter22hunter22", "API_KEY='hunter22'", '{"psk": "hunter22"}',
    "-----BEGIN RSA PRIVATE KEY-----\nhunter22\n-----END RSA PRIVATE KEY-----",
    "-----BEGIN OPENSSH PRIVATE KEY-----\nhunter22\nand the end of the log", "Bearer hunter22hunter22",
    "token, asked for once: hunter22", "mount --password hunter22", "connect --pass hunter22", "--key=hunter22",
    "the password is hunter22", "the login is hunter22", "Cookie: robotont_teleop=hunter22; a=hunter22",
    "Set-Cookie: session=hunter22; Path=/", "Authorization: Token hunter22", "Proxy-Authorization: Basic hunter22",
    'Authorization: Digest username="me", response="hunter22"', "X-Auth: hunter22", "access_key: hunter22",
    "pass: hunter22", "DB_PASS=hunter22", "dbPass = hunter22", "pwd: hunter22", "auth: hunter22", "key: hunter22",
    "login: hunter22", "password: correct hunter22", "passwords: {alice: hunter22}", "passwords:\n  alice: hunter22",
    "  psk: |\n    correct\n    hunter22", "<password>hunter22</password>", "{'secretKey': b'hunter22'}",
    "session=hunter22", "credentials alice/hunter22", "password 'hunter22' refused", "client_secret_1=hunter22",
]
NAMES = ["access_key", "pass", "pwd", "auth", "key", "login", "password", "passwords", "api-key", "apiKey", "DB_PASS",
         "wifi_psk", "token", "tokens", "client_secret", "cookie", "session", "private_key", "pin_code", "userLogin"]
HARMLESS = ["keyboard", "monkey", "KeyError", "MONKEY", "bypass", "compass", "author", "passes", "keypoints",
            "keys_held", "loginctl", "authored_by", "token_file", "password_folder", "passed", "pwm", "passive"]


@pytest.mark.parametrize("text", TEXTS)
def test_secrets_are_left_out(text):
    cleaned = clean_text(f"before {text}\nafter".replace("before  ", "before:\n  "))
    assert "hunter22" not in cleaned
    assert "(removed)" in cleaned
    assert cleaned.startswith("before")
    assert cleaned.endswith("\nafter") or "and the end" in text


@pytest.mark.parametrize("text", [
    "port: /dev/robotont", "http://10.77.0.1:11311/", "-18.90:0.00:18.90;1050", "[WARN] 3 lines dropped: check cable",
    "    KeyError: 'type'\n    next", "12 passes: all good", "wrong token\n  next line", "session opened for user me",
    "/token_file: /home/me/.ros/x: found mode 644", *(f"{name}: 7\n  below" for name in HARMLESS)])
def test_the_rest_stays(text):
    assert clean_text(text) == text


def test_a_picture_of_the_page_with_its_token():
    picture = "███ ▄▄▄▄▄ █▀ █▄███▄ \n █ █   █ █▄  ▄ ███ \n"
    assert clean_text(f"before\n{picture}after") == "before\n(removed)\n (removed)\nafter"


@pytest.mark.parametrize("name", NAMES)
def test_parameters_with_a_secret(name):
    for value in ("hunter22", 22, ["hunter22"], {"alice": "hunter22"}):
        cleaned = clean_parameters({"node": [{name: value, "port": 8080}]})
        assert cleaned == {"node": [{name: "(removed)", "port": 8080}]}


@pytest.mark.parametrize("name", HARMLESS)
def test_parameters_without(name):
    assert clean_parameters({name: 7, "use_token": True}) == {name: 7, "use_token": True}


def test_values_of_parameters_are_texts():
    assert clean_parameters(["--password hunter22"]) == ["--password (removed)"]


@pytest.mark.parametrize("text", TEXTS)
def test_messages(text):
    values = [KeyValue("wheel", text), KeyValue("wifi pass", "hunter22")]
    for message in (Log(msg=text, topics=["/x"]), DiagnosticArray(status=[DiagnosticStatus(values=values)])):
        data = io.BytesIO()
        message.serialize(data)
        assert may_hold_secrets(data.getvalue())
        clean_message(message)
        assert "hunter22" not in str(message)
        assert "/x" in str(message) or "wheel" in str(message)
