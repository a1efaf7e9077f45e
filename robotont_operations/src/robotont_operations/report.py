"""./robotont report: one archive for whoever is asked for help: black box, versions, parameters, logs.

It holds what is listed here and nothing else: numbers, words of fixed sets and names, and the logs of own nodes that
know no secret. So no password, token or key can be in it, of whatever form: no program in OWN is ever given one.
"""

import os
import platform
import re
import subprocess
import sys
import tarfile
import tempfile
import time
from pathlib import Path

import rosgraph
import rospkg
import yaml
from diagnostic_msgs.msg import DiagnosticArray

from robotont_driver.kinematics.wheel_params import KEYS
from robotont_driver.nodes import driver_node, odom_node, serial_com_node
from robotont_driver.parameters.argument_parser import ArgumentParser
from robotont_driver.parameters.files import new_file
from robotont_driver.parameters.parameters import is_number
from robotont_operations import probes, recorder_node
from robotont_operations.black_box_files import bags_of, merge, runs_in

CALLER = "/robotont_report"
LOG_END = 500_000   # [bytes] of each log that are kept, its end
LOG_FILES = 40      # the newest
OWN = ("driver_node", "serial_com_node", "odom_node", "robotont_node", "cmd_vel_mux", "recorder_node",
       "navigation_monitor", "simulator_node", "robot_state_publisher", "move_base", "amcl", "map_server")
TABLES = {"driver_node": driver_node, "serial_com_node": serial_com_node, "odom_node": odom_node,
          "recorder_node": recorder_node}
WORDS = ("port", "packets", "odom_frame", "base_frame", "joint_prefix", "imu", "folder")  # parameters that are texts
TOPICS = ("geometry_msgs/Twist", "geometry_msgs/TwistStamped", "std_msgs/Bool", "nav_msgs/Odometry")
PACKETS = ("serial_write", "serial_read")  # texts of numbers
NUMBERS = re.compile(r"[-+\d.:;e\s]*")
USER = re.compile(r"(?<=//)[^/\s]*@")  # and password, in an address: rospy names that of the master in every log
PACKAGES = ("python3-rospy", "ros-noetic-rospy", "python3-numpy", "python3-serial", "rviz", "ros-noetic-rviz",
            "systemd")
HEAD = r"[\w.: -]*\[\d+\]: (?:\x1b\[\d*m)*"  # of the journal: time, host, program and its number
COMMANDS = {  # file: (command, what of each of its lines is kept, which may be another program's)
    "versions/commit.txt": (("git", "-C", os.path.dirname(__file__), "log", "-1", "--format=%H %cI"),
                            r"[0-9a-f]{40} [-+:\dTZ]+"),
    "versions/system.txt": (("uname", "-srvm"), ".*"),
    "versions/packages.txt": (("dpkg-query", "-W", *PACKAGES), ".*"),
    "machine/usb.txt": (("lsusb",), ".*"),
    "machine/disk.txt": (("df", "-h", "/", "/tmp"), ".*"),
    "machine/memory.txt": (("free", "-m"), ".*"),
    "machine/addresses.txt": (("ip", "-brief", "address"), ".*"),
    "machine/services.txt": (("systemctl", "is-active", "robotont-master", "robotont", "robotont-recorder"), ".*"),
    "logs/kernel.txt": (("dmesg", "--ctime"),
                        r"(?:\[[^\]]*\] )?(?:(?:usb|cdc_acm) [-\d.:]+: |tty[A-Z]\w*|oom-kill:)[^=]*"),
    "logs/journal.txt": (("journalctl", "--no-pager", "--lines", "5000", "--output", "short-precise", "--unit",
                          "robotont"),
                         rf"{HEAD}(?:\[\w+\] \[[\d., ]+\] /(?:\w+/)*(?:{'|'.join(OWN)}): .*"
                         rf"|\[[\w/-]+\] process has died \[pid \d+, exit code -?\d+)"),
}


