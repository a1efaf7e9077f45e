"""Whether the robot moves as commanded: the driver's limits, this firmware's code and the physics, in simulated time.

Truth is held against the path that `cmd_vel/limited` describes, integrated exactly, and against that of the raw
commands. Distances are across the path, so that a mere delay is none; both ends go on straight. floor: a board with
the official firmware and the same commands, up to the 0.3 m/s that it allows.
"""

import math

import numpy as np

from robotont_boards import BOARDS
from robotont_driver.command.command_stream import CommandStream
from robotont_driver.command.limits import Limits
from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.robots.robot_folder import read_robot
from robotont_simulator.lockstep import LockstepRun
from robotont_simulator.mujoco_model import BODY_MASS
from robotont_simulator.official_firmware import SimulatedMotors, make_simulation
from robotont_simulator.simulation import Simulation
from robotont_simulator.world import World
from robotont_testing.figures import percentile, row
from robotont_testing.simulated_wheels import PERIOD, path_of

FLOOR = World((), (0.0, 0.0, 0.0))
REST = (0.0, 0.0, 0.0)
LEAD_IN, TAIL = 25, 50     # [periods] of rest before and after
WINDOW = 75                # [periods] by which truth may be late
BEYOND = 1.0               # [m] that the ends of a path go on straight
RAMP = 0.8                 # [m/s^2] with which the paths that do not jump begin and end
RADIUS, WAVE, EIGHT, SIDE = 0.5, 2.0, 6.0, 1.0  # [m] circle's radius, slalom's and eight's length, square's side
OFFICIAL_SPEED = 0.3       # [m/s] that its board allows a wheel
BOUNDS = {0.3: 8, 0.5: 12, 0.8: 20}  # [mm] across the path, at most
MASSES = (2.0, 3.0, 5.0)   # [kg] without wheels
DIRECTIONS = {"forward": (1.0, 0.0, 0.0), "sideways": (0.0, 1.0, 0.0), "spin": (0.0, 0.0, 1.0)}
SMOOTHED = 3               # [periods] over which a true speed is the mean
STOPS = 100


def circle(speed, way):
    """Round once, and once the other way round on the spot meanwhile."""
    turn = speed / RADIUS
    return speed * math.cos(2 * way / RADIUS), speed * math.sin(2 * way / RADIUS), -turn


def eight(speed, way):
    """A figure of eight whose curvature has no jump, driven forwards."""
    return speed, 0.0, speed * 2.405 * 2 * math.pi / EIGHT * math.sin(2 * math.pi * way / EIGHT)


def slalom(speed, way):
    """Waves, without turning."""
    angle = 0.8 * math.sin(2 * math.pi * way / WAVE)
    return speed * math.cos(angle), speed * math.sin(angle), 0.0


def square(speed, way):
    """Without turning: its corners are jumps."""
    angle = math.pi / 2 * min(3, int(way / SIDE))
    return speed * math.cos(angle), speed * math.sin(angle), 0.0


PATHS = {circle: 2 * math.pi * RADIUS, eight: EIGHT, slalom: 2 * WAVE, square: 4 * SIDE}


def commands(path, length, speed):
    """Twists of a path, one per period; all but the square begin and end with RAMP."""
    way, now, found = 0.0, 0.0, [REST] * LEAD_IN
    while way < length:
        rest = max(length - way, 0.0)
        now = speed if path is square else min(speed, now + RAMP * PERIOD, math.sqrt(2 * RAMP * rest) + 0.002)
        found.append(path(now, way + now * PERIOD / 2))
        way += now * PERIOD
    return found + [REST] * TAIL


class OwnRobot:
    """The thesis' robot with this firmware, behind the driver's limits.

    mass: [kg] of its body. told: whether the firmware's LEAD is for that mass.
    """

    def __init__(self, mass=BODY_MASS, told=True):
        robot = read_robot("thesis")
        simulation = Simulation(robot.wheels, FLOOR)
        if told:
            simulation.set_mass(mass)
        self.run = LockstepRun(simulation)
        simulation.set_mass(mass)
        settings = robot.parameters.get("driver_node", {})
        limits = Limits(*(settings.get("max_" + limit, 0.0) for limit in Limits._fields))
        self.stream = CommandStream(self.run.kinematics, limits, 0.5, PERIOD)

    def drive(self, twists):
        """(limited twists, true poses and the one before them) of one commanded twist per period."""
        limited, poses = [], [self.run.simulation.pose()]
        for x, y, turn in twists:
            now = self.run.simulation.time
            self.stream.command((x, y, 0.0), (0.0, 0.0, turn), now)
            limited.append(self.stream.twist(now))
            self.run.drive(limited[-1:])
            poses.append(self.run.simulation.pose())
        return limited, np.array(poses)


