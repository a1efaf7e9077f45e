"""The whole loop on simulated motors: commands, packets, every way to a stop; and that it allocates nothing."""

from dual_tools import (
    BLIND_TIME,
    BRAKING,
    FAULT_HOLD,
    TIMEOUT,
    Config,
    Locked,
    Robot,
    WildBoard,
    checked,
)
from sim_motor import BRAKE, COAST, GOOD, UNPLUGGED

from robotont_firmware import __version__, config
from robotont_firmware.fault_watch import DRIVER_FAULT, NO_COUNTS
from robotont_firmware.main_loop import Controller
from robotont_firmware.robot_numbers import Numbers
from robotont_firmware.status import TIMED_OUT, WAITS_FOR_ZERO

ABOUT = f"robotont_firmware {__version__} wheels 3 rate 50 units edges/period profile ours reset test"


def mean_speeds(robot, periods, command):
    before = [motor.counted for motor in robot.board.motors]
    robot.tick(periods, command)
    return [(motor.counted - start) / periods for motor, start in zip(robot.board.motors, before)]



def test_identifies_itself_whenever_it_is_asked():
    robot = Robot()
    assert robot.board.sent == checked(f"# {ABOUT}"), "the banner comes first"
    for line, times, periods, answers, why in (
        (checked("?"), 3, 8, 3, "each"),
        (checked("?"), 20, 1, 5, "answers must not fill the line"),
        (b"?;0000\n?\n", 1, 30, 6, "one of before was still due, and none of these"),
    ):
        for _ in range(times):
            robot.board.inbox += line
            robot.tick(periods)
        assert robot.board.sent.count(checked(f"# identity {ABOUT}")) == answers, why


def test_wheels_follow_a_checked_command():
    for wheels, command in ((3, "-18.90:0.00:18.90"), (4, "5:-6:7:-8"), (5, "5.5:-6:7:-8:20.25")):
        robot = Robot(wheels)
        robot.tick(50, command)
        for speed, wished in zip(mean_speeds(robot, 100, command), command.split(":")):
            assert abs(speed - float(wished)) <= 0.03, (command, speed)


def test_one_packet_per_period_and_the_totals_add_up_also_past_their_overflow():
    for start in (0, 65530, 5):
        robot = Robot()
        for motor in robot.board.motors:
            motor.turned = motor.counted = start
        robot.controller.start()
        sums = [start] * 3
        for index in range(300):
            robot.board.sent = b""  # the emulated board's heap is small
            if index % 10 == 0:
                robot.send("-60:12.5:60")
            robot.tick(1)
            ((counts, counter, totals),) = robot.packets()
            assert counter == index & 0xFF
            assert max([abs(count) for count in counts]) <= 65
            sums = [total + count for total, count in zip(sums, counts)]
            assert totals == [total & 0xFFFF for total in sums]
            assert sums == [motor.counted for motor in robot.board.motors]


def test_after_the_timeout_the_wheels_are_braked_then_released_until_a_command_comes():
    robot = Robot()
    robot.tick(40, "60:-60:30")
    robot.tick(TIMEOUT - 10)  # the last command came 9 periods ago
    assert robot.packets()[-1][0][0] > 55
    assert robot.newest()[0] == 0
    robot.tick(1)
    assert robot.newest()[0] == TIMED_OUT
    assert robot.efforts()[0] < -500
    assert robot.efforts()[1] > 500
    robot.tick(8)
    assert max([abs(count) for count in robot.packets()[-1][0]]) <= 3
    robot.tick(BRAKING)
    robot.board.motors[0].speed = 50 * 1000000  # a person turns the wheel: the motor does not resist
    robot.tick(1)
    assert robot.efforts() == [0, 0, 0]
    assert robot.newest()[0] == TIMED_OUT
    robot.tick(50, "30:30:30")
    assert robot.newest()[0] == 0
    assert robot.packets()[-1][0][0] > 25


def test_fast_wheels_are_braked_behind_the_timeout_also_where_drivers_coast():
    """The back-EMF is no part of a limit that their efforts have: with zeros such a wheel is braked at any speed."""
    for driver, extra in ((COAST, {"DRIVER": "coast", "STATIC": 330, "MAX_LOAD": 300}), (BRAKE, {})):
        robot = Robot(settings=Config(**extra), driver=driver, frequency=100 if extra else 20000)
        robot.tick(150, "170:-170:170")
        before = robot.packets()[-1][0]
        assert abs(before[0]) > 120, before
        robot.tick(TIMEOUT)
        assert robot.newest()[0] == TIMED_OUT
        robot.tick(8)
        assert max([abs(count) for count in robot.packets()[-1][0]]) < abs(before[0]) // 4, (driver, before)


