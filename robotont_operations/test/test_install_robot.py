"""install-robot: what it installs is valid, and is removed to the last file."""

import os
import re
import subprocess

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
    install_robot(tmp_path, "--page=10.0.0.7")
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


@pytest.mark.parametrize("model", [True, False])
def test_without_xacro_the_robot_starts_without_its_model(model, tmp_path, monkeypatch):
    """As on Debian, whose robots take nothing from PyPI."""
    monkeypatch.setattr(install_robot_module.importlib.util, "find_spec", lambda _name: model or None)
    done = install_robot(tmp_path)
    assert done.returncode == 0, done.stderr
    assert ("no xacro" in done.stdout) != model
    configuration = (tmp_path / "etc/robotont/robot.conf").read_text()
    assert ("ROBOTONT_ARGUMENTS=description:=false\n" in configuration) != model


def test_a_workspace_that_the_services_may_not_enter_is_named_and_nothing_written(tmp_path, monkeypatch):
    (tmp_path / "closed").mkdir(mode=0o700)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([os.environ.get("PYTHONPATH", ""), str(tmp_path / "closed")]))
    done = install_robot(tmp_path / "root", run=pytest.fail, unreadable=unreadable)
    assert done.returncode == 1
    assert "the services' user may not enter" in done.stderr
    assert files(tmp_path) == ["closed"]


def test_removal_stops_services_and_leaves_no_file_but_the_users_and_what_a_link_leads_to(tmp_path):
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
    assert ran[0] == ("systemctl", "stop", *reversed(UNITS))
    assert f"var/lib/robotont -> {outside}/black_box" in done.stdout
    assert [name for name in files(tmp_path) if name not in before and not (tmp_path / name).is_dir()] == []
    assert set(before) <= set(files(tmp_path))
    install_robot(root)
    (root / "var/lib/robotont/black_box").mkdir(parents=True)  # as systemd and the recorder do
    (root / "etc/robotont/page.pem").touch()
    install_robot(root, "--remove")
    assert [path.name for path in root.rglob("*robotont*")] == ["robotont"]
    assert (root / "etc/robotont/page.pem").exists()


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
        return [line for line in conf.read_text().splitlines() if line.startswith("ROBOTONT_")][:2]
    assert installed("robot:=robotont2") == ["ROBOTONT_PORT=/dev/robotont", "ROBOTONT_ROBOT=robotont2"]
    conf.write_text(conf.read_text().replace("/dev/robotont\n", "/dev/robotont_7\n"))
    for words, host in ((["--network", "10.0.0.7"], "10.0.0.7"), ([], "127.0.0.1")):
        assert installed(*words) == ["ROBOTONT_PORT=/dev/robotont_7", "ROBOTONT_ROBOT=robotont2"]
        environment = (etc / "robotont/environment").read_text().splitlines()
        assert {f'ROS_IP="{host}"', f'ROS_MASTER_URI="http://{host}:11311"'} <= set(environment)
        assert ("network-online" in (tmp_path / SYSTEMD / "robotont-master.service").read_text()) == bool(words)
    assert installed("robot:=robotont3") == ["ROBOTONT_PORT=/dev/robotont_7", "ROBOTONT_ROBOT=robotont3"]
    conf.write_text("ROBOTONT_PORT=/dev/ttyACM1\n")  # of an older installation
    assert installed("robot:=four_wheels") == ["ROBOTONT_PORT=/dev/ttyACM1", "ROBOTONT_ROBOT=four_wheels"]
    assert "allowed: four_wheels, robotont2" in install_robot(tmp_path, "robot:=robotont4").stderr


