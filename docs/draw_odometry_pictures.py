#!/usr/bin/env python3
"""Draws the pictures of docs/odometry.md: draw_odometry_pictures.py [FOLDER]. Needs no robot, monitor or ROS.

odometry_thesis.png: the thesis' way and ours on the same drive. odometry_covariance.png: where many runs end, and
the ellipse that each of them claims. odometry_slip.png: a wheel of four that slips, with and without detection.
calibration.png: wrong wheel parameters, and those that calibrate_wheels finds.
"""

import math
import sys
from pathlib import Path

import numpy as np
from synthetic_runs import taped_runs, true_of

from robotont_calibration.calibrate_wheels import WHEEL_NOISE
from robotont_calibration.calibration_report import draw, table
from robotont_calibration.trajectory_errors import BLUE, GREY, INK, ORANGE, drawing_style, pyplot
from robotont_calibration.unknowns import Unknowns
from robotont_calibration.wheel_estimation import calibrate
from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_driver.odometry.odometry import WheelOdometry
from robotont_driver.odometry.slip import SlipDetector
from robotont_testing.robots import SHIPPED
from robotont_testing.simulated_wheels import PERIOD, counted, even_wheels, mixed_drive, path_of, rolled, straight

NOISE = 0.005        # [m] of a wheel's path after 1 m, on a smooth floor
LAG = 0.1            # [s] time constant of the motors
SAMPLE = 5           # [periods] between steps of the thesis' odometry: 10 Hz


def main():
    """Make all pictures, in docs/pictures or in the folder that the command line names."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).resolve().parent / "pictures"
    folder.mkdir(parents=True, exist_ok=True)
    shipped = SHIPPED
    wheels = read_wheels(shipped)
    with pyplot().rc_context(drawing_style()):
        draw_thesis(wheels, folder / "odometry_thesis.png")
        draw_covariance(wheels, folder / "odometry_covariance.png")
        draw_slip(read_wheels(even_wheels(4)), folder / "odometry_slip.png")
    draw_calibration(shipped, folder / "calibration.png")


def draw_calibration(wrong, file):
    """Runs of a robot whose radius, distance and one angle are not the stated ones, as a tape measures them."""
    true = true_of(wrong, 1.02, 0.97, [(1, 1.5)])
    names = ("square", "square clockwise", "spin", "spin clockwise", "line left", "line right")
    runs = taped_runs(true, names=names)
    found = calibrate(wrong, runs, Unknowns(wrong), WHEEL_NOISE)
    print(table(wrong, found, runs))
    draw(file, wrong, found, runs)
    print(f"{file} ({file.stat().st_size / 1000:.0f} kB)")


def draw_thesis(wheels, file):
    """The same drive in the thesis' way, ours, and as it was."""
    commanded = mixed_drive(60.0, np.random.default_rng(4), 0.4)
    truth = path_of(lagged(commanded))
    counts = counted(wheels, rolled(wheels, lagged(commanded)), NOISE, np.random.default_rng(1))
    units = np.round(commanded @ Kinematics(wheels).matrix.T * Kinematics(wheels).units_per_speed)
    ways = (
        ("the thesis' way: 10 Hz Euler steps, single precision, commanded whole units", ORANGE, euler(wheels, units)),
        ("this driver: exact steps of every packet's counts", BLUE, poses(wheels, counts)),
    )
    plt = pyplot()
    figure, (place, error) = plt.subplots(1, 2, figsize=(10, 4.8), constrained_layout=True,
                                          gridspec_kw={"width_ratios": (1.1, 1)})
    place.plot(*truth[:, :2].T, color=GREY, linewidth=3.5, label="where the robot was")
    for label, colour, way in ways:
        place.plot(*way[:, :2].T, color=colour, label=label.partition(":")[0])
        place.plot(*way[-1, :2], "s", color=colour, markersize=5)
        seconds = np.arange(len(way)) * 60.0 / (len(way) - 1)
        there = truth[np.round(seconds / PERIOD).astype(int), :2]
        off = np.hypot(*(way[:, :2] - there).T)
        error.plot(seconds, 100 * off, color=colour)
        print(f"{label}: {100 * off[-1]:.1f} cm off at the end, {100 * off.max():.1f} cm at most")
    place.plot(*truth[-1, :2], "s", color=INK, markersize=5, label="end")
    place.set(title="A drive of 60 s", xlabel="x [m]", ylabel="y [m]")
    place.set_aspect("equal", adjustable="datalim")
    place.legend(loc="best")
    error.set(title="Distance from where the robot was", xlabel="time [s]", ylabel="[cm]")
    error.set_ylim(bottom=0)
    save(figure, file)
    causes(wheels, commanded)


