"""Each package.xml declares what its package uses, and packages use only what stands below them."""

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
ORDER = ["robotont_testing", "robotont_firmware", "robotont_driver", "robotont_description", "robotont_calibration",
         "robotont_simulator", "robotont_map_navigation", "robotont_teleop", "robotont_bringup", "robotont_operations",
         "robotont_demo"]
PACKAGES = [name for name in ORDER if (ROOT / name / "package.xml").exists()]
ROSDEP_KEYS = {  # of modules that are no ROS packages
    "PIL": "python3-pil", "evdev": "python3-evdev", "hypothesis": "python3-hypothesis",
    "matplotlib": "python3-matplotlib", "mpmath": "python3-mpmath", "mujoco": "python3-mujoco-pip",
    "numpy": "python3-numpy", "pytest": "python3-pytest", "qrcode": "python3-qrcode", "rospkg": "python3-rospkg",
    "ruamel": "python3-ruamel.yaml", "scipy": "python3-scipy", "serial": "python3-serial",
    "tornado": "python3-tornado", "yaml": "python3-yaml",
}
ON_THE_BOARD = {"machine", "micropython", "pyb", "stm"}  # modules of MicroPython
# What a robot needs to drive: nothing for drawing, calibrating, recording or testing.
ON_A_ROBOT = {"diagnostic_msgs", "diagnostic_updater", "geometry_msgs", "nav_msgs", "python3-numpy",
              "python3-rospkg", "python3-serial", "python3-yaml", "rosgraph", "rospy", "sensor_msgs", "std_msgs",
              "std_srvs", "tf2_msgs", "tf2_ros"}
# Under the official stack's file names, for packages that include them; they start what stands above.
OFFICIAL = {"robotont_driver/launch/fake_driver.launch"}
# The packages of github.com/robotont and its courses. Two of one name cannot share a workspace, so ours take no name of
# theirs but those of the two that they replace (docs/from-the-official-stack.md).
OFFICIAL_PACKAGES = {
    "demo_ar_steering", "demo_slam", "demo_teleop", "robotont_demos", "robotont_description", "robotont_driver",
    "robotont_gazebo", "robotont_lite_description", "robotont_msgs", "robotont_navigation", "robotont_nuc_description",
    "robotont_sensors", "robotont_support", "robotont_tutorials", "robotont_webapp", "ros_koolitus",
}
NO_KEY = {"atheris"}  # of setup/pypi; rosdep has no name for them. For tests only
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
    """{top-level module: one file that imports it}, but for the standard library and the package's own."""
    own = {file.stem for file in python_files(package, ["test"])} | {package, "conftest"}
    modules = {}
    for file in python_files(package, folders):
        for node in ast.walk(ast.parse(file.read_text())):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else \
                [node.module] if isinstance(node, ast.ImportFrom) and not node.level else []
            modules.update({name.split(".")[0]: file.relative_to(ROOT) for name in names})
    known = own | WHERE_INSTALLED | NO_KEY
    return {name: file for name, file in modules.items() if name not in known and not is_standard(name)}


@lru_cache(maxsize=None)
def is_standard(name):
    """Whether a module belongs to Python itself."""
    if name in ON_THE_BOARD or name in sys.builtin_module_names:
        return True
    if name in ROSDEP_KEYS or name in ORDER:
        return False
    found = importlib.util.find_spec(name)
    if found is None:
        return False
    place = found.origin or ""
    return place in ("built-in", "frozen") or \
        (place.startswith(sysconfig.get_path("stdlib")) and "-packages" not in place)


def key(module):
    """What package.xml says for a module."""
    return ROSDEP_KEYS.get(module, module)


def launched(package, pattern):
    """{ROS package: file} in $(find ...) and pkg="..."; not those that the file's `require` asks for first."""
    packages = {}
    for folder in (ROOT / package).iterdir():
        for file in sorted(folder.resolve().rglob(pattern)) if folder.is_dir() else ():
            if str(file.relative_to(ROOT)) in OFFICIAL:
                continue
            text = file.read_text()
            names = set(re.findall(r"\$\(find (\w+)\)", text)) | set(re.findall(r'pkg="(\w+)"', text))
            packages.update({name: file.relative_to(ROOT) for name in names - {package} - required(text)})
    return packages


def required(text):
    """Packages that a launch file asks for by `require`, directly or through an argument's choices: 'amcl'."""
    found = re.search(r'/require\s+([^"]*)', text)
    return set(found.group(1).split()) | set(re.findall(r"'(\w+)'", text)) if found else set()


@pytest.mark.parametrize("package", PACKAGES)
def test_what_a_package_uses_is_declared(package):
    used = {**imported(package, "src", "scripts", "root"), **launched(package, "*.launch")}
    undeclared = {key(name): str(file) for name, file in used.items() if key(name) not in at_run_time(package)}
    assert not undeclared, f"{package}/package.xml lacks <exec_depend> of what these files use"