def test_units_are_valid_do_little_beside_their_work_and_come_back(tmp_path):
    """By systemd's own measure, from 0 to 10. That they still do their work, the tests that boot show."""
    need("systemd-analyze")
    install_robot(tmp_path, "--page", "--fleet", "teacher")
    units = [tmp_path / SYSTEMD / unit for unit in (*UNITS, PAGE_UNIT, FLEET_UNIT)]
    assert ["Restart=always\n" in unit.read_text() for unit in units] == [True] * len(units)
    done = subprocess.run(["systemd-analyze", "verify", *map(str, units)], check=False, text=True, capture_output=True)
    # it also reads the units of this machine, whose faults are not ours
    assert not [line for line in done.stderr.splitlines() if "robotont" in line], done.stderr
    assert done.returncode == 0, done.stderr
    done = subprocess.run(["systemd-analyze", "security", "--offline=true", "--no-pager", *map(str, units)],
                          check=False, text=True, capture_output=True)
    if "unrecognized option" in done.stderr:
        pytest.skip("systemd-analyze security has no --offline here: it needs systemd 250")
    exposures = re.findall(r"exposure level for robotont\S*: ([0-9.]+)", done.stdout)
    assert len(exposures) == len(units)
    assert max(map(float, exposures)) <= 5.0, done.stdout


def usb_port(sys, serial):
    """Put a board's serial port into a tree like /sys; returns the device's path in it."""
    usb = sys / "devices/pci0000:00/0000:00:14.0/usb1/1-1"
    tty = usb / "1-1:1.2/tty/ttyACM0"
    tty.mkdir(parents=True)
    for device, subsystem, attributes in (
            (usb, "bus/usb", {"idVendor": "0483", "idProduct": "374b", "serial": serial,
                              "uevent": "DEVTYPE=usb_device\nDRIVER=usb"}),
            (usb / "1-1:1.2", "bus/usb", {"uevent": "DEVTYPE=usb_interface\nDRIVER=cdc_acm"}),
            (tty, "class/tty", {"dev": "166:0", "uevent": "MAJOR=166\nMINOR=0\nDEVNAME=ttyACM0"})):
        for key, value in attributes.items():
            (device / key).write_text(value + "\n")
        (sys / subsystem).mkdir(parents=True, exist_ok=True)
        (device / "subsystem").symlink_to(sys / subsystem)
    (sys / "class/tty/ttyACM0").symlink_to(tty)
    return tty.relative_to(sys)


def udev_answers(tmp_path, sys, device):
    """What udev would do with a device of such a tree, by the rules that are installed."""
    # links inside the tree are absolute: made in the place where they will be seen
    done = subprocess.run(
        ["unshare", "--mount", "sh", "-c", f"mount -t tmpfs none /sys && cp -a {sys}/. /sys/ && "
         f"find /sys -type l | while read link; do to=$(readlink $link); ln -sfn /sys${{to#{sys}}} $link; done && "
         f"mount --bind {tmp_path}/root/etc/udev/rules.d /etc/udev/rules.d && "
         "mount -t tmpfs none /run && mount -t tmpfs none /dev && mknod /dev/null c 1 3 && "  # where it makes the links
         f"SYSTEMD_DEVICE_VERIFY_SYSFS=0 udevadm test --action=add /sys/{device}"],
        check=False, text=True, capture_output=True)
    return done.stdout + done.stderr


def test_a_board_has_its_name_by_its_serial_number(tmp_path):
    need("udevadm", "unshare")
    if os.getuid() != 0:
        pytest.skip("needs root to show udev other devices")
    (tmp_path / "root").mkdir()
    install_robot(tmp_path / "root")
    version = int(subprocess.check_output(["udevadm", "--version"], text=True).split()[0])
    answers = udev_answers(tmp_path, tmp_path / "sys", usb_port(tmp_path / "sys", "0669FF31"))
    if "DEVPATH" not in answers:
        pytest.skip("udev does not take a stand-in for /sys here: " + answers[-300:])
    assert not re.search(r"6[01]-robotont.*:\d+.*(Invalid|Unknown|Failed|ignoring)", answers), answers
    links, = re.findall("DEVLINKS=(.*)", answers)
    assert set(links.split()) == {"/dev/robotont", "/dev/robotont_0669FF31"}
    expected = [r"ID_MM_DEVICE_IGNORE=1\b", r"ID_MM_PORT_IGNORE=1\b"]
    expected += ["MODE 0660", "GROUP [0-9]+"] if version >= 250 else []  # older ones do not say it
    assert not [words for words in expected if not re.search(words, answers)], answers