def causes(wheels, commanded):
    """What each part of the thesis' way does alone, on this drive."""
    kinematics, real = Kinematics(wheels), path_of(lagged(commanded))
    exact = commanded @ kinematics.matrix.T * kinematics.units_per_speed
    moved = lagged(commanded) @ kinematics.matrix.T * kinematics.units_per_speed
    for words, way in (
            ("10 Hz Euler steps alone, of true speeds", euler(wheels, moved, np.float64)),
            ("single precision alone, exact speeds at 50 Hz against double", None),
            ("whole units alone, each period", poses(wheels, np.round(moved))),
            ("commands instead of measurements alone", poses(wheels, exact))):
        if way is None:
            difference = euler(wheels, moved, np.float32, 1) - euler(wheels, moved, np.float64, 1)
            print(f"  {words}: {1000 * math.hypot(*difference[-1, :2]):.3f} mm")
        else:
            print(f"  {words}: {100 * math.hypot(*(way[-1, :2] - real[-1, :2])):.1f} cm at the end")


def draw_covariance(wheels, file):
    """Ends of 200 runs with the same motion, and the 95 % ellipses that the covariance of one run claims."""
    twists = np.concatenate([straight(1.5, 0.0), np.full((100, 3), (0.3, 0.0, 0.785)), straight(1.0, 0.0)])
    generator = np.random.default_rng(5)
    ends = np.array([poses(wheels, counted(wheels, rolled(wheels, twists), NOISE, generator))[-1] for _ in range(200)])
    truth = path_of(twists)
    plt = pyplot()
    figure, axis = plt.subplots(figsize=(7, 4.8), constrained_layout=True)
    axis.plot(*truth[:, :2].T, color=GREY, linewidth=3, label="motion")
    axis.plot(*ends[:, :2].T, ".", color=BLUE, markersize=4, label="ends by the odometry of 200 runs")
    odometry = WheelOdometry(Kinematics(wheels), PERIOD, NOISE)
    counts = counted(wheels, rolled(wheels, twists)).tolist()
    for index, packet in enumerate(counts, 1):
        odometry.update(packet, PERIOD)
        if (index % 60 == 0 and index < len(counts) - 40) or index == len(counts):
            ring = ellipse(odometry)
            axis.plot(*ring, color=ORANGE, linewidth=1.3,
                      label="95 % ellipse of one run's covariance" if index == len(counts) else None)
    inverse = np.linalg.inv(odometry.pose_covariance.matrix[:2, :2])
    off = ends[:, :2] - truth[-1, :2]
    inside = np.mean(np.einsum("ki,ij,kj->k", off, inverse, off) < -2 * math.log(0.05))
    print(f"ends within the 95 % ellipse: {inside:.1%} of 200")
    axis.set(title="What the covariance claims, and where runs end", xlabel="x [m]", ylabel="y [m]")
    axis.set_aspect("equal", adjustable="datalim")
    axis.legend(loc="upper left")
    save(figure, file)


