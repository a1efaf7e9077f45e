"""Each package.xml declares what its package uses, and packages use only what stands below them.

catkin_lint looks at CMake and launch files, and catkin itself at circles; neither looks at Python's imports.
"""

import ast
import importlib.util
import re
import sys
import sysconfig
from functools import lru_cache
from pathlib import Path
from xml.etree import ElementTree

import pytest

ROOT = Path(__file__).resolve().parents[2]
ORDER = ["robotont_boards", "robotont_firmware", "robotont_driver", "robotont_description", "robotont_calibration",
         "robotont_simulator", "robotont_map_navigation", "robotont_teleop", "robotont_bringup", "robotont_operations",
         "robotont_fleet", "robotont_demo", "robotont_testing"]
PACKAGES = [name for name in ORDER if (ROOT / name / "package.xml").exists()]
ROSDEP_KEYS = {  # of modules that are no ROS packages
    "PIL": "python3-pil", "mujoco": "python3-mujoco-pip", "ruamel": "python3-ruamel.yaml",
    **{name: "python3-" + name for name in ("evdev", "hypothesis", "matplotlib", "mpmath", "numpy", "pytest", "qrcode",
                                            "rospkg", "scipy", "serial", "tornado", "yaml")}}
ON_THE_BOARD = {"machine", "micropython", "pyb", "stm"}  # modules of MicroPython
# What a robot needs to drive: nothing for drawing, calibrating, recording or testing.
ON_A_ROBOT = {"diagnostic_msgs", "geometry_msgs", "nav_msgs", "python3-numpy",
              "python3-rospkg", "python3-serial", "python3-yaml", "rosgraph", "rospy", "sensor_msgs", "std_msgs",
              "std_srvs", "tf2_msgs", "tf2_ros"}
# Under the official stack's file names, for packages that include them; they start what stands above.
OFFICIAL = {"robotont_driver/launch/fake_driver.launch"}
# The packages of github.com/robotont and its courses. Two of one name cannot share a workspace, so ours take no name of
# theirs but those of the two that they replace (docs/from-the-official-stack.md).
OFFICIAL_PACKAGES = {
    "demo_ar_steering", "demo_slam", "demo_teleop", "robotont_demos", "robotont_description", "robotont_driver",
    "robotont_gazebo", "robotont_lite_description", "robotont_msgs", "robotont_navigation", "robotont_nuc_description",
    "robotont_sensors", "robotont_support", "robotont_tutorials", "robotont_webapp", "ros_koolitus"}
NO_KEY = {"zenoh"}  # of setup/pypi; rosdep has no name for them. Who needs them says so
WHERE_INSTALLED = {"robotont_msgs"}  # messages of the official robot: used where they are, and missed nowhere else


def declared(package, *kinds):
    """Names in package.xml under some kinds of tags, e.g. exec_depend."""
    root = ElementTree.parse(str(ROOT / package / "package.xml")).getroot()
    return {tag.text for kind in kinds for tag in root.findall(kind)}


def at_run_time(package):
    return declared(package, "exec_depend", "depend")


def python_files(package, folders):
    """Modules and scripts, with or without .py."""
    files = [file for folder in folders for file in (ROOT / package / folder).rglob("*") if file.is_file()]
    return [file for file in files if file.suffix == ".py" or
            (not file.suffix and file.read_bytes().startswith(b"#!/usr/bin/env python3"))]


@lru_cache(maxsize=None)
def imported(package, *folders):
    """{what package.xml says for a module: one file that imports it}, but for the standard library and its own."""
    own = {file.stem for file in python_files(package, ["test"])} | {package, "conftest"}
    own |= {file.parent.name for file in (ROOT / package / "src").glob("*/__init__.py")}
    modules = {}
    for file in python_files(package, folders):
        for node in ast.walk(ast.parse(file.read_text())):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else \
                [node.module] if isinstance(node, ast.ImportFrom) and not node.level else []
            modules.update({name.split(".")[0]: str(file.relative_to(ROOT)) for name in names})
    known = own | WHERE_INSTALLED | NO_KEY
    return {ROSDEP_KEYS.get(name, name): file for name, file in modules.items()
            if name not in known and not is_standard(name)}


