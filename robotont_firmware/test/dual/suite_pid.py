"""One wheel's controller on a simulated motor: the bounds that docs/firmware.md promises."""

import gc
from array import array

from dual_tools import Config, Locked
from sim_motor import PERIOD, SimMotor

from robotont_firmware import config
from robotont_firmware.robot_numbers import Numbers
from robotont_firmware.wheel_speed import INTEGRAL, MEAN, REFERENCE, Pid

STEP, BRAKING = 2560, 1536  # [fine units] of 256 to an edge at 50 Hz
LATENCY = 3  # [ms]


class Bench:
    """A wheel under control; `speeds` holds the motor's true speed [units] after every period."""

    def __init__(self, settings=config, **motor):
        self.motor = SimMotor(**motor)
        self.pid, self.brake = Pid(settings, Numbers(settings)), Numbers(settings).brake
        self.setpoint = 0
        self.effort = 0
        self.last = 0
        gc.collect()  # the emulated board's heap is small
        self.speeds = array("f")
        self.counts = array("h")

    def run(self, units, periods):
        target = round(units * 256)
        for _ in range(periods):
            self.motor.run(LATENCY)
            self.motor.drive(self.effort)
            self.motor.run(PERIOD - LATENCY)
            total = self.motor.counted
            counts = total - self.last
            self.last = total
            with Locked():
                step = BRAKING if target == 0 else STEP
                self.setpoint += max(-step, min(step, target - self.setpoint))
                if self.setpoint == 0:
                    self.effort = self.pid.stop(counts, 1, True, self.brake)
                else:
                    self.effort = self.pid.step(self.setpoint, counts, 1, 0)
            self.speeds.append(self.motor.speed / 1000000)
            self.counts.append(counts)
        return self


def settling(speeds, target):
    outside = [at for at in range(len(speeds)) if abs(speeds[at] - target) > 0.05 * abs(target)]
    return ((outside[-1] + 1) if outside else 0) * PERIOD / 1000


def test_step_settles():
    worst = []
    for time, most, motors in ((0.3, 10, ({},)), (0.5, 12, (
            {"tau": 40}, {"tau": 80}, {"tau": 120}, {"tau": 160}, {"friction": 16}, {"friction": 4}, {"battery": 85},
            {"tau": 120, "friction": 16, "battery": 85}))):  # fmt: skip
        found = []
        for motor in motors:
            for sign in (-1, 1):
                speeds = [sign * speed for speed in Bench(**motor).run(sign * 50, 100).speeds]
                found.append((settling(speeds, 50), 100 * (max(speeds) - 50) / 50))
        settled, over = [max(numbers) for numbers in zip(*found)]
        assert settled <= time, (motors, settled)
        assert over <= most, (motors, over)
        worst.append(f"settles in {settled:.2f} s, overshoot {over:.1f} %")
    return "; with other loads and batteries: ".join(worst)


def test_mean_error_is_zero_over_any_second():
    worst = 0
    for motor in ({}, {"tau": 120}, {"friction": 12}, {"battery": 90}):
        for units in (0.5, -0.5, 0.75, 1.5, 3.7, 12.34, -18.9, 21.83, -50.01, 87.65, 120.5):
            counts = Bench(**motor).run(units, 300).counts
            for start in range(100, 250, 10):
                mean = sum(counts[start : start + 50]) / 50
                worst = max(worst, abs(mean - units))
                # Whole edges are counted: one edge more or less at either end is 0.04 units.
                assert abs(mean - units) <= 0.04 + 1 / 512, (motor, units, mean)
    return f"worst mean error {worst:.3f} units"


def test_long_run_loses_no_edge():
    bench = Bench().run(12.34, 100)
    start = bench.last
    bench.run(12.34, 1000)
    wished = round(12.34 * 256) / 256 * 1000
    assert abs(bench.last - start - wished) <= 2, bench.last - start


def test_no_windup_after_a_blocked_wheel_is_released():
    worst = 0, 0
    for units in (20, 50, 100):
        for motor in ({}, {"tau": 120}):
            bench = Bench(**motor).run(units, 50)
            bench.motor.blocked = True
            for _ in range(13):  # longer, and it is a fault
                bench.run(units, 1)
                assert bench.pid.fault == 0
            bench.motor.blocked = False
            bench.speeds = array("f")
            bench.run(units, 100)
            over, settled = max(bench.speeds) - units, settling(bench.speeds, units)
            assert over <= 12, (units, motor, over)
            assert settled <= 0.4, (units, motor, settled)
            worst = max(worst[0], over), max(worst[1], settled)
    return "worst: {:.1f} units above, settled in {:.2f} s".format(*worst)


