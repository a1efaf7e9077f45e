"""Shows which wheel counts which way while you turn it by hand.

It listens to the board, of any firmware since March 2020, and sends nothing, so no wheel starts by itself; generation 3
holds its wheels. With --bring-up it drives one motor after another.
"""

import math
import sys
import time

from robotont_calibration.bring_up import bring_up
from robotont_driver.link.serial_port import explain, heard, usb_id
from robotont_driver.parameters.argument_parser import ArgumentParser
from robotont_driver.protocol.connection import Connection
from robotont_driver.robots.robot_folder import read_robot

STEP = 30  # [degrees] of a wheel between two lines
ROTATION = {1: "counterclockwise", -1: "clockwise"}


class TurnedWheels:
    """Sums the counts of `Wheels` and describes their turns."""

    def __init__(self, wheels):
        self._wheels = wheels
        self._totals = [0] * wheels.amount  # [edges]
        self._described = [0] * wheels.amount  # [steps] of STEP degrees at the last description

    def add(self, counts):
        """Add one packet's counts (n,) [edges]; returns a line for each wheel that has turned by another step."""
        self._totals = [total + count for total, count in zip(self._totals, counts)]
        steps = [round(degrees / STEP) for degrees in self._degrees()]
        changed = [wheel for wheel, step in enumerate(steps) if step != self._described[wheel]]
        lines = [self._describe(wheel, steps[wheel] > self._described[wheel]) for wheel in changed]
        self._described = steps
        return lines

    @property
    def verdict(self):
        """What the wheels' signs show about the rotation of the robot."""
        turned = [0 if abs(degrees) < STEP else math.copysign(1, degrees) for degrees in self._degrees()]
        if 0 in turned:
            still = [wheel for wheel, sign in enumerate(turned) if not sign]
            return f"less than {STEP} degrees: wheel " + ", ".join(map(str, still))
        rotations = {math.copysign(sign, sign * lever) for sign, lever in zip(turned, self._wheels.levers)}
        if len(rotations) == 1:
            return f"all wheels turned as if the robot had been turned {ROTATION[rotations.pop()]}"
        signs = ", ".join(f"wheel {wheel} {'forward' if sign > 0 else 'backward'}" for wheel, sign in enumerate(turned))
        return f"the wheels disagree about the robot's rotation: {signs}"

    def _degrees(self):
        return [360 * total / self._wheels.edges_per_turn for total in self._totals]

    def _describe(self, wheel, forward):
        place = round(math.degrees(self._wheels.positions[wheel])) % 360
        return (f"wheel {wheel} (at {place} degrees): {'forward' if forward else 'backward'}, "
                f"{self._degrees()[wheel]:+.0f} degrees in all")


def watch(port, wheels, connection, seconds):
    """Print what the wheels do for a time [s], and what follows from it. Raises OSError; ValueError without packets."""
    turned = TurnedWheels(wheels)
    forward = [wheel for wheel, lever in enumerate(wheels.levers) if lever * wheels.levers[0] > 0]
    which = "all its wheels" if len(forward) == wheels.amount else f"wheels {', '.join(map(str, forward))} alone"
    print("Turn each wheel by hand, or the whole robot on the floor: turned "
          f"{ROTATION[math.copysign(1, wheels.levers[0])]}, {which} must count forward. Ctrl-C ends it.", flush=True)
    try:
        for data in heard(port, 115200, seconds):
            for packet in connection.feed(data, time.monotonic()):
                for text in turned.add(packet):
                    print(text, flush=True)
    except KeyboardInterrupt:
        print()
    if connection.obstacle or not (connection.protocol and connection.protocol.packets):
        raise ValueError(connection.obstacle or connection.complaint or "no packets came")
    print(turned.verdict)


def main(arguments=None):
    """Run; returns the exit status."""
    parser = ArgumentParser(prog="./robotont wheels", description=__doc__)
    parser.add_argument("port", nargs="?", default="/dev/ttyACM0", help="serial port [%(default)s]")
    parser.add_argument("--seconds", type=float, default=60.0, help="how long to watch [%(default)s]")
    parser.add_argument("--bring-up", action="store_true", help="drive the lifted wheels, one at a time (own firmware)")
    parser.add_argument("--robot", default="", metavar="NAME or FOLDER", help="[thesis]")
    options = parser.parse_args(arguments)
    try:
        robot = read_robot(options.robot)
        connection = Connection(robot.wheels, robot.packets, usb_id=usb_id(options.port), now=time.monotonic())
        try:
            if options.bring_up:
                return 0 if bring_up(options.port, robot.wheels) else 1
            watch(options.port, robot.wheels, connection, options.seconds)
            return 0
        except OSError as error:
            raise ValueError(explain(options.port, error)) from None
    except KeyboardInterrupt:
        print()
        return 130
    except (ValueError, OSError) as error:
        print(f"turned_wheels: {error}", file=sys.stderr)
        return 1
