"""How far an estimated path is from a reference: the table and the picture of an odometry report.

The measures are those of J. Sturm et al., A Benchmark for the Evaluation of RGB-D SLAM Systems (IROS 2012), on the
plane.
"""

import math

import matplotlib
import numpy as np
from matplotlib.figure import Figure

from robotont_calibration.trajectory import seen_from, synchronise
from robotont_driver.kinematics import se2

BLUE, GREY, ORANGE, INK = "#2f6db3", "#a5abb3", "#d0782a", "#33383f"  # odometry, reference, another curve, marks
STYLE = {"font.size": 9, "axes.grid": True, "grid.color": "#e6e8eb", "axes.axisbelow": True}  # of matplotlib


class Report:
    """An estimate against a reference, both `Trajectory`, and the packets' stamps [s].

    named: name of the reference. delta: [m] stretch for relative errors.
    """

    def __init__(self, estimate, reference, named, packet_times=(), refused=0, delta=1.0):
        self.estimate, self.reference = synchronise(estimate, reference)
        self.named, self.delta, self.packet_times, self.refused = named, delta, packet_times, refused
        # absolute errors of each pose: distances [m], headings [rad]; relative ones of each stretch
        self.distances, self.headings = sizes(self.estimate.poses - self.reference.poses)
        self.stretches, self.turns = relative_errors(self.estimate, self.reference, delta)

    def rows(self):
        """(what, value with unit) of the table."""
        length = self.reference.steps.sum()
        yaw = self.reference.poses[:, 2]
        turned = np.abs(np.diff(yaw)).sum() / (2 * math.pi)
        end, end_turn = self.distances[-1], math.degrees(abs(self.estimate.poses[-1, 2] - yaw[-1]))  # whole turns count
        rows = [
            ("duration", f"{self.reference.times[-1] - self.reference.times[0]:.1f} s"),
            ("path of the " + self.named, f"{length:.2f} m"),
            ("turned, to and fro", f"{turned:.2f} turns"),
            ("absolute error, root mean square", root_mean_squares(self.distances, self.headings)),
            ("absolute error, largest", f"{1000 * self.distances.max():.1f} mm"),
            (f"relative error per {self.delta:g} m, root mean square",
             root_mean_squares(self.stretches, self.turns) if len(self.stretches) else "path too short"),
            ("error at the end", f"{1000 * end:.1f} mm, {end_turn:.2f}°"),
            ("drift per metre", f"{1000 * end / length:.1f} mm" if length else "no path"),
            ("drift per turn", f"{end_turn / turned:.2f}°" if turned > 0.25 else "too few turns"),
            ("odometry", timing(self.estimate.times)),
        ]
        if len(self.packet_times) > 1:
            rows += [("packets", timing(self.packet_times)), ("packets refused", str(self.refused))]
        return rows

    def table(self):
        """The rows as a string."""
        rows = self.rows()
        width = max(len(what) for what, _ in rows)
        return "\n".join(f"{what.ljust(width)}  {value}" for what, value in rows)

    def draw(self, path, title):
        """Write a PNG: path, heading, and the errors of both."""
        with matplotlib.rc_context(STYLE):
            figure = Figure(figsize=(10, 7.6), constrained_layout=True)
            axes = figure.subplots(2, 2)
            figure.suptitle(title, x=0.01, ha="left", fontsize=12)
            times = self.reference.times - self.reference.times[0]
            curves = ((self.reference, GREY, self.named, 3.2), (self.estimate, BLUE, "odometry", 1.5))
            for trajectory, colour, label, width in curves:
                x, y, yaw = trajectory.poses.T
                axes[0, 0].plot(x, y, color=colour, label=label, linewidth=width)
                axes[0, 1].plot(times, np.degrees(yaw), color=colour, linewidth=width)
            for (x, y, _), mark, label in zip(self.estimate.poses[[0, -1]], "os", ("start", "end")):
                axes[0, 0].plot(x, y, mark, color=INK, markersize=5, label=label)
            axes[1, 0].plot(times, 1000 * self.distances, color=BLUE)
            axes[1, 1].plot(times, np.degrees(self.headings), color=BLUE)
            axes[0, 0].set(title="Path", xlabel="x [m]", ylabel="y [m]")
            axes[0, 0].set_aspect("equal", adjustable="datalim")
            axes[0, 0].legend()
            axes[0, 1].set(title="Heading", xlabel="time [s]", ylabel="heading [°]")
            axes[1, 0].set(title="Error of the place", xlabel="time [s]", ylabel="distance [mm]", ylim=(0, None))
            axes[1, 1].set(title="Error of the heading", xlabel="time [s]", ylabel="heading [°]", ylim=(0, None))
            figure.savefig(str(path))


def sizes(errors):
    """(distances [m], headings [rad], within half a turn) of K x 3 errors of poses."""
    return np.hypot(errors[:, 0], errors[:, 1]), np.abs(se2.wrap(errors[:, 2]))


def relative_errors(estimate, reference, delta):
    """`sizes` of the errors of the motion over consecutive stretches of `delta` [m] of the reference's path.

    The stretches are those of evo_rpe: from one pose at which another `delta` was complete to the next, so that
    the first one begins `delta` behind the start. None where the path is shorter than two.
    """
    marks, gone = [], 0.0
    for index, step in enumerate(reference.steps, 1):
        gone += step
        if gone >= delta:
            marks.append(index)
            gone = 0.0
    moved, believed = (seen_from(one.poses[marks[:-1]], one.poses[marks[1:]]) for one in (reference, estimate))
    return sizes(seen_from(moved, believed))


def root_mean_squares(distances, headings):
    """The text for the table, of [m] and [rad]."""
    distance, heading = (np.sqrt(np.mean(values ** 2)) for values in (distances, headings))
    return f"{1000 * distance:.1f} mm, {math.degrees(heading):.2f}°"


def timing(times):
    """The text for the table: when messages came, of K >= 2 rising stamps [s]."""
    periods = np.diff(times)
    median = np.median(periods)
    missing = np.maximum(np.round(periods / median) - 1, 0).sum() if median > 0 else 0
    return (f"{len(times)} at {1 / np.mean(periods):.1f}/s, {missing:.0f} missing; {1000 * median:.1f} ms between two, "
            f"at most {1000 * periods.max():.0f} ms")
