"""What leaves the machine with a report holds no secrets, and everything else."""

import pytest

from robotont_operations.privacy import clean_parameters, clean_text


@pytest.mark.parametrize("text", [
    "password=hunter22", "wifi_password: hunter22", 'token = "hunter22"', "open http://robot:8080/?token=hunter22&x=1",
    "http://me:hunter22@robot/", "Authorization: Bearer hunter22hunter22", "API_KEY='hunter22'", '{"psk": "hunter22"}',
    "-----BEGIN RSA PRIVATE KEY-----\nhunter22\n-----END RSA PRIVATE KEY-----",
])
def test_secrets_are_left_out(text):
    cleaned = clean_text(f"before {text} after")
    assert "hunter22" not in cleaned
    assert "(removed)" in cleaned
    assert cleaned.startswith("before ")
    assert cleaned.endswith(" after")


@pytest.mark.parametrize("text", ["port: /dev/robotont", "http://10.77.0.1:11311/", "-18.90:0.00:18.90;1050",
                                  "[WARN] 3 lines dropped: check cable", "key: value"])
def test_the_rest_stays(text):
    assert clean_text(text) == text


def test_parameters():
    given = {"web": {"token": "hunter22", "port": 8080, "users": [{"password": 22}]}, "use_token": True}
    assert clean_parameters(given) == {
        "web": {"token": "(removed)", "port": 8080, "users": [{"password": "(removed)"}]}, "use_token": True}
