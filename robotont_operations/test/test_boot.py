"""A machine that boots into what install-robot installs, without a network: namespaces stand in for it."""

import contextlib
import os
import re
import signal
import subprocess
import time
from pathlib import Path

import pytest
import rosbag
from installing import install_robot, need

from robotont_operations.black_box_files import bags_of, runs_in
from robotont_operations.installation import UNITS
from robotont_testing import places
from robotont_testing.harness import Processes, wait_for
from robotont_testing.stand_in_board import Board

REPOSITORY = Path(__file__).resolve().parents[2]
WORKSPACE = places.program("robotont_bringup", "require").parents[3]  # with the source, development or install space
MASTER, DRIVER, RECORDER = r"/rosmaster\0", r"/serial_com_node\0", r"/recorder_node\0"  # in their command lines
CGROUPS = ("/sys/fs/cgroup/unified", "/sys/fs/cgroup")


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

    def run(self, *command):
        """What a command within the machine prints."""
        return subprocess.run(["nsenter", "--target", str(self.process("systemd\0--system")), "--all", "--root", "--wd",
                               "timeout", "60", *command], env={**os.environ, "ROS_MASTER_URI": "http://127.0.0.1:11311"},
                              check=False, text=True, stdout=subprocess.PIPE).stdout

    def recorded_odometry(self, since=0.0):
        """Times [s] of odometry of after a time in a file of the black box, the newest that has any."""
        newest = runs_in(self.shared / "black_box")[-1:]  # none until the recorder has started
        for path in (path for run in newest for path in reversed(bags_of(run))):
            with contextlib.suppress(OSError), rosbag.Bag(str(path)) as bag:  # OSError: it has just been deleted
                times = [stamp.to_sec() for _, _, stamp in bag.read_messages("/odom", raw=True)]
                return [at for at in times if at > since]
        return []

    def journal(self):
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
    install_robot(tree, "--page", "--fleet", "10.255.0.1")
    (tree / "etc/robotont/robot.conf").write_text(
        "ROBOTONT_PORT=/shared/board\nROBOTONT_ARGUMENTS=\n"
        "ROBOTONT_RECORDER_ARGUMENTS=folder:=/shared/black_box\n")
    (tree / "etc/systemd/system/boot.target").write_text(
        f"[Unit]\nWants=systemd-journald.service systemd-sysusers.service {' '.join(UNITS)}\n")
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


@pytest.mark.skipif(not rosbag.bag.found_lz4, reason="no roslz4, which is compiled, for this Python")
@pytest.mark.parametrize("victim, number", [(MASTER, signal.SIGTERM), (r"roslaunch\0.*robot\.launch", signal.SIGKILL)])
def test_a_service_that_is_killed_comes_back_with_those_that_need_it(robot, victim, number):
    """Odometry, and a black box that records it, as the master of now knows them."""
    lost = (MASTER, DRIVER, RECORDER) if victim == MASTER else (DRIVER,)
    come(robot, lambda: robot.recorded_odometry(), "a black box with odometry")
    before = {words: robot.process(words) for words in (MASTER, DRIVER, RECORDER)}
    assert all(before.values()), before
    assert os.stat(f"/proc/{before[DRIVER]}").st_uid != 0
    os.kill(robot.process(victim), number)
    for words in lost:
        come(robot, lambda words=words: robot.process(words) not in {None, before[words]}, f"a new {words}")
    back = time.time()
    come(robot, lambda: robot.recorded_odometry(back), "odometry in the black box")
    assert {words for words in before if robot.process(words) != before[words]} == set(lost)


def test_page_and_fleet_start_beside_the_driver(robot):
    """As far as their services' rights let them; the page asks for the token whose file the journal names."""
    come(robot, lambda: robot.process(DRIVER), "the driver")
    robot.run("systemctl", "start", "robotont-page", "robotont-fleet")
    come(robot, lambda: "asked for once: cat /var/lib/robotont/robotont_teleop_token" in robot.journal(), "the page")
    come(robot, lambda: "fleet_node" in robot.run("rosnode", "list"), "the fleet's node")


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
