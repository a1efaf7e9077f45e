"""When a robot stands, and when it counts as held, by what is commanded and what its wheels measure."""

import itertools
import math
import random
import sys
from types import SimpleNamespace

import pytest
import rospy
from geometry_msgs.msg import PoseStamped, Twist, Vector3
from navigation_messages import Monitor
from sensor_msgs import point_cloud2
from std_msgs.msg import Float32, String

from robotont_boards import BOARDS
from robotont_driver.command.limits import Limits, limit_acceleration
from robotont_driver.kinematics.se2 import between, compose
from robotont_driver.kinematics.wheel_params import WHEEL_MASS
from robotont_driver.robots.robot_folder import read_robot
from robotont_map_navigation.felt import GLOBAL, LOCAL
from robotont_map_navigation.held import FELT, FREE, FRONT, LAG, MAKERS, PASSED, STAND, TRIES, HoldWatch
from robotont_simulator.simulation import Simulation
from robotont_simulator.world import World
from robotont_testing import places
from robotont_testing.bus import transform
from robotont_testing.node_test import ERROR, OK

sys.path.append(str(places.package("robotont_simulator") / "test"))
from lockstep import LockstepRun
from test_sim_official_firmware import Drive

PERIOD = 0.02  # [s] between two twists of the odometry, of every folder's board
SLOWER = 0.036  # [s] likewise, as of an EKF
AHEAD = 0.2, 0.0, 0.0
REST = 0.0, 0.0, 0.0
LIMITS = Limits(linear_acceleration=1.5, angular_acceleration=8.0, linear_deceleration=2.25)  # of most folders
FOLDERS = "thesis", "four_wheels", "robotont2", "robotont21", "robotont3"
PUSHING = 0.3  # [s] at most of wheels that are commanded against what holds them


def verdicts(commanded, measured, seconds=6.0, lost=(), obeys=True, step=PERIOD):
    """([s] of each stand, [s] until words come or None): measured(t) at each `step` [s], none while `lost`."""
    watch, stands = HoldWatch(0.19), []
    for look in range(int(seconds / step)):
        now = look * step
        stood = obeys and stands and now < stands[-1] + STAND
        watch.command(REST if stood else commanded(now), now)
        if lost and lost[0] <= now < lost[1]:
            continue
        stand, held = watch.measure(REST if stood else measured(now), now, now)
        stands += [now] if stand else []
        if held:
            return stands, now
    return stands, None


@pytest.mark.parametrize("commanded", [AHEAD, (0.0, -0.1, 0.0), (0.05, 0.0, 0.0), (0.0, 0.0, 0.5), (0.1, 0.1, -1.0)])
@pytest.mark.parametrize("share", [0.0, -0.5, 0.2])
@pytest.mark.parametrize("obeys", [True, False])
@pytest.mark.parametrize("step", [PERIOD, SLOWER])
def test_a_robot_that_does_not_move_as_commanded_stands_and_is_held_the_third_time(commanded, share, obeys, step):
    stands, held = verdicts(lambda now: commanded, lambda now: tuple(share * speed for speed in commanded),
                            obeys=obeys, step=step)
    assert len(stands) == TRIES
    assert stands[0] >= LAG + FELT - 1e-9
    pushed = [now - before for before, now in zip([0.0, *(stand + STAND for stand in stands)], stands)]
    assert max(pushed) <= PUSHING
    assert held < 2.0


@pytest.mark.parametrize("commanded", [AHEAD, (0.0, -0.1, 0.0), (0.0, 0.0, 0.6), (0.3, 0.0, 0.4)])
def test_a_robot_with_its_makers_firmware_is_held_later(commanded):
    watch, stands = HoldWatch(0.19, *MAKERS), []
    for look in range(300):
        watch.command(commanded, look * PERIOD)
        stand, held = watch.measure(REST, look * PERIOD, look * PERIOD)
        stands += [look * PERIOD] if stand else []
        if held:
            break
    assert len(stands) == TRIES
    assert LAG + FELT < stands[0] < 0.5


