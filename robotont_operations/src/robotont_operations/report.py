"""./robotont report: one archive for whoever is asked for help: black box, versions, parameters, logs; no secrets."""

import os
import platform
import socket
import subprocess
import sys
import tarfile
import tempfile
import time
from pathlib import Path

import rosgraph
import rospkg
import yaml

from robotont_driver.parameters.command_line import CommandLine
from robotont_operations import probes
from robotont_operations.black_box_files import bags_of, merge, runs_in
from robotont_operations.privacy import clean_parameters, clean_text
from robotont_operations.recorder_node import PARAMETERS

CALLER = "/robotont_report"
LOG_END = 500_000   # [bytes] of each log that are kept, its end
LOG_FILES = 40      # the newest
PACKAGES = ("python3-rospy", "ros-noetic-rospy", "python3-numpy", "python3-serial", "rviz", "ros-noetic-rviz",
            "systemd")
COMMANDS = {
    "versions/system.txt": ("uname", "-a"),
    "versions/packages.txt": ("dpkg-query", "-W", *PACKAGES),
    "machine/usb.txt": ("lsusb",),
    "machine/disk.txt": ("df", "-h"),
    "machine/memory.txt": ("free", "-m"),
    "machine/addresses.txt": ("ip", "-brief", "address"),
    "logs/kernel.txt": ("dmesg", "--ctime"),
    "logs/services.txt": ("systemctl", "--no-pager", "status", "robotont-master", "robotont", "robotont-recorder"),
    "logs/journal.txt": ("journalctl", "--no-pager", "--lines", "5000", "--output", "short-precise",
                         "--unit", "robotont*"),
}


class Report:
    """Gathers files in a folder; missing ones are listed in `notes`, never an error."""

    def __init__(self, folder):
        self._folder = Path(folder)
        self.notes = []

    def text(self, name, text):
        """Add a string, with its secrets removed."""
        path = self._folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(clean_text(text), "utf-8")

    def commands(self):
        """Output of the system's own commands."""
        for name, command in COMMANDS.items():
            try:
                done = subprocess.run(command, check=False, text=True, errors="replace", stdin=subprocess.DEVNULL,
                                      stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=10)
                self.text(name, done.stdout[-LOG_END:])
            except (OSError, subprocess.TimeoutExpired) as error:
                self.notes.append(f"{name}: {error}")

    def versions(self):
        """Of the stack, of Python and of ROS."""
        packages = rospkg.RosPack()
        lines = [f"python {platform.python_version()}", f"host {socket.gethostname()}", f"time {time.ctime()}"]
        lines += [f"{name} {packages.get_manifest(name).version} in {packages.get_path(name)}"
                  for name in sorted(packages.list()) if name.startswith("robotont")]
        lines += [f"{name}={value}" for name, value in sorted(os.environ.items()) if name.startswith("ROS_")]
        git = subprocess.run(["git", "-C", packages.get_path("robotont_operations"), "log", "-1", "--format=%H %cI"],
                             check=False, text=True, capture_output=True)
        lines.append("commit " + (git.stdout.strip() or "unknown: no git repository"))
        self.text("versions/stack.txt", "\n".join(lines) + "\n")

    def graph(self):
        """Nodes, topics and parameters of a running system."""
        uri = rosgraph.get_master_uri()
        master = probes.remote(uri, 5.0)
        try:
            state = master.getSystemState(CALLER)[2]
            parameters = master.getParam(CALLER, "/")[2]
        except Exception as error:  # whatever is wrong with the master, the rest of the report is wanted
            self.notes.append(f"nodes and parameters: no ROS master at {uri} ({error})")
            return
        kinds = zip(("publishers", "subscribers", "services"), state)
        self.text("ros/graph.yaml", yaml.safe_dump({kind: dict(map(tuple, pairs)) for kind, pairs in kinds}))
        (self._folder / "ros/parameters.yaml").write_text(yaml.safe_dump(clean_parameters(parameters)), "utf-8")

    def settings(self):
        """The files of install-robot in /etc, with the user's changes."""
        for path in sorted(Path("/etc/robotont").glob("*")) if Path("/etc/robotont").is_dir() else ():
            try:
                self.text(f"settings/{path.name}", path.read_text("utf-8", "replace"))
            except OSError as error:
                self.notes.append(f"settings/{path.name}: {error}")

    def logs(self, folder):
        """The ends of the newest log files of ROS."""
        files = [path for path in Path(folder).rglob("*") if path.is_file() and not path.is_symlink()]
        for path in sorted(files, key=lambda path: path.stat().st_mtime)[-LOG_FILES:]:
            try:
                with open(path, "rb") as file:
                    file.seek(max(0, path.stat().st_size - LOG_END))
                    self.text(f"logs/ros/{path.relative_to(folder)}", file.read().decode("utf-8", "replace"))
            except OSError as error:
                self.notes.append(f"{path}: {error}")

    def black_box(self, folder):
        """One bag for each run of the recorder."""
        try:
            runs = runs_in(folder)
        except OSError as error:
            runs = []
            self.notes.append(f"black box: {error}")
        if not runs:
            self.notes.append(f"black box: none in {folder}: --black-box FOLDER, where it is elsewhere; to have one: "
                              "roslaunch robotont_bringup recorder.launch folder:=$HOME/black_box (beside ./robotont "
                              "sim: ./robotont shell -c '...')")
        for run in runs:
            output = self._folder / "black_box" / (run.name + ".bag")
            output.parent.mkdir(exist_ok=True)
            self.notes += [f"black box {words}" for words in merge(bags_of(run), output)[1]]


def pack(folder, output):
    """Write the folder as a compressed archive that only its owner may read."""
    handle = os.open(str(output), os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600)
    with os.fdopen(handle, "wb") as file, tarfile.open(fileobj=file, mode="w:gz") as archive:
        archive.add(str(folder), arcname=Path(output).name.partition(".tar")[0])


def parse_arguments():
    """Options of the command line."""
    folder = next(parameter.default for parameter in PARAMETERS if parameter.name == "folder")
    parser = CommandLine(
        prog="./robotont report",
        description="Pack the black box, versions, parameters and logs for whoever is asked for help. "
        "Passwords, tokens and keys are removed; look into the archive before you hand it on.")
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
        for part, *arguments in ((report.versions,), (report.commands,), (report.graph,), (report.settings,),
                                 (report.logs, rospkg.get_log_dir()), (report.black_box, options.black_box)):
            try:
                part(*arguments)
            except Exception as error:  # whatever is wrong on this machine, the rest is wanted all the more
                report.notes.append(f"the rest of {part.__name__}: {type(error).__name__}: {error}")
        report.text("notes.txt", "".join(note + "\n" for note in report.notes) or "nothing is missing\n")
        try:
            pack(folder, output)
        except OSError as error:
            print(f"report: {output}: {error.strerror}: --output FILE.tar.gz where there is room", file=sys.stderr)
            return 1
    for note in report.notes:
        print("without", note)
    size = os.path.getsize(output) / 1e6
    size = f"{size:.1f} MB" if size >= 0.1 else f"{1000 * size:.0f} kB"
    print(f"{output}: {size}; look into it before you hand it on: tar tzf {output}")
    return 0
