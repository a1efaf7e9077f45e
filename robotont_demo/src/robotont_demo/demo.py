"""The driver at work without a robot: a square and a turning circle, figures, and a picture.

Starts the stack on the simulator, behind a serial line that spoils some bytes; drives by cmd_vel, and compares odom
with where the robot truly is. Exit status 0 only when the end pose is right within the bounds.
"""

import math
import signal
import sys
import time
from pathlib import Path

import rospy
from geometry_msgs.msg import Twist
from std_msgs.msg import Float32

from robotont_bringup.stack import StackError, scratch, stack
from robotont_calibration.trajectory import synchronise
from robotont_demo.recording import Recorder
from robotont_demo.scenario import PERIOD, draw, errors_of, plan
from robotont_driver.parameters.argument_parser import ArgumentParser
from robotont_driver.robots.robot_folder import read_robot

STOPPING = 100     # poses of the odometry in which the robot comes to stand
BAD_BYTES = 0.001  # share of bytes that the line spoils


def parse(words):
    """The options; exits with status 2 and a message when they are wrong."""
    parser = ArgumentParser(prog="./robotont demo", description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--robot", default="", metavar="NAME or FOLDER", help="of config/robots [thesis]")
    parser.add_argument("--picture", type=Path, default="demo.png", help="where to put the picture [%(default)s]")
    options = parser.parse_args(words)
    try:
        options.robot = read_robot(options.robot)
    except (OSError, ValueError) as error:
        parser.error(str(error))
    try:
        options.picture.open("ab").close()  # now, not after the drive
    except OSError as error:
        parser.error(f"--picture: {error}")
    return options


def run(options):
    """Drive, print the figures, draw; whether the end pose is right. StackError: it does not work."""
    # the official firmware allows a wheel 0.3 m/s; generation 2 sums every second encoder window only
    official = options.robot.packets != "auto"
    allowed = (0.06, math.radians(5.0)) if official else (0.03, math.radians(2.0))
    twists = plan(0.2 if official else 0.4)  # [m/s]
    with scratch() as folder, stack("demo", folder, "robotont_bringup", "simulation.launch", f"port:={folder}/board",
                                    f"robot:={options.robot.folder}/") as wait_for:
        recorder = Recorder()
        rospy.Publisher("simulator_node/byte_errors", Float32, queue_size=1, latch=True).publish(BAD_BYTES)
        drive(twists, recorder, wait_for)
    odometry, truth = synchronise(recorder.trajectory("odometry"), recorder.trajectory("truth"))
    error = [values[-1] for values in errors_of(odometry, truth)]
    link = recorder.link
    for what, value in (
            ("packets written to the line", link["packets written"]),
            ("packets published on serial_read", link["packets published"]),
            ("  lines that the demo has spoilt, dropped", link["lines dropped"]),
            ("  periods repaired from the totals", link["periods repaired"]),
            ("end pose, odometry against truth", f"{error[0] * 1000:.2f} mm, {math.degrees(error[1]):.3f} deg"),
            ("  allowed", f"{allowed[0] * 1000:g} mm, {math.degrees(allowed[1]):g} deg")):
        print(f"  {what:<42} {value}")
    draw(options.picture, f"A square, then a circle while turning, in the simulator, robot {options.robot.folder.name}",
         odometry, truth, allowed[0])
    print(f"picture: {options.picture}")
    return all(found < most for found, most in zip(error, allowed))


def drive(twists, recorder, wait_for):
    """Follow the twists, then stop. wait_for: that of the `stack`, whose StackError names the missing event."""
    command = rospy.Publisher("cmd_vel", Twist, queue_size=1)
    wait_for(lambda: recorder.odometry and recorder.truth and recorder.drives and command.get_num_connections(),
             "a robot that obeys")
    due, message = time.monotonic(), Twist()
    for number, (message.linear.x, message.linear.y, message.angular.z) in enumerate(twists, 1):
        command.publish(message)
        if number * 10 // len(twists) > (number - 1) * 10 // len(twists):
            print(f"  {100 * number / len(twists):3.0f} %", flush=True)
        due += PERIOD
        time.sleep(max(0.0, due - time.monotonic()))
    driven, before = len(recorder.odometry), recorder.link
    wait_for(lambda: command.publish(Twist()) or len(recorder.odometry) > driven + STOPPING, "the last counts")
    wait_for(lambda: recorder.link is not before, "the newest diagnostics")


def main():
    """Run the demo; returns the exit status."""
    for ending in (signal.SIGTERM, signal.SIGINT):  # in a shell's background it would ignore Ctrl-C, its nodes too
        signal.signal(ending, signal.default_int_handler)
    options = parse(sys.argv[1:])
    print(f"driving the simulator, robot {options.robot.folder.name}: a square of 1 m, then a circle while turning "
          f"(up to a minute);\nthe demo itself spoils {100 * BAD_BYTES:g} % of the line's bytes",
          flush=True)
    try:
        good = run(options)
    except StackError as error:
        print(f"the demo failed: {error}", file=sys.stderr)
        return 1
    except KeyboardInterrupt:
        print("\ninterrupted", file=sys.stderr)
        return 130
    if not good:
        print("the end pose is outside the bounds", file=sys.stderr)
    return 0 if good else 1