class OfficialRobot:
    """Robotont 2 with the official firmware. It has no limits to be told."""

    def __init__(self):
        wheels = read_robot("robotont2").wheels
        self._simulation = make_simulation("robotont2", wheels, FLOOR, 0)
        self._board = BOARDS["robotont2"](SimulatedMotors(self._simulation))
        self._kinematics = Kinematics(wheels)

    def drive(self, twists):
        """As OwnRobot's; a command every second period, no more does the board take."""
        poses = [self._simulation.pose()]
        for number, twist in enumerate(twists):
            if number % 2 == 0:
                self._board.receive(b"MS:%.4f:%.4f:%.4f\r\n" % tuple(self._kinematics.wheel_speeds(twist)),
                                    self._board.now)
            self._board.advance((number + 1) * PERIOD)
            poses.append(self._simulation.pose())
        return twists, np.array(poses)


def deviation(twists, poses):
    """(across the path [m], heading [rad]) by which each true pose is off the path of `twists`."""
    path = seen_from(poses[0], path_of(twists))
    moving = np.flatnonzero(np.any(np.array(twists), axis=1))
    first, last = path[moving[0]], path[moving[-1] + 1]
    start, end = heading_of(path[moving[0]:]), heading_of(path[moving[-1] + 1::-1])
    path = np.vstack([[*(first[:2] - BEYOND * start), first[2]], path[moving[0]:moving[-1] + 2],
                      [*(last[:2] - BEYOND * end), last[2]]])
    across, heading = [], []
    for number, (x, y, yaw) in enumerate(poses[moving[0]:]):
        near = path[max(0, number - WINDOW):number + WINDOW]
        off, place = nearest((x, y), near)
        across.append(off)
        heading.append(math.remainder(yaw - place, 2 * math.pi))
    return np.array(across), np.abs(heading)


def seen_from(pose, path):
    """Poses of a path that begins at the origin, begun at `pose`."""
    x, y, yaw = pose
    sin, cos = math.sin(yaw), math.cos(yaw)
    return np.column_stack([x + cos * path[:, 0] - sin * path[:, 1], y + sin * path[:, 0] + cos * path[:, 1],
                            yaw + path[:, 2]])


def heading_of(path):
    """Unit vector of a path's first motion."""
    steps = path[:, :2] - path[0, :2]
    lengths = np.hypot(*steps.T)
    first = int(np.argmax(lengths > 1e-4))
    return steps[first] / max(lengths[first], 1e-9)


def nearest(point, path):
    """(distance [m], yaw [rad]) of the path's nearest place."""
    begin, step = path[:-1], np.diff(path, axis=0)
    square_lengths = np.maximum(np.sum(step[:, :2] ** 2, axis=1), 1e-12)
    part = np.clip(np.sum((point - begin[:, :2]) * step[:, :2], axis=1) / square_lengths, 0.0, 1.0)
    places = begin + part[:, None] * step
    distances = np.hypot(*(places[:, :2] - point).T)
    best = int(np.argmin(distances))
    return float(distances[best]), float(places[best, 2])


def bench_paths(options):
    """Rows of each path at each speed."""
    rows = []
    for path, length in PATHS.items():
        for speed in options.speeds:
            wanted = commands(path, length, speed)
            limited, poses = OwnRobot().drive(wanted)
            across, heading = deviation(limited, poses)
            raw = max(deviation(wanted, poses)[0])
            official = None
            if speed <= OFFICIAL_SPEED:
                official = 1000 * max(deviation(*OfficialRobot().drive(wanted))[0])
            name = f"{path.__name__} at {speed:g} m/s"
            bound = next((f"<= {most}" for fast, most in BOUNDS.items() if speed <= fast), "")
            rows += [
                row(name + ", across the path", 1000 * max(across), "mm", official, bound,
                    f"rms {1000 * math.sqrt(np.mean(across ** 2)):.1f}; off the raw commands' path: {1000 * raw:.1f}"),
                row(name + ", heading", math.degrees(max(heading)), "deg", None, "<= 2"),
            ]
    return rows


