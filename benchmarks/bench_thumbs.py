"""A lap by the thumbs of a person on the page in Chromium: sticks whose middle is where a thumb lands, and fixed ones.

The person is a model: REACTION behind what the robot does, pushes the left thumb ahead and turns by the right one
towards a place LOOK_AHEAD on the middle of the way. Thumbs land beside the middle of a ring, tremble, and are set anew.
"""

import math
import sys
import threading
import time
from pathlib import Path

import numpy as np

from robotont_driver.command.limits import Limits, limit_acceleration
from robotont_driver.kinematics.se2 import arc, compose
from robotont_testing.browser import PHONE, Browser
from robotont_testing.figures import row

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "robotont_teleop" / "test"))
from web_client import Served

MIDDLE, AXES = (5.0, 5.4), (1.9, 1.5)  # [m] of the lap around the box in the middle of the room
REACTION, LOOK_AHEAD, TURNS = 0.25, 0.6, 0.75  # [s], [m], [of the fastest turn per rad]
LANDS, TREMBLES, AMPLITUDE = 12.0, 2.5, 0.08  # [px] beside a ring, [px] and [of the way] of a thumb, each one sigma
HAND = 0.1         # [s] in which a thumb has gone two thirds of its way; a tremble lasts three times as long
ANEW = (3.0, 6.0)  # [s] after which both thumbs are set anew
PATIENT = 1.0      # [s] of the server: a busy computer is no part of this
PERIOD = 0.05      # [s] of a thumb
LIMITS = Limits(linear_acceleration=1.0, angular_acceleration=6.0)
FIXED_REACH, FIXED_MIDDLE = 38.0, 0.06  # [px] and part of it, of the sticks until bd38d6b4 on a phone 390 px wide
FIXED = {"stick.js": ("this.landed = [event.clientX, event.clientY];\n"
                      "      const box = this.field.getBoundingClientRect();",
                      "const box = this.field.getBoundingClientRect();\n"
                      "      this.landed = [box.left + box.width / 2, box.top + box.height / 2 - 7];\n"
                      "      this.follow(event);\n      return;"),
         "stick_curve.js": ("  const length = Math.hypot(x, y) / REACH;",
                            f"  const way = Math.hypot(x, y) / {FIXED_REACH};\n"
                            f"  return way < {FIXED_MIDDLE} ? [0, 0] : [x, 0 - y].map("
                            f"(part) => part / {FIXED_REACH} / Math.max(1, way));\n"
                            "  const length = Math.hypot(x, y) / REACH;")}


def bench_lap(options):
    """The same persons with both kinds, in turns; the floor is the fixed one."""
    found = {kind: [] for kind in ("fixed", "floating")}
    for seed in range(options.rounds):
        for kind, laps in found.items():
            laps.append(lap(kind == "fixed", seed))
    fixed, floating = (list(zip(*laps)) for laps in found.values())
    return [row("lap: time", list(floating[0]), "s", list(fixed[0]), "<= 1 x floor"),
            row("lap: off the middle, mean", list(floating[1]), "m", list(fixed[1]), "<= 0.8 x floor"),
            row("lap: off the middle, 95 %", list(floating[2]), "m", list(fixed[2]))]


def lap(fixed, seed):
    """(time [s], mean and 95 % of the distance from the middle of the way [m]) of one lap."""
    random = np.random.default_rng(seed)
    with Served(oldest=PATIENT, dead_man=PATIENT) as server, Browser() as browser:
        for name, (before, after) in FIXED.items() if fixed else ():
            kind, content = server.server.files[name]
            assert before in content.decode(), name
            server.server.files[name] = kind, content.decode().replace(before, after).encode()
        robot = Robot(server.robot)
        page = browser.page(f"http://127.0.0.1:{server.port}/", PHONE)
        page.wait("document.getElementById('app')?.dataset.live === 'true'", "the sticks")
        page.key("Digit3", down=True)
        thumbs = [Thumb(page, number, selector, fixed, random) for number, selector in ((1, "#move"), (2, "#turn"))]
        start = due = anew = time.monotonic()
        while robot.laps < 1.0:
            if time.monotonic() > anew:
                anew = time.monotonic() + random.uniform(*ANEW)
                page.lift()
                for thumb in thumbs:
                    thumb.land()
            ahead, turn = wishes(robot.seen(time.monotonic() - REACTION))
            thumbs[0].push(0.0, ahead)
            thumbs[1].push(-turn, 0.0)
            due = max(due + PERIOD, time.monotonic())
            time.sleep(max(0.0, due - time.monotonic()))
            assert time.monotonic() < start + 300.0, "no lap in five minutes"
        robot.ends = True
        off = np.array(robot.off)
        return time.monotonic() - start, float(np.mean(off)), float(np.percentile(off, 95))


