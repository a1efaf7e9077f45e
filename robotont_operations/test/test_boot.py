"""install-robot: what it installs is valid, starts at boot without a network, and is removed to the last file."""

import contextlib
import io
import os
import re
import shutil
import signal
import subprocess
import time
import unittest.mock
from pathlib import Path

import pytest
import rosbag

from robotont_boards import BOARDS
from robotont_operations import install_robot as install_robot_module
from robotont_operations import robot_choice
from robotont_operations.black_box import bags_of, runs_in
from robotont_testing import places
from robotont_testing.board_port import BoardPort
from robotont_testing.dc_motors import Motors
from robotont_testing.harness import Processes, wait_for
from robotont_testing.stand_in_board import Board

REPOSITORY = Path(__file__).resolve().parents[2]
WORKSPACE = places.program("robotont_bringup", "require").parents[3]  # with the source, development or install space
UNITS = ("robotont-master.service", "robotont.service", "robotont-recorder.service")
BOOT = """[Unit]
Wants=systemd-journald.service systemd-sysusers.service robotont-watch.service {units}
"""
WATCH = """[Unit]
After=robotont-master.service
[Service]
EnvironmentFile=/etc/robotont/environment
Environment=ROS_HOME=/tmp
ExecStart=/usr/bin/env python3 -c "import rospy, time; from nav_msgs.msg import Odometry; rospy.init_node('watch'); \\
    rospy.wait_for_message('odom', Odometry); open('/shared/odom', 'w').write(str(time.time()))"
"""
MASTER, DRIVER, RECORDER = r"/rosmaster\0", r"/robotont_node\0", r"/recorder_node\0"  # in their command lines
CGROUPS = ("/sys/fs/cgroup/unified", "/sys/fs/cgroup")


@contextlib.contextmanager
def arguments(*words):
    """A block in which this process was started with these."""
    with unittest.mock.patch("sys.argv", ["install-robot", *map(str, words)]):
        yield


def install_robot(*words):
    """What install-robot prints, and its exit status, as of a finished process."""
    out, err = io.StringIO(), io.StringIO()
    with arguments(*words), contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            status = install_robot_module.main()
        except SystemExit as end:
            status = end.code
    return subprocess.CompletedProcess(words, status, out.getvalue(), err.getvalue())


def files(root):
    return sorted(str(path.relative_to(root)) for path in Path(root).rglob("*"))


def need(*tools):
    lacking = [tool for tool in tools if not shutil.which(tool)]
    if lacking:
        pytest.skip("these commands are missing: " + ", ".join(lacking))


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
    assert [name for name in files(tmp_path) if name not in before] in ([], ["var", "var/lib"])
    again = install_robot("--root", tmp_path, "--remove")
    assert again.returncode == 1
    assert "nothing is installed" in again.stderr


@pytest.mark.parametrize("link", ["etc/robotont", "etc/systemd", "etc/udev/rules.d", "etc/robotont/installed",
                                  "etc/robotont/robot.conf", "etc/udev/rules.d/60-robotont.rules"])
def test_what_is_a_link_out_of_an_image_is_refused(link, tmp_path):
    root, outside = tmp_path / "root", tmp_path / "outside"
    (root / link).parent.mkdir(parents=True)
    is_file = link.endswith(("installed", ".conf", ".rules"))
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
    assert is_file or install_robot("--root", root, "--remove").returncode == 1
    assert not is_file or (outside.read_text(), outside.stat().st_mode & 0o777) == ("mine\n", 0o600)
    assert files(tmp_path) == before


def test_removal_deletes_nothing_outside_of_an_image_and_all_inside(tmp_path):
    root, outside = tmp_path / "root", tmp_path / "outside"
    for name in ("victim", "black_box/run", "folder/robotont-master.service"):
        (outside / name).parent.mkdir(parents=True, exist_ok=True)
        (outside / name).touch()
    root.mkdir()
    assert install_robot("--root", root).returncode == 0
    with open(str(root / "etc/robotont/installed"), "a") as listed:
        listed.write(f"../outside/victim\n{outside}/victim\netc/linked/robotont-master.service\n")
    (root / "etc/linked").symlink_to(outside / "folder")
    (root / "var/lib").mkdir(parents=True)
    (root / "var/lib/robotont").symlink_to(outside / "black_box")
    done = install_robot("--root", root, "--remove")
    assert done.returncode == 0, done.stderr
    for words in ("../outside/victim", f"{outside}/victim", f"{root}/etc/linked is a link", f"{outside}/black_box"):
        assert words in done.stderr
    assert files(root) == ["etc", "etc/linked", "var", "var/lib"]
    assert files(outside) == ["black_box", "black_box/run", "folder", "folder/robotont-master.service", "victim"]


