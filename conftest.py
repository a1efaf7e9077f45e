"""Lets pytest run rostests: each .test file is one test, with a ROS master of its own.

A comment such as <!-- needs: chromium, /dev/uinput --> names programs and files without which a .test file is skipped.
Tests whose bounds are in real time are marked `timed`, rostests by a name timed_*.test: `./robotont test` runs them
apart, four at a time; alone_*.test, which measure milliseconds or keep both cores busy, follow one by one.
./robotont test runs long_*.test only when asked for (-m long), nightly_*.test once a day.
"""

import contextlib
import importlib.util
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path
from xml.etree import ElementTree

import pytest

# The official package robotont_msgs, where it is neither installed nor in the workspace: the folder to import it from.
ROBOTONT_MSGS = Path(os.environ.get("ROBOTONT_MSGS",
                                    str(Path(__file__).parent / ".build/robotont_msgs/lib/python3/dist-packages")))

# The longest files of each step of ./robotont test begin first: else one is left when all others are done.
LONG = ("test_web_teleop_node", "status", "goto", "simulator_node", "launches",
        "robotont_node", "stack", "simulator_drive", "official_boards", "serial_com_node",
        "test_web_page_looks", "test_nothing_is_left_running", "test_web_page", "test_robotont_script", "test_boot",
        "test_exercise", "test_navigation_launch", "test_fleet_access", "test_firmware_suites", "test_two_launches",
        "test_hands_through_the_mux", "test_gyro", "test_sim_driving", "test_firmware_bounds", "test_sim_faults",
        "test_presses", "test_press_histories", "test_old_commands", "test_fleet", "test_keyboard_terminal",
        "test_network", "test_cmd_vel_mux_restarts", "timed_odom_node")


class WithoutTf2:
    """tf2 is compiled for the system's Python: on another one (test --python3.8) who imports it is skipped."""

    @staticmethod
    def find_spec(name, _path=None, _target=None):
        """Called by Python."""
        if name == "tf2_py":
            pytest.skip("needs tf2_py, which is compiled for the system's Python only", allow_module_level=True)


if "ROBOTONT_WITHOUT_TF2" in os.environ:
    sys.meta_path.insert(0, WithoutTf2)


def pytest_configure(config):
    """No test reaches a robot that runs; a rostest's program is run by its launch file alone."""
    os.environ.pop("ROS_MASTER_URI", None)
    for word in config.invocation_params.args:
        file = Path(str(word).partition("::")[0])
        if file.name.startswith("rostest_"):
            test = next((one for one in file.parent.glob("*.test") if file.name in one.read_text()), file.parent)
            raise pytest.UsageError(f"{file.name} is run by its launch file: ./robotont test {test}")


def pytest_collect_file(file_path, parent):
    """Take .test files."""
    if file_path.suffix == ".test":
        return RostestFile.from_parent(parent, path=file_path)
    return None


def pytest_collection_modifyitems(items):
    """The longest first."""
    items.sort(key=lambda item: LONG.index(item.path.stem) if item.path.stem in LONG else len(LONG))


class RostestFile(pytest.File):
    """A launch file that rostest runs."""

    def collect(self):
        """One item."""
        rostest = Rostest.from_parent(self, name=self.path.stem)
        rostest.add_marker(pytest.mark.rostest)
        if self.path.name.startswith(("timed_", "alone_")):
            rostest.add_marker(pytest.mark.timed)
        for mark in ("long", "nightly"):
            if self.path.name.startswith(mark + "_"):
                rostest.add_marker(mark)
        if self.path.name.startswith("alone_"):
            rostest.add_marker(pytest.mark.alone)
        if self.path.name == "robotont_msgs.test" and not has_robotont_msgs():
            rostest.add_marker(pytest.mark.skip(
                reason="needs the official package robotont_msgs at $ROBOTONT_MSGS or .build/robotont_msgs"))
        yield rostest


class Rostest(pytest.Item):
    """A run of rostest."""

    def runtest(self):
        """Run it; all that it prints is shown when it fails, what its tests print with -s as well."""
        for need in _needs(self.path.read_text()):
            if not (shutil.which(need) or os.access(need, os.W_OK)):
                pytest.skip(f"{self.name}: no {need}")
        environment = {**os.environ, "ROS_IP": "127.0.0.1"}
        environment.pop("ROS_MASTER_URI", None)
        environment.pop("ROS_HOSTNAME", None)
        environment["ROBOTONT_TOOLS"] = sysconfig.get_path("purelib")  # the tests' own, on no node's path
        environment["PYTHONPATH"] = os.pathsep.join(filter(None, [os.environ.get("PYTHONPATH"), str(ROBOTONT_MSGS)]))
        with tempfile.TemporaryDirectory() as results:
            environment["ROS_TEST_RESULTS_DIR"] = results
            result = subprocess.run(["rostest", str(self.path)], env=environment, check=False,
                                    stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
            for found in Path(results).rglob("rosunit-*.xml"):
                with contextlib.suppress(ElementTree.ParseError):  # its node has crashed
                    print(ElementTree.parse(str(found)).findtext(".//system-out"))
        if result.returncode:
            raise RostestError(result.stdout)

    def repr_failure(self, excinfo, style=None):
        """What rostest printed."""
        if isinstance(excinfo.value, RostestError):
            return str(excinfo.value)
        return super().repr_failure(excinfo, style)

    def reportinfo(self):
        """Where it stands."""
        return self.path, 0, "rostest " + self.name


def has_robotont_msgs():
    """Whether robotont_msgs can be imported, or lies at ROBOTONT_MSGS."""
    return (ROBOTONT_MSGS / "robotont_msgs").is_dir() or importlib.util.find_spec("robotont_msgs") is not None


def _needs(text):
    """Programs and files that the comment "needs: ..." of a .test file names."""
    comment = re.search(r"<!-- needs: (.*?) -->", text)
    return comment[1].split(", ") if comment else []


class RostestError(Exception):
    """rostest ended with an error; holds what it printed."""
