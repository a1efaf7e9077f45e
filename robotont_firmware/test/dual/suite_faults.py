"""What breaks on a robot, on simulated motors: the motors stop, nothing runs away, and the status states why."""

from dual_tools import BRAKING, FAST, FAULT_HOLD, TIMEOUT, Config, Locked, Robot, profile
from sim_motor import BRAKE, COAST, DIODE, HALF, MICRO, REVERSED, UNPLUGGED

from robotont_firmware import config, pin_profile_robotont21, pin_profile_vnh
from robotont_firmware.fault_watch import NO_COUNTS, OVERLOAD, TOO_MANY, WRONG_WAY
from robotont_firmware.robot_numbers import Numbers
from robotont_firmware.status import BATTERY_IS_LOW, TIMED_OUT, WAITS_FOR_ZERO
from robotont_firmware.wheel_speed import HEAT, INTEGRAL, Pid

CREEP = config.MAX_LOAD / 19.2 + 1  # [units] that MAX_LOAD turns a free wheel faster
STEADY = 45  # [periods] from rest to a steady drive; a command was sent 2 periods before
SHARES = (1, -1, 0.5)  # of the speed that each wheel gets, turned round so that every wheel gets each


def command(wheel, units):
    """Return a command that gives `wheel` that speed, and the others theirs."""
    shares = [SHARES[(index - wheel) % 3] for index in range(3)]
    return ":".join([f"{share * units:.2f}" for share in shares])


def lead_on(robot, wheel, units, periods=80, until_off=True):
    """Command at 20 Hz; return (seconds until the wheel is off for a fault, or None, its fastest speed [units])."""
    fastest = 0
    for period in range(periods):
        if period % 3 == 0:
            robot.send(command(wheel, units))
        robot.board.sent = b""  # the emulated board's heap is small
        robot.tick(1)
        fastest = max(fastest, abs(robot.board.motors[wheel].speed) / MICRO)
        if until_off and robot.newest()[3][wheel] not in (0, OVERLOAD):
            assert robot.efforts()[wheel] == 0
            return (period + 1) / config.RATE, fastest
    return None, fastest


def test_a_broken_encoder_stops_all_within_a_second_and_never_runs_away():
    slowest, highest = 0, 0
    for kind, fault in ((UNPLUGGED, NO_COUNTS), (REVERSED, WRONG_WAY), (HALF, NO_COUNTS)):
        for units in (5, 7.5, 10, 20, 50, 80, 120, 150, -5, -150) if FAST else (5, 20, -150):
            for wheel in range(3):
                for driving in (False, True):
                    case = kind, units, wheel, driving
                    robot = Robot()
                    if driving:
                        lead_on(robot, wheel, units, STEADY, until_off=False)
                    robot.board.motors[wheel].encoder = kind
                    seconds, fastest = lead_on(robot, wheel, units)
                    assert seconds is not None, case
                    assert seconds <= 0.95, (case, seconds)
                    assert fastest <= abs(units) + CREEP, (case, fastest)
                    flags, _, _, faults = robot.newest()[:4]
                    assert faults == [fault if index == wheel else 0 for index in range(3)], (case, faults)
                    assert flags == WAITS_FOR_ZERO
                    slowest = max(slowest, seconds)
                    highest = max(highest, fastest / abs(units) if abs(units) >= 20 else 0)
    print(f"off within {slowest:.2f} s, from 20 units on at most {highest:.2f} times the commanded speed")


def test_slower_than_5_units_a_wheel_without_encoder_creeps_and_stops():
    for kind in (UNPLUGGED, REVERSED):
        for units in (0.5, 1, 2, 3, 4):
            robot = Robot()
            robot.board.motors[1].encoder = kind
            seconds, fastest = lead_on(robot, 1, units)
            assert seconds <= 1, (kind, units, seconds)
            assert fastest <= units + CREEP, (kind, units, fastest)