def wishes(pose):
    """(ahead, turn), each a part of the fastest, of who sees the robot at a pose."""
    angle = math.atan2((pose[1] - MIDDLE[1]) / AXES[1], (pose[0] - MIDDLE[0]) / AXES[0]) + LOOK_AHEAD / np.mean(AXES)
    x, y = MIDDLE[0] + AXES[0] * math.cos(angle) - pose[0], MIDDLE[1] + AXES[1] * math.sin(angle) - pose[1]
    bearing = math.remainder(math.atan2(y, x) - pose[2], 2 * math.pi)
    return max(0.1, 0.8 - 0.8 * abs(bearing)), max(-1.0, min(1.0, TURNS * bearing))


class Thumb:
    """A thumb on a stick: where it is held is not where it is meant to be."""

    def __init__(self, page, number, selector, fixed, random):
        self._page, self._number, self._fixed, self._random = page, number, fixed, random
        self._ring = page.place(f"{selector} .ring")

    def land(self):
        """Beside the middle of the ring."""
        self._at, self._error, self._moved = np.zeros(2), np.zeros(2), time.monotonic()
        self._landed = np.array(self._ring) + self._random.normal(0.0, LANDS, 2)

    def push(self, right, up):
        """Towards this part of the fastest, as the hand has learned the curve."""
        way = np.array([right, -up])
        size = float(np.linalg.norm(way))
        wanted = way / size * (way_of(size, self._fixed)) if size else way
        lasts, self._moved = time.monotonic() - self._moved, time.monotonic()
        fades = math.exp(-lasts / (3 * HAND))
        self._error = fades * self._error + math.sqrt(1 - fades ** 2) * self._random.normal(
            0.0, TREMBLES + AMPLITUDE * np.linalg.norm(wanted), 2)
        self._at = self._at + (1 - math.exp(-lasts / HAND)) * (wanted - self._at)
        self._page.finger_at(self._number, *(self._landed + self._at + self._error))


def way_of(part, fixed):
    """[px] by which a thumb is pushed for a part of the fastest: the inverse of stick_curve.js."""
    if fixed:
        return FIXED_REACH * part
    pushed = np.linspace(0.0, 1.0, 101)
    return 80.0 * (0.08 + 0.92 * float(np.interp(part, 0.35 * pushed + 0.65 * pushed ** 3, pushed)))


class Robot:
    """Stands on the middle of the way and does what the page sends, within LIMITS, on its own thread."""

    def __init__(self, robot):
        self._robot, self.ends = robot, False
        self.pose, self._twist = (MIDDLE[0] + AXES[0], MIDDLE[1], math.pi / 2), (0.0, 0.0, 0.0)
        self._past, self.off, self._angle, self._start = [(0.0, self.pose)], [], 0.0, 0.0
        kind = type(robot)
        robot.state = lambda: {**kind.state(robot), "pose": list(self.pose), "velocity": list(self._twist)}
        threading.Thread(target=self._run, daemon=True).start()

    def _run(self):
        then = time.monotonic()
        while not self.ends:
            time.sleep(0.01)
            now = time.monotonic()
            wanted = self._robot.sent[-1] if self._robot.sent else self._twist
            self._twist = limit_acceleration(self._twist, wanted, now - then, LIMITS)
            self.pose = compose(self.pose, arc(tuple(part * (now - then) for part in self._twist)))
            then = now
            x, y = ((self.pose[axis] - MIDDLE[axis]) / AXES[axis] for axis in (0, 1))
            self._angle += math.remainder(math.atan2(y, x) - self._angle, 2 * math.pi)
            self._past.append((now, self.pose))
            if any(self._twist):
                self.off.append(abs(math.hypot(x, y) - 1.0) * float(np.mean(AXES)))

    @property
    def laps(self):
        """How many it has driven."""
        return self._angle / (2 * math.pi)

    def seen(self, at):
        """The pose at a time [s] that is over."""
        return next((pose for when, pose in reversed(self._past) if when <= at), self._past[0][1])


PARTS = (bench_lap,)
