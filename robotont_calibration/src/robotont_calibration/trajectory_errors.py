"""The figures and the picture of an odometry report."""

import math

import numpy as np

from robotont_calibration.trajectory import (
    absolute_errors,
    align,
    relative_errors,
    root_mean_square,
    synchronise,
    timing,
)

BLUE, GREY, ORANGE = "#2f6db3", "#a5abb3", "#d0782a"  # odometry, reference, second curve
INK = "#33383f"
STYLE = {
    "figure.dpi": 100, "font.size": 9, "axes.titlesize": 10, "axes.titleweight": "bold", "axes.titlelocation": "left",
    "axes.spines.top": False, "axes.spines.right": False, "axes.edgecolor": "#8a9099", "axes.labelcolor": INK,
    "axes.grid": True, "grid.color": "#e6e8eb", "grid.linewidth": 0.8, "axes.axisbelow": True, "text.color": INK,
    "xtick.color": INK, "ytick.color": INK, "legend.frameon": False, "lines.linewidth": 1.6,
}


class Report:
    """An estimate against a reference, both `Trajectory`, and the packets' stamps [s].

    named: name of the reference. alignment: one of trajectory.ALIGNMENTS. delta: [m] stretch for relative errors.
    """

    def __init__(self, estimate, reference, named, packet_times=(), refused=0, alignment="origin", delta=1.0):
        estimate, self.reference = synchronise(estimate, reference)
        self.estimate = align(estimate, self.reference, alignment)
        self.named, self.alignment, self.delta = named, alignment, delta
        self.packet_times, self.refused = packet_times, refused
        self.distances, self.headings = absolute_errors(self.estimate, self.reference)
        self.stretches, self.turns = relative_errors(self.estimate, self.reference, delta)

    def figures(self):
        """{name: number}, in the units that stand in `rows`."""
        reference, turned = self.reference, self.reference.turned / (2 * math.pi)
        end = self.estimate.poses[-1, 2] - reference.poses[-1, 2]  # unwrapped: whole turns count
        return {
            "duration": reference.times[-1] - reference.times[0],
            "length": reference.length,
            "turned": turned,
            "ate": root_mean_square(self.distances),
            "ate_largest": float(self.distances.max()),
            "ate_heading": math.degrees(root_mean_square(self.headings)),
            "rpe": root_mean_square(self.stretches),
            "rpe_heading": math.degrees(root_mean_square(self.turns)),
            "end": float(self.distances[-1]),
            "end_heading": math.degrees(abs(end)),
            "per_metre": 1000 * float(self.distances[-1]) / reference.length if reference.length else math.nan,
            "per_turn": math.degrees(abs(end)) / turned if turned > 0.25 else math.nan,
        }

    def rows(self):
        """(what, value with unit) of the table."""
        of = self.figures()
        rows = [
            ("duration", f"{of['duration']:.1f} s"),
            ("path of the " + self.named, f"{of['length']:.2f} m"),
            ("turned, to and fro", f"{of['turned']:.2f} turns"),
            ("absolute error, root mean square", f"{1000 * of['ate']:.1f} mm, {of['ate_heading']:.2f}°"),
            ("absolute error, largest", f"{1000 * of['ate_largest']:.1f} mm"),
            (f"relative error per {self.delta:g} m, root mean square",
             f"{1000 * of['rpe']:.1f} mm, {of['rpe_heading']:.2f}°" if len(self.stretches) else "path too short"),
            ("error at the end", f"{1000 * of['end']:.1f} mm, {of['end_heading']:.2f}°"),
            ("drift per metre", "no path" if math.isnan(of["per_metre"]) else f"{of['per_metre']:.1f} mm"),
            ("drift per turn", "too few turns" if math.isnan(of["per_turn"]) else f"{of['per_turn']:.2f}°"),
        ]
        for what, times in (("odometry", self.estimate.times), ("packets", self.packet_times)):
            if len(times) > 1:
                found = timing(times)
                rows.append((what, f"{found.messages} at {found.rate:.1f}/s, {found.missing} missing"))
                rows.append((f"{what}: time between two", (
                    f"{1000 * found.period:.1f} ms, 99 % within ±{1000 * found.jitter:.1f} ms, "
                    f"longest {1000 * found.longest:.0f} ms")))
        if len(self.packet_times):
            rows.append(("packets refused", str(self.refused)))
        return rows

    def table(self):
        """The rows as a string."""
        rows = self.rows()
        width = max(len(what) for what, _ in rows)
        return "\n".join(f"{what.ljust(width)}  {value}" for what, value in rows)

    def draw(self, path, title):
        """Write a PNG: path, heading, speed and error."""
        plt = pyplot()
        with plt.rc_context(drawing_style()):
            figure, axes = plt.subplots(2, 2, figsize=(10, 7.6), constrained_layout=True)
            figure.suptitle(title, x=0.01, ha="left", fontsize=12)
            start = self.reference.times[0]
            curves = ((self.reference, GREY, self.named, 3.2), (self.estimate, BLUE, "odometry", 1.5))
            for trajectory, colour, label, width in curves:
                style = {"color": colour, "label": label, "linewidth": width}
                axes[0, 0].plot(trajectory.poses[:, 0], trajectory.poses[:, 1], **style)
                axes[0, 1].plot(trajectory.times - start, np.degrees(trajectory.poses[:, 2]), **style)
                times, speeds, _ = trajectory.speeds()
                axes[1, 0].plot(times - start, speeds, **style)
            ends = self.estimate.poses[[0, -1], :2]
            axes[0, 0].plot(*ends[0], "o", color=INK, markersize=5, label="start")
            axes[0, 0].plot(*ends[1], "s", color=INK, markersize=5, label="end")
            axes[0, 0].set(title="Path", xlabel="x [m]", ylabel="y [m]")
            axes[0, 0].set_aspect("equal", adjustable="datalim")
            axes[0, 1].set(title="Heading", xlabel="time [s]", ylabel="heading [°]")
            axes[1, 0].set(title="Speed over ground", xlabel="time [s]", ylabel="speed [m/s]")
            axes[0, 0].legend()
            axes[0, 1].legend()
            self._draw_errors(axes[1, 1], start)
            figure.savefig(str(path))
            plt.close(figure)

    def _draw_errors(self, axis, start):
        times = self.estimate.times - start
        axis.plot(times, 1000 * self.distances, color=BLUE, label="position (left axis)")
        axis.set_title("Error", loc="left")
        axis.set(xlabel="time [s]", ylabel="position [mm]")
        axis.set_ylim(bottom=0)
        other = axis.twinx()
        other.spines["right"].set_visible(True)
        other.grid(False)
        other.plot(times, np.degrees(self.headings), color=ORANGE, label="heading (right axis)", linewidth=1.2)
        other.set_ylabel("heading [°]")
        other.set_ylim(bottom=0)
        axis.set_zorder(other.get_zorder() + 1)  # the position is drawn over the heading's noise
        axis.patch.set_visible(False)
        axis.legend(handles=[*axis.get_lines(), *other.get_lines()], loc="lower right",
                    bbox_to_anchor=(1.0, 1.0), ncol=2)


def drawing_style():
    """The entries of STYLE that this matplotlib supports."""
    supported = pyplot().rcParams
    return {name: value for name, value in STYLE.items() if name in supported}


def pyplot():
    """matplotlib.pyplot that draws into files, whatever display there is."""
    import matplotlib  # here, for it is slow to load and only pictures need it

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    return plt
