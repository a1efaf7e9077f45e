"""Whether the robot moves as commanded: the driver's limits, this firmware's code and the physics, in simulated time.

Truth is held against the path that `cmd_vel/limited` describes, integrated exactly, and against that of the raw
commands. Distances are across the path, so that a mere delay is none; both ends go on straight. floor: a board with
the official firmware and the same commands, up to the 0.3 m/s that it allows; of spins and of headings at a stop the
same body on wheels whose speeds are held exactly, which is what rollers and floor do by themselves.
"""

import math
import sys
from unittest import mock

import matplotlib
import mujoco
import numpy as np
from paths import LEAD_IN, PATHS, RAMP, REST, commands, deviation, seen_from

from robotont_boards import BOARDS
from robotont_driver.command.command_stream import CommandStream
from robotont_driver.command.limits import Limits
from robotont_driver.kinematics.kinematics import Kinematics
from robotont_driver.kinematics.wheel_params import BODY_MASS
from robotont_driver.robots.robot_folder import read_robot
from robotont_firmware import config
from robotont_simulator.mujoco_model import ROLLERS, TIMESTEP
from robotont_simulator.simulated_board import make_simulation
from robotont_simulator.simulation import Simulation
from robotont_simulator.world import World
from robotont_testing import places
from robotont_testing.figures import percentile, row
from robotont_testing.simulated_wheels import PERIOD, path_of

sys.path.append(str(places.package("robotont_simulator") / "test"))
from lockstep import LockstepRun

matplotlib.use("Agg")
import matplotlib.pyplot as plt

FLOOR = World()
OFFICIAL_SPEED = 0.3       # [m/s] that its board allows a wheel
BOUNDS = {0.3: 8, 0.5: 12, 0.8: 20}  # [mm] across the path, at most
MASSES = (2.0, 3.0, 5.0)   # [kg] without wheels
DIRECTIONS = {"forward": (1.0, 0.0, 0.0), "sideways": (0.0, 1.0, 0.0)}
STEPS = (0.05,)            # [m/s] beside those of --speeds
SMOOTHED = 3               # [periods] over which a true speed is the mean
SECOND = round(1 / PERIOD)  # [periods]
SEEDS, STOPS = (1, 2, 3), 100
FLYWHEEL = 1e4             # [kg m^2] that no floor slows down


def set_mass(simulation, mass):
    """Make the body, without the wheels, this heavy [kg], of the same shape."""
    model, body = simulation.mujoco_model, simulation.mujoco_model.body("base_link").id
    model.body_inertia[body] *= mass / model.body_mass[body]
    model.body_mass[body] = mass
    mujoco.mj_setConst(model, simulation.data)


class OwnRobot:
    """The thesis' robot with this firmware, behind the driver's limits.

    mass: [kg] of its body. told: whether the firmware's LEAD is for that mass. plane: whether both rows of rollers
    roll at one distance from the middle, and so do not rub.
    """

    def __init__(self, mass=BODY_MASS, told=True, plane=False):
        robot = read_robot("thesis")
        simulation = Simulation(robot.wheels, FLOOR)
        if plane:
            model = simulation.mujoco_model
            rows = model.geom_bodyid[model.geom_type == mujoco.mjtGeom.mjGEOM_ELLIPSOID]
            model.body_pos[rows, 2] = 0.0
            mujoco.mj_setConst(model, simulation.data)
        if told:
            set_mass(simulation, mass)
        with mock.patch.object(config, "RUBBING", 0 if plane else config.RUBBING):
            self.run = LockstepRun(simulation)
        self.radii = np.array(robot.wheels.radii)
        set_mass(simulation, mass)
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
            self.move(limited[-1])
            poses.append(self.run.simulation.pose())
        return limited, np.array(poses)

    def move(self, twist):
        """One period of a twist that goes out."""
        self.run.drive([twist])

    def turned(self):
        """[m, m, rad] by which the wheels' own angles have moved the robot, each twist after the other."""
        return self.run.kinematics.inverse @ (self.radii * [
            self.run.simulation.data.joint(f"wheel{wheel}").qpos[0] for wheel in range(len(self.radii))])


class HeldRobot(OwnRobot):
    """The same body on wheels that are held at the commanded speeds, whatever the floor does."""

    def __init__(self, mass=BODY_MASS):
        super().__init__(mass)
        model = self.run.simulation.mujoco_model
        self._wheels = [int(model.joint(f"wheel{wheel}").dofadr[0]) for wheel in range(len(self.radii))]
        model.actuator_gainprm[:] = model.actuator_biasprm[:] = model.dof_frictionloss[self._wheels] = 0.0
        model.dof_armature[self._wheels] = FLYWHEEL
        mujoco.mj_setConst(model, self.run.simulation.data)
        self._speeds = np.zeros(len(self.radii))

    def move(self, twist):
        """As OwnRobot's; the speeds change evenly within the period."""
        data, steps = self.run.simulation.data, round(PERIOD / TIMESTEP)
        change = (self.run.kinematics.wheel_speeds(twist) / self.radii - self._speeds) / steps
        for _ in range(steps):
            self._speeds = self._speeds + change
            data.qvel[self._wheels] = self._speeds
            mujoco.mj_step(self.run.simulation.mujoco_model, data)