def test_garbage_and_questions_keep_no_motor_alive():
    periods = TIMEOUT + BRAKING + 1
    for line, refused in ((b"30:30:30;0000\n30:30:30\n30:30;\n\x00\xff", periods * 3 & 0xFF), (checked("?"), 0)):
        robot = Robot()
        robot.tick(40, "30:30:30")
        for _ in range(periods):
            robot.board.inbox += line
            robot.tick(1)
        assert robot.efforts() == [0, 0, 0], line
        assert robot.newest()[2] == refused


def test_plain_pc_takes_over_after_the_timeout_only():
    robot = Robot()
    robot.tick(20, "30:30:30")
    robot.board.inbox += b"-30:-30:-30;\n"
    robot.tick(5)
    assert robot.packets()[-1][0][0] > 0
    robot.tick(60)
    for _ in range(10):
        robot.board.sent = b""
        robot.board.inbox += b"-30:-30:-30;\n"
        robot.tick(5)
    assert robot.packets()[-1][0][0] < -25


def break_line(robot, broken):
    robot.board.faults[1] = broken


def break_encoder(robot, broken):
    robot.board.motors[1].encoder = UNPLUGGED if broken else GOOD


def test_a_fault_stops_all_until_a_zero_that_comes_after_it():
    for spoil, fault, periods in ((break_line, DRIVER_FAULT, 1), (break_encoder, NO_COUNTS, BLIND_TIME)):
        robot = Robot()
        robot.tick(40, "30:30:30")
        spoil(robot, True)
        robot.tick(periods + 1, "30:30:30")
        efforts = robot.efforts()
        assert efforts[1] == (fault != DRIVER_FAULT), "shorted, where its driver can"
        assert max(efforts[0], efforts[2]) < 0, "the others brake"
        assert list(robot.controller._setpoints.now) == [0, 0, 0], "a zero drives none a bit further"
        spoil(robot, False)
        robot.tick(2, "0:0:0")
        for _ in range(BRAKING // 20):
            robot.newest()  # the emulated board's heap is small
            robot.tick(20, "30:30:30")
        assert max([abs(count) for count in robot.packets()[-1][0][::2]]) <= 3
        for _ in range(60):
            assert robot.efforts() == [0, 0, 0], "neither a zero that came at once starts it, nor a command"
            assert robot.newest()[0] == WAITS_FOR_ZERO
            assert robot.newest()[3] == [0, fault, 0]
            robot.tick(1, "30:30:30")
        robot.tick(3, "0:0:0")
        assert robot.newest()[0] == 0
        assert robot.newest()[3] == [0, 0, 0]
        robot.tick(50, "30:30:30")
        assert robot.packets()[-1][0][1] > 25


def test_the_fault_hold_begins_when_the_line_is_quiet():
    for low in (1, 60):
        robot = Robot()
        robot.board.faults[2] = True
        robot.tick(low, "0:0:0")
        robot.board.faults[2] = False
        for _ in range(FAULT_HOLD - 1):
            robot.tick(1, "0:0:0")
            assert robot.newest()[0] == WAITS_FOR_ZERO
        robot.tick(2, "0:0:0")
        assert robot.newest()[0] == 0


def test_too_fast_keeps_the_direction():
    robot = Robot()
    robot.tick(1, "720:-360:90")
    targets = list(robot.controller._setpoints.targets)
    limit = Numbers(config).max_speed
    for target, wished in zip(targets, (limit, -limit // 2, limit // 8)):
        assert abs(target - wished) <= 8, targets


def test_set_points_keep_the_direction_and_change_no_faster_than_the_torque_allows():
    for mass, inertia in ((1, 1), (3576, 429000), (12000, 429000), (3576, 4000000)):
        robot = Robot(settings=Config(MASS=mass, INERTIA=inertia))
        numbers, steps = Numbers(Config(MASS=mass, INERTIA=inertia)), []
        while robot.controller._setpoints.now[0] < 25600:
            before = list(robot.controller._setpoints.now)
            robot.tick(1, "100:-50:25")
            now = list(robot.controller._setpoints.now)
            steps.append(max([abs(a - b) for a, b in zip(now, before)]))
            assert abs(now[0] + 2 * now[1]) <= 32, now
            assert abs(now[0] - 4 * now[2]) <= 64, now
        assert max(steps) == numbers.change <= 2559, mass
        lead = max(numbers.lead, numbers.turn_lead)
        assert (lead * numbers.change >> 4) * numbers.gain >> 16 <= config.MAX_TORQUE
        assert now == [25600, -12800, 6400]


def test_a_turn_is_driven_against_what_rubs():
    heavy = Config(MASS=3576, INERTIA=429000, RUBBING=76)
    drag = Numbers(heavy).drag * Numbers(heavy).turn_lead
    assert drag > 0
    for command, turning in (("50:50:50", drag), ("-9:-9:-9", -drag), ("50:-50:0", 0)):
        robot = Robot(settings=heavy)
        robot.tick(60, command)
        assert set(robot.controller._setpoints.bends) == {turning}, "for all alike: no acceleration straight on"


def test_one_wheel_is_driven_on_its_own_while_no_commands_come():
    """Order !test: for half a second at most by the firmware's own clock, never too fast."""
    for body, effort, speed, least, most in (
        ("!test 1+", 400, 300, 25, 25), ("!test 1-", -400, 300, 25, 25), ("!test 1+", 999, 150, 3, 5),
    ):
        robot = Robot(settings=Config(TEST_EFFORT=abs(effort), TEST_SPEED=speed))
        robot.send(body)
        driven = []
        for _ in range(80):
            robot.tick(1)
            driven.append((robot.efforts(), robot.newest()[0]))
        periods = [flags for efforts, flags in driven if efforts == [0, effort, 0]]
        assert least <= len(periods) <= most, (body, len(periods))
        assert periods[:-1] == [0] * (len(periods) - 1), "the status shows which periods are driven"
        assert [flags for efforts, flags in driven if efforts == [0, 0, 0]] == [TIMED_OUT] * (80 - len(periods)), body
        assert not robot.board.motors[1].speed


def fail(robot, broken=True):
    robot.board.faults[2] = broken
    robot.tick(1)


def test_a_command_or_a_fault_ends_it_and_after_a_reset_zeros_come_first():
    for ends in (lambda robot: robot.send("0:0:0"), fail):
        robot = Robot()
        robot.send("!test 0+")
        robot.tick(5)
        assert robot.efforts() == [400, 0, 0]
        ends(robot)
        robot.tick(1)
        assert robot.efforts()[0] <= 0
        assert max([abs(effort) for effort in robot.efforts()[1:]]) <= 1, "shorted, or off"
        robot.send("!test 0+")
        fail(robot, False)
        robot.tick(TIMEOUT + BRAKING)
        assert robot.efforts() == [0, 0, 0], "an order that came then is forgotten"
    robot = Robot(cause="power")
    robot.send("!test 0+")
    robot.tick(1)
    assert robot.efforts() == [0, 0, 0], "zeros first"


def test_status_has_voltage_and_load_once_a_second_and_the_light_shows_what_goes_on():
    robot = Robot(battery_mv=12340)
    lights = []
    robot.board.load = lambda: 49
    robot.board.light = lambda on: lights.append(bool(on))
    robot.controller = Controller(robot.board, config, "test")
    robot.tick(1)
    assert robot.newest()[4:] == (1234, 49)
    robot.board.battery_mv = 11000
    robot.tick(config.RATE - 1)
    assert robot.newest()[4] == 1234, "the same for a second"
    robot.tick(1)
    assert 1100 <= robot.newest()[4] <= 1110, "then the mean over some periods"
    robot.board.keep = False  # the emulated board has not as much memory
    shown = {}
    for name, command, fault in (("idle", None, False), ("driven", "20:20:20", False), ("fault", None, True)):
        fail(robot, fault)
        robot.tick(40, command)
        lights.clear()
        robot.tick(64, command)
        shown[name] = sum(lights), len(lights)
    assert shown == {"idle": (1, 8), "driven": (8, 8), "fault": (4, 8)}


def test_the_watchdog_is_fed_in_each_period_until_the_pc_asks_for_the_repl():
    board = WildBoard([checked("0:0:0")])
    Controller(board, config).run()
    assert board.fed == board.ticks == 221


def test_the_whole_loop_allocates_nothing():
    lines = ["0:0:0", "-180.55:0.00:90.25", "", "0:0:0", "3:-3:9.5", "?"]
    lines = [checked(line) if line else b"\xff\x00;;;\n" * 40 for line in lines] + [b"1:2:3;\n", b"7" * 250]
    board = WildBoard(lines)
    controller = Controller(board, config, reset_cause="test")
    controller.start()
    with Locked():
        controller.run()
    assert board.sent > 220 * 30
    assert controller._tested == 2, "the order was obeyed"
