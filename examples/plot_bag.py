#!/usr/bin/env python3
"""Draws ways of the robot out of bags: plot_bag.py square.bag other.bag writes square.png."""

import argparse
from pathlib import Path

import matplotlib

matplotlib.use("Agg")  # into a file, without a screen
import matplotlib.pyplot as plt
import rosbag

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("bags", nargs="+", type=Path)
bags = parser.parse_args().bags
picture = bags[0].with_suffix(".png")
for bag in bags:
    try:
        messages = rosbag.Bag(str(bag)).read_messages(topics=["odom", "/odom"])
    except (OSError, rosbag.ROSBagException) as error:  # Unindexed: the recording did not end well; rosbag reindex
        parser.error(f"{bag}: {error}")
    way = [message.pose.pose.position for _, message, _ in messages]
    if not way:
        parser.error(f"{bag}: no odom in it; record it by rosbag record -O way.bag odom")
    plt.plot([place.x for place in way], [place.y for place in way], label=bag.stem,
             marker="o", markevery=[0])  # where it starts
    print(f"{len(way)} poses: {picture}")
plt.axis("equal")
plt.title("odometry: where the robot believes it is")
plt.xlabel("x [m]")
plt.ylabel("y [m]")
plt.legend()
plt.savefig(str(picture), dpi=100)
