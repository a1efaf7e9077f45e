"""Robotont's boards as delivered, generations 2, 2.1, 3: rim speeds to the board, poses from it; docs/protocol.md.

A line of feedback is (x [m], y [m], yaw [rad], vx [m/s], vy [m/s], turn [rad/s]). Once per period the board moves its
pose by its twist times 0.02 s, turned by the yaw before. The wheels' way is inverse(last) . now: lost lines lose none.
"""

import cmath
import math
import re
from operator import add

from robotont_driver.kinematics.se2 import between, compose
from robotont_driver.protocol.protocol import Packet, PacketError, Power, Protocol, ProtocolError, Ranges, format_packet

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
JITTER = 2.0          # ... for so many [periods] more than have passed
MOST_LOST = 256       # [periods] that are handed out for lost lines
MEMORY = 1000         # [periods] in which the board's clock, by its lines, follows this computer's
LOOPS = 10            # of the board, of which generation 3 makes one longer
EARLY, LATE = 0.5, 1.5  # [periods] within which a line comes after the one before it, if none is lost or held back
MOST_WAITING = 10     # lines
SMOOTH = 0.07         # of the most edges a period: roughness of `gap` per loop up to which it is believed
VISITS = 4            # of a place among LOOPS over which its length is averaged
NEGLIGIBLE = 5.0      # [edges] by which it does not matter whether the board has restarted
AVERAGED = 100        # lines over which the mean length of a loop is taken
STRANGE = 50          # lines in a row that moved against their own twist: firmware before March 2020
OLD = ("firmware from before March 2020: it has no time-out, or its poses are 11 to 24 % off; flash the makers' "
       "2.1.3 (robot:=robotont2) or this project's (robot:=robotont21, docs/firmware.md)")

USB_ID = "0483:5740"  # of generation 3: STM32 virtual serial port
ORIGIN = (0.0,) * 6

_READING = re.compile(r"-?[0-9]{1,9}(?:\.[0-9]{1,9})?")
OLD_LINE = re.compile(r"Setpoint [012], |Speed\[[012]\]: |MOTOR [012]: |(Fault|Temp|Effort|Current\[[012]\]): |"
                  r"(Encoders|Setpoints) -?[0-9]{1,5}:-?[0-9]{1,5}:-?[0-9]{1,5}$")


