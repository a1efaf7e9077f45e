"""Synthetic drives for tests: encoder counts of a moving robot, with noise, slip and truth."""

import math

import numpy as np

PERIOD = 0.02  # [s]
BARE = {"wheelDistanceFromCenter": 0.125, "wheelRadius": 0.035, "gearboxReductionRatio": 18.75,
        "encoderEdgesPerMotorRevolution": 64, "pidControlFrequency": 50}


def even_wheels(number, first=math.pi / 4, **keys):
    """Wheel parameters (the keys of wheel_params.yaml) of a robot with `number` wheels, evenly placed."""
    rads = [first + 2 * math.pi * wheel / number for wheel in range(number)]
    return {**BARE, "wheelAmount": number, "wheelRads": rads, **keys}


def rolled(wheels, twists):
    """Paths [m], K x n, that wheels roll in each period of K twists (v_x, v_y, omega), K x 3."""
    rows = [(math.cos(direction), math.sin(direction), lever)
            for direction, lever in zip(wheels.directions, wheels.levers)]
    return np.asarray(twists) @ np.array(rows).T * PERIOD


def counted(wheels, paths, noise=0.0, generator=None):
    """Counts, K x n integers, of encoders on wheels that roll `paths` [m], K x n.

    noise: standard deviation [m] of a path after 1 m. The encoders start anywhere within an edge.
    """
    generator = generator or np.random.default_rng(0)
    noisy = paths + noise * np.sqrt(np.abs(paths)) * generator.standard_normal(paths.shape)
    angle = generator.uniform(0, 1, paths.shape[1]) + np.cumsum(noisy / np.array(wheels.metres_per_edge), axis=0)
    return np.diff(np.floor(angle), axis=0, prepend=np.zeros((1, paths.shape[1]))).astype(int)


def end_pose(twists):
    """(x, y, yaw) after K twists (K x 3), each held for a period; yaw is not wrapped."""
    return path_of(twists)[-1]


def path_of(twists):
    """(K + 1) x 3 poses of K twists, each held for a period; from the origin, yaw not wrapped."""
    steps = np.asarray(twists) * PERIOD
    yaw = np.concatenate([[0.0], np.cumsum(steps[:, 2])])
    middle = yaw[:-1] + steps[:, 2] / 2
    chord = np.sinc(steps[:, 2] / 2 / np.pi)
    x = np.cumsum(chord * (np.cos(middle) * steps[:, 0] - np.sin(middle) * steps[:, 1]))
    y = np.cumsum(chord * (np.sin(middle) * steps[:, 0] + np.cos(middle) * steps[:, 1]))
    return np.column_stack([np.concatenate([[0.0], x]), np.concatenate([[0.0], y]), yaw])


def still(seconds):
    """Twists of a robot that stands."""
    return np.zeros((round(seconds / PERIOD), 3))


def straight(x, y, speed=0.4, acceleration=1.0):
    """Twists of a straight line to (x, y) [m] in base_link, sped up and slowed down."""
    length = math.hypot(x, y)
    return profile(length, speed, acceleration)[:, None] * np.array((x / length, y / length, 0.0))


def spin(angle, speed=1.5, acceleration=4.0):
    """Twists of a turn on the spot by an angle [rad]."""
    return profile(abs(angle), speed, acceleration)[:, None] * np.array((0.0, 0.0, math.copysign(1, angle)))


def square(side, turn, speed=0.4):
    """Twists of a square with corners turned on the spot; turn = 1 counterclockwise, -1 clockwise."""
    legs = [part for _ in range(4) for part in (straight(side, 0, speed), still(0.1), spin(turn * math.pi / 2))]
    return np.concatenate([*legs, still(0.3)])


def profile(length, speed, acceleration):
    """Speeds per period of a trapezium that covers exactly `length`."""
    speed = min(speed, math.sqrt(length * acceleration))
    ramp = np.arange(PERIOD / 2, speed / acceleration, PERIOD) * acceleration
    hold = max(0, round((length - speed ** 2 / acceleration) / speed / PERIOD))
    speeds = np.concatenate([ramp, np.full(hold, speed), ramp[::-1]])
    return speeds * (length / (speeds.sum() * PERIOD))


def matrix_of(covariance):
    """3 x 3 of a `Covariance`, its upper triangle row by row."""
    xx, xy, xa, yy, ya, aa = covariance
    return np.array(((xx, xy, xa), (xy, yy, ya), (xa, ya, aa)))


def touches(simulation):
    """Whether the body of a robotont_simulator.simulation.Simulation touches a wall or a box."""
    contacts = simulation.data.contact.geom[:simulation.data.ncon]
    return bool(np.any(contacts == simulation.mujoco_model.geom("body").id))
