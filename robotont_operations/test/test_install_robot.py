"""install-robot: what it installs is valid, and is removed to the last file."""

import os
import re
import subprocess

import pytest
from installing import arguments, files, install_robot, need

from robotont_boards import BOARDS
from robotont_operations import install_robot as install_robot_module
from robotont_operations import robot_choice
from robotont_testing.board_port import BoardPort
from robotont_testing.dc_motors import Motors

UNITS = ("robotont-master.service", "robotont.service", "robotont-recorder.service")


def test_dry_run_names_each_file_and_writes_nothing(tmp_path):
    done = install_robot("--root", tmp_path, "--dry-run", "--page")
    assert done.returncode == 0
    assert "  etc/systemd/system/robotont.service\n" in done.stdout
    assert "robotont-page.service -> /etc" in done.stdout
    assert not files(tmp_path)


def test_a_root_that_is_not_there_is_refused(tmp_path):
    done = install_robot("--root", tmp_path / "mnt")
    assert done.returncode == 2
    assert f"--root: found {tmp_path / 'mnt'}, which is no folder" in done.stderr
    assert not files(tmp_path)


@pytest.mark.parametrize("name, option, words", [
    ("page", "--page=10.0.0.7", "teleop.launch address:=10.0.0.7 $ROBOTONT_PAGE_ARGUMENTS\n"),
    ("page", "--page", "teleop.launch address:=0.0.0.0 "),
    ("fleet", "fleet:=10.0.0.7", "fleet.launch router:=tcp/10.0.0.7:7447\n")])
def test_page_and_fleet_start_at_boot_where_they_were_asked_for(name, option, words, tmp_path):
    unit = tmp_path / f"etc/systemd/system/robotont-{name}.service"
    install_robot("--root", tmp_path)
    assert not unit.exists()
    assert f"robotont_{'teleop_token' if name == 'page' else 'fleet_password'}" in install_robot(
        "--root", tmp_path, option).stdout
    assert words in unit.read_text()
    assert (tmp_path / "etc/systemd/system/multi-user.target.wants" / unit.name).is_symlink()
    assert install_robot("--root", tmp_path).returncode == 0
    assert unit.exists()
    assert install_robot("--root", tmp_path, f"--{name}", "127.0.0.1").returncode == 2
    install_robot("--root", tmp_path, "--remove")
    assert not unit.exists()


@pytest.mark.parametrize("model", [True, False])
def test_without_xacro_the_robot_starts_without_its_model(model, tmp_path, monkeypatch):
    """As on Debian, whose robots take nothing from PyPI."""
    monkeypatch.setattr(install_robot_module.importlib.util, "find_spec", lambda _name: model or None)
    done = install_robot("--root", tmp_path)
    assert done.returncode == 0, done.stderr
    assert ("no xacro" in done.stdout) != model
    configuration = (tmp_path / "etc/robotont/robot.conf").read_text()
    assert ("ROBOTONT_ARGUMENTS=description:=false\n" in configuration) != model


def test_a_workspace_that_the_services_may_not_enter(tmp_path, monkeypatch):
    """Refused where the services would start from it at once; for another root there is only a warning."""
    closed = tmp_path / "closed"
    closed.mkdir(mode=0o700)
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join([os.environ.get("PYTHONPATH", ""), str(closed)]))
    here, elsewhere = install_robot("--dry-run"), install_robot("--root", tmp_path, "--dry-run")
    assert (here.returncode, elsewhere.returncode) == (1, 0)
    assert "would write" not in here.stdout
    for done in (here, elsewhere):
        assert "the services' user may not enter" in done.stderr


def test_removal_leaves_no_file(tmp_path):
    (tmp_path / "etc/systemd/system").mkdir(parents=True)
    (tmp_path / "etc/systemd/system/other.service").write_text("[Service]\nExecStart=/bin/true\n")
    before = files(tmp_path)
    for _ in range(2):
        assert install_robot("--root", tmp_path).returncode == 0
    (tmp_path / "var/lib/robotont/black_box").mkdir(parents=True)  # as systemd and the recorder do
    assert install_robot("--root", tmp_path, "--remove").returncode == 0
    assert not [name for name in files(tmp_path) if name not in before and not (tmp_path / name).is_dir()]
    assert not list(tmp_path.rglob("*robotont*"))
    again = install_robot("--root", tmp_path, "--remove")
    assert again.returncode == 1
    assert "nothing is installed" in again.stderr


@pytest.mark.parametrize("link", ["etc/robotont", "etc/systemd", "etc/udev/rules.d", "etc/robotont/robot.conf",
                                  "etc/udev/rules.d/60-robotont.rules"])