def test_a_slow_wheel_beside_fast_ones_is_found_whatever_its_encoder_misses():
    for kind, most in ((UNPLUGGED, 1.2), (HALF, 8)):
        for line in ("0.30:-50.00:25.00", "0.50:-0.50:0.25"):
            robot, seconds = Robot(), 0
            robot.board.motors[0].encoder = kind
            while seconds == 0 or robot.newest()[3][0] != NO_COUNTS:
                if round(seconds * 50) % 3 == 0:
                    robot.send(line)
                robot.board.sent = b""
                robot.tick(1)
                seconds += 0.02
                assert seconds <= most, (kind, line)
                assert abs(robot.board.motors[0].speed) / MICRO <= CREEP + 1, (kind, line)


def test_a_motor_without_current_is_named():
    robot = Robot()
    robot.board.motors[2].powered = False
    seconds, _ = lead_on(robot, 2, 50)
    assert seconds <= 0.5
    assert robot.newest()[3] == [0, 0, NO_COUNTS]


def test_silence_with_a_reversed_encoder_accelerates_nothing():
    for units in (5, 48, 150, -48):
        for reversed_at in range(TIMEOUT - 3, TIMEOUT + 10):
            robot = Robot()
            lead_on(robot, 0, units, STEADY, until_off=False)
            robot.send(command(0, units))  # the last one before the silence
            before = 0
            for period in range(TIMEOUT + BRAKING + 5):
                if period == reversed_at:
                    robot.board.motors[0].encoder = REVERSED
                robot.tick(1)
                speed = abs(robot.board.motors[0].speed) / MICRO
                # Reversed while it is still driven it may be a little faster; the brake accelerates nothing.
                bound = abs(units) + 0.5 if period > TIMEOUT else abs(units) + CREEP
                assert speed <= max(bound, before), (units, reversed_at, period, speed)
                before = speed
            assert robot.efforts() == [0, 0, 0]


def test_zeros_stop_a_wheel_with_a_reversed_encoder():
    """Held by such counts it is turned on: after a tap, to and fro."""
    for settings, motor, units in (
        (Config(), {"driver": BRAKE}, 34),
        (profile(pin_profile_vnh), {"driver": DIODE}, 34),
        (profile(pin_profile_robotont21), {"driver": COAST, "frequency": 100, "battery": 140}, 20),
    ):
        for tau in (60, 300):
            for ways in ((1,), (1, -1), (-1, 1, -1)):
                robot = Robot(settings=settings, tau=tau, **motor)
                wheel = robot.board.motors[0]
                wheel.encoder = REVERSED
                for way in ways:
                    lead_on(robot, 0, way * units, 15, until_off=False)
                for period in range(300):
                    if period % 3 == 0:
                        robot.send("0:0:0")
                    robot.board.sent = b""
                    robot.tick(1)
                    if period == 150:
                        turned = wheel.turned
                assert abs(wheel.turned - turned) <= 3, (settings.PROFILE, tau, ways, wheel.turned - turned)


def test_behind_a_drive_too_slow_to_prove_anything_a_slope_rolls_no_wheel():
    robot = Robot(settings=Config(MASS=3576, INERTIA=429000, RUBBING=76), tau=300, load=30)
    robot.tick(100, "1.5:1.5:1.5")
    turned = [motor.turned for motor in robot.board.motors]
    robot.tick(200, "0:0:0")
    rolled = max([abs(motor.turned - before) for motor, before in zip(robot.board.motors, turned)])
    assert rolled < 100, rolled


