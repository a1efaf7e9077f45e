"""Where the boards of Robotont, as delivered, have their wheels, and how a wheel file's wheels are ordered on them."""

import math

from robotont_driver.protocol.protocol import ProtocolError

POSITIONS = tuple(math.radians(angle) for angle in (60, 180, 300))  # [rad] yaw of each wheel's place in base_link
DISTANCE = 0.145       # [m] centre to wheel; 0.127 in firmware from before March 2020
RADIUS = 0.035         # [m]
BOARD_EDGES = 1200     # of a wheel's turn: 64 of a motor's turn, behind a gear of 18.75
PERIOD = 0.02          # [s] between two lines of feedback
LARGEST_ANGLE = 0.1    # [rad] by which a wheel file may differ from POSITIONS: a calibrated one differs a little
CALIBRATED = 0.05      # part by which a calibrated distance may differ from the board's


class BoardWheels:
    """The board's wheels in the order and with the signs of a wheel file.

    The board drives wheel j along the direction at POSITIONS[j] + 90 degrees, counterclockwise positive. A wheel
    file may list the same wheels in another order and with other signs. `places[k]`: which of the board's wheels the
    file's wheel k is. `signs[k]`: +1 or -1, the file's positive direction of wheel k on the board.
    """

    def __init__(self, wheels, distance=DISTANCE):
        """Raises ProtocolError for wheels that the board cannot have."""
        if wheels.amount != 3:
            raise ProtocolError(f"wheelAmount: found {wheels.amount}, allowed: 3, for the board has three motors")
        if abs(wheels.pid_frequency * PERIOD - 1) > 1e-6:
            raise ProtocolError(f"pidControlFrequency: found {wheels.pid_frequency:g}, allowed: {1 / PERIOD:g} [Hz], "
                               "the rate of the board's feedback")
        self.signs = tuple(math.copysign(1, lever) for lever in wheels.levers)
        self.places = tuple(self._place(position) for position in wheels.positions)
        if len(set(self.places)) != 3:
            raise ProtocolError(self._refusal(wheels))
        self.distance = distance
        # [m/s per unit] a unit is one edge per period, whatever radius a calibration has found
        self.speed_of_unit = 2 * math.pi * RADIUS / wheels.edges_per_turn / PERIOD
        self.edges_per_metre = wheels.edges_per_turn / (2 * math.pi * RADIUS)
        self.rows = tuple((-sign * math.sin(POSITIONS[place]), sign * math.cos(POSITIONS[place]), sign * distance)
                          for place, sign in zip(self.places, self.signs))

    @staticmethod
    def _place(position):
        """Index of the board's wheel at a position [rad]; None where it has none."""
        for place, angle in enumerate(POSITIONS):
            if abs(math.remainder(position - angle, 2 * math.pi)) < LARGEST_ANGLE:
                return place
        return None

    @staticmethod
    def _refusal(wheels):
        found = ", ".join(f"{math.degrees(position) % 360:.0f}" for position in wheels.positions)
        return (f"wheelRads: found wheels at {found} degrees, allowed: one each at 60, 180 and 300, where the board "
                "has them, in any order")

    @property
    def edges_of_board(self):
        """How many of the board's own edges are one of the wheel file's."""
        return BOARD_EDGES / (self.edges_per_metre * 2 * math.pi * RADIUS)

    def misfit(self, wheels):
        """Warning about wheels at another distance than the board assumes; empty when they agree."""
        for distance in wheels.distances:
            if abs(distance / self.distance - 1) > CALIBRATED:
                return (f"the robot has {distance:g} m from centre to wheel, the board assumes {self.distance:g} m, so "
                        "turns would be wrong")
        return ""

    def board_speeds(self, units):
        """Rim speeds [m/s] of the board's three wheels for units in the file's order."""
        speeds = [0.0] * 3
        for unit, place, sign in zip(units, self.places, self.signs):
            speeds[place] = sign * unit * self.speed_of_unit
        return speeds

    def edges(self, step):
        """Edges (floats, in the file's order) that make a displacement (forward [m], left [m], turn [rad])."""
        forward, left, turn = step
        return [(x * forward + y * left + z * turn) * self.edges_per_metre for x, y, z in self.rows]

    def most_edges(self, dx, dy, turn):
        """A bound on the edges of any wheel for a displacement of (dx, dy) [m] in any direction and a turn [rad]."""
        return (math.hypot(dx, dy) + abs(turn) * self.distance) * self.edges_per_metre
