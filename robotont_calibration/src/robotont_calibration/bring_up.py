"""Drives one motor after another for a moment and judges what the encoders count: a robot's first minute.

The board itself ends each drive (order `!test`, see docs/protocol.md), so nothing runs on when this program ends.
"""

import time

from robotont_driver.link.serial_port import opened
from robotont_driver.protocol.board_status import TIMED_OUT, WAITS_FOR_ZERO
from robotont_driver.protocol.checked import QUESTION, Checked, add_checksum
from robotont_driver.protocol.protocol import format_packet

MOVED, LEAST = 0.0125, 4  # [turns of a wheel], [edges]: what is less in half a second is none
REST = 1.2    # [s] from an order until its wheel stands again
PATIENCE = 3.0  # [s] for an answer
QUESTIONS = """\
Lift the robot: no wheel may touch anything. Each motor turns for half a second forward, then backward, at little
of its effort. Before, `./robotont wheels` should have shown that each wheel, turned by hand, counts its own way.
Press Enter when all wheels are in the air (Ctrl-C ends it): """


class BringUp:
    """Talks to the firmware over an open serial `line` (time-out 0 to 0.1 s). wheels: `Wheels`."""

    needed = (2, 1)  # firmware

    def __init__(self, line, wheels):
        self._line = line
        self._wheels = wheels.amount
        self._reader = Checked(wheels)

    def prepare(self):
        """Wait until the board waits for nothing but orders. Raises ValueError."""
        self._talk(PATIENCE, lambda health: health.identity is not None, QUESTION)
        health = self._reader.health
        needed = ".".join(map(str, self.needed))
        if health.identity is None:
            raise ValueError(f"no answer from this project's firmware, from {needed} on (./robotont flash); this "
                               "test drives no other board")
        if health.obstacle:
            raise ValueError(health.obstacle)
        if tuple(map(int, health.identity.version.split(".")[:2])) < self.needed:
            raise ValueError(f"the board has firmware {health.identity.version}, older than {needed}: "
                               "./robotont flash")
        zeros = add_checksum(format_packet([0] * self._wheels))
        waiting = TIMED_OUT | WAITS_FOR_ZERO
        self._talk(PATIENCE, lambda health: health.status and not health.status.flags & waiting, zeros)
        self._talk(PATIENCE, lambda health: health.status.flags & TIMED_OUT)
        self._check()

    def turn(self, wheel, sign):
        """Drive one wheel forward (sign 1) or backward (-1); list of the edges that each wheel made meanwhile."""
        self._line.write(add_checksum("!test {}{};".format(wheel, "+" if sign > 0 else "-")))
        counts = self._talk(REST, lambda health: health.fault)
        self._check()
        return counts

    def _talk(self, seconds, done, words=b""):
        """Read until `done(health)` or the time is over, say the words 5 times a second; the sums of the counts."""
        sums = [0] * self._wheels
        end, due = time.monotonic() + seconds, 0.0
        while time.monotonic() < end and not done(self._reader.health):
            if words and time.monotonic() >= due:
                self._line.write(words)
                due = time.monotonic() + 0.2
            for packet in self._reader.feed(self._line.read(4096), time.monotonic()):
                sums = [total + count for total, count in zip(sums, packet)]
        return sums

    def _check(self):
        health = self._reader.health
        if health.status is None or health.fault or health.status.flags & WAITS_FOR_ZERO:
            raise ValueError(health.fault or "the board does not get ready to drive")


def judge(wheel, forward, backward, edges_per_turn):
    """What is wrong with a motor, empty when nothing is; forward, backward: edges of all wheels in each drive."""
    moved = max(LEAST, MOVED * edges_per_turn)
    other = next((other for other in range(len(forward)) if other != wheel and
                  min(abs(forward[other]), abs(backward[other])) >= moved), None)
    ahead, back = forward[wheel], -backward[wheel]
    still = max(abs(ahead), abs(back)) < moved
    faults = (
        (still and other is not None, f"turns wheel {other}, or its encoder is connected there: exchange plugs, or "
                                      f"lines {wheel} and {other} of ENCODERS"),
        (still, f"does not turn, or its encoder counts less than {moved:.0f} edges: battery, motor "
                "driver, motor cable, encoder's cable and supply, a wheel on the floor"),
        (ahead <= -moved and back <= -moved, f"runs backward: swap DIRECTIONS[{wheel}]"),
        (min(ahead, back) < moved, f"turns one way only: one of its direction pins (DIRECTIONS[{wheel}]) or of its "
                                   "encoder's channels is not connected"),
        (max(ahead, back) > 2 * min(ahead, back), "turns much slower one way: friction, or a bad contact"),
        (other is not None, f"turns wheel {other}, too: a wheel touches the ground, or their pins are connected"),
    )
    return next((words for found, words in faults if found), "")


def bring_up(port, wheels):
    """Ask, then try all motors of the `Wheels` at a serial port, and print what each does; whether all are right.

    Raises ValueError where they cannot be tried, in words for the user; OSError.
    """
    try:
        input(QUESTIONS)
    except EOFError:
        raise ValueError("nothing was driven: a terminal is needed to ask whether the wheels are in the air") from None
    right = True
    with opened(port, 115200, 0.02) as line:
        tried = BringUp(line, wheels)
        tried.prepare()
        for wheel in range(wheels.amount):
            forward, backward = tried.turn(wheel, 1), tried.turn(wheel, -1)
            fault = judge(wheel, forward, backward, wheels.edges_per_turn)
            right = right and not fault
            print(f"motor {wheel} {fault or 'is right'} "
                  f"({forward[wheel]:+d} edges forward, {backward[wheel]:+d} backward)", flush=True)
    return right
