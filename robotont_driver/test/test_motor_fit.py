"""The fit against motors computed from their parts (geared_motors), and what it refuses. See test_firmware_tune."""

import numpy as np
import pytest
from geared_motors import GearedMotors

from robotont_driver.tools.motor_fit import DirectionFit, compare, fit_direction, propose

EFFORTS = [*range(100, 1000, 100), 999]
WHEELS = 40


@pytest.fixture(name="drawn", scope="module")
def _drawn():
    """(truths (n, 3), fits) of wheels of drawn sizes, half of them driven backward."""
    random = np.random.default_rng(20)

    def draw(*bounds):
        return random.uniform(*bounds, (WHEELS, 1))

    motors = GearedMotors(
        volts=draw(10, 16), rotor=1.25e-6 * draw(0.7, 3), wheel=6e-5 * draw(0.5, 4), friction=0.0012 * draw(0.4, 2),
        wheel_friction=0.003 * draw(0.3, 3), viscous=draw(0, 5e-6), cogging=0.0006 * draw(0, 1.5), play=draw(0, 0.1),
        uneven=draw(0, 0.5))
    signs = np.resize([1, -1], (WHEELS, 1))
    steps = signs[..., None] * motors.steps(signs * EFFORTS)
    return np.stack(motors.truth, axis=-1)[:, 0], [fit_direction(EFFORTS, list(each)) for each in steps]


def test_friction_gain_and_time_constant_of_other_motors_are_found_and_their_errors_are_as_stated(drawn):
    truths, fits = drawn
    found = np.array([(fit.friction, fit.gain, fit.tau) for fit in fits])
    off = found[..., 0] - truths
    assert (np.abs(off[:, 0]) < 2).all(), "of 4000"
    assert (np.abs(off[:, 1]) < 0.005 * truths[:, 1]).all()
    assert (np.abs(off[:, 2]) < 0.08).all(), "periods: 1.6 ms"
    assert (np.mean(np.abs(off) < found[..., 1], axis=0) > 0.5).all()
    assert (np.mean(np.abs(off) < 2 * found[..., 1], axis=0) > 0.85).all()
    assert (found[..., 1] < [1.5, 0.1, 0.12]).all(), "stated, and not as so much that all is covered"
    assert not [fit.fault for fit in fits if fit.fault]


def counts(speed, tau, periods=25, wrong=lambda at: 1.0):
    """Whole edges of a first-order response."""
    times = np.arange(periods + 1.0)
    way = speed * (times - tau * (1 - np.exp(-times / tau)))
    return np.diff(np.floor(way)) * np.array([wrong(at) for at in range(periods)])


def steps_of(speed, tau=3.0, **words):
    return [counts(speed(effort), tau, **words) for effort in EFFORTS]


def straight(effort):
    return max(0.0, effort - 160) / 19.2


@pytest.mark.parametrize("steps, words", [
    (steps_of(lambda effort: straight(effort) ** 1.6 / 8), "does not grow evenly"),
    (steps_of(lambda effort: min(straight(effort), 22)), "does not grow evenly"),
    (steps_of(straight, wrong=lambda at: at % 2), "counts leave the model"),
    (steps_of(straight, tau=39.0), "time constant is uncertain"),
    (steps_of(lambda effort: straight(effort) + 20), "turns faster than its effort"),
    (steps_of(straight), ""),
])
def test_what_is_no_such_motor_is_refused(steps, words):
    fault = fit_direction(EFFORTS, steps).fault
    assert words in fault
    assert bool(words) == bool(fault)


def test_too_few_steps_are_no_fit_and_the_speed_bound_is_named():
    with pytest.raises(ValueError, match="turns from 300 on; only 0 of 10 steps"):
        fit_direction(EFFORTS, steps_of(lambda effort: 3.0 * (effort >= 300)))
    cut = [each[:6] if effort > 400 else each for effort, each in zip(EFFORTS, steps_of(straight))]
    with pytest.raises(ValueError, match="6 were ended by the bound on its speed"):
        fit_direction(EFFORTS, cut)


def fit(friction=160, gain=19.2, tau=3.0):
    return DirectionFit(200, (friction, 1), (gain, 0.1), (tau, 0.1), 0.4, 0.0, (999 - friction) / gain, "")


@pytest.mark.parametrize("odd, words", [
    ({"gain": 27.5}, ["wheel 1 differs: speed -30 %, time constant +0 %, friction +0: fewer edges for its effort"]),
    ({"friction": 420}, ["wheel 1 differs: speed -31 %, time constant +0 %, friction +260: more friction"]),
    ({"tau": 4.5}, ["wheel 1 differs: speed +0 %, time constant +50 %, friction +0: a heavier wheel"]),
    ({"tau": 3.3, "gain": 20.5, "friction": 190}, []),
])
def test_a_wheel_that_differs_is_named_with_what_it_may_be(odd, words):
    lines = compare([(fit(), fit()), (fit(**odd), fit(**odd)), (fit(), fit())])
    assert [line[:len(word)] for line, word in zip(lines, words)] == words
    assert len(lines) == len(words)


def test_a_direction_that_differs_is_named():
    assert compare([(fit(), fit()), (fit(), fit(friction=420)), (fit(), fit())])[0].startswith(
        "wheel 1 turns 31 % slower backward")


def test_the_proposal_is_as_of_12_volts():
    fits = [(fit(friction=140), fit(friction=180))] * 3
    assert propose(fits, 12, {"LEAD": 240, "TURN_LEAD": 103}) == {
        "STATIC": 160, "SPEED_GAIN": 4915, "LEAD": 250, "TURN_LEAD": 113, "FREE_LEAD": 60}
    assert propose(fits, 16.8, {}) == {"STATIC": 224, "SPEED_GAIN": 6881, "FREE_LEAD": 60}