def test_removal_stops_nothing_where_nothing_is_installed(tmp_path, monkeypatch):
    ran = []
    monkeypatch.setattr(install_robot_module, "run", lambda commands: ran.extend(commands) or True)
    for options, status in ((["--dry-run"], 1), ([], 1), ([], 0)):
        with arguments("--root", tmp_path, "--remove", *options):
            assert install_robot_module._remove(install_robot_module.parse_arguments(), live=True) == status
        assert bool(ran) == (status == 0)
        install_robot("--root", tmp_path, *options)
    assert ran[0][:2] == ("systemctl", "stop")


@pytest.mark.parametrize("address", ["300.1.1.1", "10.0.0", "10.0.0.1.", "1", "127.0.0.1", "0.0.0.0", "localhost",
                                     "robot..local", "-robot", "robot-.local", "robot local", ""])
def test_an_address_that_no_robot_can_have(address, tmp_path):
    done = install_robot("--root", tmp_path, f"--network={address}")
    assert done.returncode == 2
    assert f"found {address!r}, allowed: an IPv4 address" in done.stderr
    assert not files(tmp_path)


@pytest.mark.parametrize("address", ["10.0.0.7", "robot", "Robot-7.local", "7up.example.org"])
def test_an_address_that_a_robot_can_have(address):
    assert install_robot_module.can_be_found_under(address)


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


class BootedRobot:
    """A machine that has booted into the services, seen from outside."""

    def __init__(self, shared, group):
        self.shared = shared
        self._group = group

    def process(self, words):
        """Process id of the one whose command line holds the words, a regular expression; None without one."""
        for pid in remaining(self._group):
            with contextlib.suppress(OSError):
                if re.search(words, Path(f"/proc/{pid}/cmdline").read_text()):
                    return int(pid)
        return None

    def ask(self, *command):
        """What a ROS command prints in the machine's network; "" when it fails."""
        with contextlib.suppress(subprocess.TimeoutExpired):
            done = subprocess.run(self._within("--net", *command), env=self._environment(), timeout=10, check=False,
                                  text=True, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL)
            return "" if done.returncode else done.stdout
        return ""

    def run(self, *command):
        """Run a command of the machine itself."""
        subprocess.run(self._within("--all", "--root", "--wd", *command), check=True, timeout=60)

    def _within(self, *words):
        return ["nsenter", "--target", str(self.process("systemd\0--system")), *words]

    @staticmethod
    def _environment():
        return {**os.environ, "ROS_MASTER_URI": "http://127.0.0.1:11311", "ROS_IP": "127.0.0.1"}

    def recorded_odometry(self, since):
        """Whether a file of the black box holds odometry of after a time [s]."""
        newest = runs_in(self.shared / "black_box")[-1:]  # none until the recorder has started
        for path in (path for run in newest for path in reversed(bags_of(run))):
            with contextlib.suppress(OSError), rosbag.Bag(str(path)) as bag:  # OSError: it has just been deleted
                return any(stamp.to_sec() > since for _, _, stamp in bag.read_messages("/odom", raw=True))
        return False

    def journal(self):
        """What the machine has logged."""
        return subprocess.run(["journalctl", "-D", str(self.shared / "journal"), "--no-pager", "-o", "short-monotonic",
                               "-u", "robotont*"], check=False, text=True, capture_output=True).stdout


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    need("unshare", "nsenter", "systemctl", "journalctl")
    tmp_path = tmp_path_factory.mktemp("boot")
    if os.getuid() != 0 or not os.path.exists("/lib/systemd/systemd"):
        pytest.skip("needs root and systemd to boot")
    if not all(folder.stat().st_mode & 1 for folder in (REPOSITORY, *REPOSITORY.parents)):
        pytest.skip(f"{REPOSITORY} is closed to other users, of whom the robot's is one")
    hierarchy = next((Path(path) for path in CGROUPS if os.path.exists(path + "/cgroup.procs")), None)
    if hierarchy is None or not os.access(str(hierarchy), os.W_OK):
        pytest.skip("no writable cgroup2 hierarchy here")
    tree = tmp_path / "tree"
    tree.mkdir()
    install_robot("--root", tree, "--page", "--fleet", "10.255.0.1")
    (tree / "etc/robotont/robot.conf").write_text(
        "ROBOTONT_PORT=/shared/board\nROBOTONT_ARGUMENTS=\n"
        "ROBOTONT_RECORDER_ARGUMENTS=folder:=/shared/black_box\n")
    (tree / "etc/systemd/system/boot.target").write_text(BOOT.format(units=" ".join(UNITS)))
    (tree / "etc/systemd/system/robotont-watch.service").write_text(WATCH)
    machine = tmp_path / "machine"
    shared = machine / "shared"
    shared.mkdir(parents=True)
    shared.chmod(0o777)  # the services' user writes there
    for folder in (tmp_path, *list(tmp_path.parents)[:2]):
        folder.chmod(0o755)
    group = hierarchy / f"robotont_boot_{os.getpid()}"
    group.mkdir()
    with Board(str(shared / "board")) as board, Processes() as processes:
        os.chmod(os.path.realpath(board.link), 0o666)
        log = tmp_path / "boot.log"
        try:
            booted = processes.start(
                "sh", "-c", f"echo $$ >{group}/cgroup.procs; exec unshare --mount --pid --net --uts --ipc --cgroup "
                f"--fork --kill-child sh {REPOSITORY}/robotont_operations/test/boot_machine.sh {machine} {tree} "
                f"boot.target {REPOSITORY} {WORKSPACE}", log=log)
            wait_for(lambda: (shared / "booted").exists() or booted.poll() is not None, "systemd")
            if booted.poll() is not None:
                pytest.skip("systemd does not start in a namespace here: " + log.read_text().strip())
            yield BootedRobot(shared, group)
        finally:
            processes.stop(booted, 9)
            wait_for(lambda: not remaining(group), "the end of what was booted")
            wait_for(lambda: removed(group), "the end of the control group")