def test_reversal_respects_both_limits():
    for most, settings in ((4000, config), (1000, Config(MAX_EFFORT=1000))):
        bench, largest = Bench(settings).run(150, 60), 0
        for _ in range(60):
            bench.run(-150, 1)
            largest = max(largest, abs(bench.effort))
            assert bench.effort == 0 or abs(bench.effort - 19.2 * bench.counts[-1]) <= config.MAX_TORQUE + 19.2
        assert largest <= most
    assert largest == 1000


def test_no_effort_of_a_stop_points_along_the_motion():
    """Whatever the encoder counts: out of a drive or at rest, braking or held, however many periods were missed."""
    for setpoint, before in ((0, 0), (120, 120), (-120, -110), (50, -50)):
        for periods, holds in ((1, True), (1, False), (3, True)):
            for size in (1, 2, 5, 11, 30, 60, 104, 105, 200, 313, 400, 3000, 32767):
                pid = Pid(config, Numbers(config))
                for _ in range(6):
                    pid.step(setpoint * 256, before, 1, 0)
                for counts in (size, size, size // 2, -size, size, -size // 3, -size):
                    with Locked():
                        effort = pid.stop(counts, periods, holds, 19660)
                    assert effort * counts <= 0, (setpoint, before, periods, holds, size, counts, effort)
                    assert effort != 0, "shorted at least"


def test_who_stands_is_held_against_what_moves_it_and_is_not_driven_back():
    """load: of a slope, backward. A slope of 5 degrees takes 25 units of a robot of 3.6 kg."""
    for load in (0, 12, 25, -25):
        for units in (0, 50):
            bench = Bench(Config(MASS=3576, INERTIA=429000), load=load, tau=300).run(units, 50).run(0, 50)
            start = bench.last
            bench.run(0, 150)
            assert abs(bench.last - start) <= 8, (load, units, bench.last - start)
            assert abs(bench.motor.speed) < 10000, (load, bench.motor.speed)
            assert bench.effort * load >= 0, (load, bench.effort)


def test_who_was_never_seen_to_follow_its_effort_is_only_shorted_against_a_push():
    """Its encoder may count backward: more would drive it on."""
    for counts in (30, -60):
        fresh, driven = Pid(config, Numbers(config)), Pid(config, Numbers(config))
        for speed in (40, 40, 40, 40):
            driven.step(40 * 256, speed, 1, 0)
        driven.stop(0, 1, True, 19660)
        assert abs(fresh.stop(counts, 1, True, 19660)) == 1
        assert abs(driven.stop(counts, 1, True, 19660)) > 100


def test_a_stopped_wheel_is_not_driven_back():
    for units in (100, -100):
        bench = Bench(tau=160).run(units, 50).run(0, 60)
        back = max(bench.counts) if units < 0 else -min(bench.counts)
        edges = sum([abs(count) for count in bench.counts if count * units < 0])
        assert back <= 2, back
        assert edges <= 4, edges


def test_the_reference_lags_forward_and_backward_alike():
    """Three wheels that lag one way, whichever way they turn, turn the robot."""
    pid, owed, way = Pid(config, Numbers(config)), 0, 0
    for period in range(4000):
        setpoint = abs(period % 400 - 200) * 13 - 1300  # up and down, 5 units at most
        pid.step(setpoint, pid.n[REFERENCE] >> 8, 1, 0)
        owed += setpoint - pid.n[REFERENCE] if period >= 400 else 0
        way += pid.n[REFERENCE] - pid.n[MEAN]
    assert abs(owed) < 3600 // 2, owed  # half of the least that a set-point has, per period
    assert abs(way) < 3600 // 2, way


def test_a_wheel_that_makes_its_way_owes_nothing():
    """The reference rises within the period whose edges are counted."""
    for units in (100, -100):
        pid, way = Pid(config, Numbers(config)), 0
        for _ in range(60):
            before = pid.n[REFERENCE]
            pid.step(units * 256, way >> 9, 1, 0)
            way = (way & 511) + before + pid.n[REFERENCE]
        assert abs(pid.n[INTEGRAL]) <= 256, pid.n[INTEGRAL]
