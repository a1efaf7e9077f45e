#!/usr/bin/env python3
"""Draws ways of the robot out of bags: plot_bag.py square.bag other.bag writes square.png."""

import argparse
from pathlib import Path

import matplotlib

matplotlib.use("Agg")  # into a file, without a screen
import matplotlib.pyplot as plt
import rosbag

from robotont_driver.kinematics import se2

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("bags", nargs="+", type=Path)
bags = parser.parse_args().bags
picture = bags[0].with_suffix(".png")
for bag in bags:
    try:
        recording = rosbag.Bag(str(bag))
    except (OSError, rosbag.ROSBagException) as error:  # Unindexed: the recording did not end well; rosbag reindex
        parser.error(f"{bag}: {error}")
    odom, truth = ([se2.pose_of(message.pose.pose) for _, message, _ in recording.read_messages([name, "/" + name])]
                   for name in ("odom", "ground_truth/odom"))
    if not odom:
        parser.error(f"{bag}: no odom in it; record it by rosbag record -O way.bag odom")
    # the simulator's truth, laid on the start of the odometry: it is told in the room, from another origin
    true = [se2.compose(odom[0], se2.between(truth[0], pose)) for pose in truth]
    for way, line, label in ((odom, "-", bag.stem), (true, ":", f"{bag.stem}, true")):
        if way:
            plt.plot([pose[0] for pose in way], [pose[1] for pose in way], line, label=label,
                     marker="o", markevery=[0])  # where it starts
    print(f"{len(odom)} poses, {len(true)} true ones: {picture}")
plt.axis("equal")
plt.title("where the robot believes it is, by odometry, and where it is (true)")
plt.xlabel("x [m]")
plt.ylabel("y [m]")
plt.legend()
plt.savefig(str(picture), dpi=100)