def test_what_is_a_link_out_of_an_image_is_refused(link, tmp_path):
    root, outside = tmp_path / "root", tmp_path / "outside"
    (root / link).parent.mkdir(parents=True)
    is_file = link.endswith((".conf", ".rules"))
    if is_file:
        outside.write_text("mine\n")
        outside.chmod(0o600)
    else:
        outside.mkdir()
    (root / link).symlink_to(outside)
    before = files(tmp_path)
    done = install_robot("--root", root)
    assert done.returncode == 1
    assert f"install-robot: {root / link} is a link to {outside}" in done.stderr
    assert install_robot("--root", root, "--remove").returncode == 1
    assert not is_file or (outside.read_text(), outside.stat().st_mode & 0o777) == ("mine\n", 0o600)
    assert files(tmp_path) == before


def test_removal_deletes_a_link_and_not_what_it_leads_to_and_leaves_what_is_the_users(tmp_path):
    root, outside = tmp_path / "root", tmp_path / "outside"
    (outside / "black_box/run").mkdir(parents=True)
    root.mkdir()
    assert install_robot("--root", root).returncode == 0
    (root / "var/lib").mkdir(parents=True)
    (root / "var/lib/robotont").symlink_to(outside / "black_box")
    (root / "etc/robotont/page.pem").touch()
    done = install_robot("--root", root, "--remove")
    assert done.returncode == 0, done.stderr
    assert f"var/lib/robotont -> {outside}/black_box" in done.stdout
    assert [path.name for path in root.rglob("*robotont*")] == ["robotont"]
    assert (root / "etc/robotont/page.pem").exists()
    assert (outside / "black_box/run").exists()


def test_removal_stops_nothing_where_nothing_is_installed(tmp_path, monkeypatch):
    ran = []
    monkeypatch.setattr(install_robot_module, "run", lambda commands: ran.extend(commands) or True)
    for options, status in ((["--dry-run"], 1), ([], 1), ([], 0)):
        with arguments("--root", tmp_path, "--remove", *options):
            assert install_robot_module._remove(install_robot_module.parse_arguments(), live=True) == status
        assert bool(ran) == (status == 0)
        install_robot("--root", tmp_path, *options)
    assert ran[0][:2] == ("systemctl", "stop")


@pytest.mark.parametrize("address", ["300.1.1.1", "10.0.0.1.", "127.0.0.1", "0.0.0.0", "224.0.0.1", "localhost",
                                     "robot..local", "robot-.local", "robot local", ""])
def test_an_address_that_no_robot_can_have(address, tmp_path):
    done = install_robot("--root", tmp_path, f"--network={address}")
    assert done.returncode == 2
    assert f"found {address!r}, allowed: an IPv4 address" in done.stderr
    assert not files(tmp_path)


@pytest.mark.parametrize("address", ["10.0.0.7", "robot", "Robot-7.local", "7up.example.org"])
def test_an_address_that_a_robot_can_have(address):
    assert install_robot_module.address(address) == address


def test_the_users_own_settings_are_kept(tmp_path):
    install_robot("--root", tmp_path)
    (tmp_path / "etc/robotont/robot.conf").write_text("ROBOTONT_PORT=/dev/robotont_42\n")
    install_robot("--root", tmp_path, "--network", "10.0.0.7")
    assert (tmp_path / "etc/robotont/robot.conf").read_text() == "ROBOTONT_PORT=/dev/robotont_42\n"
    environment = (tmp_path / "etc/robotont/environment").read_text()
    assert 'ROS_IP="10.0.0.7"' in environment
    assert 'ROS_MASTER_URI="http://10.0.0.7:11311"' in environment
    assert "network-online" in (tmp_path / "etc/systemd/system/robotont-master.service").read_text()
    install_robot("--root", tmp_path)
    assert 'ROS_IP="127.0.0.1"' in (tmp_path / "etc/robotont/environment").read_text()
    assert "network-online" not in (tmp_path / "etc/systemd/system/robotont-master.service").read_text()


def test_the_robot_that_is_named_is_kept_until_another_one_is(tmp_path):
    conf = tmp_path / "etc/robotont/robot.conf"

    def lines():
        return [line for line in conf.read_text().splitlines() if line.startswith("ROBOTONT_")]
    assert install_robot("--root", tmp_path, "robot:=robotont2").returncode == 0
    assert lines()[:2] == ["ROBOTONT_PORT=/dev/robotont", "ROBOTONT_ROBOT=robotont2"]
    conf.write_text(conf.read_text().replace("/dev/robotont\n", "/dev/robotont_7\n"))
    install_robot("--root", tmp_path)
    assert lines()[:2] == ["ROBOTONT_PORT=/dev/robotont_7", "ROBOTONT_ROBOT=robotont2"]
    install_robot("--root", tmp_path, "robot:=robotont3")
    assert lines()[:2] == ["ROBOTONT_PORT=/dev/robotont_7", "ROBOTONT_ROBOT=robotont3"]
    conf.write_text("ROBOTONT_PORT=/dev/ttyACM1\n")  # of an older installation
    install_robot("--root", tmp_path, "robot:=four_wheels")
    assert lines() == ["ROBOTONT_PORT=/dev/ttyACM1", "ROBOTONT_ROBOT=four_wheels"]
    assert "allowed: four_wheels, robotont2" in install_robot("--root", tmp_path, "robot:=robotont4").stderr