@pytest.mark.parametrize("commanded, measured", [((0.113, 0.0, -0.59), (0.027, 0.031, -0.28)),
                                                 ((0.285, 0.0, 1.0), (0.082, -0.107, 0.9)),
                                                 ((0.3, 0.0, 0.4), (0.3, 0.0, 0.0)),
                                                 ((0.033, 0.0, 0.18), (0.0, 0.0, 0.0))])
def test_a_turn_does_not_hide_that_the_way_is_barred_nor_a_way_that_the_turn_is(commanded, measured):
    """As against somebody's back while a plan led around him."""
    stands, held = verdicts(lambda now: commanded, lambda now: measured)
    assert len(stands) == TRIES
    assert held


def test_the_words_tell_the_part_that_is_held():
    watch, words = HoldWatch(0.19), ""
    for look in range(200):
        watch.command((0.3, 0.0, 0.4), look * PERIOD)
        words = words or watch.measure((0.3, 0.0, 0.0), look * PERIOD, look * PERIOD)[1]
    assert "it was to turn at 0.40 rad/s, and its wheels turned it at 0.00 rad/s" in words
    assert watch.turn_alone


def reversal(now):
    return (0.4 if now < 1.0 else max(-0.4, 0.4 - 2.25 * (now - 1.0)), 0.0, 0.0)


@pytest.mark.parametrize("commanded, measured", [
    (lambda now: AHEAD, lambda now: (0.2 * min(1.0, now / 0.6), 0.0, 0.0)),
    (lambda now: AHEAD, lambda now: REST if 1.0 < now < 1.12 else AHEAD),
    (lambda now: AHEAD, lambda now: (0.1, 0.05, 0.3)),
    (lambda now: (0.02, 0.0, 0.05), lambda now: REST),
    (reversal, lambda now: reversal(now - 0.12)),
], ids=["a slow start", "a threshold that it got over", "slower, and not straight", "commands that ask for nothing",
        "wheels that turn round first"])
@pytest.mark.parametrize("step", [PERIOD, SLOWER])
def test_a_robot_that_moves_as_commanded_does_not_stand(commanded, measured, step):
    assert verdicts(commanded, measured, step=step) == ([], None)


def test_stands_far_from_each_other_never_end_a_goal():
    """It drives FREE, and some more, between two of them."""
    stuck = STAND + 2 * FREE / AHEAD[0]
    stands, held = verdicts(lambda now: AHEAD, lambda now: REST if now % (2 * stuck) < stuck else AHEAD, 30.0)
    assert len(stands) > TRIES
    assert held is None


def test_what_is_felt_lies_where_the_camera_looks_so_that_a_scan_clears_it_again():
    """Seen from 0.1 m before the robot's middle, with a cell of 0.025 m to spare; plans keep 0.19 m free."""
    for (off, _), side in itertools.product((LOCAL, GLOBAL), FRONT):
        ahead, aside = (0.19 + off) * math.cos(side) - 0.1, (0.19 + off) * abs(math.sin(side))
        assert math.atan2(aside + 0.025, ahead) < 1.03 / 2


def test_without_odometry_nothing_is_known_and_the_watch_begins_anew():
    stands, _ = verdicts(lambda now: AHEAD, lambda now: REST, lost=(0.1, 1.5))
    assert stands[0] >= 1.5 + FELT


def command_ahead(monitor, seconds, pose=REST, measured=REST):
    """Command 0.2 m/s while the odometry moves from a pose on, by a velocity [m/s] and [rad/s]."""
    for _ in range(round(seconds / PERIOD)):
        monitor.hear("cmd_vel/limited", Twist(linear=Vector3(*AHEAD)))
        pose = compose(pose, [PERIOD * part for part in measured])
        monitor.measured = transform("odom", "base_link", *pose)
        monitor.measured.header.stamp = rospy.Time.now()
        monitor.sleep(PERIOD)