def test_a_hand_that_rolls_a_reversed_wheel_does_not_start_it():
    """It looks like a slope, and is tried to be braked: that drives it on, and is given up."""
    for settings, motor in (
        (Config(), {"driver": BRAKE}),
        (profile(pin_profile_vnh), {"driver": DIODE}),
        (profile(pin_profile_robotont21), {"driver": COAST, "frequency": 100, "battery": 140}),
    ):
        for tau in (60, 300):
            for hand in (20, 50, 80):
                robot = Robot(settings=settings, tau=tau, **motor)
                wheel = robot.board.motors[0]
                wheel.encoder = REVERSED
                robot.tick(20, "0:0:0")
                for period in range(40):
                    for each in robot.board.motors:
                        each.speed = hand * MICRO
                    robot.tick(1, "0:0:0" if period % 10 == 0 else None)
                robot.board.sent = b""
                robot.tick(250, "0:0:0")
                turned = wheel.turned
                robot.tick(50, "0:0:0")
                assert abs(wheel.turned - turned) <= 3, (settings.PROFILE, tau, hand, wheel.turned - turned)


def test_a_reversed_wheel_that_seems_to_follow_does_not_run_on_behind_a_shove():
    """Driven to and fro it turns as its effort for a moment. Held by its counts it then runs at a steady speed."""
    for ways in (((34, 8), (-34, 12)), ((34, 12), (-34, 15)), ((20, 20), (-20, 6))):
        robot = Robot(settings=Config(MASS=3576, INERTIA=429000, RUBBING=76), tau=300)
        wheel = robot.board.motors[0]
        wheel.encoder = REVERSED
        robot.tick(10, "0:0:0")
        for units, periods in ways:
            for period in range(periods):
                robot.tick(1, f"{units}:{units}:{units}" if period % 5 == 0 else None)
        robot.tick(25, "0:0:0")
        for period in range(5):
            for each in robot.board.motors:
                each.speed = 80 * MICRO
            robot.tick(1, "0:0:0" if period == 0 else None)
        robot.board.sent = b""
        robot.tick(150, "0:0:0")
        turned = wheel.turned
        robot.tick(50, "0:0:0")
        assert abs(wheel.turned - turned) <= 3, (ways, wheel.turned - turned)


def test_zeros_stop_who_rolls_down_a_slope_already():
    """load: 25 units are 5 degrees, 31 are 8. It was let roll, restarted there, or pushed back as zeros came."""
    for settings, motor, most, loads in (
        (Config(), {"driver": BRAKE}, 2600, (18, 25, 31)),
        (profile(pin_profile_vnh), {"driver": DIODE}, 2600, (10, 25)),
        (profile(pin_profile_robotont21), {"driver": COAST, "frequency": 100, "battery": 140}, 2400, (10, 25)),
    ):
        settings.MASS, settings.INERTIA, settings.RUBBING = 3576, 429000, 76
        for load in loads:
            for pushed in (None, 0, 4):
                robot = Robot(settings=settings, tau=300, load=load, **motor)
                robot.tick(25 if pushed is None else 60, None if pushed is None else "12:12:12")
                if pushed == 0 and motor["driver"] != COAST:
                    robot.tick(150)
                for _ in range(pushed or 0):
                    for wheel in robot.board.motors:
                        wheel.speed = -10 * MICRO
                    robot.tick(1, "12:12:12")
                start = [wheel.turned for wheel in robot.board.motors]
                robot.tick(200, "0:0:0")
                end = [wheel.turned for wheel in robot.board.motors]
                robot.tick(100, "0:0:0")
                case = settings.PROFILE, load, pushed
                for wheel, began, ended in zip(robot.board.motors, start, end):
                    assert abs(ended - began) <= most, (case, ended - began)
                    assert abs(wheel.turned - ended) <= 2, (case, wheel.turned - ended)


def test_the_brake_obeys_the_current_limit():
    for units in (20, 60, 150, -150):
        robot = Robot()
        lead_on(robot, 0, units, until_off=False)
        currents = []
        for _ in range(TIMEOUT + BRAKING):
            robot.tick(1)
            currents.append(abs(robot.board.motors[0].current()))
        # The speed falls within a period by up to a third, and the effort is for the period's beginning.
        assert max(currents) <= config.MAX_TORQUE * 1.1, (units, max(currents))
        assert robot.newest()[0] == TIMED_OUT
        assert abs(robot.board.motors[0].speed) < 2 * MICRO