def draw_slip(wheels, file):
    """Ten seconds in which wheel 1 turns 30 % too far for two."""
    twists = np.tile((0.8, 0.0, 0.3), (500, 1)) * np.clip(np.minimum(np.arange(500), 499 - np.arange(500))
                                                          / 50, 0, 1)[:, None]
    paths = rolled(wheels, twists)
    paths[200:300, 1] *= 1.3
    counts = counted(wheels, paths, NOISE, np.random.default_rng(3))
    kinematics = Kinematics(wheels)
    finder = SlipDetector(kinematics.matrix, wheels.metres_per_edge, NOISE, 0.1, 1 / PERIOD)
    odometry, found, out = WheelOdometry(kinematics, PERIOD, NOISE), [(0.0, 0.0)], []
    for packet in counts.tolist():
        if finder.update(packet):
            odometry.exclude(finder.slipping)
        odometry.update(packet, PERIOD)
        found.append((odometry.pose.x, odometry.pose.y))
        out.append(bool(finder.slipping))
    truth, without, found = path_of(twists)[:, :2], poses(wheels, counts)[:, :2], np.array(found)
    seconds = np.arange(501) * PERIOD
    span = seconds[np.flatnonzero(out)[[0, -1]] + 1]
    plt = pyplot()
    figure, (place, error) = plt.subplots(1, 2, figsize=(10, 4.4), constrained_layout=True)
    place.plot(*truth.T, color=GREY, linewidth=3.5, label="where the robot was")
    error.axvspan(4, 6, color="#eceef1", linewidth=0, label="wheel 1 slips by 30 %")
    error.axvline(span[0], color=INK, linewidth=1, linestyle="--", label=f"left out, {span[0] - 4:.2f} s later")
    error.axvline(span[1], color=INK, linewidth=1, linestyle=":", label="taken back")
    for label, colour, way in (("all wheels counted", ORANGE, without),
                               ("wheel 1 left out while it slips", BLUE, found)):
        off = 100 * np.hypot(*(way - truth).T)
        place.plot(*way.T, color=colour, label=label)
        error.plot(seconds, off, color=colour)
        print(f"{label}: {off[-1]:.1f} cm off at the end")
    place.set(title="A curve on four wheels", xlabel="x [m]", ylabel="y [m]")
    place.set_aspect("equal", adjustable="datalim")
    place.legend(loc="center left")
    error.set(title="Distance from where the robot was", xlabel="time [s]", ylabel="[cm]")
    error.set_ylim(bottom=0)
    error.legend(loc="upper left")
    save(figure, file)


def lagged(twists):
    """Response of the motors to commanded twists, K x 3: a lag of the first order with the time constant LAG."""
    now, made = np.zeros(3), np.empty_like(twists)
    for index, twist in enumerate(twists):
        now = now + (twist - now) * (1 - math.exp(-PERIOD / LAG))
        made[index] = now
    return made


def euler(wheels, units, kind=np.float32, every=SAMPLE):
    """Poses as the thesis' odom_node makes them: newest units (K x n) every so many periods, Euler steps."""
    kinematics = Kinematics(wheels)
    speeds = (units[::every] / kinematics.units_per_speed @ kinematics.inverse.T).astype(kind)
    elapsed = kind(every * PERIOD)
    x = y = yaw = kind(0)
    path = [(x, y, yaw)]
    for forward, left, turn in speeds:
        x += (forward * np.cos(yaw) - left * np.sin(yaw)) * elapsed
        y += (forward * np.sin(yaw) + left * np.cos(yaw)) * elapsed
        yaw += turn * elapsed
        path.append((x, y, yaw))
    return np.array(path, dtype=float)


def poses(wheels, counts):
    """(K + 1) x 3 poses of the odometry of K x n counts."""
    odometry, path = WheelOdometry(Kinematics(wheels), PERIOD, 0.0), [(0.0, 0.0, 0.0)]
    for packet in counts.tolist():
        odometry.update(packet, PERIOD)
        path.append((odometry.pose.x, odometry.pose.y, odometry.pose.yaw))
    return np.array(path)


def ellipse(odometry):
    """2 x 60 points of the 95 % ellipse around the odometry's place."""
    around = np.linspace(0, 2 * math.pi, 60)
    root = np.linalg.cholesky(odometry.pose_covariance.matrix[:2, :2]) * math.sqrt(-2 * math.log(0.05))
    return root @ (np.cos(around), np.sin(around)) + np.array([[odometry.pose.x], [odometry.pose.y]])


def save(figure, file):
    """Write a PNG and print its path."""
    figure.savefig(str(file))
    pyplot().close(figure)
    print(f"{file} ({file.stat().st_size / 1000:.0f} kB)")


if __name__ == "__main__":
    main()