@lru_cache(maxsize=None)
def is_standard(name):
    """Whether a module is Python's own, or MicroPython's."""
    found = importlib.util.find_spec(name) if name not in ON_THE_BOARD else None
    place = found.origin or "" if found else ""
    return name in ON_THE_BOARD or name in sys.builtin_module_names or place in ("built-in", "frozen") or \
        (place.startswith(sysconfig.get_path("stdlib")) and "-packages" not in place)


def launched(package, pattern):
    """{ROS package: file} in $(find ...) and pkg="..."; not those that the file's `require` asks for first."""
    packages = {}
    for folder in (ROOT / package).iterdir():
        for file in sorted(folder.resolve().rglob(pattern)) if folder.is_dir() else ():
            if str(file.relative_to(ROOT)) not in OFFICIAL:
                text = file.read_text()
                names = set(re.findall(r"\$\(find (\w+)\)", text)) | set(re.findall(r'pkg="(\w+)"', text))
                packages.update({name: str(file.relative_to(ROOT)) for name in names - {package} - required(text)})
    return packages


def required(text):
    """Packages that a launch file asks for by `require`, directly or through an argument's choices: 'amcl'."""
    found = re.search(r'/require\s+([^"]*)', text)
    return set(found.group(1).split()) | set(re.findall(r"'(\w+)'", text)) if found else set()


@pytest.mark.parametrize("package", PACKAGES)
def test_what_a_package_and_its_tests_use_is_declared_and_stands_below_it(package):
    used = {**imported(package, "src", "scripts", "root"), **launched(package, "*.launch")}
    run_time = at_run_time(package)
    assert not {name: file for name, file in used.items() if name not in run_time}, "package.xml lacks <exec_depend>"
    used_by_tests = {**imported(package, "test"), **launched(package, "*.test")}
    known = run_time | declared(package, "test_depend")
    assert not {name: file for name, file in used_by_tests.items() if name not in known}, "lacks <test_depend>"
    assert "rostest" in known or not list((ROOT / package / "test").glob("*.test"))
    assert run_time & set(ROSDEP_KEYS.values()) <= set(used), "declared in vain"
    assert (run_time | set(used)) & set(ORDER) <= set(ORDER[:ORDER.index(package)])


@pytest.mark.parametrize("package", PACKAGES)
def test_a_package_brings_what_a_release_needs_and_catkin_knows_its_tests(package):
    root = ElementTree.parse(str(ROOT / package / "package.xml")).getroot()
    assert root.find("export/architecture_independent") is not None
    assert root.findtext("url").startswith("https://")
    assert f"\nChangelog for package {package}\n" in (ROOT / package / "CHANGELOG.rst").read_text()
    has_tests = (ROOT / package / "test").exists()
    assert ("robotont_add_tests()" in (ROOT / package / "CMakeLists.txt").read_text()) == has_tests


def test_all_packages_have_their_place_and_the_official_ones_can_stay_in_the_workspace():
    ours = {file.parent.name for file in ROOT.glob("*/package.xml")}
    assert ours <= set(ORDER)
    assert ours & OFFICIAL_PACKAGES == {"robotont_driver", "robotont_description"}


@pytest.mark.parametrize("file", sorted((ROOT / "launch").glob("*.launch")), ids=lambda file: file.name)
def test_a_launch_file_asks_first_for_what_bringup_does_not_bring(file):
    """`require` stands before everything else that has an effect."""
    text = file.read_text()
    if not set(re.findall(r'pkg="(\w+)"', text)) <= at_run_time("robotont_bringup"):
        first = next(tag for tag in ElementTree.fromstring(text) if tag.tag != "arg")
        assert "/require " in first.get("command", "")


def test_a_robot_gets_nothing_that_it_does_not_need():
    assert at_run_time("robotont_driver") <= ON_A_ROBOT
    brought, ahead = set(), ["robotont_bringup"]
    while ahead:
        more = at_run_time(ahead.pop()) - brought
        brought |= more
        ahead += more & set(PACKAGES)
    assert not brought & {"move_base", "amcl", "gmapping", "map_server", "robotont_simulator", "python3-mujoco-pip",
                          "robotont_calibration", "python3-matplotlib", "rosbag"}