class BoardWheels:
    """The board's wheels in the order, with the signs and calibrated numbers of a wheel file.

    Wheel j drives along POSITIONS[j] + 90 degrees, counterclockwise positive. `misfit`: where the distance is another.
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

    The board executes one line per 20 ms, of two that came together the older one: hence the pacing. A line of three
    bytes or fewer, a second terminator or a missing field do harm.
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
        self._most = PUSHED * self.fastest * PERIOD * wheels.edges_per_turn / (2 * math.pi * RADIUS)
        self._mean = 1.0 + (self.longest - 1.0) / LOOPS  # [periods] a loop
        self._last = None, 0.0   # newest trusted line, and [s] when it was made
        self._came = 0.0         # [s] newest line
        self._regular = 0        # how many came in a row a period after the one before
        self._waiting = []       # [(line, s when it came)] that the next ones may confirm
        self._move = compose     # how a step moves the board's pose: by the twist in base_link
        self._place = 0          # among LOOPS, of the newest trusted line's loop
        self._lengths = {}       # [periods] of the loop at each place, by the arrivals
        self._average = self._mean  # [periods] of a loop, likewise: where no place shows the longer one
        self._strange = 0        # lines in a row that follow neither the newest trusted one nor the one before them
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
        elif OLD_LINE.match(text):
            self.obstacle = OLD
        elif text:
            raise PacketError("unknown", f"neither ODOM nor RANGE, POWER or BATSTATE: {text[:40]!r}")
        return []

    def _read_pose(self, line, now):
        """Trust a line that follows the newest trusted one, or whatever line came before it: there is no checksum."""
        self.check_reach(self._board_wheels.edges(newest_loop(line, self._move)[1]))
        interval = (now - self._came) / PERIOD
        self._regular = self._regular + 1 if EARLY < interval < LATE else 0
        if self._regular:
            self._average += (interval - self._average) / AVERAGED
        self._came = now
        self._waiting = [*self._waiting[1 - MOST_WAITING:], (line, now)]
        if self._follows(self._last[0], line):
            lost = self._loops(now) - 1
            if lost and self._regular:  # of such as stand still, which follow each other
                self._last = self._last[0], now - PERIOD
                self._place = (self._place + lost) % LOOPS
            self._waiting, self._strange = [(line, now)], 0
        else:
            confirmed = self._waiting[:-1] and self._follows(self._waiting[-2][0], line)
            self._strange = 0 if confirmed else self._strange + 1
            self.obstacle = OLD if self._strange >= STRANGE else self.obstacle
            if self._follows(ORIGIN, line):
                self._restart(now)
            elif not confirmed:
                raise PacketError("inconsistent", "the pose does not follow the one before it by its own twist")
            elif self._last[0] is None:
                self._last, self._waiting = self._waiting[-2], self._waiting[-1:]
            else:
                self._look_for_a_restart(line, now)
        steps = []
        for each, came in self._waiting:
            loops = 1 if self._follows(self._last[0], each) else self._loops(came)
            more, rough = gap(self._last[0], each, loops, self._move)
            if each is line or largest(self._board_wheels.edges(rough)) < SMOOTH * loops * self._most:
                steps += self._trust(each, came, more)
        self._waiting = []
        return steps

    def _follows(self, before, line):
        """Whether the pose has moved from `before` to `line` by its twist, in either frame, in one period."""
        for move in (self._move, compose, added) if before else ():
            pose = move(before[:3], [speed * PERIOD for speed in line[3:]])
            if all(abs(value - other) <= PRINTED + SINGLE * abs(value) for value, other in zip(line, pose)):
                self._move = move
                return True
        return False

    def _restart(self, now):
        """The board has restarted: its pose is the origin."""
        self.restarts += self._last[0] is not None
        self._last = ORIGIN, now - PERIOD
        self._waiting = self._waiting[-1:]
        self._lengths.clear()

    def _look_for_a_restart(self, line, now):
        """Whence the motors have made the way to a confirmed line; PacketError where from neither in that time."""
        last, at = self._last
        ways = [self._board_wheels.edges(gap(start, line, 1, self._move)[0][0]) for start in (last, ORIGIN)]
        lost, restarted = (largest(edges) <= self._most * ((now - at) / PERIOD + JITTER) for edges in ways)
        if not lost and not restarted:
            raise PacketError("inconsistent", "old lines: their poses are farther away than the motors can go")
        self.doubts += lost and restarted and largest(map(float.__sub__, *ways)) > NEGLIGIBLE
        if not lost:
            self._restart(at + PERIOD)

    def _loops(self, now):
        """The board's loops, 1 at least, from the newest trusted line to one that came `now` [s]."""
        return min(max(1, round((now - self._last[1]) / PERIOD / self._mean)), MOST_LOST)

    def _trust(self, line, now, steps):
        """List of `Packet`, one per loop, up to a line that is the newest trusted one now."""
        at = self._last[1]
        lengths = self._lengths_of(len(steps), (now - at) / PERIOD / len(steps))
        made = at + sum(lengths) * PERIOD
        self._last = line, min(made + (now - made) / MEMORY, now)
        too_many = max(0, round((made - now) / PERIOD))  # loops: nothing arrives before it is made
        self._place = (self._place - too_many) % LOOPS
        self.repaired += len(steps) - 1
        return [self._packet(step, length) for step, length in zip(steps, lengths)]

    def _packet(self, step, length):
        """The `Packet` of a step that the board has counted for one period, and that took `length` of them."""
        edges = [edge * length for edge in self._board_wheels.edges(step)]
        packet = Packet([round(edge, DECIMALS) for edge in edges], format_packet(edges, DECIMALS))
        packet.periods = length
        return packet

    def _lengths_of(self, loops, passed):
        """[periods] that each of the next `loops` takes; passed: by the arrivals, which show the longer one."""
        places = [(self._place + more) % LOOPS for more in range(1, loops + 1)]
        self._place = (self._place + loops) % LOOPS
        if loops == 1 and self._regular > 1:
            mean = self._lengths.setdefault(self._place, passed)
            self._lengths[self._place] += (passed - mean) / VISITS
        longer = self.longest - 1.0
        shorter, longest = sorted((1.0, 1.0, *self._lengths.values()))[-2:]
        if longest - shorter < longer / 2:  # it is not known yet which place has it
            if self.packets < AVERAGED and passed < self.longest + 0.1:
                return [max(passed, 0.9)] * loops
            return [min(max(1.0, self._average), self._mean)] * loops
        return [1.0 + longer * (self._lengths.get(place) == longest) for place in places]

    def encode(self, command):
        """`MS:` with the rim speeds, scaled by one factor where one is faster than `fastest`; `RS:0:0:0` at rest."""
        speeds = self._board_wheels.board_speeds(command)
        if largest(speeds) < STANDING or self.obstacle:
            return STOP
        factor = min(1.0, self.fastest / largest(speeds))
        return "MS:{:.4f}:{:.4f}:{:.4f}\n".format(*(speed * factor + 0.0 for speed in speeds)).encode()

    def encode_lights(self, first, colours):
        """`LED:` lines, which firmware with lights obeys and other firmware ignores."""
        return [f"LED:{first + start}:{lights(colours[start:start + LIGHTS_PER_LINE])}\n".encode()
                for start in range(0, len(colours), LIGHTS_PER_LINE)]


