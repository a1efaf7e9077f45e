"""Each package.xml declares what its package uses, and packages use only what stands below them.

catkin_lint looks at CMake and launch files, and catkin itself at circles; neither looks at Python's imports.
"""

import ast
import re
from pathlib import Path
from xml.etree import ElementTree

import pytest
import rospkg

ROOT = Path(__file__).resolve().parents[2]
ORDER = ["robotont_boards", "robotont_driver", "robotont_firmware", "robotont_description",
         "robotont_calibration", "robotont_simulator", "robotont_map_navigation", "robotont_teleop",
         "robotont_bringup", "robotont_course", "robotont_operations", "robotont_fleet", "robotont_demo",
         "robotont_testing"]
PACKAGES = [name for name in ORDER if (ROOT / name / "package.xml").exists()]
RUN_TIME = ("exec_depend", "depend")
# Under the official stack's file names, for packages that include them; they start what stands above.
OFFICIAL = {"robotont_driver/launch/fake_driver.launch"}
# Messages of the official robot, and of its tags: used where they are, and missed nowhere else
WHERE_INSTALLED = {"robotont_msgs", "ar_track_alvar_msgs"}


def declared(package, *kinds):
    """Modules and ROS packages that a package.xml names, python3-numpy as numpy."""
    root = ElementTree.parse(str(ROOT / package / "package.xml")).getroot()
    return {re.sub(r"^python3-|-pip$|\.yaml$", "", tag.text) for kind in kinds for tag in root.findall(kind)}


KNOWN = set(rospkg.RosPack().list()).union(*(declared(package, *RUN_TIME, "test_depend") for package in PACKAGES))


def imported(file):
    """Modules that a Python file imports."""
    for node in ast.walk(ast.parse(file.read_text())):
        names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else \
            [node.module] if isinstance(node, ast.ImportFrom) and not node.level else []
        yield from (name.split(".")[0].replace("PIL", "pil") for name in names)


def used(package, folders):
    """{module or ROS package: a file that uses it}, but for the standard library; not what a `require` asks for."""
    found = {}
    for file in (file for folder in folders for file in (ROOT / package / folder).rglob("*") if file.is_file()):
        text = file.read_text() if file.suffix in (".py", ".launch", ".test", "") else ""
        if file.suffix == ".py" or text.startswith("#!/usr/bin/env python3"):
            names = set(imported(file))
        elif str(file.relative_to(ROOT)) in OFFICIAL:
            names = set()
        else:
            names = set(re.findall(r'(?:\$\(find |pkg=")(\w+)', text))
            require = re.search(r'/require\s+([^"]*)', text)
            names -= {*require[1].split(), *re.findall(r"'(\w+)'", text)} if require else set()
        found.update(dict.fromkeys((names & KNOWN) - {package} - WHERE_INSTALLED, str(file.relative_to(ROOT))))
    return found


@pytest.mark.parametrize("package", PACKAGES)
def test_what_a_package_and_its_tests_use_is_declared_and_stands_below_it(package):
    of_package, run_time = used(package, ["src", "scripts", "root", "launch"]), declared(package, *RUN_TIME)
    assert not {name: file for name, file in of_package.items() if name not in run_time}, "package.xml lacks it"
    known = run_time | declared(package, "test_depend")
    lacking = {name: file for name, file in used(package, ["test"]).items() if name not in known}
    assert not lacking, "package.xml lacks <test_depend>"
    assert (run_time | set(of_package)) & set(ORDER) <= set(ORDER[:ORDER.index(package)])


def test_a_robot_gets_nothing_that_it_does_not_need():
    brought, ahead = set(), ["robotont_bringup"]
    while ahead:
        more = declared(ahead.pop(), *RUN_TIME) - brought
        brought |= more
        ahead += more & set(PACKAGES)
    assert not brought & {"move_base", "amcl", "gmapping", "map_server", "robotont_simulator", "mujoco",
                          "robotont_calibration", "matplotlib", "rosbag"}


# Keys of rosdep's own lists (ros/rosdistro, rosdep/base.yaml and python.yaml) that our packages may use.
RULES = {f"python3-{name}" for name in (
    "hypothesis", "matplotlib", "mujoco-pip", "numpy", "opencv", "pil", "prometheus-client", "pytest", "qrcode",
    "rospkg", "scipy", "serial", "setuptools", "tornado", "yaml")} | {"iputils-ping", "liburdfdom-tools"}


@pytest.mark.parametrize("package", PACKAGES)
def test_rosdep_has_a_rule_for_every_key(package):
    """Else `rosdep install` of the workspace fails. What is no key of its lists is a ROS package."""
    root = ElementTree.parse(str(ROOT / package / "package.xml")).getroot()
    keys = {tag.text for tag in root if tag.tag.endswith("depend")}
    assert {key for key in keys if "-" in key} <= RULES


def test_each_kind_of_message_is_installed_where_ros_is_debians():
    """No other package brings it for long: diagnostic_msgs came with diagnostic_updater, until that went."""
    kinds = set().union(*(declared(package, *RUN_TIME) for package in PACKAGES))
    used_by_nodes = {kind for kind in kinds if kind.endswith(("_msgs", "_srvs"))} - WHERE_INSTALLED
    of_others = {"std_msgs", "rosgraph_msgs", "actionlib_msgs"}  # rospy's and actionlib's own
    listed = (ROOT / "setup" / "apt_packages.txt").read_text().split()
    assert not {kind for kind in used_by_nodes - of_others if "python3-" + kind.replace("_", "-") not in listed}
