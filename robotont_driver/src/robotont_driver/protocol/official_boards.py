"""Robotont's boards as delivered, generations 2, 2.1, 3: rim speeds to the board, poses from it; docs/protocol.md."""

import math
import re

from robotont_driver.protocol.packet import Packet, PacketError, format_packet
from robotont_driver.protocol.pose_feedback import PERIOD, PoseTracker, parse_pose
from robotont_driver.protocol.protocol import Power, Protocol, ProtocolError, Ranges

POSITIONS = tuple(math.radians(angle) for angle in (60, 180, 300))  # [rad] yaw of each wheel's place in base_link
DISTANCE = 0.145       # [m] centre to wheel; 0.127 in firmware from before March 2020
RADIUS = 0.035         # [m]
BOARD_EDGES = 1200     # of a wheel's turn: 64 of a motor's turn, behind a gear of 18.75
LARGEST_ANGLE = 0.1    # [rad] by which a wheel file may differ from POSITIONS: a calibrated one differs a little
CALIBRATED = 0.05      # part by which a calibrated distance may differ from the board's

BANNER = "**** MAIN ****"
STOP = b"RS:0:0:0\n"
STANDING = 0.0005     # [m/s] slower wheels are stopped
PUSHED = 1.5          # part of the board's limit that a wheel exceeds at most while its lines are lost
DECIMALS = 3          # of edges
LIGHTS_PER_LINE = 20  # the board takes lines of at most 254 bytes
RANGE_SENSORS = 12
STRANGE = 50          # lines in a row that moved against their own twist: firmware before February 2020
OLD = ("firmware of August 2018 to February 2020: its poses are short by 11 to 24 %, and the speeds between are not "
       "sent; flash the makers' 2.1.3 (robot:=robotont2) or this project's (robot:=robotont21, docs/firmware.md)")

USB_ID = "0483:5740"  # of generation 3: STM32 virtual serial port
TRANSFER = 64         # [bytes] of a USB transfer; a line is shorter
TICK = 0.001 / PERIOD  # [periods] of the clock by which generation 3 measures speeds
DRAWING = 1.25        # [periods] of a loop that draws the display, every tenth; ...
MEAN = 1.025          # ... of all loops
LONGEST = 2.0         # [periods] a multiple of any period has whole edges, too
WHOLE = 0.003         # [edges] by which a number of edges is not whole, out of a line's six decimals
STILL = b"LM:8:0:0:0\n"  # a mode of the lights that the firmware does not have: nothing animates them

_READING = re.compile(r"-?[0-9]{1,9}(?:\.[0-9]{1,9})?")
_DEBUG = re.compile(r"Setpoint [012], |Speed\[[012]\]: |MOTOR [012]: |(Fault|Temp|Effort|Current\[[012]\]): ")


