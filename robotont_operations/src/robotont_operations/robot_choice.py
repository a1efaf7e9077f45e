"""Which robot starts at boot: the one that was named, or a proposal by the board that is plugged in."""

import glob
import re

from robotont_driver.link.which_robot import listen
from robotont_driver.protocol.connection import OFFICIAL
from robotont_driver.robots.robot_folder import read_robot

LINE = re.compile(r"^ROBOTONT_ROBOT=.*$", re.MULTILINE)


def chosen(robot):
    """What robot.conf gets for a `robot:=`: a name, or an absolute path. Raises OSError, ValueError for a wrong one."""
    folder = read_robot(robot).folder
    return str(folder.resolve()) if "/" in robot else folder.name


def with_robot(text, robot):
    """Contents of a robot.conf with that robot; "": as it is."""
    if not robot:
        return text
    line = "ROBOTONT_ROBOT=" + robot
    return LINE.sub(lambda _: line, text) if LINE.search(text) else text.rstrip("\n") + "\n" + line + "\n"


def ports():
    """Serial ports at which a board may be."""
    return sorted(glob.glob("/dev/ttyACM*"))


def proposal(seconds=1.0):
    """What to say about a board that is plugged in and wants another robot than the thesis'; empty without one."""
    for port in ports():
        try:
            name, robot = listen(port, 115200, seconds)
        except (OSError, ValueError):  # in use, as by the service that runs already
            continue
        if name in OFFICIAL:
            return f"the board at {port} speaks {name}: ./robotont install-robot {robot}"
    return ""
