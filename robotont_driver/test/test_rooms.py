"""Each folder of robotont_driver imports only from those below it, and most know neither rospy nor a clock."""

import ast
from pathlib import Path

import pytest

SOURCE = Path(__file__).resolve().parents[1] / "src" / "robotont_driver"
PURE = ["parameters", "kinematics", "robots", "odometry", "protocol", "command"]
ROOMS = [*PURE, "link", "rospy_repairs", "ros", "nodes"]
IMPURE_MODULES = {"rospy", "rospkg", "roslib", "genpy", "serial", "time", "threading", "socket", "std_msgs"}


def imports(room):
    """(file, module) of each import in a room."""
    for file in sorted((SOURCE / room).rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text())):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import) else \
                [node.module] if isinstance(node, ast.ImportFrom) else []
            yield from ((file.name, name) for name in names)


def test_each_module_is_in_a_room():
    assert {path.name for path in SOURCE.iterdir()} - {"__pycache__"} == {*ROOMS, "__init__.py"}


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_imports_only_from_rooms_below(room):
    above = ROOMS[ROOMS.index(room) + 1:]
    wrong = [(file, name) for file, name in imports(room)
             if name.startswith("robotont_driver.") and name.split(".")[1] in above]
    assert not wrong


@pytest.mark.parametrize("room", PURE)
def test_a_pure_room_imports_no_ros_no_port_and_no_clock(room):
    impure = [(file, name) for file, name in imports(room) if name.split(".")[0] in IMPURE_MODULES]
    assert impure == ([("robot_folder.py", "rospkg")] if room == "robots" else []), "which finds the robots shipped"