@pytest.mark.parametrize("name, board, early", [
    ("serial_com_node/packets", "robotont3", 0), ("robot", "robotont2", 0), ("robot", "robotont21", 1)])
@pytest.mark.parametrize("first", [True, False])
def test_a_makers_board_is_known_by_its_name(monkeypatch, name, board, early, first):
    """Also where the robot starts behind navigation."""
    monitor = Monitor(monkeypatch, {name: board} if first else {})
    monitor.parameters[name] = board
    monitor.hear("move_base/current_goal", PoseStamped())
    monitor.connections["scan"] = 0
    monitor.hear("cmd_vel/driven_by", String("navigation"))
    command_ahead(monitor, 0.38)
    assert len(monitor.sent["navigation/stand"]) == early
    command_ahead(monitor, 0.14)
    assert len(monitor.sent["navigation/stand"]) == 1


def test_what_holds_the_robot_ends_navigations_goals_and_a_new_one_tries_again(monkeypatch):
    monitor = Monitor(monkeypatch)
    monitor.connections["scan"] = 0  # without a sensor, for whose scans it would stand
    stands, ended, felt, told = map(monitor.sent.__getitem__, (
        "navigation/stand", "move_base/cancel", "navigation/felt", "navigation/held"))

    def drive(by, seconds):
        monitor.hear("cmd_vel/driven_by", String(by))
        command_ahead(monitor, seconds)
    drive("hand", 1.0)
    assert (stands, ended) == ([], [])
    drive("navigation", 0.4)
    assert (stands, ended) == ([Float32(STAND)], [])
    xs, _, _ = zip(*point_cloud2.read_points(felt[-1]))
    assert min(xs) > 0.15
    drive("navigation", 1.5)
    assert (len(stands), len(ended)) == (TRIES, 1)
    level, words, _ = monitor.reports["motion"]()
    assert (level, words) == (ERROR, told[-1].data)
    assert words.startswith("something holds the robot")
    monitor.sleep(1.0)
    assert not felt[-1].width, "a cloud of nothing: else costmaps would never forget the one before"
    monitor.hear("move_base/current_goal", PoseStamped())
    assert told[-1] == String("")
    drive("navigation", 3.0)
    assert monitor.reports["motion"]()[0] == ERROR
    drive("hand", 0.1)
    assert (monitor.reports["motion"]()[:2], told[-1]) == ((OK, "as commanded"), String(""))


def test_the_way_to_what_was_touched_is_barred_until_the_robot_has_left_it(monkeypatch):
    """It slides along something ahead on its left, at half the speed; the contact lies where it does not get."""
    monitor = Monitor(monkeypatch)
    barred, felt = monitor.sent["navigation/barred"], monitor.sent["navigation/felt"]
    monitor.hear("cmd_vel/driven_by", String("navigation"))

    def drive(yaw=0.0, x=1.0, seconds=0.3):
        command_ahead(monitor, seconds, (x, 0.0, yaw), (0.06, -0.14, 0.0))
        return barred and (barred[-1].x, barred[-1].y)
    assert drive(seconds=0.1) == []
    assert drive() == pytest.approx((math.sqrt(0.5), math.sqrt(0.5)))
    x, y, _ = next(point_cloud2.read_points(felt[-1]))
    assert math.atan2(y, x) == pytest.approx(math.pi / 4, abs=0.11)
    assert drive(math.pi / 2) == pytest.approx((math.sqrt(0.5), -math.sqrt(0.5)))
    known = len(barred)
    drive(x=1.1, seconds=0.1)
    monitor.sleep(PASSED[1])
    drive(seconds=0.1)
    assert len(barred) == known