class BoardWheels:
    """The board's wheels in the order and with the signs of a wheel file.

    The board drives wheel j along the direction at POSITIONS[j] + 90 degrees, counterclockwise positive. A wheel
    file may list the same wheels in another order and with other signs, and calibrated numbers; `misfit`: a warning
    where its distance is another one.
    """

    def __init__(self, wheels, distance):
        """Raises ProtocolError for wheels that the board cannot have."""
        if wheels.amount != 3:
            raise ProtocolError(f"wheelAmount: found {wheels.amount}, allowed: 3, for the board has three motors")
        if abs(wheels.pid_frequency * PERIOD - 1) > 1e-6:
            raise ProtocolError(f"pidControlFrequency: found {wheels.pid_frequency:g}, allowed: {1 / PERIOD:g} [Hz], "
                                "the rate of the board's feedback")
        self._places = [place for position in wheels.positions for place, angle in enumerate(POSITIONS)
                        if abs(math.remainder(position - angle, 2 * math.pi)) < LARGEST_ANGLE]
        if len(set(self._places)) != 3:
            found = ", ".join(f"{math.degrees(position) % 360:.0f}" for position in wheels.positions)
            raise ProtocolError(f"wheelRads: found wheels at {found} degrees, allowed: one each at 60, 180 and 300, "
                                "where the board has them, in any order")
        odd = [one for one in wheels.distances if abs(one / distance - 1) > CALIBRATED]
        self.misfit = (f"the robot has {odd[0]:g} m from centre to wheel, the board assumes {distance:g} m, so turns "
                       "would be wrong") if odd else ""
        self._signs = [math.copysign(1, lever) for lever in wheels.levers]
        self._distance = distance
        self.edges_of_board = BOARD_EDGES / wheels.edges_per_turn  # how many are one of the wheel file's
        self.edges_per_metre = wheels.edges_per_turn / (2 * math.pi * RADIUS)  # whatever a calibration has found
        self._rows = [(-sign * math.sin(POSITIONS[place]), sign * math.cos(POSITIONS[place]), sign * distance)
                      for place, sign in zip(self._places, self._signs)]

    def board_speeds(self, units):
        """Rim speeds [m/s] of the board's three wheels for units in the file's order."""
        speeds = [0.0] * 3
        for unit, place, sign in zip(units, self._places, self._signs):
            speeds[place] = sign * unit / self.edges_per_metre / PERIOD
        return speeds

    def edges(self, step):
        """Edges (floats, in the file's order) that make a displacement (forward [m], left [m], turn [rad])."""
        forward, left, turn = step
        return [(x * forward + y * left + z * turn) * self.edges_per_metre for x, y, z in self._rows]

    def most_edges(self, dx, dy, turn):
        """A bound on the edges of any wheel for a displacement of (dx, dy) [m] in any direction and a turn [rad]."""
        return (math.hypot(dx, dy) + abs(turn) * self._distance) * self.edges_per_metre


class Robotont2(Protocol):
    """Generations 2 and 2.1.

    The board executes one line per 20 ms, of two that came together the older one; a line of three bytes or fewer, a
    second terminator or a missing field do harm. Hence the pacing, one terminator, and always all fields.
    """

    name = "robotont2"
    pacing = 0.03
    pause = 0.03
    hello = b"\x1b"     # ESC stops the board and clears what a former program may have left in its buffer
    goodbye = b"\x1b"
    fastest = 0.30      # [m/s] the board limits each wheel to this by itself, which would bend the path

    def __init__(self, wheels, distance=DISTANCE):
        """Raises ProtocolError when the board cannot have these wheels. distance [m]: as its firmware has it."""
        super().__init__(wheels)
        self._board_wheels = BoardWheels(wheels, distance)
        usual = PUSHED * self.fastest * PERIOD * self._board_wheels.edges_per_metre
        self._tracker = PoseTracker(self._board_wheels, usual, self.period_length)
        self.misfit = self.complaint = self._board_wheels.misfit

    repaired = property(lambda self: self._tracker.repaired)
    restarts = property(lambda self: self._tracker.restarts)
    doubts = property(lambda self: self._tracker.doubts)

    def period_length(self, _line, _elapsed):
        """By what a period of the board was longer than it says."""
        return 1.0

    def read_line(self, text, now):
        """List of `Packet` that the line completes. Raises PacketError."""
        if text.startswith("ODOM:"):
            return self._read_pose(parse_pose(text), now)
        if text == BANNER:
            self.banner = text
            self._tracker.restart(now)
        elif text.startswith("RANGE:"):
            self.readings.append(Ranges(tuple(reading / 1000 for reading in read_numbers(text, RANGE_SENSORS))))
        elif text.startswith("POWER:"):
            current, voltage = read_numbers(text, 2)
            self.readings.append(Power(voltage, current))
        elif text.startswith("BATSTATE:"):
            motors, computer, _, voltage = read_numbers(text, 4)
            self.readings.append(Power(voltage, motors + computer))
        elif is_debug(text):
            self.obstacle = OLD
        elif text:
            raise PacketError("unknown", f"neither ODOM nor RANGE, POWER or BATSTATE: {text[:40]!r}")
        return []

    def _read_pose(self, line, now):
        self.check_reach([self._board_wheels.most_edges(line.vx * PERIOD, line.vy * PERIOD, line.turn * PERIOD)])
        edges = self._tracker.update(line, now)
        if self._tracker.strange >= STRANGE:
            self.obstacle = OLD
        if self._tracker.inconsistent:
            self.dropped["inconsistent"] = self._tracker.inconsistent
        return [Packet([round(edge, DECIMALS) for edge in each], format_packet(each, DECIMALS)) for each in edges]

    def encode(self, command):
        """`MS:` with the rim speeds, all scaled by one factor to the board's limit; `RS:0:0:0` at rest."""
        speeds = self._board_wheels.board_speeds(command)
        largest = max(map(abs, speeds))
        factor = min(1.0, self.fastest / max(largest, STANDING))
        if largest < STANDING or self.obstacle:
            return STOP
        return "MS:{:.4f}:{:.4f}:{:.4f}\n".format(*(speed * factor + 0.0 for speed in speeds)).encode()

    def encode_lights(self, first, colours):
        """`LED:` lines, which firmware with lights obeys and other firmware ignores."""
        return [f"LED:{first + start}:{lights(colours[start:start + LIGHTS_PER_LINE])}\n".encode()
                for start in range(0, len(colours), LIGHTS_PER_LINE)]


