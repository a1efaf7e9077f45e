"""Command line of `robot`: checks a robot of config/robots, or a folder, for launch files and by hand."""

import argparse
import math
import sys

from robotont_driver.kinematics.wheel_params import doubts, no_load_speeds
from robotont_driver.parameters.parameters import ParameterError, read_parameters
from robotont_driver.robots.robot_folder import PARAMETERS, read_robot
from robotont_driver.ros.server_parameters import COMMON_PARAMETERS

ARGUMENTS = {  # that robot.launch sets behind the folder's parameters
    "serial_com_node": ("port", "range_frame_prefix", "base_frame"),
    "odom_node": ("odom_frame", "base_frame", "joint_prefix", "publish_tf")}
MOST_POWER = 300.0  # [W] of a motor of such a robot; Robotont's have 8


def overruled(robot):
    """A line for each parameter in a `Robot`'s driver.yaml that does not count."""
    words = "robot.launch sets it, by port:=, publish_tf:= or namespace:="
    return [f"{robot.folder / PARAMETERS}: {node}: ~{name}: {words}"
            for node, names in ARGUMENTS.items() for name in names if name in robot.parameters.get(node, {})]


def parameter_faults(robot):
    """List of what is wrong with the parameters in a `Robot`'s driver.yaml, a line for each."""
    from robotont_driver.nodes import driver_node, odom_node, serial_com_node  # half a second that a launch has not

    def of_wheels(parameters):
        serial_com_node.check_protocol(robot.wheels, parameters["packets"])

    def of_joints(parameters):
        odom_node.joint_names(parameters["joint_names"], robot.wheels.amount)

    faults = overruled(robot)
    for module, check in ((driver_node, bool), (odom_node, of_joints), (serial_com_node, of_wheels)):
        node = module.__name__.rpartition(".")[2]
        try:
            check(read_parameters((*module.PARAMETERS, *COMMON_PARAMETERS), robot.parameters.get(node, {})))
        except ParameterError as error:
            faults += [f"{robot.folder / PARAMETERS}: {node}: {words}" for words in error.faults]
    return faults


def warnings(robot, reach):
    """List of what is doubtful in a `Robot` without a mistake; reach: [m/s] of its slowest wheel without load."""
    wheels = robot.wheels
    edges, power = wheels.edges_per_motor_turn, wheels.motor.no_load_speed * wheels.motor.stall_torque / 4
    limit = robot.parameters.get("driver_node", {}).get("max_wheel_speed", 0.0)
    return [words for applies, words in (
        (doubts(wheels), doubts(wheels)),
        (edges % 4, f"encoderEdgesPerMotorRevolution: found {edges}, a multiple of 4 where both edges of both "
         "channels count: a sheet's pulses per channel x 4"),
        (power > MOST_POWER, f"motorNoLoadSpeed, motorStallTorque: a motor of {power:.0f} W; are they in "
         "rad/s and N m, before the gear?"),
        (limit > reach, f"{robot.folder / PARAMETERS}: driver_node: max_wheel_speed: found {limit:g}, the motors "
         f"reach {reach:.2f} [m/s] without load: wheels that cannot follow leave the path"),
    ) if applies]


def main():
    """Check a robot, and say what it is; exit status 1 and all faults when it is wrong."""
    parser = argparse.ArgumentParser(prog="robot", description=__doc__)
    parser.add_argument("robot", nargs="?", default="", help="name or folder [thesis]")
    parser.add_argument("--path", action="store_true", help="print its path alone, for a launch file: its nodes check "
                        "their parameters themselves")
    try:
        options = parser.parse_args()
        robot = read_robot(options.robot)
        folder, wheels = robot.folder.resolve(), robot.wheels
        if options.path:
            sys.stderr.writelines(line + "\n" for line in overruled(robot))
            print(folder, end="")
            return
        faults = parameter_faults(robot)
        if faults:
            raise ValueError("\n".join(faults))
        places = ", ".join(f"{math.degrees(position) % 360:.0f}" for position in wheels.positions)
        reach = min(no_load_speeds(wheels))
        found = warnings(robot, reach)
        print(f"{folder}: {wheels.amount} wheels, which stand at {places} degrees, {wheels.pid_frequency:g} Hz, "
              f"motors that reach {reach:.2f} m/s without load" + ", no mistake found" * (not found))
        for words in found:
            print(f"warning: {words}")
    except (OSError, ValueError) as error:
        sys.exit(f"robot: {error}")