def test_a_blocked_wheel_gets_no_current_for_long():
    robot = Robot()
    lead_on(robot, 1, 100, until_off=False)
    robot.board.motors[1].blocked = True
    robot.board.motors[1].speed = 0
    currents = []
    for _ in range(150):
        robot.tick(1, command(1, 100))
        currents.append(abs(robot.board.motors[1].current()))
    assert max(currents) <= config.MAX_TORQUE * 1.6  # one period with the effort from before
    assert robot.newest()[3] == [0, NO_COUNTS, 0]
    assert sum(currents[100:]) == 0


def test_any_encoder_drives_as_commanded_and_stops_whatever_multiple_it_counts():
    """More than the motors can make is a fault; as told, it is no fault."""
    told = 0
    for edges in (16, 64, 1000):
        for times in (1, 2, 4, 8, 16):
            for units in (20, 60, 120):
                last = "0:0:0" if units != 60 else None
                robot = Robot(settings=Config(EDGES=edges))
                for motor in robot.board.motors:
                    motor.times, motor.part = edges * times, 64
                for _ in range(80):
                    robot.board.sent = b""
                    line = ":".join([f"{share * units * edges / 64:.2f}" for share in (1, -1, 0.5)])
                    robot.tick(1, line)
                    assert abs(robot.board.motors[0].speed) < 1.1 * units * MICRO, (edges, times, units)
                case = edges, times, units, robot.board.motors[0].speed / MICRO
                if times == 1:
                    assert abs(case[-1] - units) < 0.1 * units, case
                    assert robot.newest()[3] == [0, 0, 0], case
                told += TOO_MANY in robot.newest()[3]
                robot.tick(50 if last else TIMEOUT + 26, last)
                for motor in robot.board.motors:
                    assert abs(motor.speed) < MICRO, (case, last, motor.speed / MICRO)
    assert told > 0, told


