"""Whether the true poses can be true: x forward, y to the left [m], yaw counterclockwise, of these drives.

Other axes and units of x and y fit no plausible robot. Other readings of yaw may, where spins end near whole turns:
each is a model of its own, and the evidence of the runs decides. Not to be tested by any run: a scale of x and y
together that is up to SCALED off, and a marker whose axis is up to TURNED off.
"""

import math

import numpy as np

from robotont_calibration.wheel_estimation import calibrate

STRETCHES = 10    # of a run are enough to compare
BETTER = 10.0     # twice the logarithm of the evidence by which a reading is taken for true
DIFFERENT = 4.0   # standard deviations by which two readings lead to different parameters ...
NOTICED = 0.002   # ... that differ by more than this: shares of lengths, [rad]

CONTRADICTS = 0.015  # slip from drive to drive; real robots' is up to 0.006
FAR = 2.5            # ties by which no parameter is really wrong: 25 % of a length, 29 degrees, and ...
SCALED = 0.06        # ... part of the radius that a ruler would show; of the real robots' ones 0.04 is the largest
TURNED = math.radians(3)  # common to all angles; less is not to be told from a robot whose front was built askew
NOISIEST, UNTRUE = 0.025, 3.0 # wheel noise [m] after 1 m (real robots' is 0.003 to 0.014), factor of the truth's

DEGREE = math.degrees(1.0)
YAWS = {  # what yaw may be instead: the factor that makes it right
    "is in degrees where radians are asked for": 1 / DEGREE,
    "is in radians where degrees are asked for": DEGREE,
    "has the wrong sign": -1.0,
    "has the wrong sign, and is in radians where degrees are asked for": -DEGREE,
    "has the wrong sign, and is in degrees where radians are asked for": -1 / DEGREE,
}


def implausible(found):
    """Words for what no true poses of a robot make of a `Calibration`."""
    names, values = found.free.names, found.values
    far = [name for name, value, tie in zip(names, values, found.free.ties) if abs(value) > FAR * tie]
    radii, angles = (np.mean([value for name, value in zip(names, values) if name.startswith(key)] or 0.0)
                     for key in ("wheelRadius", "wheelRads"))
    return [words for wrong, words in (
        (far, f"{', '.join(far)} would change by more than any robot needs: is this the robot's file?"),
        (abs(radii) > SCALED, f"the radius would change by {radii:+.0%}: is x, y in metres? Measure a wheel with a "
                              "ruler, and put it into the file"),
        (abs(angles) > TURNED, f"all wheels would turn by {math.degrees(angles):+.0f} degrees: x of the true poses is "
                               "not where the robot looks"),
        (found.slip > CONTRADICTS, "the runs contradict each other: from drive to drive the wheels differ by "
                                   f"{found.slip:.1%}"),
        (found.wheel_noise > NOISIEST or found.measured > UNTRUE,
         "the counts do not fit the true poses: are x forward and y to the left, in metres? Do their times, and the "
         "point that is measured, belong to this drive?"),
    ) if wrong]


def wrong_yaw(runs, free):
    """Words for each of YAWS that the runs say is meant or cannot tell from the one asked for; the likeliest first.

    Arguments as of `calibrate`.
    """
    def read(factor):
        """(minus twice the logarithm of the evidence of yaw as it is, calibration) with a factor."""
        found = calibrate([run._replace(poses=run.poses * (1.0, 1.0, factor)) for run in runs], free)
        return found.unlikely - 2 * measured * math.log(abs(factor)), found

    runs = [run._replace(stretches=run.stretches[::math.ceil(len(run.stretches) / STRETCHES)]) for run in runs]
    measured = sum(len(run.stretches) for run in runs)
    unlikely, asked = read(1.0)
    words = []
    for name, factor in YAWS.items():
        other_unlikely, other = read(factor)
        if implausible(other):
            continue
        better, apart = unlikely - other_unlikely, np.abs(other.values - asked.values)
        told = apart > np.maximum(NOTICED, DIFFERENT * np.hypot(other.deviations, asked.deviations))
        if better > BETTER:
            words.append((-better, f"the true poses fit the counts only if yaw {name}"))
        elif better > -BETTER and told.any():
            words.append((-better, f"these runs do not tell whether yaw {name}: add a square, or a turn that ends far "
                                   "from a whole one"))
    return [text for _, text in sorted(words)]