@pytest.mark.parametrize("package", PACKAGES)
def test_what_tests_use_is_declared(package):
    used = {**imported(package, "test"), **launched(package, "*.test")}
    known = at_run_time(package) | declared(package, "test_depend")
    undeclared = {key(name): str(file) for name, file in used.items() if key(name) not in known}
    assert not undeclared, f"{package}/package.xml lacks <test_depend> of what these files use"
    if list((ROOT / package / "test").glob("*.test")):
        assert "rostest" in known


@pytest.mark.parametrize("package", PACKAGES)
def test_what_cmake_needs_is_configured_first(package):
    """catkin takes the order of packages from build and test dependencies only: an exec_depend comes too late."""
    needed = set(re.findall(r"find_package\((robotont_\w+)", (ROOT / package / "CMakeLists.txt").read_text()))
    assert needed <= declared(package, "depend", "build_depend", "test_depend")


@pytest.mark.parametrize("package", PACKAGES)
def test_no_module_is_declared_in_vain(package):
    """Of the keys that stand for modules; other packages are programs, plug-ins and messages."""
    used = {key(name) for name in imported(package, "src", "scripts", "root")}
    assert at_run_time(package) & set(ROSDEP_KEYS.values()) <= used


@pytest.mark.parametrize("package", PACKAGES)
def test_a_package_uses_only_what_stands_below_it(package):
    below = set(ORDER[:ORDER.index(package)])
    used = at_run_time(package) | set(imported(package, "src", "scripts", "root")) | set(launched(package, "*.launch"))
    assert {name for name in used if name in ORDER} <= below


def test_no_cycle_not_even_through_tests():
    above = {package: declared(package, "exec_depend", "depend", "build_depend", "test_depend") & set(ORDER)
             for package in PACKAGES}
    while above:
        free = [package for package, needs in above.items() if not needs & set(above)]
        assert free, f"a cycle among {above}"
        for package in free:
            del above[package]


@lru_cache(maxsize=None)
def imports_of_modules():
    """{module: modules that it imports}, of all packages, also those that functions import."""
    files = {f"{package}.{'.'.join(file.relative_to(ROOT / package / 'src' / package).with_suffix('').parts)}": file
             for package in PACKAGES for file in python_files(package, ["src"])}
    imports = {}
    for module, file in files.items():
        names = set()
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.ImportFrom) and node.module:
                names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
        imports[module] = names & set(files)
    return imports


def test_no_modules_import_each_other_in_a_circle():
    above = dict(imports_of_modules())
    while above:
        free = [module for module, needs in above.items() if not needs & set(above)]
        assert free, f"a circle among {sorted(above)}"
        for module in free:
            del above[module]


@pytest.mark.parametrize("package", PACKAGES)
def test_a_package_brings_what_a_release_needs(package):
    root = ElementTree.parse(str(ROOT / package / "package.xml")).getroot()
    assert root.find("export/architecture_independent") is not None
    assert root.findtext("url").startswith("https://")
    assert f"\nChangelog for package {package}\n" in (ROOT / package / "CHANGELOG.rst").read_text()


@pytest.mark.parametrize("package", PACKAGES)
def test_catkin_knows_the_tests_of_a_package(package):
    assert "robotont_add_tests()" in (ROOT / package / "CMakeLists.txt").read_text()
    assert not [file for file in (ROOT / package / "test").glob("*.test") if "../config" in file.read_text()]


def test_a_robot_gets_nothing_that_it_does_not_need():
    assert at_run_time("robotont_driver") <= ON_A_ROBOT


def test_all_packages_have_their_place():
    assert {file.parent.name for file in ROOT.glob("robotont_*/package.xml")} <= set(ORDER)


def test_the_official_packages_can_stay_in_the_workspace():
    ours = {ElementTree.parse(str(file)).getroot().findtext("name") for file in ROOT.glob("*/package.xml")}
    assert ours & OFFICIAL_PACKAGES == {"robotont_driver", "robotont_description"}


@pytest.mark.parametrize("file", sorted((ROOT / "launch").glob("*.launch")), ids=lambda file: file.name)
def test_a_launch_file_asks_first_for_what_bringup_does_not_bring(file):
    """`require` stands before everything else that has an effect."""
    text = file.read_text()
    if set(re.findall(r'pkg="(\w+)"', text)) <= at_run_time("robotont_bringup"):
        return
    first = next(tag for tag in ElementTree.fromstring(text) if tag.tag != "arg")
    assert "/require " in first.get("command", "")


def test_a_robot_is_started_without_simulator_and_navigation_stack():
    brought, ahead = set(), ["robotont_bringup"]
    while ahead:
        more = at_run_time(ahead.pop()) - brought
        brought |= more
        ahead += more & set(PACKAGES)
    assert not brought & {"move_base", "amcl", "gmapping", "map_server", "robotont_simulator", "python3-mujoco-pip",
                          "robotont_calibration", "python3-matplotlib", "rosbag"}
