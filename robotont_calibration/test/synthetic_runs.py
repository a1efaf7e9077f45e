"""Synthetic calibration runs: wheels that differ from their parameters, with noise, and measured poses."""

import math

import numpy as np
import rosbag
import rospy
from geometry_msgs.msg import PoseStamped
from std_msgs.msg import String

from robotont_calibration.calibration_runs import taped_run, tracked_run
from robotont_calibration.trajectory import Trajectory
from robotont_driver.kinematics import se2
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_testing.simulated_wheels import PERIOD, counted, path_of, rolled, spin, square, straight

NOISE = 0.001                        # [m] after 1 m; the simulator's wheels have 0.0003
TRACKED = (0.001, math.radians(0.1))  # [m], [rad] a ground truth's
SECONDS = 1.0                         # [s] of a stretch of a run with a ground truth
TAPE = (0.002, math.radians(0.5))     # [m], [rad] a tape's and a ruler's


def true_of(wrong, radius=1.0, distance=1.0, angles=()):
    """Parameters of the real robot, for `wrong` ones: their excess, as fractions and in degrees."""
    rads = list(wrong["wheelRads"])
    for wheel, degrees in angles:
        rads[wheel] -= math.radians(degrees)
    return {**wrong, "wheelRads": rads, "wheelRadius": wrong["wheelRadius"] / radius,
            "wheelDistanceFromCenter": (np.asarray(wrong["wheelDistanceFromCenter"]) / distance).tolist()}


def drives():
    """The runs that the guide asks for, as twists."""
    return [square(2.0, 1), square(2.0, -1), spin(10 * math.pi), spin(-10 * math.pi),
            straight(0, 3.0), straight(0, -3.0)]


def recorded(parameters, twists, seed, deviation, noise=NOISE, point=(0.0, 0.0)):
    """(counts, K x 3 measured poses of a point of base_link, from where it begins) of a robot with these parameters."""
    wheels = read_wheels(parameters)
    generator = np.random.default_rng(seed)
    counts = counted(wheels, rolled(wheels, twists), noise, generator)
    poses = path_of(twists)[1:].T
    poses = np.transpose(se2.between((*point, 0.0), se2.compose(poses, (*point, 0.0))))
    place, yaw = deviation
    return counts, poses + generator.standard_normal(poses.shape) * (place, place, yaw)


def tracked_runs(parameters, seed=0, noise=NOISE, point=(0.0, 0.0), times=1):
    """`Run`s with a ground truth: each drive so many times."""
    found = []
    for index, twists in enumerate(drives() * times):
        counts, poses = recorded(parameters, twists, seed + index, TRACKED, noise, point)
        stamps = PERIOD * np.arange(1, len(counts) + 1)
        found.append(tracked_run(str(index), stamps, counts, Trajectory(stamps, poses), SECONDS, TRACKED))
    return found


def taped_runs(parameters, seed=0, noise=NOISE, names=None):
    """`Run`s with ends measured by tape only; the start, too, is a little off its mark."""
    found = []
    for index, twists in enumerate(drives()):
        counts, poses = recorded(parameters, twists, seed + index, TAPE, noise)
        along, across, turn = np.random.default_rng(seed + index + 500).standard_normal(3) * (TAPE[0], *TAPE)
        x, y, yaw = se2.between((0.0, 0.0, turn), poses[-1])
        found.append(taped_run(names[index] if names else str(index), counts, (x + along, y + across, yaw), TAPE))
    return found


def write_run(path, counts, poses=(), times=None):
    """A bag of packets, and where there are poses, of a ground truth on the topic truth. times: [s] of each."""
    times = [1000.0 + at for at in (PERIOD * np.arange(1, len(counts) + 1) if times is None else times)]
    with rosbag.Bag(str(path), "w") as bag:
        for at, packet in zip(times, np.asarray(counts).tolist()):
            text = ":".join(f"{count:.3f}" for count in packet) + ";\n"
            bag.write("serial_read", String(text), rospy.Time.from_sec(at))
        for at, (x, y, yaw) in zip(times, np.asarray(poses).tolist()):
            message = PoseStamped()
            message.header.stamp = rospy.Time.from_sec(at)
            message.pose.position.x, message.pose.position.y = x, y
            message.pose.orientation.z, message.pose.orientation.w = math.sin(yaw / 2), math.cos(yaw / 2)
            bag.write("truth", message, message.header.stamp)
