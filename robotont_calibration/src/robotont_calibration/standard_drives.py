"""Drives that show how true odometry is, as twists (v_x [m/s], v_y [m/s], omega [rad/s]), one per control period.

UMBmark: J. Borenstein and L. Feng, Measurement and Correction of Systematic Odometry Errors in Mobile Robots,
IEEE Transactions on Robotics and Automation 12 (1996).
"""

import math

SPEED = 0.3      # [m/s]
TURNING = 0.8    # [rad/s]
PAUSE = 0.6      # [s] after each leg, in which the robot comes to rest
REST = (0.0, 0.0, 0.0)


def driven(legs, frequency, speed=SPEED):
    """Twists of legs, each a constant motion as of `se2.arc` ([m], [m], [rad]), in whole periods; then a pause."""
    for x, y, turn in legs:
        periods = math.ceil(max(math.hypot(x, y) / speed, abs(turn) / TURNING) * frequency)
        for _ in range(periods):
            yield x * frequency / periods, y * frequency / periods, turn * frequency / periods
        for _ in range(round(PAUSE * frequency)):
            yield REST


def calibration_drives(frequency, side=2.0, turns=3.0, line=3.0):
    """(name, description, required space, twists at a `frequency` [Hz]) of each drive that a calibration wants.

    side, line: [m]. The squares are UMBmark's: driven forwards, a quarter turn on the spot behind each side.
    """
    free = f"{side + 0.5:g} m x {side + 0.5:g} m of free floor, in front and to the "
    ahead, quarter, spin = (side, 0.0, 0.0), math.pi / 2, 2 * math.pi * turns
    return [(name, what, room, driven(legs, frequency)) for name, what, room, legs in (
        ("square", f"a square of {side:g} m, counterclockwise", free + "left", 4 * [ahead, (0.0, 0.0, quarter)]),
        ("square_clockwise", f"a square of {side:g} m, clockwise", free + "right", 4 * [ahead, (0.0, 0.0, -quarter)]),
        ("spin", f"{turns:g} turns on the spot, counterclockwise", "the room it takes", [(0.0, 0.0, spin)]),
        ("spin_clockwise", f"{turns:g} turns on the spot, clockwise", "the same", [(0.0, 0.0, -spin)]),
        ("line_left", f"{line:g} m sideways to the left", f"{line + 0.5:g} m of free floor", [(0.0, line, 0.0)]),
        ("line_right", f"{line:g} m sideways to the right", "the same, on the other side", [(0.0, -line, 0.0)]),
    )]
