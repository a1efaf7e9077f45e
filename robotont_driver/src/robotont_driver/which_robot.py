"""Command line of which_robot: listens to a board and prints the launch line that drives it. Needs no ROS master."""

import argparse
import select
import sys
import time

import serial

from robotont_driver.dialects.recognition import PATIENCE, Listener
from robotont_driver.serial_link import explain, usb_id

LINES = {
    "checked": "roslaunch robotont_bringup robot.launch port:={}",
    "plain": "roslaunch robotont_bringup robot.launch port:={}",
    "robotont2": "roslaunch robotont_bringup robot.launch generation:=2 port:={}",
    "robotont3": "roslaunch robotont_bringup robot.launch generation:=3 port:={}",
    "robotont2018": "roslaunch robotont_bringup robot.launch port:={}",
}


def listen(port, baudrate, seconds):
    """(dialect's name or None, description of the received data). Sends nothing. Raises OSError."""
    listener = Listener(wheels=3, usb_id=usb_id(port))
    with serial.Serial(port, baudrate, timeout=0, exclusive=True) as line:
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            if select.select([line.fileno()], [], [], max(0.0, end - time.monotonic()))[0]:
                name = listener.feed(line.read(4096))
                if name:
                    return name, ""
    return None, listener.heard


def main(arguments=None):
    """Run; returns the exit status."""
    parser = argparse.ArgumentParser(prog="which_robot", description=__doc__)
    parser.add_argument("port", nargs="?", default="/dev/ttyACM0", help="serial port [%(default)s]")
    parser.add_argument("--baudrate", type=int, default=115200, help="[%(default)s]")
    parser.add_argument("--seconds", type=float, default=2 * PATIENCE, help="how long to listen [%(default)s]")
    options = parser.parse_args(arguments)
    try:
        name, received = listen(options.port, options.baudrate, options.seconds)
    except (OSError, ValueError) as error:
        print(f"which_robot: {explain(options.port, error)}", file=sys.stderr)
        return 1
    if name is None:
        print(f"which_robot: {options.port}: {received}", file=sys.stderr)
        return 1
    print(f"the board speaks {name}; start it with\n  {LINES[name].format(options.port)}")
    return 0