class OfficialRobot:
    """Robotont 2 with the official firmware. It has no limits to be told."""

    def __init__(self):
        wheels = read_robot("robotont2").wheels
        self._simulation = make_simulation("robotont2", wheels, FLOOR, 0)
        self._board = BOARDS["robotont2"](self._simulation)
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


def bench_paths(options):
    """Rows of each path at each speed, and a picture of them."""
    rows = []
    figure, places = plt.subplots(len(PATHS), len(options.speeds), squeeze=False,
                                  figsize=(3 * len(options.speeds), 2.5 * len(PATHS)))
    for (path, length), line in zip(PATHS.items(), places):
        for speed, place in zip(options.speeds, line):
            wanted = commands(path, length, speed)
            limited, poses = OwnRobot().drive(wanted)
            across, heading = deviation(limited, poses)
            raw = max(deviation(wanted, poses)[0])
            name = f"{path.__name__} at {speed:g} m/s"
            drawn, official = {"cmd_vel/limited": seen_from(poses[0], path_of(limited)), "this firmware": poses}, None
            if speed <= OFFICIAL_SPEED:
                sent, drawn["official"] = OfficialRobot().drive(wanted)
                official = 1000 * max(deviation(sent, drawn["official"])[0])
            draw(place, name, drawn)
            bound = next((f"<= {most}" for fast, most in BOUNDS.items() if speed <= fast), "")
            rows += [
                row(name + ", across the path", 1000 * max(across), "mm", official, bound,
                    f"rms {1000 * math.sqrt(np.mean(across ** 2)):.1f}; off the raw commands' path: {1000 * raw:.1f}"),
                row(name + ", heading", math.degrees(max(heading)), "deg", None, "<= 2"),
            ]
    places[0, 0].legend(fontsize="x-small")
    figure.tight_layout()
    figure.savefig(options.picture)
    return rows


def draw(place, name, paths):
    """Draw {label: poses} into one place of a figure."""
    for (label, path), style in zip(paths.items(), ("k--", "C0-", "C1-")):
        place.plot(path[:, 0], path[:, 1], style, label=label, linewidth=1)
    place.set_title(name, fontsize="small")
    place.tick_params(labelsize="x-small")
    place.axis("equal")


def bench_steps(options):
    """Rows of steps from rest: overshoot, and how long after the limits' own time the speed stays within 5 %."""
    rows = []
    for name, direction in DIRECTIONS.items():
        for mass in MASSES:
            for speed in (*STEPS, *options.speeds):
                wanted = step(direction, speed, speed)
                untold, _ = settling(*along(direction, *OwnRobot(mass, told=False).drive(wanted)), False)
                limited, poses = OwnRobot(mass).drive(wanted)
                over, settled = settling(*along(direction, limited, poses), False)
                across, heading = deviation(limited, poses)
                rows.append(row(f"{name} to {speed:g} m/s, {mass:g} kg: overshoot", 100 * over, "%", None, "<= 3",
                                f"within 5 % after {settled:.2f} s; {1000 * max(across):.0f} mm off the path, "
                                f"{math.degrees(max(heading)):.1f} deg; told {BODY_MASS:g} kg: "
                                f"{100 * untold:.1f} %"))
    return rows


def bench_spins(options):
    """Rows of steps on the spot, by the wheels' speed: with both rows of rollers in one plane, and as they are.

    As they are: the overshoot of the speed, that of its mean over the way of one roller, the ripple of a steady spin.
    """
    direction, rows, wheels = (0.0, 0.0, 1.0), [], read_robot("thesis").wheels
    distance, roller = np.mean(wheels.distances), 2 * math.pi * np.mean(wheels.radii) / ROLLERS
    for mass in MASSES:
        for speed in (*STEPS, *options.speeds):
            wanted = step(direction, speed / distance, speed) + [(0.0, 0.0, speed / distance)] * SECOND
            (plane, settled, *_), (over, late, mean, mean_late, ripple), (held, _, held_mean, _, held_ripple) = (
                spinning(*robot.drive(wanted), roller / speed / PERIOD)
                for robot in (OwnRobot(mass, plane=True), OwnRobot(mass), HeldRobot(mass)))
            name = f"spin, wheels to {speed:g} m/s, {mass:g} kg"
            rows += [row(name + ", rows in one plane: overshoot", 100 * plane, "%", None, "<= 3",
                         f"within 5 % after {settled:.2f} s"),
                     row(name + ": overshoot", 100 * over, "%", 100 * held, "<= 3", f"within 5 % after {late:.2f} s"),
                     row(name + ": the same of the mean over a roller", 100 * mean, "%", 100 * held_mean, "<= 3",
                         f"within 5 % after {mean_late:.2f} s"),
                     row(name + ": ripple to both sides", 100 * ripple, "%", 100 * held_ripple)]
    return rows