class Robotont3(Robotont2):
    """Generation 3 takes every USB transfer for a whole line, and a field too few halts the board.

    `encode` gives lines of less than 64 bytes, each for one write, so a line is a transfer. ESC is unknown there.
    """

    name = "robotont3"
    hello = b""
    goodbye = b""
    pause = 0.0
    fastest = 0.40

    def period_length(self, line, elapsed):
        """By what a period of the board was longer than it says; line: `PoseLine`, None over lost lines: a mean.

        The board measures speeds over the true time since its last loop, in whole milliseconds, but moves its pose by
        them times 0.02 s, also where its display has taken 25 ms. The length is the time nearest to `elapsed`
        [periods], where the link was not late, in which the wheels have made whole edges.
        """
        if line is None:
            periods = max(1, round(elapsed / MEAN))
            return 1 + (DRAWING - 1) / periods if elapsed - periods > (DRAWING - 1) / 2 else 1.0
        if elapsed >= LONGEST:
            elapsed = 1.0
        wheels = self._board_wheels
        each = [edge * wheels.edges_of_board * TICK
                for edge in wheels.edges((line.vx * PERIOD, line.vy * PERIOD, line.turn * PERIOD))]
        ticks = sorted(range(round(1 / TICK), round(LONGEST / TICK)), key=lambda tick: abs(tick * TICK - elapsed))
        whole = (tick * TICK for tick in ticks if all(abs(math.remainder(edge * tick, 1)) < WHOLE for edge in each))
        return next(whole, min(max(elapsed, 1.0), DRAWING))

    def encode_lights(self, first, colours):
        """The lines that show these colours and turn all other lights off; none when they do not fit into a transfer.

        Firmware without lights ignores them. The last colour is shown up to the last light, so equal ones at the end
        fit. The board's buffer keeps what a former line left behind a shorter one, hence the padding.
        """
        different = len(colours)
        while different > 1 and colours[different - 2] == colours[-1]:
            different -= 1
        line = f"LS:{first}:{first + len(colours) - 1}:{lights(colours[:different])}"
        return [STILL, line.ljust(TRANSFER - 2).encode() + b"\n"] if colours and len(line) <= TRANSFER - 2 else []


def lights(colours):
    """Colours (r, g, b), 0..255, as the board reads them."""
    return ":".join(str(red << 16 | green << 8 | blue) for red, green, blue in colours)


def is_debug(text):
    """Whether a line is one that only firmware before February 2020 sends."""
    return bool(_DEBUG.match(text))


def read_numbers(text, amount):
    """List of the finite floats behind the first colon of a line. Raises PacketError."""
    fields = text.split(":")[1:]
    if len(fields) != amount:
        raise PacketError("fields", f"{len(fields)} fields instead of {amount} in {text[:60]!r}")
    if not all(map(_READING.fullmatch, fields)):
        raise PacketError("number", f"not {amount} numbers in {text[:60]!r}")
    return list(map(float, fields))
