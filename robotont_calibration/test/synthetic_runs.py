"""Synthetic calibration runs: wheels that differ from their parameters, with noise, and measured poses."""

import math

import numpy as np
import rosbag
import rospy
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Odometry
from std_msgs.msg import String

from robotont_calibration.calibration_runs import taped_run, tracked_run
from robotont_calibration.trajectory import Trajectory
from robotont_driver.kinematics import se2
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_testing.simulated_wheels import PERIOD, counted, path_of, rolled, spin, square, straight

NOISE = 0.001                        # [m] after 1 m; the simulator's wheels have 0.0003
TRACKED = (0.001, math.radians(0.1))  # [m], [rad] a ground truth's
TAPE = (0.002, math.radians(0.5))     # [m], [rad] a tape's and a ruler's


def true_of(wrong, radius=1.0, distance=1.0, angles=()):
    """Parameters of the real robot, for `wrong` ones: their excess, as fractions and in degrees."""
    rads = list(wrong["wheelRads"])
    for wheel, degrees in angles:
        rads[wheel] -= math.radians(degrees)
    return {**wrong, "wheelRads": rads, "wheelRadius": wrong["wheelRadius"] / radius,
            "wheelDistanceFromCenter": (np.asarray(wrong["wheelDistanceFromCenter"]) / distance).tolist()}


def drives(times=1):
    """{number: twists} of the runs that the guide asks for."""
    return dict(enumerate(times * [square(2.0, 1), square(2.0, -1), spin(10 * math.pi), spin(-10 * math.pi),
                                   straight(0, 3.0), straight(0, -3.0)]))


def recorded(parameters, twists, seed, deviation):
    """(counts, K x 3 measured poses, from where it begins) of a robot with these parameters."""
    wheels = read_wheels(parameters)
    generator = np.random.default_rng(seed)
    counts = counted(wheels, rolled(wheels, twists), NOISE, generator)
    poses = path_of(twists)[1:]
    place, yaw = deviation
    return counts, poses + generator.standard_normal(poses.shape) * (place, place, yaw)


def tracked_runs(parameters, driven=None):
    """`Run`s with a ground truth."""
    for number, twists in (driven or drives()).items():
        counts, poses = recorded(parameters, twists, number, TRACKED)
        stamps = PERIOD * np.arange(1, len(counts) + 1)
        yield tracked_run(str(number), stamps, counts, Trajectory(stamps, poses))._replace(deviation=TRACKED)


def taped_runs(parameters, seed=0, driven=None, spoil=lambda _number, poses: poses):
    """`Run`s with ends measured by tape only; the start, too, is a little off its mark."""
    for number, twists in (driven or drives()).items():
        counts, poses = recorded(parameters, twists, seed + number, TAPE)
        along, across, turn = np.random.default_rng(seed + number + 500).standard_normal(3) * (TAPE[0], *TAPE)
        x, y, yaw = se2.between((0.0, 0.0, turn), poses[-1])
        end, = spoil(number, np.array([(x + along, y + across, math.remainder(yaw, 2 * math.pi))]))
        yield taped_run(str(number), counts, end)._replace(deviation=TAPE)


def write_run(path, **topics):
    """A bag of (time [s], counts) on serial_read, (time, pose) as Odometry on a topic odom, else as PoseStamped."""
    with rosbag.Bag(str(path), "w") as bag:
        for topic, rows in topics.items():
            for at, values in rows:
                stamp = rospy.Time.from_sec(float(at))
                if topic == "serial_read":
                    message = String(":".join(f"{count:.3f}" for count in values) + ";\n")
                else:
                    message = Odometry() if topic.endswith("odom") else PoseStamped()
                    message.header.stamp = stamp
                    pose = getattr(message.pose, "pose", message.pose)
                    pose.position.x, pose.position.y = values[:2]
                    pose.orientation.z, pose.orientation.w = math.sin(values[2] / 2), math.cos(values[2] / 2)
                bag.write(topic, message, stamp)