class Robotont3(Robotont2):
    """Generation 3 takes every USB transfer for a whole line, and a field too few halts the board.

    So a line has less than 64 bytes, for one write. ESC is unknown. A tenth loop takes 25 ms, and its pose counts 20.
    """

    name = "robotont3"
    hello = b""
    fastest = 0.40
    longest = 1.25

    def encode_lights(self, first, colours):
        """The lines that show these colours and turn all other lights off; none where a transfer is too short."""
        # the last colour is shown up to the last light; the padding covers what a former line left in the board
        different = len(colours)
        while different > 1 and colours[different - 2] == colours[-1]:
            different -= 1
        line = f"LS:{first}:{first + len(colours) - 1}:{lights(colours[:different])}"
        return [STILL, line.ljust(TRANSFER - 2).encode() + b"\n"] if colours and len(line) <= TRANSFER - 2 else []


def lights(colours):
    """Colours (r, g, b), 0..255, as the board reads them."""
    return ":".join(str(red << 16 | green << 8 | blue) for red, green, blue in colours)


def added(pose, step):
    """The pose that a step in its own frame, the odometry's, has moved."""
    return tuple(map(add, pose, step))


def newest_loop(line, move):
    """(pose before a line's newest loop, the step in base_link that it made) where `move` adds a step to a pose."""
    yaw = line[2] - line[5] * PERIOD
    x, y, _ = move((0.0, 0.0, yaw), [speed * PERIOD for speed in line[3:]])
    before = line[0] - x, line[1] - y, yaw
    return before, between(before, line[:3])


def gap(last, line, loops, move):
    """(list of the steps in base_link that some loops have made between two lines, a step: how rough they are).

    A line tells its newest step, so with one lost line nothing is guessed. The others change evenly, and more in the
    middle by what is missing then, whose mean is rough. The board turns each step by the yaw before it.
    """
    if loops < 2:  # or not known: as if all steps were alike
        forward, left, turn = between(last[:3], line[:3])
        middle = (turn - line[5] * PERIOD) / 2
        return [(*between((0.0, 0.0, middle), (forward, left, 0.0))[:2], turn)], (0.0, 0.0, math.inf)
    (_, first), (before, newest) = newest_loop(last, move), newest_loop(line, move)
    shares = [at / loops for at in range(1, loops)]
    even = [[start + share * (end - start) for start, end in zip(first, newest)] for share in shares]
    bulges = [share * (1 - share) for share in shares]
    more = (before[2] - last[2] - sum(turn for _, _, turn in even)) / sum(bulges)
    yaw, way, turned = last[2], complex(before[0] - last[0], before[1] - last[1]), 0j
    for (forward, left, turn), bulge in zip(even, bulges):
        way -= cmath.rect(1.0, yaw) * complex(forward, left)
        turned += cmath.rect(bulge, yaw)
        yaw += turn + more * bulge
    if abs(turned) < sum(bulges) / 2:  # most of a turn
        turned = cmath.rect(sum(bulges), (last[2] + yaw) / 2)
    missing = (way / turned).real, (way / turned).imag, more
    steps = [[part + bulge * off for part, off in zip(step, missing)] for step, bulge in zip(even, bulges)]
    return [*steps, newest], [off * sum(bulges) / len(bulges) for off in missing]


def largest(edges):
    """Magnitude of the longest of some paths [edges]."""
    return max(map(abs, edges))


def read_numbers(text, amount):
    """List of the finite floats behind the first colon of a line. Raises PacketError."""
    fields = text.split(":")[1:]
    if len(fields) != amount:
        raise PacketError("fields", f"{len(fields)} fields instead of {amount} in {text[:60]!r}")
    if not all(map(_READING.fullmatch, fields)):
        raise PacketError("number", f"not {amount} numbers in {text[:60]!r}")
    return list(map(float, fields))