def test_a_board_that_is_plugged_in_is_proposed(tmp_path, monkeypatch, capsys):
    port = BoardPort(str(tmp_path / "board"), lambda now: BOARDS["robotont2"](Motors(), start=now))
    port.plug()
    monkeypatch.setattr(robot_choice, "ports", lambda: [str(tmp_path / "none"), port.link])
    try:
        with arguments("--dry-run"):
            assert install_robot_module._install(install_robot_module.parse_arguments(), live=True) == 1
    finally:
        port.unplug()
    words = f"the board at {port.link} speaks robotont2: ./robotont install-robot robot:=robotont2"
    assert words in capsys.readouterr().err
    assert port.heard == []


def test_units_are_valid_do_little_beside_their_work_and_come_back(tmp_path):
    """By systemd's own measure, from 0 to 10. That they still do their work, the tests that boot show."""
    need("systemd-analyze")
    install_robot("--root", tmp_path, "--page", "--fleet", "teacher")
    units = [tmp_path / "etc/systemd/system" / unit for unit in (
        *UNITS, "robotont-page.service", "robotont-fleet.service")]
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


def usb_port(sys, port, serial, name, minor):
    """Put a board's serial port into a tree like /sys; returns the device's path in it."""
    usb = sys / f"devices/pci0000:00/0000:00:14.0/usb1/{port}"
    tty = usb / f"{port}:1.2/tty/{name}"
    tty.mkdir(parents=True)
    for device, attributes in (
            (usb, {"idVendor": "0483", "idProduct": "374b", "serial": serial, "busnum": "1", "devnum": str(minor + 2),
                   "uevent": "DEVTYPE=usb_device\nDRIVER=usb\n"}),
            (usb / f"{port}:1.2", {"bInterfaceNumber": "02", "uevent": "DEVTYPE=usb_interface\nDRIVER=cdc_acm\n"}),
            (tty, {"dev": f"166:{minor}", "uevent": f"MAJOR=166\nMINOR={minor}\nDEVNAME={name}\n"})):
        for key, value in attributes.items():
            (device / key).write_text(value if key == "uevent" else value + "\n")
    for folder, device in (("bus/usb", usb), ("bus/usb", usb / f"{port}:1.2"), ("class/tty", tty)):
        (sys / folder).mkdir(parents=True, exist_ok=True)
        (device / "subsystem").symlink_to(sys / folder)
    (sys / "class/tty" / name).symlink_to(tty)
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


def test_two_boards_keep_their_names_when_they_change_ports(tmp_path):
    need("udevadm", "unshare")
    if os.getuid() != 0:
        pytest.skip("needs root to show udev other devices")
    (tmp_path / "root").mkdir()
    install_robot("--root", tmp_path / "root")
    version = int(subprocess.check_output(["udevadm", "--version"], text=True).split()[0])
    for turn, ports in enumerate((("1-1", "1-2"), ("1-2", "1-1"))):
        sys = tmp_path / f"sys{turn}"
        for minor, (port, serial) in enumerate(zip(ports, ("0669FF31", "0670AA42"))):
            device = usb_port(sys, port, serial, f"ttyACM{(minor + turn) % 2}", minor)
            answers = udev_answers(tmp_path, sys, device)
            if "DEVPATH" not in answers:
                pytest.skip("udev does not take a stand-in for /sys here: " + answers[-300:])
            assert not re.search(r"6[01]-robotont.*:\d+.*(Invalid|Unknown|Failed|ignoring)", answers), answers
            links = re.search("DEVLINKS=(.*)", answers)
            assert links, answers
            assert set(links.group(1).split()) == {"/dev/robotont", f"/dev/robotont_{serial}"}
            if version >= 250:  # older ones do not say it
                assert "MODE 0660" in answers, answers
                assert re.search("GROUP [0-9]+", answers), answers
            assert "ID_MM_DEVICE_IGNORE=1" in answers, answers
            assert "ID_MM_PORT_IGNORE=1" in answers, answers
