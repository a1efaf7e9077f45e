"""Drives that show how true odometry is, as twists (v_x [m/s], v_y [m/s], omega [rad/s]), one per control period.

UMBmark: J. Borenstein and L. Feng, Measurement and Correction of Systematic Odometry Errors in Mobile Robots,
IEEE Transactions on Robotics and Automation 12 (1996).
"""

import math

SPEED = 0.3      # [m/s]
TURNING = 0.8    # [rad/s]
PAUSE = 0.6      # [s] after each part, in which the robot comes to rest
REST = (0.0, 0.0, 0.0)


def square(side, frequency, clockwise=False):
    """The UMBmark's square: four sides [m], driven forwards, and a quarter turn on the spot behind each."""
    turn = -1.0 if clockwise else 1.0
    for _ in range(4):
        yield from part((SPEED, 0.0, 0.0), side / SPEED, frequency)
        yield from part((0.0, 0.0, turn * TURNING), math.pi / 2 / TURNING, frequency)


def spin(turns, frequency):
    """`turns` on the spot, counterclockwise; negative: clockwise."""
    yield from part((0.0, 0.0, math.copysign(TURNING, turns)), abs(turns) * 2 * math.pi / TURNING, frequency)


def sideways(distance, frequency):
    """A line to the left [m]; negative: to the right."""
    yield from part((0.0, math.copysign(SPEED, distance), 0.0), abs(distance) / SPEED, frequency)


def part(twist, seconds, frequency):
    """A twist for a time in whole periods, slowed down so that the way is exact, then a pause."""
    periods = math.ceil(seconds * frequency)
    slower = seconds * frequency / periods if periods else 0.0
    for _ in range(periods):
        yield tuple(speed * slower for speed in twist)
    for _ in range(round(PAUSE * frequency)):
        yield REST


def calibration_drives(frequency, side=2.0, turns=3.25, line=3.0):
    """(name, description, required space, twists at a `frequency` [Hz]) of each drive that a calibration wants.

    side, line: [m].
    """
    free = f"{side + 0.5:g} m x {side + 0.5:g} m of free floor, in front and to the "
    return [
        ("square", f"a square of {side:g} m, counterclockwise", free + "left", square(side, frequency)),
        ("square_clockwise", f"a square of {side:g} m, clockwise", free + "right", square(side, frequency, True)),
        ("spin", f"{turns:g} turns on the spot, counterclockwise", "the room it takes", spin(turns, frequency)),
        ("spin_clockwise", f"{turns:g} turns on the spot, clockwise", "the same", spin(-turns, frequency)),
        ("line_left", f"{line:g} m sideways to the left", f"{line + 0.5:g} m of free floor", sideways(line, frequency)),
        ("line_right", f"{line:g} m sideways to the right", "the same, on the other side", sideways(-line, frequency)),
    ]
