"""The result of a calibration: a table of before and after."""

import math

import numpy as np

from robotont_calibration.calibration_runs import errors_along
from robotont_driver.kinematics.wheel_params import read_wheels

SAME_THING = """\
The point is where in base_link the measured poses are taken: marker, laser or camera. A distance for each wheel and
a point are the same thing: a point off the middle looks like wheels at unequal distances, so only one of the two can
be looked for."""


def table(given, found, runs):
    """Text: each parameter before and after with its uncertainty, and each run's errors.

    given: mapping with the old parameters. found: `Calibration`.
    """
    lines = [f"{'parameter':24} {'unit':4} {'before':>10} {'after':>10} {'change':>10} {'std. dev.':>10}"]
    for name, value, deviation in zip(found.free.names, found.values, found.deviations):
        key, _, index = name.rstrip("]").partition("[")
        if key.startswith("point"):
            unit, before, after = "m", 0.0, value
            change, spread = f"{1000 * value:+.1f} mm", f"{1000 * deviation:.1f} mm"
        else:
            before, after = (pick(parameters[key], index) for parameters in (given, found.parameters))
            unit, change, spread = ("rad", f"{math.degrees(value):+.3f}°", f"{math.degrees(deviation):.3f}°") \
                if key == "wheelRads" else ("m", f"{value:+.3%}", f"{deviation:.3%}")
        lines.append(f"{name:24} {unit:4} {before:10.6f} {after:10.6f} {change:>10} {spread:>10}"
                     + ("   NOT DETERMINED by these runs" if name in found.undetermined else ""))
    lines.append(f"{'wheel_noise':24} {'m':4} {'':10} {found.wheel_noise:10.4f}   after 1 m, for driver.yaml")
    lines.append(f"{'slip':24} {'':4} {'':10} {found.slip:10.2%}   by which parameters differ from drive to drive")
    if "point x" in found.free.names:
        lines += ["", SAME_THING]
    lines += ["", "error of place along each run (root of the mean square) and of heading at its end", "",
              f"{'run':24} {'before':>18} {'after':>18}"]
    errors = [[errors_along(read_wheels(parameters), run, found.point) for run in runs]
              for parameters in (given, found.parameters)]
    rows = [run.name for run in runs], *errors
    lines += [f"{name:24} " + " ".join(f"{words(error):>18}" for error in row) for name, *row in zip(*rows)]
    lines.append(f"{'mean':24} " + " ".join(f"{words(np.mean(column, axis=0)):>18}" for column in errors))
    lines += [f"{run.name}: {run.missing} packets are missing or came too late, the longest gap is "
              f"{run.longest_gap:.2f} s: make this run again" for run in runs if run.missing]
    return "\n".join(lines)


def pick(value, index):
    """The number at an index (a string, perhaps empty) of a number or list; the mean of a list without one."""
    return float(np.mean(value)) if not index or not isinstance(value, (list, tuple)) else value[int(index)]


def words(error):
    """An error of place and yaw for the table."""
    return f"{1000 * error[0]:.0f} mm {math.degrees(error[1]):5.1f}°"
