"""Installed into an empty prefix, and out of reach of the source tree, everything starts."""

import os
import signal
import subprocess
from pathlib import Path

import pytest

from robotont_testing.harness import free_port, wait_for_master

pytestmark = pytest.mark.nightly
ROOT = Path(__file__).resolve().parents[2]
NEEDS_THE_STACK = {"navigation.launch": "move_base", "slam.launch": "gmapping",
                   "diagnostics.launch": "diagnostic_aggregator",
                   "camera_scan.launch": "depthimage_to_laserscan",
                   "robot_localization.launch": "robot_localization", "gamepad.launch": "teleop_twist_joy"}
PYTHON = "-DPYTHON_EXECUTABLE=/usr/bin/python3"
PARSE = """
import sys
from roslaunch.config import load_config_default
for file in sys.argv[1:]:
    try:
        nodes = load_config_default([file], None).nodes
        print(file, 'nodes', *(node.namespace + node.name for node in nodes), flush=True)
    except Exception as error:
        print(file, type(error).__name__, str(error).splitlines()[0], flush=True)
"""


def outside():
    """The environment of somebody who has sourced ROS, and no workspace."""
    environment = {name: value for name, value in os.environ.items() if name != "CMAKE_PREFIX_PATH"}
    opt = next((path for path in ("/opt/ros/noetic", "/opt/ros/one") if Path(path).exists()), None)
    return {**environment, "CMAKE_PREFIX_PATH": opt} if opt else environment


def run(environment, *words, timeout=300.0):
    """A finished program, started far from the source tree."""
    return subprocess.run([str(word) for word in words], env=environment, cwd="/", check=False, text=True,
                          stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=timeout)


@pytest.fixture(scope="module")
def prefix(tmp_path_factory):
    """The whole repository, installed as `catkin_make install` does it, without tests."""
    folder = tmp_path_factory.mktemp("installed")
    for command in (["cmake", "-S", ROOT, "-B", folder / "build", f"-DCMAKE_INSTALL_PREFIX={folder}/prefix",
                     f"-DCATKIN_DEVEL_PREFIX={folder}/devel", "-DCATKIN_ENABLE_TESTING=OFF", PYTHON],
                    ["cmake", "--build", folder / "build", "--target", "install"]):
        done = run(outside(), *command)
        assert done.returncode == 0, done.stdout
    return folder / "prefix"


def test_a_package_alone_configures_without_its_tests(tmp_path):
    done = run(outside(), "cmake", "-S", ROOT / "robotont_driver", "-B", tmp_path, PYTHON,
               f"-DCATKIN_DEVEL_PREFIX={tmp_path}/devel")
    assert done.returncode == 0, done.stdout
    assert "no tests of robotont_driver: robotont_testing is not in this workspace" in done.stdout


@pytest.fixture(scope="module")
def installed(prefix):
    """The environment of somebody who has sourced the prefix, and whose python has what Debian lacks."""
    kept = {name: os.environ[name] for name in ("HOME", "TMPDIR", "ROBOTONT_LIFELINE") if name in os.environ}
    sourced = subprocess.run(["bash", "-c", f". '{prefix}/setup.bash' && env -0"], check=True,
                             env={**kept, "PATH": "/usr/bin:/bin"}, stdout=subprocess.PIPE, cwd="/").stdout
    environment = dict(os.fsdecode(setting).split("=", 1) for setting in sourced.split(b"\0") if b"=" in setting)
    sites = [path for path in os.environ["PYTHONPATH"].split(":") if path.endswith("site-packages")]
    environment["PYTHONPATH"] = ":".join([environment["PYTHONPATH"], *sites])
    return {**environment, "ROS_MASTER_URI": f"http://127.0.0.1:{free_port()}", "ROS_IP": "127.0.0.1",
            "ROS_LOG_DIR": str(prefix.parent / "log")}


def test_all_is_there_and_the_source_tree_is_out_of_reach(prefix, installed):
    """What packages keep outside src/, scripts/ and test/ is all data that something opens."""
    for name in ("ROS_PACKAGE_PATH", "PYTHONPATH", "PATH", "CMAKE_PREFIX_PATH", "LD_LIBRARY_PATH"):
        paths = installed.get(name, "").split(":")
        assert not [path for path in paths if path.startswith(str(ROOT)) and not path.endswith("site-packages")]
    for file in prefix.rglob("*"):
        if file.is_file() and file.suffix != ".pyc":
            assert os.fsencode(ROOT) not in file.read_bytes(), f"{file} leads back to the source tree"
    assert not [file for file in prefix.glob("lib/robotont_*/*") if not os.access(str(file), os.X_OK)]
    for package in ROOT.glob("robotont_*/package.xml"):
        share = prefix / "share" / package.parent.name
        assert (share / "package.xml").exists()
        for folder in package.parent.iterdir():
            if folder.is_dir() and folder.name not in ("src", "test", "scripts", "cmake", "__pycache__"):
                for file in folder.resolve().rglob("*"):
                    place = share / folder.name / file.relative_to(folder.resolve())
                    assert file.is_dir() or file.suffix == ".pyc" or place.exists(), f"{place} is not installed"


def test_every_launch_file_parses(prefix, installed):
    files = sorted(map(str, (prefix / "share").glob("robotont_*/launch/*.launch")))
    assert len(files) >= len(list((ROOT / "launch").glob("*.launch")))
    lines = run(installed, "python3", "-c", PARSE, *files).stdout
    found = dict(line.split(maxsplit=1) for line in lines.splitlines() if line.startswith("/"))
    packages = run(installed, "rospack", "list-names").stdout.split()
    for file in files:
        name = Path(file).name
        if NEEDS_THE_STACK.get(name, "rospy") in packages:
            assert found[file].split()[0] == "nodes", lines
        else:
            assert found[file].startswith("RLException"), lines
            assert f"{name} needs the ROS package" in lines


def test_odometry_comes_from_the_simulated_robot(installed, tmp_path):
    """Whose launch file includes robot.launch and all of its nodes. A tool finds the shipped configuration."""
    assert float(run(installed, "rosrun", "robotont_description", "robot_radius").stdout) == 0.15
    with open(str(tmp_path / "output"), "wb") as output:
        process = subprocess.Popen(["roslaunch", "robotont_bringup", "simulation.launch", f"port:={tmp_path}/board"],
                                   env=installed, cwd="/", stdout=output, stderr=output, stdin=subprocess.DEVNULL,
                                   start_new_session=True)
    try:
        wait_for_master(installed["ROS_MASTER_URI"], 60.0)
        odometry = run(installed, "rostopic", "echo", "-n", "1", "odom/child_frame_id", timeout=60.0)
        assert "base_link" in odometry.stdout, (tmp_path / "output").read_text()
    finally:
        os.killpg(process.pid, signal.SIGINT)
        process.wait(30.0)
