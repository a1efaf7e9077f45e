"""Robotont's boards as delivered, generations 2, 2.1, 3: rim speeds to the board, poses from it; docs/protocol.md.

A line of feedback is (x [m], y [m], yaw [rad], vx [m/s], vy [m/s], turn [rad/s]). Once per period the board moves its
pose by its twist times 0.02 s, turned by the yaw before. What the wheels have made is inverse(last) . now, so lost
lines lose no distance.
"""

import math
import re
from operator import add

from robotont_driver.kinematics.se2 import between, compose, sinc
from robotont_driver.protocol.packet import Packet, PacketError, format_packet
from robotont_driver.protocol.protocol import Power, Protocol, ProtocolError, Ranges

POSITIONS = tuple(math.radians(angle) for angle in (60, 180, 300))  # [rad] yaw of each wheel's place in base_link
DISTANCE = 0.145       # [m] centre to wheel
RADIUS = 0.035         # [m]
PERIOD = 0.02          # [s] between two lines
LARGEST_ANGLE = 0.1    # [rad] by which a wheel file may differ from POSITIONS: a calibrated one differs a little
CALIBRATED = 0.05      # part by which a calibrated distance may differ from the board's

BANNER = "**** MAIN ****"
STOP = b"RS:0:0:0\n"
LIGHTS_PER_LINE = 20  # the board takes lines of at most 254 bytes
TRANSFER = 64         # [bytes] of a USB transfer; a line is shorter
STILL = b"LM:8:0:0:0\n"  # a mode of the lights that the firmware does not have: nothing animates them
STANDING = 0.0005     # [m/s] slower wheels are stopped
DECIMALS = 3          # of edges
RANGE_SENSORS = 12
PRINTED = 2e-6        # [m, rad] two roundings to six decimals, and as much again
SINGLE = 1.5e-7       # relative error of the board's single-precision pose
PUSHED = 1.5          # part of the board's limit that a wheel exceeds at most while its lines are lost ...
JITTER = 2.0          # ... and [periods] for which it does so more than have passed
MOST_LOST = 256       # [periods] that are handed out for lost lines
MEMORY = 1000         # [periods] in which the board's clock, by its lines, follows this computer's
LOOPS = 10            # of the board, of which generation 3 makes one longer
LATE = 1.5            # [periods] a line that comes later tells nothing of its loop's length
VISITS = 4            # of a place among them over which its length is averaged
NEGLIGIBLE = 5.0      # [edges] by which it does not matter whether the board has restarted
STRANGE = 50          # lines in a row that moved against their own twist: firmware before February 2020
OLD = ("firmware from before March 2020: it has no time-out, or its poses are short by 11 to 24 %; flash the makers' "
       "2.1.3 (robot:=robotont2) or this project's (robot:=robotont21, docs/firmware.md)")

USB_ID = "0483:5740"  # of generation 3: STM32 virtual serial port
ORIGIN = (0.0,) * 6

_READING = re.compile(r"-?[0-9]{1,9}(?:\.[0-9]{1,9})?")
_OLD = re.compile(r"Setpoint [012], |Speed\[[012]\]: |MOTOR [012]: |(Fault|Temp|Effort|Current\[[012]\]): |"
                  r"(Encoders|Setpoints) -?[0-9]{1,5}:-?[0-9]{1,5}:-?[0-9]{1,5}$")


class BoardWheels:
    """The board's wheels in the order and with the signs of a wheel file.

    The board drives wheel j along the direction at POSITIONS[j] + 90 degrees, counterclockwise positive. A wheel
    file may list the same wheels in another order and with other signs, and calibrated numbers; `misfit`: a warning
    where its distance is another one.
    """

    def __init__(self, wheels):
        """Raises ProtocolError for wheels that the board cannot have."""
        if wheels.amount != 3:
            raise ProtocolError(f"wheelAmount: found {wheels.amount}, allowed: 3, for the board has three motors")
        if abs(wheels.pid_frequency * PERIOD - 1) > 1e-6:
            raise ProtocolError(f"pidControlFrequency: found {wheels.pid_frequency:g}, allowed: {1 / PERIOD:g} [Hz], "
                                "the rate of the board's feedback")
        places = [place for position in wheels.positions for place, angle in enumerate(POSITIONS)
                  if abs(math.remainder(position - angle, 2 * math.pi)) < LARGEST_ANGLE]
        if len(set(places)) != 3:
            found = ", ".join(f"{math.degrees(position) % 360:.0f}" for position in wheels.positions)
            raise ProtocolError(f"wheelRads: found wheels at {found} degrees, allowed: one each at 60, 180 and 300, "
                                "where the board has them, in any order")
        odd = [one for one in wheels.distances if abs(one / DISTANCE - 1) > CALIBRATED]
        self.misfit = (f"the robot has {odd[0]:g} m from centre to wheel, the board assumes {DISTANCE:g} m, so turns "
                       "would be wrong") if odd else ""
        edges_per_metre = wheels.edges_per_turn / (2 * math.pi * RADIUS)  # whatever a calibration has found
        # by wheel of the file: its number on the board, edges there per metre, negative where it turns the other way
        self._wheels = [(place, math.copysign(edges_per_metre, lever)) for place, lever in zip(places, wheels.levers)]

    def board_speeds(self, units):
        """Rim speeds [m/s] of the board's three wheels for units in the file's order."""
        return [unit / edges / PERIOD for _, unit, edges in sorted(
            (place, unit, edges) for unit, (place, edges) in zip(units, self._wheels))]

    def edges(self, step):
        """Edges (3 floats, in the file's order) that make a displacement (forward [m], left [m], turn [rad])."""
        forward, left, turn = step
        return [edges * (left * math.cos(POSITIONS[place]) - forward * math.sin(POSITIONS[place]) + DISTANCE * turn)
                for place, edges in self._wheels]


