"""What a fleet is set up with: keys, names, passwords, maps, ports. Without a network."""

from concurrent.futures import ThreadPoolExecutor

import pytest

from robotont_fleet import zenoh_keys as keys
from robotont_fleet.fleet_page import arguments, read_ground
from robotont_fleet.zenoh_setup import add_users, read_users, router_settings
from robotont_teleop.web.page_setup import SetUpError


@pytest.mark.parametrize("name", ["", "*", "a/b", "r1/**", "-r", "ä", "r" * 42, "teacher", "Teacher"])
def test_a_name_that_is_no_part_of_a_key_or_the_teachers_is_refused(name):
    with pytest.raises(ValueError, match="allowed"):
        keys.check_name(name)


@pytest.mark.parametrize("router", ["", "192.168.1.5", "192.168.1.5:7447", "tcp/192.168.1.5"])
def test_a_router_that_is_no_endpoint_is_refused(router):
    with pytest.raises(ValueError, match="allowed: tcp/ADDRESS:7447"):
        keys.check_router(router)
    keys.check_router("tcp/192.168.1.5:7447")
    keys.check_router("tcp/[fe80::1]:7447#iface=eth0")


def test_each_robot_gets_its_own_keys_only(tmp_path):
    users = add_users(tmp_path / "users", ["order", "r2"])
    assert read_users(tmp_path / "users") == add_users(tmp_path / "users", ["r2"]) == users
    access = router_settings(7447, tmp_path / "users")["access_control"]
    rules = {rule["id"]: rule["key_exprs"] for rule in access["rules"]}
    assert rules["teacher"] == ["**"]
    assert all("/order/" in key for key in rules["order"])
    assert access["default_permission"] == "deny"
    with pytest.raises(ValueError, match=r"other: found no password of the page \(teacher\), allowed: .*--add"):
        router_settings(7447, tmp_path / "other")
    (tmp_path / "users").chmod(0o644)
    with pytest.raises(ValueError, match="600"):
        read_users(tmp_path / "users")


def test_robots_that_are_added_at_once_all_have_their_passwords(tmp_path):
    with ThreadPoolExecutor(8) as starts:
        list(starts.map(lambda number: add_users(tmp_path / "users", [f"r{number}"]), range(40)))
    assert set(read_users(tmp_path / "users")) == {"teacher", *(f"r{number}" for number in range(40))}


@pytest.mark.parametrize("content, words", [
    (b"r1:abcdefgh\nno colon", "users: found no colon in line 2, allowed: NAME:PASSWORD"),
    (b"\xff:x", None), (b"x" * 10 ** 6, "it has more than"), (b"", None)])
def test_passwords_of_any_content_are_read_or_refused_with_words(tmp_path, content, words):
    (tmp_path / "users").write_bytes(content)
    (tmp_path / "users").chmod(0o600)
    if words is None:
        assert len(read_users(tmp_path / "users")) == bool(content)
    else:
        with pytest.raises((ValueError, OSError), match=words):
            read_users(tmp_path / "users")


@pytest.mark.parametrize("yaml, image, words", [
    ("resolution: 1\n", b"", "found no 'image'"),
    ("image: a.pgm\nresolution: 0.1\norigin: 3\n", b"P5\n1 1\n255\n0", "allowed: a map of map_server"),
    ("image: a.pgm\nresolution: 0.1\norigin: [0, 0, 1]\n", b"P5\n1 1\n255\n0", "found a turned map"),
    ("image: a.pgm\nresolution: 0.1\norigin: [.inf, 0, 0]\n", b"P5\n1 1\n255\n0", "without a resolution or a place"),
    ("image: a.pgm\nresolution: 1.0e+308\norigin: [0, 0, 0]\n", b"P5\n9 9\n255\n" + bytes(81), "without a resolution"),
    ("image: a.pgm\nresolution: 0.1\norigin: [0, 0, 0]\n", b"P5\n100000 100000\n255\n0", "decompression bomb"),
    ("image: .\n", b"", "it is no file")])
def test_a_map_that_is_none_is_refused_with_words(tmp_path, yaml, image, words):
    (tmp_path / "m.yaml").write_bytes(yaml.encode("latin-1"))
    (tmp_path / "a.pgm").write_bytes(image)
    with pytest.raises(SetUpError) as raised:
        read_ground(tmp_path / "m.yaml")
    assert str(raised.value).startswith(f"--map {tmp_path}/m.yaml: ")
    assert words in str(raised.value)


def test_a_port_that_is_none_is_refused(capsys):
    """It would be taken for another: the page of port 99999999 was at 57599."""
    with pytest.raises(SystemExit):
        arguments(["--port", "65536"])
    assert "--port: found '65536', allowed: 0 to 65535" in capsys.readouterr().err
    assert arguments(["--port", "0"]).port == 0