class Report:
    """Gathers files in a folder; missing ones are listed in `notes`, never an error."""

    def __init__(self, folder):
        self._folder = Path(folder)
        self.notes = []

    def text(self, name, text):
        """Add a text, with escapes where it is no Unicode, and without users in addresses."""
        path = self._folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(USER.sub("", text), "utf-8", "backslashreplace")

    def commands(self):
        """Output of the system's own commands."""
        for name, (command, kept) in COMMANDS.items():
            try:
                done = subprocess.run(command, check=False, text=True, errors="replace", stdin=subprocess.DEVNULL,
                                      stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=10)
                lines = (re.match(kept, line) for line in done.stdout.splitlines())
                text = "".join(line.group() + "\n" for line in lines if line)
                self.text(name, text[-LOG_END:])
                if done.returncode or not text:
                    self.notes.append(f"{name}: {command[0]} has ended with status {done.returncode}; "
                                      f"{len(done.stdout)} characters, of which {len(text)} may be kept")
            except (OSError, subprocess.TimeoutExpired) as error:
                self.notes.append(f"{name}: {error}")

    def versions(self):
        """Of the stack, of Python and of ROS."""
        packages = rospkg.RosPack()
        lines = [f"python {platform.python_version()}", f"time {time.ctime()}",
                 f"ROS {os.environ.get('ROS_DISTRO', '')}"]
        lines += [f"{name} {packages.get_manifest(name).version} in {packages.get_path(name)}"
                  for name in sorted(packages.list()) if name.startswith("robotont")]
        self.text("versions/stack.txt", "\n".join(lines) + "\n")

    def graph(self):
        """Names of nodes, topics and services, and own parameters, of the master."""
        try:
            _, _, state = probes.ask(rosgraph.get_master_uri(), 4.0, "getSystemState", CALLER)
            _, _, parameters = probes.ask(rosgraph.get_master_uri(), 4.0, "getParam", CALLER, "/")
        except Exception as error:  # whatever is wrong with the master, the rest of the report is wanted
            self.notes.append(f"nodes and parameters: no ROS master answers ({type(error).__name__})")
            return
        kinds = zip(("publishers", "subscribers", "services"), state)
        self.text("ros/graph.yaml", yaml.safe_dump({kind: dict(map(tuple, pairs)) for kind, pairs in kinds}))
        self.text("ros/parameters.yaml", yaml.safe_dump(own_parameters(parameters)))

    def logs(self, *folders):
        """The ends of the newest log files of own nodes."""
        own = re.compile(rf"(?:\w+-)*(?:{'|'.join(OWN)})-\d+(?:-stdout)?\.log(?:\.\d+)?")
        files = [path for folder in set(folders) for path in Path(folder).rglob("*")
                 if own.fullmatch(path.name) and path.is_file() and not path.is_symlink()]
        if not files:
            self.notes.append(f"logs/ros: no log file of the robot's nodes in {', '.join(sorted(set(folders)))}")
        for path in sorted(files, key=lambda path: path.stat().st_mtime)[-LOG_FILES:]:
            try:
                with open(path, "rb") as file:
                    file.seek(max(0, path.stat().st_size - LOG_END))
                    self.text(f"logs/ros/{path.parent.name}/{path.name}", file.read().decode("utf-8", "replace"))
            except OSError as error:
                self.notes.append(f"{path}: {error}")

    def black_box(self, folder):
        """One bag for each run of the recorder."""
        runs = runs_in(folder)
        if not runs:
            self.notes.append(f"black box: none in {folder}: --black-box FOLDER, where it is elsewhere; to have one: "
                              "roslaunch robotont_bringup recorder.launch folder:=$HOME/black_box (beside ./robotont "
                              "sim: ./robotont shell -c '...')")
        for number, run in enumerate(runs):
            output = self._folder / "black_box" / f"{number:02d}.bag"
            output.parent.mkdir(exist_ok=True)
            self.notes += [f"black box {words}" for words in merge(bags_of(run), output, kept)[1]]


def own_parameters(parameters):
    """Of all parameters, a dictionary, those of own nodes' tables and of wheels, which are numbers or names."""
    found = {}
    for name, value in parameters.items():
        table = TABLES.get(name)
        if name in KEYS:
            found[name] = value if all(map(is_number, value if isinstance(value, list) else [value])) else "(a text)"
        elif table and isinstance(value, dict):
            found[name] = {one.name: value[one.name] for one in table.PARAMETERS if one.name in value and (
                one.accepts(value[one.name]) and (one.name in WORDS or not isinstance(value[one.name], str)))}
        elif isinstance(value, dict):
            inner = own_parameters(value)
            found.update({name: inner} if inner else {})
    return found


def kept(topic, raw):
    """What of a message of the black box goes into the report: itself, a part of it, or None.

    raw: (type, data, ..., class) of rosbag.
    """
    if raw[0] in TOPICS:
        return raw[-1]().deserialize(raw[1])
    if raw[0] == "std_msgs/String" and topic.rpartition("/")[2] in PACKETS:
        message = raw[-1]().deserialize(raw[1])
        return message if NUMBERS.fullmatch(message.data) else None
    if raw[0] == "diagnostic_msgs/DiagnosticArray":
        message = DiagnosticArray().deserialize(raw[1])
        message.status = [one for one in message.status if one.name.partition(":")[0].rpartition("/")[2] in OWN]
        return message
    return None


def parse_arguments():
    """Options of the command line."""
    folder = next(parameter.default for parameter in recorder_node.PARAMETERS if parameter.name == "folder")
    parser = ArgumentParser(
        prog="./robotont report",
        description="Pack the black box, versions, and the robot's parameters and logs for whoever is asked for help. "
        "No program whose words are in it knows a password or a token. The names of all nodes and topics are in it, "
        "and this computer's addresses, devices, disk and memory.")
    parser.add_argument("--output", metavar="FILE.tar.gz",
                        help="default: robotont_report_TIME.tar.gz in this folder")
    parser.add_argument("--black-box", default=folder, metavar="FOLDER", help="of recorder_node [%(default)s]")
    return parser.parse_args()


def main():
    """Run report; returns the exit status."""
    options = parse_arguments()
    output = options.output or time.strftime("robotont_report_%Y-%m-%dT%H-%M-%S.tar.gz")
    with tempfile.TemporaryDirectory(prefix="robotont_report_") as folder:
        report = Report(folder)
        for part, *arguments in ((report.versions,), (report.commands,), (report.graph,),
                                 (report.logs, rospkg.get_log_dir(), os.path.expanduser("~/.ros/log")),
                                 (report.black_box, options.black_box)):
            try:
                part(*arguments)
            except Exception as error:  # whatever is wrong on this machine, the rest is wanted all the more
                report.notes.append(f"the rest of {part.__name__}: {type(error).__name__}")
        try:
            report.text("notes.txt", "".join(note + "\n" for note in report.notes) or "nothing is missing\n")
            with new_file(output, 0o600) as file, tarfile.open(fileobj=file, mode="w:gz") as archive:  # for its owner
                archive.add(folder, arcname=Path(output).name.partition(".tar")[0])
        except OSError as error:
            print(f"report: {output}: {error.strerror or error}: --output FILE.tar.gz, and TMPDIR, where there is room",
                  file=sys.stderr)
            return 1
    for note in report.notes:
        print("note:", note.encode("utf-8", "backslashreplace").decode())
    print(f"{output}: {os.path.getsize(output) / 1000:.0f} kB; look into it before you hand it on: tar tzf {output}")
    return 0