def spinning(limited, poses, periods):
    """`settling` of a spin, both of its mean over so many periods, and half of the ripple in its last second."""
    limited, turned = np.dot(limited, (0.0, 0.0, 1.0)), speeds_of(poses, True)
    mean, own = (smoothed(speeds, max(1, round(periods))) / limited[-1] for speeds in (turned, limited))
    outside = np.flatnonzero(np.abs(mean - 1) > 0.05)
    late = (outside[-1] + 1 if len(outside) else 0) - int(np.argmax(own >= 0.999))
    return (*settling(limited, poses, True), max(mean) - 1, max(0.0, late * PERIOD),
            np.ptp(smoothed(turned, SMOOTHED)[-SECOND:]) / 2 / limited[-1])


def step(direction, most, speed):
    """Twists of a step from rest to `most` times a direction, which takes as long as one to `speed` [m/s]."""
    return [REST] * LEAD_IN + [tuple(most * part for part in direction)] * round((1.5 + speed / RAMP) / PERIOD)


def along(direction, limited, poses):
    """(speeds of the limited twists in a direction, poses)."""
    return np.dot(limited, direction), poses


def settling(limited, poses, turning):
    """(overshoot as a part, [s] from when the limited speed is reached until the true one stays within 5 %)."""
    speeds, final = smoothed(speeds_of(poses, turning), SMOOTHED), limited[-1]
    reached = int(np.argmax(limited >= 0.999 * final)) - (SMOOTHED - 1)
    outside = np.flatnonzero(np.abs(speeds - final) > 0.05 * final)
    return max(speeds) / final - 1, max(0.0, (outside[-1] + 1 - reached) * PERIOD)


def speeds_of(poses, turning):
    """[m/s], or [rad/s] of the turn, in each period."""
    steps = np.diff(poses, axis=0)
    turns = np.remainder(steps[:, 2] + math.pi, 2 * math.pi) - math.pi
    return (turns if turning else np.hypot(steps[:, 0], steps[:, 1])) / PERIOD


def smoothed(speeds, periods):
    """Each mean over so many."""
    return np.convolve(speeds, np.ones(periods) / periods, "valid")


def bench_stops(_options):
    """Rows of sudden stops, STOPS for each of SEEDS: time until it stands, swing back, heading left over."""
    own, held = (np.array([found for seed in SEEDS for found in stops(robot(), seed)]).T
                 for robot in (OwnRobot, HeldRobot))
    times, back, left, by_wheels = own
    above, of_floor, of_wheels = (int(np.sum(angles > 0.2)) for angles in (left, held[2], by_wheels))
    return [row("stop: until it stands", times.tolist(), "s", None, "<= 0.24"),
            row("stop: swing back", percentile(back, 1.0), "mm"),
            row("stop: heading off the curve", left.tolist(), "deg", held[2].tolist(), "<= 0.2"),
            row("stop: the same by the wheels' own angles", by_wheels.tolist(), "deg"),
            row("stops above 0.2 deg", above, "", of_floor, "",
                f"of {len(left)}; {of_wheels} by the wheels' own angles")]


def stops(robot, seed):
    """(time [s], swing back [mm], heading off the curve [deg], the same by the wheels' own angles) of each stop."""
    random = np.random.default_rng(seed)
    for _ in range(STOPS):
        angle, speed, turn = random.uniform(-math.pi, math.pi), random.uniform(0.1, 0.8), random.uniform(-1.5, 1.5)
        robot.drive([(speed * math.cos(angle), speed * math.sin(angle), turn)] * 75)
        before = robot.turned()[2]
        _, poses = robot.drive([REST] * 75)
        steps = np.linalg.norm(np.diff(poses[:, :2], axis=0), axis=1)
        still = int(np.flatnonzero(steps > 0.01 * PERIOD)[-1]) + 1
        way = poses[:, :2] - poses[0, :2]
        along = way @ (way[still] / np.linalg.norm(way[still]))
        # the curve of the stop keeps its ratio of turn to way
        curve = turn / speed * float(np.sum(steps))
        turned = math.remainder(poses[-1, 2] - poses[0, 2], 2 * math.pi)
        yield (still * PERIOD, 1000 * (max(along) - along[-1]), math.degrees(abs(turned - curve)),
               math.degrees(abs(robot.turned()[2] - before - curve)))


PARTS = (bench_steps, bench_spins, bench_paths, bench_stops)