class Makers:
    """A robot with its makers' firmware, as a `LockstepRun`; its driver keeps the wheels below the board's limit."""

    def __init__(self, name, mass):
        self._drive, self._before = Drive(name, mass), (0.0, 0.0, 0.0)
        self.odometry = SimpleNamespace(twist=REST)

    def hold(self, twist, seconds):
        self._drive.hold(twist, seconds)

    def within(self, twist):
        wheels, fastest = self._drive.kinematics.matrix @ twist, self._drive.protocol.fastest
        return tuple(part * min(1.0, fastest / max(*abs(wheels), 1e-9)) for part in twist)

    def drive(self, twists):
        for twist in twists:
            self.hold(twist, PERIOD)
        pose = self._drive.odometry.pose
        now = pose.x, pose.y, pose.yaw
        self.odometry.twist, self._before = [part / PERIOD for part in between(self._before, now)], now


def drive(name, seed, mass, seconds):
    """[(time, commanded, measured)] of a robot folder on an empty floor, by what move_base may ask for."""
    draw = random.Random(seed)
    wheels = read_robot(name).wheels
    whole = mass + wheels.amount * WHEEL_MASS
    makers = name in BOARDS
    run = Makers(name, whole) if makers else LockstepRun(Simulation(wheels._replace(mass=whole), World(), seed))
    twist, record = REST, []
    run.hold(REST, 0.4)
    while len(record) < seconds / PERIOD:
        target = draw.choice([(draw.uniform(0.05, 0.4), 0.0, draw.uniform(-1.0, 1.0)), (0.05, 0.0, 0.0), REST,
                              (0.0, 0.0, draw.choice([-1, 1]) * draw.uniform(0.3, 1.0))])
        for _ in range(draw.randint(5, 100)):
            twist = limit_acceleration(twist, target, PERIOD, LIMITS) if any(target) else REST
            twist = run.within(twist) if makers else twist
            run.drive([twist])
            record.append((len(record) * PERIOD, twist, tuple(run.odometry.twist)))
    return record


def arrivals(record, draw, jitter=0.0, line=1, stall=0.0, stalled=("commands", "odometry")):
    """[(time of arrival, what, stamp, twist)], as the monitor gets them.

    jitter: [s] at most, behind which packets come together; line: periods in a packet; stall: [s] again and again in
    which those that are `stalled` do not come, and of which the newest counts.
    """
    begins = list(itertools.accumulate([stall + draw.uniform(0.3, 3.0) for _ in record])) if stall else []

    def late(time, what):
        return max([time, *(begin + stall for begin in begins if what in stalled and begin <= time < begin + stall)])
    packets = [record[end - line:end] for end in range(line, len(record) + 1, line)]
    means = [(packet[-1][0] + PERIOD, tuple(sum(one[2][part] for one in packet) / line for part in range(3)))
             for packet in packets]
    news = {(late(time, "commands"), "commands"): (time, twist) for time, twist, _ in record}
    last = 0.0
    for stamp, twist in means:
        last = max(last + 1e-5, late(stamp + draw.uniform(0.003, 0.003 + jitter), "odometry"))
        news[last, "odometry"] = stamp, twist
    return sorted((time, what, *found) for (time, what), found in news.items())


LONG = [pytest.param(name, mass, 25.0, marks=pytest.mark.long) for name in FOLDERS for mass in (2.0, 8.0)]


@pytest.mark.parametrize(("name", "mass", "seconds"), [("thesis", 2.0, 5.0), ("robotont3", 2.0, 5.0), *LONG])
def test_no_goal_ends_in_a_drive_however_its_odometry_comes(name, mass, seconds):
    """A heavy robot that crawls may stand once: its wheels have to turn round first."""
    record = drive(name, 1, mass, seconds)
    for way in ({}, {"jitter": 0.3}, {"line": 5}, {"stall": 0.3}, {"stall": 0.3, "stalled": "odometry"}):
        watch, stands = HoldWatch(0.15, *MAKERS) if name in BOARDS else HoldWatch(0.15), []
        for time, what, stamp, twist in arrivals(record, random.Random(2), **way):
            if what == "commands":
                watch.command(twist, time)
                continue
            stand, held = watch.measure(twist, stamp, time)
            stands += [time] if stand else []
            assert not held, (way, time)
        assert len(stands) <= (mass > 5.0), (way, stands)
