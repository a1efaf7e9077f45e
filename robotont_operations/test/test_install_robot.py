"""install-robot: what it installs is valid, and is removed to the last file."""

import os
import pwd
import re
import subprocess
from unittest import mock

import pytest
from installing import files, install_robot, need

from robotont_operations import install_robot as install_robot_module
from robotont_operations.installation import FLEET_UNIT, PAGE_UNIT, UNITS, unreadable

SYSTEMD = "etc/systemd/system"


def test_page_and_fleet_start_at_boot_where_they_were_asked_for_in_a_namespace_too(tmp_path):
    units = {name: tmp_path / SYSTEMD / f"robotont-{name}.service" for name in ("page", "fleet")}
    install_robot(tmp_path)
    assert not any(unit.exists() for unit in units.values())
    said = install_robot(tmp_path, "--page", "fleet:=10.0.0.7").stdout
    assert "robotont_teleop_token" in said
    assert "robotont_fleet_password" in said
    assert install_robot(tmp_path).returncode == 0
    for name, words in (("page", "teleop.launch address:=0.0.0.0 "),
                        ("fleet", "fleet.launch router:=tcp/10.0.0.7:7447 ")):
        assert words + f"$ROBOTONT_{name.upper()}_ARGUMENTS\n" in units[name].read_text()
        assert f"\nROBOTONT_{name.upper()}_ARGUMENTS=\n" in (tmp_path / "etc/robotont/robot.conf").read_text()
        assert (tmp_path / SYSTEMD / "multi-user.target.wants" / units[name].name).is_symlink()
        assert install_robot(tmp_path, f"--{name}", "127.0.0.1").returncode == 2
    assert ":8100/ " in said
    assert "phones: http://10.0.0.8:8100/, and once" in install_robot(tmp_path, "--page=10.0.0.8").stdout
    assert "phones: http://10.0.0.8:8100/, and once" in install_robot(tmp_path).stdout  # kept
    configuration = tmp_path / "etc/robotont/robot.conf"
    configuration.write_text(configuration.read_text().replace("PAGE_ARGUMENTS=", "PAGE_ARGUMENTS=web_port:=8200"))
    assert ":8100" not in install_robot(tmp_path, "--page=10.0.0.7").stdout
    assert "teleop.launch address:=10.0.0.7 " in units["page"].read_text()
    install_robot(tmp_path, "--remove")
    assert not any(unit.exists() for unit in units.values())


def test_a_service_of_another_driver_is_kept_beside_each_time(tmp_path):
    theirs = tmp_path / SYSTEMD / "robotont.service"
    theirs.parent.mkdir(parents=True)
    for number in (1, 2):
        theirs.write_text(f"[Service]\nExecStart=/theirs {number}\n")
        said = [install_robot(tmp_path).stdout for _ in range(2)]
        words = f"robotont.service was another's: kept as robotont.service.before{number}\n"
        assert [words in one for one in said] == [True, False]
    install_robot(tmp_path, "--remove")
    kept = [theirs.with_name(f"robotont.service.before{number}").read_text() for number in (1, 2)]
    assert kept == ["[Service]\nExecStart=/theirs 1\n", "[Service]\nExecStart=/theirs 2\n"]
    theirs.write_text(kept[1])  # its name is given back
    wanted = theirs.parent / "multi-user.target.wants" / theirs.name
    wanted.symlink_to(theirs)  # systemctl enable
    assert install_robot(tmp_path, "--remove").stderr == "install-robot: nothing is installed\n"
    assert (theirs.read_text(), wanted.is_symlink()) == (kept[1], True)


@pytest.mark.parametrize("model", [True, False])
def test_without_xacro_the_robot_starts_without_its_model(model, tmp_path, monkeypatch):
    """As on Debian, whose robots take nothing from PyPI."""
    monkeypatch.setattr(install_robot_module.importlib.util, "find_spec", lambda _name: model or None)
    done = install_robot(tmp_path)
    assert done.returncode == 0, done.stderr
    assert (f"take description:=false out of {tmp_path}/etc/robotont/robot.conf" in done.stdout) != model
    configuration = (tmp_path / "etc/robotont/robot.conf").read_text()
    assert ("ROBOTONT_ARGUMENTS=description:=false\n" in configuration) != model
    assert "no xacro: the robot does not start" not in done.stdout
    (tmp_path / "etc/robotont/robot.conf").write_text("ROBOTONT_ARGUMENTS=\n")  # kept
    assert ("no xacro: the robot does not start" in install_robot(tmp_path).stdout) != model


def test_a_workspace_that_the_services_may_not_enter_is_named_and_nothing_written(tmp_path, monkeypatch):
    (tmp_path / "closed").mkdir(mode=0o700)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([os.environ.get("PYTHONPATH", ""), str(tmp_path / "closed")]))
    done = install_robot(tmp_path / "root", run=pytest.fail, unreadable=unreadable)
    assert done.returncode == 1
    assert "the services' user may not enter" in done.stderr
    assert files(tmp_path) == ["closed"]