class Robotont2(Protocol):
    """Generations 2 and 2.1.

    The board executes one line per 20 ms, of two that came together the older one; a line of three bytes or fewer, a
    second terminator or a missing field do harm. Hence the pacing, one terminator, and always all fields.
    """

    name = "robotont2"
    pacing = 0.03
    hello = b"\x1b"     # ESC stops the board and clears what a former program may have left in its buffer
    fastest = 0.30      # [m/s] of a wheel; generation 2 clamps each alone by itself, which would bend the path
    longest = 1.0       # [periods] that each tenth of its loops takes; its pose counts one period

    def __init__(self, wheels):
        """Raises ProtocolError when the board cannot have these wheels."""
        super().__init__(wheels)
        self._board_wheels = BoardWheels(wheels)
        # [edges] a period
        self._usual = PUSHED * self.fastest * PERIOD * wheels.edges_per_turn / (2 * math.pi * RADIUS)
        self._last = None, 0.0   # newest trusted line, and [s] when it was made
        self._heard = None, 0.0  # newest line, and [s] when it came
        self._place, self._lengths = 0, [1.0] * LOOPS  # of the newest trusted line's loop; [periods], by the arrivals
        self._strange = 0        # lines in a row that follow neither
        self.misfit = self.complaint = self._board_wheels.misfit

    def read_line(self, text, now):
        """List of `Packet` that the line completes. Raises PacketError."""
        if text.startswith("ODOM:"):
            return self._read_pose(read_numbers(text, 6), now)
        if text == BANNER:
            self.banner = text
            self._restart(now)
        elif text.startswith("RANGE:"):
            self.readings.append(Ranges(tuple(reading / 1000 for reading in read_numbers(text, RANGE_SENSORS))))
        elif text.startswith("POWER:"):
            current, voltage = read_numbers(text, 2)
            self.readings.append(Power(voltage, current))
        elif text.startswith("BATSTATE:"):
            motors, computer, _, voltage = read_numbers(text, 4)
            self.readings.append(Power(voltage, motors + computer))
        elif is_old(text):
            self.obstacle = OLD
        elif text:
            raise PacketError("unknown", f"neither ODOM nor RANGE, POWER or BATSTATE: {text[:40]!r}")
        return []

    def _read_pose(self, line, now):
        """Trust a line that follows the newest trusted one, or the one before it: there is no checksum."""
        (before, at), self._heard = self._heard, (line, now)
        steps = []
        if not follows(self._last[0], line):
            confirmed = follows(before, line)
            self._strange = 0 if confirmed else self._strange + 1
            self.obstacle = OLD if self._strange >= STRANGE else self.obstacle
            if follows(ORIGIN, line):
                self._restart(now)
            elif confirmed:
                steps = self._bridge(before, at)
            else:
                raise PacketError("inconsistent", "the pose does not follow the one before it by its own twist")
        last, at = self._last
        # at rest lost lines follow, too; in motion the next is a loop later, however late it comes
        loops = 1 if last and any(last[3:]) else max(0, self._loops(at, now))
        length = self._length(loops, (now - at) / PERIOD)
        steps.append([edge * length for edge in self._board_wheels.edges(body_step(last, line))])
        self.check_reach(steps[-1])
        made = at + loops * length * PERIOD
        self._last = line, min(made + (now - made) / MEMORY, now)  # nothing arrives before it is made
        return [Packet([round(edge, DECIMALS) for edge in each], format_packet(each, DECIMALS)) for each in steps]

    def _restart(self, now):
        """The board has restarted: its pose is the origin."""
        self.restarts += self._last[0] is not None
        self._last = ORIGIN, now - PERIOD

    def _bridge(self, line, now):
        """List of edges, one per period, from the newest trusted line to one that the next has confirmed.

        Raises PacketError where the motors cannot have made such a way in that time, from there or from the origin.
        """
        last, at = self._last
        if last is None:
            self._last = line, now
            return []
        ways = [self._board_wheels.edges(body_step(start, line)) for start in (last, ORIGIN)]
        lost, restarted = (largest(way) <= self._usual * ((now - at) / PERIOD + JITTER) for way in ways)
        if not lost and not restarted:
            raise PacketError("inconsistent", "old lines: their poses are farther away than the motors can go")
        self.doubts += lost and restarted and largest(map(float.__sub__, *ways)) > NEGLIGIBLE
        self.restarts += not lost
        periods = max(1, self._loops(at, now))
        length = self._length(periods, (now - at) / PERIOD)
        self.repaired += periods - 1
        self._last = line, min(at + periods * length * PERIOD, now)
        return [[edge * length / periods for edge in ways[not lost]]] * periods

    def _loops(self, at, now):
        """The board's loops between two times [s]."""
        return min(round((now - at) / PERIOD / (0.9 + 0.1 * self.longest)), MOST_LOST)

    def _length(self, loops, passed):
        """[periods] that each of the next `loops` takes on the mean, for one that its pose counts.

        passed: [periods] by the arrivals, from which the place of the longer one is learnt.
        """
        places = [(self._place + more) % LOOPS for more in range(1, loops + 1)]
        self._place = (self._place + loops) % LOOPS
        if loops == 1 and passed < LATE:
            self._lengths[self._place] += (passed - self._lengths[self._place]) / VISITS
        long, longer = max(self._lengths), self.longest - 1.0
        if long - min(self._lengths) < longer / 2:  # it is not known yet which place has it
            return min(max(passed / max(loops, 1), 0.9), self.longest)
        return 1.0 + longer * places.count(self._lengths.index(long)) / max(loops, 1)

    def encode(self, command):
        """`MS:` with the rim speeds, all scaled by one factor to `fastest`; `RS:0:0:0` at rest."""
        speeds = self._board_wheels.board_speeds(command)
        fastest = largest(speeds)
        factor = min(1.0, self.fastest / max(fastest, STANDING))
        if fastest < STANDING or self.obstacle:
            return STOP
        return "MS:{:.4f}:{:.4f}:{:.4f}\n".format(*(speed * factor + 0.0 for speed in speeds)).encode()

    def encode_lights(self, first, colours):
        """`LED:` lines, which firmware with lights obeys and other firmware ignores."""
        return [f"LED:{first + start}:{lights(colours[start:start + LIGHTS_PER_LINE])}\n".encode()
                for start in range(0, len(colours), LIGHTS_PER_LINE)]


