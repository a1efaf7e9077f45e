"""What a calibration has changed: a table, and a picture of before and after."""

import functools
import math
from typing import NamedTuple

import numpy as np

from robotont_calibration.calibration import Stretch, misfit
from robotont_calibration.trajectory_errors import BLUE, GREY, INK, ORANGE, drawing_style, pyplot
from robotont_driver import se2
from robotont_driver.wheels import read_wheels


class Run(NamedTuple):
    """A recorded run: its name, all of it as one stretch, and the stretches that the calibration uses."""

    name: str
    whole: Stretch
    stretches: list


def table(given, found, runs):
    """Text: each parameter before and after with its uncertainty, and each run's end error before and after.

    given: mapping with the old parameters. found: `Calibration`.
    """
    lines = [f"{'parameter':24} {'before':>10} {'after':>10}   standard deviation"]
    for name, value, deviation in zip(found.names, found.values, found.deviations):
        key, _, index = name.rstrip("]").partition("[")
        before, after = (pick(parameters[key], index) for parameters in (given, found.parameters))
        unit = "rad" if key == "wheelRads" else "m"
        change, spread = (f"{math.degrees(value):+.3f}°", f"{math.degrees(deviation):.3f}°") if unit == "rad" else \
            (f"{value:+.3%}", f"{deviation:.3%}")
        lines.append(f"{name:24} {before:10.6f} {after:10.6f}   {spread} [{unit}], changed by {change}"
                     + ("   NOT DETERMINED by these runs" if name in found.undetermined else ""))
    lines.append(f"{'wheel_noise':24} {'':10} {found.wheel_noise:10.4f}   [m] after 1 m, for config/driver.yaml")
    lines += ["", f"{'error at the end':24} {'before':>18} {'after':>18}"]
    for run in runs:
        before, after = (ends(parameters, run) for parameters in (given, found.parameters))
        lines.append(f"{run.name:24} {words(before):>18} {words(after):>18}")
    return "\n".join(lines)


def pick(value, index):
    """The number at an index (text, perhaps empty) of a number or list; the mean of a list without one."""
    return float(np.mean(value)) if not index or not isinstance(value, (list, tuple)) else value[int(index)]


def ends(parameters, run):
    """(place [m], yaw [rad]) by which the odometry with these parameters misses the end of a run."""
    x, y, yaw = misfit(read_wheels(parameters), run.whole)
    return math.hypot(x, y), abs(yaw)


def words(error):
    """An error of place and yaw for the table."""
    return f"{1000 * error[0]:.0f} mm {math.degrees(error[1]):5.1f}°"


def draw(path, given, found, runs):
    """Write a PNG: where each run ended, by the old and the new parameters, around where it really ended."""
    plt = pyplot()
    with plt.rc_context(drawing_style()):
        figure, (places, turns) = plt.subplots(
            1, 2, figsize=(10, 4.6), constrained_layout=True, gridspec_kw={"width_ratios": (1.25, 1)})
        figure.suptitle("Odometry at the end of each run", x=0.01, ha="left", fontsize=12)
        rows = np.arange(len(runs))[::-1]
        for label, parameters, colour, shift in (
                ("before", given, ORANGE, 0.19), ("after", found.parameters, BLUE, -0.19)):
            wheels = read_wheels(parameters)
            missed = np.array([misfit(wheels, run.whole) for run in runs])
            places.plot(1000 * missed[:, 0], 1000 * missed[:, 1], "o", color=colour, label=label, markersize=7)
            turns.barh(rows + shift, np.degrees(missed[:, 2]), 0.34, color=colour, label=label)
        places.plot(0, 0, "+", color=INK, markersize=14, markeredgewidth=1.5, label="truth")
        places.axhline(0, color=GREY, linewidth=0.8, zorder=0)
        places.axvline(0, color=GREY, linewidth=0.8, zorder=0)
        places.set(title="Place", xlabel="forward from the true end [mm]", ylabel="left of the true end [mm]")
        places.set_aspect("equal", adjustable="datalim")
        places.legend()
        turns.set_yticks(rows)
        turns.set_yticklabels([run.name for run in runs])
        turns.axvline(0, color=INK, linewidth=0.8)
        turns.grid(axis="y", visible=False)
        turns.set(title="Heading", xlabel="turned too far [°]")
        figure.savefig(str(path))
        plt.close(figure)


def whole_of(stretches, deviation):
    """One `Stretch` of all, put together from what each one measured."""
    end = functools.reduce(se2.compose, (stretch.moved for stretch in stretches), (0.0, 0.0, 0.0))
    return Stretch(np.concatenate([stretch.counts for stretch in stretches]), end, deviation)