def test_removal_stops_services_and_leaves_no_file_but_the_users_and_what_a_link_leads_to(tmp_path, monkeypatch):
    homes = ["/home/robotont", "/var/lib/robotont"]  # of a person who was called so before; of our user
    monkeypatch.setattr(pwd, "getpwall", lambda: [pwd.struct_passwd(("robotont", "x", 9, 9, "", homes.pop(), ""))])
    root, outside, ran = tmp_path / "root", tmp_path / "outside", []
    (outside / "black_box/run").mkdir(parents=True)
    (root / "etc/systemd/system").mkdir(parents=True)
    (root / "etc/systemd/system/other.service").write_text("[Service]\nExecStart=/bin/true\n")
    before = files(tmp_path)
    done = install_robot(root, "--remove", run=pytest.fail)
    assert (done.returncode, done.stderr) == (1, "install-robot: nothing is installed\n")
    for _ in range(2):
        assert install_robot(root).returncode == 0
    (root / "var/lib").mkdir(parents=True)
    (root / "var/lib/robotont").symlink_to(outside / "black_box")
    done = install_robot(root, "--remove", run=lambda commands: ran.extend(commands) or True)
    assert done.returncode == 0, done.stderr
    assert (ran[0], ran[1]) == (("systemctl", "stop", *reversed(UNITS)), ("userdel", "robotont"))
    assert f"var/lib/robotont -> {outside}/black_box" in done.stdout
    assert [name for name in files(tmp_path) if name not in before and not (tmp_path / name).is_dir()] == []
    assert set(before) <= set(files(tmp_path))
    install_robot(root)
    (root / "var/lib/robotont/black_box").mkdir(parents=True)  # as systemd and the recorder do
    (root / "etc/robotont/page.pem").touch()
    with mock.patch("shutil.rmtree", side_effect=OSError("read-only file system")):
        assert install_robot(root, "--remove", run=lambda _: True).returncode == 1
    install_robot(root, "--remove", run=lambda commands: ran.extend(commands) or True)  # takes the rest
    assert [path.name for path in root.rglob("*robotont*")] == ["robotont"]
    assert ((root / "etc/robotont/page.pem").exists(), ran.count(("userdel", "robotont"))) == (True, 1)


@pytest.mark.parametrize("name", ["etc/robotont/robot.conf", "etc/systemd/system/robotont.service"])
def test_what_is_no_file_is_refused_and_other_names_of_a_file_are_not_written_through(name, tmp_path):
    root, other = tmp_path / "root", tmp_path / "other"
    (root / name).parent.mkdir(parents=True)
    other.write_bytes("# K\u00fcche\n".encode("latin-1"))
    for make in (os.mkfifo, lambda link: os.symlink(str(other), link)):
        make(str(root / name))
        done = install_robot(root, "robot:=robotont2")
        assert (done.returncode, f"{root / name} is no file" in done.stderr) == (1, True)
        (root / name).unlink()
    os.link(str(other), str(root / name))
    done = install_robot(root, "robot:=robotont2")
    assert done.returncode == 0, done.stderr
    assert other.read_bytes() == b"# K\xfcche\n"
    if name.endswith(".conf"):
        assert (root / name).read_bytes() == b"# K\xfcche\nROBOTONT_ROBOT=robotont2\n"


@pytest.mark.parametrize("left", [b"", bytes(400)])
def test_a_configuration_without_words_as_a_loss_of_power_may_leave_it_is_made_anew(left, tmp_path):
    install_robot(tmp_path, "robot:=robotont2")
    conf = tmp_path / "etc/robotont/robot.conf"
    before = conf.read_text()
    conf.write_bytes(left)
    install_robot(tmp_path, "robot:=robotont2")
    assert conf.read_text() == before


@pytest.mark.parametrize("good, addresses", [
    (False, ["300.1.1.1", "10.0.0.1.", "127.0.0.1", "0.0.0.0", "224.0.0.1", "localhost", "robot..local", "robot-.local",
             "robot local", ""]),
    (True, ["10.0.0.7", "robot", "Robot-7.local", "7up.example.org"])])
def test_an_address_that_a_robot_can_have_and_one_that_it_cannot(good, addresses, tmp_path):
    for address in addresses:
        done = install_robot(tmp_path, f"--network={address}")
        assert done.returncode == (0 if good else 2), address
        assert (f"found {address!r}, allowed: an IPv4 address" in done.stderr) != good


