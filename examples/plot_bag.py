#!/usr/bin/env python3
"""Draws the way of the robot out of a bag: plot_bag.py square.bag writes square.png."""

import sys
from pathlib import Path

import matplotlib

matplotlib.use("Agg")  # into a file, without a screen
import matplotlib.pyplot as plt
import rosbag

bag = Path(sys.argv[1])
way = [message.pose.pose.position for _, message, _ in rosbag.Bag(str(bag)).read_messages(topics=["odom", "/odom"])]
plt.plot([place.x for place in way], [place.y for place in way])
plt.axis("equal")
plt.xlabel("x [m]")
plt.ylabel("y [m]")
plt.savefig(str(bag.with_suffix(".png")), dpi=100)
print(f"{len(way)} poses: {bag.with_suffix('.png')}")