class Robotont3(Robotont2):
    """Generation 3 takes every USB transfer for a whole line, and a field too few halts the board.

    `encode` gives lines of less than 64 bytes, each for one write, so a line is a transfer. ESC is unknown there. Its
    display takes 25 ms of every tenth loop, and its pose counts 20.
    """

    name = "robotont3"
    hello = b""
    fastest = 0.40
    longest = 1.25

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


def follows(before, line):
    """Whether the pose has moved from `before` to `line` by its twist, in either frame, in one period."""
    if before is None:
        return False
    step = [speed * PERIOD for speed in line[3:]]
    return any(all(abs(value - other) <= PRINTED + SINGLE * abs(value) for value, other in zip(line, pose))
               for pose in (compose(before[:3], step), tuple(map(add, before[:3], step))))


def body_step(before, line):
    """(forward [m], left [m], turn [rad]) in base_link that the wheels have made between two lines.

    The board turns each step by the yaw before it. So n equal steps of a turn d add up to their sum, turned by half of
    what the n - 1 first of them turn, and shortened by sinc(n d / 2) / sinc(d / 2). The line has the newest one's d.
    """
    x, y, turn = between(before[:3], line[:3])
    newest = line[5] * PERIOD
    x, y, _ = between((0.0, 0.0, (turn - newest) / 2), (x, y, 0.0))
    longer = sinc(newest / 2) / sinc(turn / 2) if abs(turn) < math.pi else 1.0
    return longer * x, longer * y, turn


def largest(edges):
    """Magnitude of the longest of some paths [edges]."""
    return max(map(abs, edges))


def is_old(text):
    """Whether a line is one that only firmware from before March 2020 sends."""
    return bool(_OLD.match(text))


def read_numbers(text, amount):
    """List of the finite floats behind the first colon of a line. Raises PacketError."""
    fields = text.split(":")[1:]
    if len(fields) != amount:
        raise PacketError("fields", f"{len(fields)} fields instead of {amount} in {text[:60]!r}")
    if not all(map(_READING.fullmatch, fields)):
        raise PacketError("number", f"not {amount} numbers in {text[:60]!r}")
    return list(map(float, fields))