def test_the_robot_and_the_users_own_settings_are_kept_and_the_network_is_not(tmp_path):
    etc = tmp_path / "etc"
    conf = etc / "robotont/robot.conf"

    def installed(*words):
        install_robot(tmp_path, *words)
        return [line for line in conf.read_text("latin-1").splitlines() if line.startswith("ROBOTONT_")][:2]
    assert installed("robot:=robotont2") == ["ROBOTONT_PORT=/dev/robotont", "ROBOTONT_ROBOT=robotont2"]
    conf.write_bytes(conf.read_bytes().replace(b"/dev/robotont\n", b"/dev/robotont_7\n") + b"# K\xfcche\n")  # Latin-1
    for words, host in ((["--network", "10.0.0.7"], "10.0.0.7"), ([], "127.0.0.1")):
        assert installed(*words) == ["ROBOTONT_PORT=/dev/robotont_7", "ROBOTONT_ROBOT=robotont2"]
        environment = (etc / "robotont/environment").read_text().splitlines()
        assert {f'ROS_IP="{host}"', f'ROS_MASTER_URI="http://{host}:11311"'} <= set(environment)
        assert ("network-online" in (tmp_path / SYSTEMD / "robotont-master.service").read_text()) == bool(words)
    assert installed("robot:=robotont3") == ["ROBOTONT_PORT=/dev/robotont_7", "ROBOTONT_ROBOT=robotont3"]
    assert conf.read_bytes().endswith(b"# K\xfcche\n")
    conf.write_text("ROBOTONT_PORT=/dev/ttyACM1\n")  # of an older installation
    assert installed("robot:=four_wheels") == ["ROBOTONT_PORT=/dev/ttyACM1", "ROBOTONT_ROBOT=four_wheels"]
    assert "allowed: four_wheels, robotont2" in install_robot(tmp_path, "robot:=robotont4").stderr


def test_units_are_valid_and_come_back(tmp_path):
    """That they do their work, the tests that boot show."""
    need("systemd-analyze")
    install_robot(tmp_path, "--page", "--fleet", "teacher")
    units = [tmp_path / SYSTEMD / unit for unit in (*UNITS, PAGE_UNIT, FLEET_UNIT)]
    assert ["Restart=always\n" in unit.read_text() for unit in units] == [True] * len(units)
    done = subprocess.run(["systemd-analyze", "verify", *map(str, units)], check=False, text=True, capture_output=True)
    # it also reads the units of this machine, whose faults are not ours
    assert not [line for line in done.stderr.splitlines() if "robotont" in line], done.stderr
    assert done.returncode == 0, done.stderr


# What udev would do with a board's port by the rules in $1, in mounts of its own.
UDEV = r"""
usb=/sys/devices/pci0000:00/0000:00:14.0/usb1/1-1 port=$usb/1-1:1.2 tty=$port/tty/ttyACM0
mount -t tmpfs none /sys && mount -t tmpfs none /run && mount -t tmpfs none /dev && mknod /dev/null c 1 3 &&
mount --bind $1 /etc/udev/rules.d && mkdir -p $tty /sys/bus/usb /sys/class/tty || exit
ln -s $tty /sys/class/tty/; ln -s /sys/class/tty $tty/subsystem
ln -s /sys/bus/usb $usb/subsystem; ln -s /sys/bus/usb $port/subsystem
echo 0483 >$usb/idVendor; echo 374b >$usb/idProduct; echo 0669FF31 >$usb/serial; echo 166:0 >$tty/dev
printf 'DEVTYPE=usb_device\nDRIVER=usb\n' >$usb/uevent
printf 'DEVTYPE=usb_interface\nDRIVER=cdc_acm\n' >$port/uevent
printf 'MAJOR=166\nMINOR=0\nDEVNAME=ttyACM0\n' >$tty/uevent
SYSTEMD_DEVICE_VERIFY_SYSFS=0 exec udevadm test --action=add $tty 2>&1
"""


def test_a_board_has_its_name_by_its_serial_number(tmp_path):
    need("udevadm", "unshare")
    if os.getuid() != 0:
        pytest.skip("needs root to show udev other devices")
    install_robot(tmp_path)
    version = int(subprocess.check_output(["udevadm", "--version"], text=True).split()[0])
    answers = subprocess.run(["unshare", "--mount", "sh", "-c", UDEV, "sh", str(tmp_path / "etc/udev/rules.d")],
                             check=False, text=True, stdout=subprocess.PIPE).stdout
    if "DEVPATH" not in answers:
        pytest.skip("udev does not take a stand-in for /sys here: " + answers[-300:])
    assert not re.search(r"6[01]-robotont.*:\d+.*(Invalid|Unknown|Failed|ignoring)", answers), answers
    links, = re.findall("DEVLINKS=(.*)", answers)
    assert set(links.split()) == {"/dev/robotont", "/dev/robotont_0669FF31"}
    expected = [r"ID_MM_DEVICE_IGNORE=1\b", r"ID_MM_PORT_IGNORE=1\b"]
    expected += ["MODE 0660", "GROUP [0-9]+"] if version >= 250 else []  # older ones do not say it
    assert not [words for words in expected if not re.search(words, answers)], answers