def bench_steps(options):
    """Rows of steps from rest: overshoot, and how long after the limits' own time the speed stays within 5 %."""
    rows = []
    for name, direction in DIRECTIONS.items():
        for mass in MASSES:
            for speed in options.speeds:
                wanted = [REST] * LEAD_IN + [tuple(speed * part for part in direction)] * round(
                    (1.5 + speed / RAMP) / PERIOD)
                untold, _ = settling(*along(direction, *OwnRobot(mass, told=False).drive(wanted)), name == "spin")
                limited, poses = OwnRobot(mass).drive(wanted)
                over, settled = settling(*along(direction, limited, poses), name == "spin")
                across, heading = deviation(limited, poses) if name != "spin" else (np.zeros(1), np.zeros(1))
                unit = "rad/s" if name == "spin" else "m/s"
                rows.append(row(f"{name} to {speed:g} {unit}, {mass:g} kg: overshoot", 100 * over, "%", None, "<= 3",
                                f"within 5 % after {settled:.2f} s; {1000 * max(across):.0f} mm off the path, "
                                f"{math.degrees(max(heading)):.1f} deg; with LEAD for {BODY_MASS:g} kg: "
                                f"{100 * untold:.1f} %"))
    return rows


def along(direction, limited, poses):
    """(speeds of the limited twists in a direction, poses)."""
    return np.dot(limited, direction), poses


def settling(limited, poses, turning):
    """(overshoot as a part, [s] from when the limited speed is reached until the true one stays within 5 %)."""
    steps = np.diff(poses, axis=0)
    turns = np.remainder(steps[:, 2] + math.pi, 2 * math.pi) - math.pi
    speeds = (turns if turning else np.hypot(steps[:, 0], steps[:, 1])) / PERIOD
    speeds = np.convolve(speeds, np.ones(SMOOTHED) / SMOOTHED, "valid")
    final = limited[-1]
    reached = int(np.argmax(limited >= 0.999 * final)) - (SMOOTHED - 1)
    outside = np.flatnonzero(np.abs(speeds - final) > 0.05 * final)
    return max(speeds) / final - 1, max(0.0, (outside[-1] + 1 - reached) * PERIOD)


def bench_stops(_options):
    """Rows of sudden stops from STOPS motions: heading left over, swing back, time until it stands."""
    random, left, back, times = np.random.default_rng(1), [], [], []
    robot = OwnRobot()
    for _ in range(STOPS):
        angle, speed, turn = random.uniform(-math.pi, math.pi), random.uniform(0.1, 0.8), random.uniform(-1.5, 1.5)
        twist = (speed * math.cos(angle), speed * math.sin(angle), turn)
        limited, before = robot.drive([twist] * 75)
        _, poses = robot.drive([REST] * 75)
        speeds = np.linalg.norm(np.diff(poses[:, :2], axis=0), axis=1) / PERIOD
        still = int(np.flatnonzero(speeds > 0.01)[-1]) + 1
        times.append(still * PERIOD)
        way = poses[:, :2] - poses[0, :2]
        along = way @ (way[still] / np.linalg.norm(way[still]))
        back.append(1000 * (max(along) - along[-1]))
        # the curve of the stop keeps its ratio of turn to way
        length = float(np.sum(np.linalg.norm(np.diff(poses[:, :2], axis=0), axis=1)))
        turned = math.remainder(poses[-1, 2] - poses[0, 2], 2 * math.pi)
        left.append(math.degrees(abs(turned - turn / speed * length)))
    return [row("stop: until it stands", times, "s", None, "<= 0.24"),
            row("stop: swing back", percentile(back, 1.0), "mm"),
            row("stop: heading off the curve", left, "deg", None, "<= 0.2",
                f"largest {max(left):.2f}; {sum(angle > 0.2 for angle in left)} of {STOPS} above")]


PARTS = (bench_steps, bench_paths, bench_stops)
