"""Whatever the true poses contain: nothing that is worse than the old file is written, and the reason is told."""

import math

import numpy as np
import pytest
from synthetic_runs import drives, taped_runs, true_of

from robotont_calibration.calibrate_wheels import contradictions
from robotont_calibration.calibration_runs import errors_along
from robotont_calibration.free_parameters import FreeParameters
from robotont_calibration.true_poses import YAWS
from robotont_calibration.wheel_estimation import calibrate
from robotont_driver.kinematics import se2
from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_testing.robots import SHIPPED

FAR_OFF, NEAR = true_of(SHIPPED, 1.02, 0.97, [(1, 1.5)]), true_of(SHIPPED, 0.997, 1.006, [(0, 0.3)])
FIVE = math.radians(5)
BAD = {  # what becomes of the end p of run i
    **{f"yaw {name}": lambda i, p, factor=factor: p * (1, 1, 1 / factor) for name, factor in YAWS.items()},
    "no yaw": lambda i, p: p * (1, 1, 0),
    "half of yaw": lambda i, p: p * (1, 1, 0.5),
    "y to the right": lambda i, p: p * (1, -1, 1),
    "x backward": lambda i, p: p * (-1, 1, 1),
    "x and y exchanged": lambda i, p: p[:, (1, 0, 2)],
    "millimetres": lambda i, p: p * (1000, 1000, 1),
    "yards": lambda i, p: p / (0.9144, 0.9144, 1),
    "nothing": lambda i, p: p * 0,
    "one end": lambda i, p: p + np.multiply(i == 1, (0.5, 0.3, 0.3)),
    "the runs contradict each other": lambda i, p: p * (1 + 0.03 * (-1) ** i),
    "the end's opposite": lambda i, p: np.transpose(se2.between(p.T, (0.0, 0.0, 0.0))),
    "the frame turned": lambda i, p: np.transpose(se2.compose((0.0, 0.0, FIVE), p.T)) - (0.0, 0.0, FIVE),
}


def guided(true, seed=0, spoil=lambda i, p: p, which=(0, 1, 2, 3, 4, 5)):
    """`Run`s of a robot that is not as its file says, as the guide drives it: its ends are where it really came to."""
    nominal, real = Kinematics(read_wheels(SHIPPED)), Kinematics(read_wheels(true))
    ratio = np.divide(real.wheels.metres_per_edge, nominal.wheels.metres_per_edge)
    really = (real.inverse @ np.diag(ratio) @ nominal.matrix).T
    return list(taped_runs(true, seed, {i: drives()[i] @ really for i in which}, spoil))


def worse(parameters, clean):
    """[m] by how much the ends of clean runs are farther off than with the file."""
    return np.mean([errors_along(read_wheels(parameters), run)[0] - errors_along(read_wheels(SHIPPED), run)[0]
                    for run in clean])


def judged(runs):
    """(`Calibration`, reasons not to write it)."""
    found = calibrate(runs, FreeParameters(SHIPPED))
    return found, contradictions(runs, found)


@pytest.mark.parametrize("true", [NEAR, FAR_OFF], ids=["near", "far off"])
@pytest.mark.parametrize("bad", ["right", *BAD])
def test_nothing_worse_is_written_and_what_yaw_is_is_told(true, bad):
    found, reasons = judged(guided(true, 0, BAD.get(bad, lambda i, p: p)))
    farther = worse(found.parameters, guided(true, 900))
    print(f"{bad}: {'refused' if reasons else 'written'}, puts ends {1000 * farther:.1f} mm farther off")
    assert reasons or farther < 0.002
    if bad == "right":
        assert not reasons
    if bad.startswith("yaw") and "degrees where" not in bad:
        assert bad in reasons[0]


@pytest.mark.parametrize("factor", [1.0, -1.0])
def test_spins_near_whole_turns_and_lines_do_not_tell_what_yaw_is(factor):
    """They fit any sign and unit: it is said, and nothing is written."""
    _, reasons = judged(guided(FAR_OFF, 0, lambda i, p: p * (1, 1, factor), which=(2, 3, 4, 5)))
    assert "yaw" in reasons[0]