def come(robot, condition, what):
    """As `wait_for`, for a minute; the journal tells why it did not come."""
    try:
        return wait_for(condition, what, timeout=60, period=0.2)
    except AssertionError as error:
        raise AssertionError(f"{error}\n{robot.journal()}") from None


@pytest.mark.timed
def test_boot_without_network_to_the_first_odometry(robot):
    odom, booted = robot.shared / "odom", robot.shared / "booted"
    come(robot, lambda: odom.exists() and odom.read_text(), "odometry")
    seconds = float(odom.read_text()) - float(booted.read_text())
    bags = come(robot, lambda: [bag for run in runs_in(robot.shared / "black_box") for bag in bags_of(run)],
                "a file of the black box")
    with rosbag.Bag(str(bags[0])) as bag:
        assert bag.get_message_count() > 0
    assert os.stat(f"/proc/{robot.process(DRIVER)}").st_uid != 0
    assert seconds <= 10.0, robot.journal()


@pytest.mark.timed
@pytest.mark.parametrize("victim, number", [(MASTER, signal.SIGTERM), (r"roslaunch\0.*robot\.launch", signal.SIGKILL)])
def test_a_service_that_is_killed_comes_back_with_those_that_need_it(robot, victim, number):
    """Odometry, and a black box that records it, as the master of now knows them."""
    lost = (MASTER, DRIVER, RECORDER) if victim == MASTER else (DRIVER,)
    come(robot, lambda: robot.recorded_odometry(0.0), "a black box with odometry")
    before = {words: robot.process(words) for words in (MASTER, DRIVER, RECORDER)}
    assert all(before.values()), before
    os.kill(robot.process(victim), number)
    for words in lost:
        come(robot, lambda words=words: robot.process(words) not in {None, before[words]}, f"a new {words}")
    come(robot, lambda: {"/recorder_node", "/robotont_node"} <= set(robot.ask("rosnode", "list").split()),
         "nodes that the master knows")
    come(robot, lambda: "twist" in robot.ask("rostopic", "echo", "-n", "1", "/odom"), "odometry")
    back = time.time()
    come(robot, lambda: robot.recorded_odometry(back), "odometry in the black box")
    assert {words for words in before if robot.process(words) != before[words]} == set(lost)


@pytest.mark.timed
def test_page_and_fleet_start_beside_the_driver(robot):
    """As far as their services' rights let them; the page asks for the token whose file the journal names."""
    come(robot, lambda: robot.process(DRIVER), "the driver")
    robot.run("systemctl", "start", "robotont-page", "robotont-fleet")
    come(robot, lambda: "asked for once: cat /var/lib/robotont/robotont_teleop_token" in robot.journal(), "the page")
    come(robot, lambda: "fleet_node" in robot.ask("rosnode", "list"), "the fleet's node")


def remaining(group):
    pids = []
    for folder, _, _ in os.walk(str(group)):
        with contextlib.suppress(OSError):  # systemd removed it since the walk found it
            pids += (Path(folder) / "cgroup.procs").read_text().split()
    return pids


def removed(group):
    """Whether the control group and those in it are gone; the kernel needs a moment after their last process."""
    for folder, _, _ in os.walk(str(group), topdown=False):
        with contextlib.suppress(OSError):
            os.rmdir(folder)
    return not group.exists()