class Jammed:
    """A wheel that something slows, whatever the effort."""

    def __init__(self, settings=config):
        self.pid = Pid(settings, Numbers(settings))
        self.battery, self.most = settings.BATTERY, Numbers(settings).max_heat

    def run(self, periods, units=100, edges=60):
        """Return the torque of every period [effort at 12 V]."""
        torques = []
        for _ in range(periods):
            with Locked():
                effort = self.pid.step(units * 256, edges, 1, 0)
            torques.append(effort * self.battery // 12000 - 4915 * edges // 256)
        return torques


def test_a_wheel_that_is_held_back_keeps_its_continuous_current_only():
    assert config.CONTINUOUS_TORQUE <= 1000, "1.25 A, the motor's continuous rating"
    means = []
    for battery in (12000, 14800, 16800):
        wheel = Jammed(Config(BATTERY=battery))
        torques = wheel.run(1, edges=0) + wheel.run(399)
        assert max(torques[:21]) > 0.95 * config.MAX_TORQUE, battery
        assert max(torques) <= config.MAX_TORQUE, battery
        assert wheel.pid.n[HEAT] == wheel.most
        assert wheel.pid.fault == 0
        means.append(sum(torques[150:]) / 250)  # after 3 s
        assert max(wheel.run(20, edges=0)[1:]) <= config.CONTINUOUS_TORQUE, "nor more when it jams altogether"
        wheel.run(100, 0, 0)  # cools
        assert wheel.pid.n[HEAT] < wheel.most
    assert max(means) <= config.CONTINUOUS_TORQUE, means
    return f"mean torque after 3 s: {means[0]:.0f} of 4000"


def test_an_overload_is_in_the_status_and_goes_away():
    robot = Robot()
    robot.controller._pids[2].n[HEAT] = 1 << 29
    robot.controller._counter = 7  # it is told in every eighth packet
    robot.tick(1, "0:0:0")
    assert robot.newest()[3] == [0, 0, OVERLOAD]
    robot.tick(60, "0:0:0")
    assert robot.newest()[3] == [0, 0, 0]


def test_missed_ticks_cost_no_distance():
    for units in (12.34, 20.5, 50):
        for pattern in ((1, 4), (2, 3, 1), (1, 1, 1, 1, 1, 1, 6)):
            robot = Robot()
            lead_on(robot, 0, units, until_off=False)
            motor, periods = robot.board.motors[0], 0
            before, ((_, counter, _),) = motor.counted, robot.packets()
            for step in range(240):
                robot.board.sent = b""  # the emulated board's heap is small
                robot.board.skip = pattern[step % len(pattern)]
                periods += robot.board.skip
                robot.tick(1, command(0, units))
            lost = round(units * 256) / 256 * periods - (motor.counted - before)
            assert abs(lost) <= 5, (units, pattern, lost)
            assert robot.newest()[1] == periods - 240 & 0xFF, "and they are counted"
            assert robot.packets()[0][1] == counter + periods & 0xFF, "and show as gaps"


def limp(robot, periods, body=None):
    """Let time pass while two ticks of three are missed; a command at every third."""
    for _ in range(0, periods, 3):
        robot.board.skip = 3
        robot.tick(1, body)


def test_missed_ticks_prolong_no_time():
    robot = Robot()
    lead_on(robot, 0, 50, until_off=False)
    robot.tick(1, command(0, 50))
    limp(robot, TIMEOUT)
    assert robot.newest()[0] == TIMED_OUT
    assert robot.efforts()[0] < 0
    limp(robot, BRAKING)
    assert robot.controller._undriven >= BRAKING
    robot.board.faults[1] = True
    robot.tick(1)
    robot.board.faults[1] = False
    limp(robot, FAULT_HOLD + 2, "0:0:0")
    assert robot.newest()[0] == 0
    lead_on(robot, 0, 6, until_off=False)
    robot.board.motors[0].encoder = UNPLUGGED
    limp(robot, 45, command(0, 6))
    assert robot.newest()[3] == [NO_COUNTS, 0, 0]
    pid = Pid(config, Numbers(config))
    for _ in range(0, config.OVERLOAD_TIME + 9, 3):
        pid.step(100 * 256, 12, 3, 0)
    assert pid.n[HEAT] == Numbers(config).max_heat


def test_missed_ticks_change_nothing_in_the_brake():
    efforts = []
    for periods in (1, 2, 3):
        pid = Pid(config, Numbers(config))
        pid.step(60 * 256, 60, 1, 0)
        with Locked():
            effort = pid.stop(60 * periods, periods, False, 19660)
        efforts.append(effort)
    assert efforts == [efforts[0]] * 3, efforts
    assert efforts[0] < 0


def test_a_low_battery_is_reported_after_a_second():
    robot = Robot(settings=Config(BATTERY_LOW=10500), battery_mv=12000)
    for voltage, periods, flags in ((12000, 60, 0), (10000, 40, 0), (10000, 20, BATTERY_IS_LOW), (12000, 1, 0)):
        robot.board.battery_mv = voltage
        robot.tick(periods, "0:0:0")
        assert robot.newest()[0] == flags, "a dip under load is no empty battery"


def test_a_fuller_battery_gets_less_duty():
    for battery in (12000, 14800, 16800):
        robot = Robot(settings=Config(BATTERY=battery), battery=battery // 120)
        lead_on(robot, 0, 50, 100, until_off=False)
        pid = robot.controller._pids[0]
        assert abs(robot.board.motors[0].speed / MICRO - 50) < 1.5
        assert abs(pid.n[INTEGRAL] * Numbers(config).i >> 16) < 60, "the feed-forward fits by itself"
