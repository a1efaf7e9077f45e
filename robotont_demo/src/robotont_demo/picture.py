"""The demo's picture: the three paths, and how far the odometry is from the truth on the way."""

import math

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

from robotont_demo.recording import distances

TRUTH, COMMAND, ODOMETRY, START = "#b8d4e8", "#7a7a7a", "#1f4e79", "#2e7d32"
ARROWS = 60  # poses from one arrow to the next


def draw(commanded, odometry, truth, allowed, name, file):
    """Write the PNG file.

    commanded: K x 2 [m]; odometry, truth: TimedPoses; allowed: error at the end [m]; name: of the robot.
    """
    figure, (left, right) = plt.subplots(1, 2, figsize=(11, 5.2), gridspec_kw={"width_ratios": (1.25, 1)})
    draw_paths(left, commanded, odometry, truth, name)
    draw_distances(right, odometry, truth, allowed)
    for axes in (left, right):
        axes.grid(color="#e6e6e6")
        axes.set_axisbelow(True)
        for side in ("top", "right"):
            axes.spines[side].set_visible(False)
    figure.tight_layout()
    figure.savefig(str(file), dpi=110)
    plt.close(figure)


def draw_paths(axes, commanded, odometry, truth, name):
    """Seen from above: where the robot was, should have been, and believed to be, with arrows of its heading."""
    axes.plot(*truth.poses.T[:2], color=TRUTH, linewidth=7, solid_capstyle="round", label="truth")
    axes.plot(*commanded.T, color=COMMAND, linewidth=1.2, linestyle=(0, (4, 3)), label="command: cmd_vel")
    axes.plot(*odometry.poses.T[:2], color=ODOMETRY, linewidth=1.6, label="odometry: odom, with the heading")
    for x, y, yaw in odometry.poses[::ARROWS]:
        axes.arrow(x, y, 0.07 * math.cos(yaw), 0.07 * math.sin(yaw), width=0.008, head_width=0.04, color=ODOMETRY,
                   length_includes_head=True, zorder=3)  # above the band of the truth
    axes.plot(0, 0, "o", color=START, markersize=8, label="start", zorder=4)
    axes.set_aspect("equal", adjustable="datalim")
    axes.set(xlabel="x [m]", ylabel="y [m]", title=f"A square, then a circle while turning\non {name}")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.13), ncol=4, fontsize=8, frameon=False)


def draw_distances(axes, odometry, truth, allowed):
    """Over time, with the bound at the end."""
    distance = 1000 * distances(odometry, truth)
    axes.plot(odometry.stamps - odometry.stamps[0], distance, color=ODOMETRY, linewidth=0.9)
    axes.axhline(1000 * allowed, color="#9e9e9e", linestyle=":", label="allowed at the end")
    axes.set(xlabel="time [s]", ylabel="distance from the truth [mm]",
             ylim=(0, 1.1 * max(1000 * allowed, distance.max())), title="Odometry against truth\n")
    axes.legend(loc="upper right", fontsize=8)
