"""Listens to a board as delivered and prints the launch line that drives it. Needs no ROS master."""

import argparse
import importlib.util
import sys

from robotont_driver.link.serial_port import explain, heard, serial_ports, usb_id
from robotont_driver.protocol.connection import OLD_FIRMWARE, PATIENCE, Listener, explained, robot_for

LINE = "roslaunch robotont_bringup robot.launch {} port:={}"


def listen(port, baudrate, seconds):
    """(protocol's name, the robot for it), or (None, why there is none). Sends nothing. Raises OSError."""
    listener = Listener(usb_id(port))
    name = next(filter(None, map(listener.feed, heard(port, baudrate, seconds))), None)
    if name == OLD_FIRMWARE:
        return None, explained(name)
    return name, robot_for(name, listener.fields) if name else listener.heard


def tell(port, baudrate, seconds):
    """Print what the board at a port is, and the line that starts it; the exit status."""
    try:
        name, received = listen(port, baudrate, seconds)
        trouble = "" if name else f"{port}: {received}"
    except OSError as error:
        trouble = explain(port, error)
    if trouble:
        print(f"which_robot: {trouble}", file=sys.stderr)
        return 1
    model = "" if importlib.util.find_spec("xacro") else " description:=false"  # no xacro, no model
    print(f"the board at {port} speaks {explained(name)}; start it with\n  {LINE.format(received, port)}{model}")
    if received == "robot:=thesis":
        print("  (for a Robotont 2 that was flashed: robot:=robotont21; with thesis it goes left for right, and turns "
              "the wrong way)")
    return 0


def main(arguments=None):
    """Run; returns the exit status."""
    parser = argparse.ArgumentParser(prog="which_robot", description=__doc__)
    parser.add_argument("port", nargs="?", help="serial port [each that there is]")
    parser.add_argument("--baudrate", type=int, default=115200, help="[%(default)s]")
    parser.add_argument("--seconds", type=float, default=2 * PATIENCE, help="how long to listen [%(default)s]")
    options = parser.parse_args(arguments)
    ports = [options.port] if options.port else serial_ports()
    if not ports:
        print("which_robot: there is no serial port: is the board plugged in, with a cable that carries data?",
              file=sys.stderr)
    return max([tell(port, options.baudrate, options.seconds) for port in ports], default=1)
