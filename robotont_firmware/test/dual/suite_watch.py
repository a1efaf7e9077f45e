"""The fault rules one by one, at their edges: FaultWatch.look told what a wheel did, period by period."""

from dual_tools import Config

from robotont_firmware.fault_watch import NO_COUNTS, NO_FAULT, WRONG_WAY, FaultWatch

CONFIG = Config()
GAIN = CONFIG.SPEED_GAIN
FAR = 1 << 20


def free(units):
    """The effort that turns a free wheel at a speed."""
    return CONFIG.STATIC + (GAIN * int(units * 256) >> 16)


class Wheel:
    """Is to turn at `setpoint` units, and the fastest of all at `fastest`."""

    def __init__(self, setpoint, fastest=0, settled=True, limited=False):
        self.watch = FaultWatch(CONFIG, GAIN)
        self.watch.reset()
        self.setpoint, self.fastest = setpoint * 256, max(abs(setpoint), fastest) * 256
        self.settled, self.limited = settled, limited

    def look(self, ahead, push, periods=1):
        """Judge a period in which it made `ahead` edges with an effort `push`."""
        wished = self.setpoint
        return self.watch.look(
            self.setpoint, wished, int(ahead * 256), push, self.limited, periods, self.settled, self.fastest
        )

    def fault(self, ahead, push, periods=100, first=()):
        """Return (fault, after so many periods) or (NO_FAULT, periods)."""
        for made in first:
            self.look(made, 0)
        for period in range(periods):
            found = self.look(ahead, push)
            if found != NO_FAULT:
                return found, period + 1
        return NO_FAULT, periods

    def uneven(self, mean, by, periods=200):
        """Return after how many periods that swing around `mean` edges it is at fault, or None."""
        for period in range(periods):
            if self.look(mean + (by if period & 1 else -by), 0) != NO_FAULT:
                return period + 1
        return None

    def bounds(self, ahead=0):
        """Return the (least, most) effort that it may have once it makes `ahead` edges a period."""
        for _ in range(30):
            self.look(ahead, 0)
        return self.watch.bound(-FAR), self.watch.bound(FAR)


def test_a_wheel_may_have_what_turns_a_free_one_and_its_load():
    least = -CONFIG.STATIC - CONFIG.MAX_LOAD
    for setpoint, ahead, fastest, most in (
        (50, 0, 0, free(50 * 294 / 256)),  # 1.15 times its set-point
        (50, 50, 0, free(50) + CONFIG.MAX_LOAD),
        (10, 0, 0, CONFIG.STATIC + CONFIG.MAX_LOAD),
        (10, 0, 90, CONFIG.STATIC + CONFIG.MAX_LOAD + free(20) - CONFIG.STATIC),  # a quarter of the difference
        (10, -30, 0, CONFIG.STATIC + CONFIG.MAX_LOAD),  # the wrong way is no speed
    ):
        for sign in (1, -1):
            found = Wheel(sign * setpoint, fastest).bounds(sign * ahead)
            assert found == ((least, most) if sign > 0 else (-most, -least)), (setpoint, ahead, fastest, found)


def test_the_bound_follows_the_lesser_of_what_it_counts_now_and_lately():
    for ahead, periods, most in (
        (100, 1, free(62.5) + CONFIG.MAX_LOAD),  # a quarter of the way
        (0, 1, free(10 * 294 / 256) if free(11) > 560 else CONFIG.STATIC + CONFIG.MAX_LOAD),
        (100, 2, free(75) + CONFIG.MAX_LOAD),
        (100, 4, free(100) + CONFIG.MAX_LOAD),
    ):
        wheel = Wheel(10)
        wheel.bounds(50)
        wheel.look(ahead, 0, periods)
        assert wheel.watch.bound(FAR) == most, (ahead, periods)
    for periods in (6, 8):
        wheel = Wheel(10)
        wheel.bounds(50)
        wheel.look(100, 0, periods)  # no more than all of the way
        wheel.look(150, 0)
        assert wheel.watch.bound(FAR) == free(112.5) + CONFIG.MAX_LOAD
        assert wheel.watch.bound(100) == 100, "within its bounds"
    wheel.fastest = 0  # not told
    wheel.look(112.5, 0)
    assert wheel.watch.bound(FAR) == free(112.5) + CONFIG.MAX_LOAD


def test_the_integral_of_a_bounded_wheel_may_hold_the_load_and_no_more():
    assert CONFIG.BLOCKED_INTEGRAL == CONFIG.MAX_LOAD


def test_the_direction_is_that_of_the_last_drive():
    wheel = Wheel(0)
    wheel.look(0, 0)
    assert wheel.watch.direction() == 0
    wheel.setpoint = wheel.fastest = 50 * 256
    for _ in range(30):
        wheel.look(50, 1000)
    assert wheel.watch.direction() == 1
    wheel.setpoint, wheel.fastest = -10 * 256, 10 * 256
    assert wheel.fault(45, -4000) == (WRONG_WAY, CONFIG.BLIND_TIME), "what it counted is now the wrong way"
    assert wheel.watch.direction() == -1
    wheel.watch.reset()
    assert wheel.watch.direction() == 0


def test_a_reset_forgets():
    wheel = Wheel(50)
    wheel.fault(-20, 4000, CONFIG.BLIND_TIME - 1)
    wheel.watch.reset()
    assert wheel.watch.bound(FAR) == FAR
    assert wheel.fault(0, 4000) == (NO_COUNTS, CONFIG.BLIND_TIME)


def test_unbounded_while_the_robot_changes_its_motion_unless_it_is_slow_and_gets_no_faster():
    assert Wheel(50, settled=False).bounds(30) == (-FAR, FAR), "60 % are not slow"
    assert Wheel(50, settled=False).bounds(20)[1] < FAR, "40 % are"
    wheel = Wheel(50, settled=False)
    wheel.bounds(10)
    for step, bounded in ((2, True), (3, False)):  # _RISE: 2.5 units
        wheel.look(10, 0)
        wheel.bounds(10)
        wheel.look(10 + step, 0)
        assert (wheel.watch.bound(FAR) < FAR) == bounded, step


def test_the_time_at_the_bound():
    for settled, periods in ((True, CONFIG.BLIND_TIME), (False, 24)):
        assert Wheel(50, settled=settled).fault(0, 4000) == (NO_COUNTS, periods)
        assert Wheel(-50, settled=settled).fault(0, -4000) == (NO_COUNTS, periods)
    assert Wheel(50).watch.look(12800, 12800, 0, 4000, False, 14, True, 12800) == NO_COUNTS, "missed ticks count"


def test_what_is_no_fault():
    bound = Wheel(50).bounds()[1]
    for ahead, push, settled, limited, why in (
        (0, bound - (bound >> 3) - 1, True, False, "less than seven eighths of the bound"),
        (50, 4000, True, False, "as fast as it should be"),
        (30, 4000, False, False, "60 % while the robot changes its motion"),
        (-20, -100, False, True, "dragged backward while it brakes"),
        (60, 4000, True, False, "faster than it should be, as it is driven"),
        (45, free(45) + CONFIG.MAX_LOAD * 5 // 8 - 40, True, True, "90 % are not slow, and it is not at the bound"),
        (60, -4000, False, False, "held back while the robot changes its motion"),
    ):
        assert Wheel(50, settled=settled, limited=limited).fault(ahead, push)[0] == NO_FAULT, why
    wheel = Wheel(50)
    wheel.bounds(40)
    assert wheel.fault(40, -4000)[0] == NO_FAULT, "slower than it should be while it is held back"
    assert wheel.fault(0, 4000, first=[0] * 9)[1] == CONFIG.BLIND_TIME, "and that is not held against it"
    assert Wheel(50).fault(0, bound - (bound >> 3)) == (NO_COUNTS, CONFIG.BLIND_TIME)
    assert Wheel(50, limited=True).fault(0, CONFIG.STATIC + CONFIG.MAX_LOAD)[0] == NO_COUNTS, "slow, and limited"
    assert Wheel(50, limited=True).fault(0, CONFIG.STATIC + CONFIG.MAX_LOAD // 2)[0] == NO_FAULT, "it hardly works"
    assert Wheel(50, limited=True).fault(30, free(30) + CONFIG.MAX_LOAD * 5 // 8)[0] == NO_COUNTS, "60 % are slow"
    assert Wheel(50, limited=True).fault(-20, 100)[0] == WRONG_WAY, "the wrong way it need not work much"


def test_how_much_it_has_to_owe():
    for setpoint, fastest, ahead, periods in ((5, 5, 4, 16), (50, 100, 40, 20), (50, 50, 45, 20), (50, 50, 0, 14)):
        wheel = Wheel(setpoint, fastest)
        wheel.bounds(ahead)
        assert wheel.fault(ahead, 4000) == (NO_COUNTS, periods), (setpoint, fastest)
    wheel = Wheel(10)
    wheel.bounds(11)
    found, periods = wheel.fault(11, -4000)
    assert found == WRONG_WAY
    assert periods in (20, 21), "one edge a period too many, or a little less, for it is smoothed"


def test_the_wrong_way_takes_16_edges():
    assert Wheel(50).fault(-5, 4000)[0] == WRONG_WAY, "5 a period are 70 in the time"
    assert Wheel(50).fault(-1, 4000)[0] == NO_COUNTS, "a tremor"
    wheel = Wheel(50)
    wheel.bounds(40)
    wheel.fault(40, 4000, 8)
    assert wheel.fault(-30, 4000)[0] == WRONG_WAY, "edges ahead count as far as two periods of the fastest"
    wheel = Wheel(50)
    for edges, push in ((-60, 4000), (-60, 4000), (-60, 4000), (50, 0), (50, 0), (50, 0)):
        wheel.look(edges, push)
    assert wheel.fault(12, 4000)[0] == NO_COUNTS, "nor do more than that the wrong way"
    wheel = Wheel(10)
    found = [wheel.look(30, -CONFIG.STATIC - CONFIG.MAX_LOAD) for _ in range(40)]
    assert WRONG_WAY in found, "faster than it should be, although it is held back"
    wheel = Wheel(10)
    assert {wheel.look(30, -(CONFIG.STATIC + CONFIG.MAX_LOAD) * 6 // 8) for _ in range(40)} == {NO_FAULT}


def test_a_wheel_that_gets_faster_follows():
    for settled, step in ((True, 8), (False, 2.5)):  # _CLEAR_RISE, _RISE: more than noise
        for rise, follows in ((step + 0.1, True), (step - 0.5, False)):
            wheel = Wheel(100, settled=settled)
            counted = 0.0
            for _ in range(10):
                ahead = counted + rise
                assert wheel.look(ahead, 4000) == NO_FAULT
                counted += (ahead - counted) / 4
            blind = wheel.fault(counted, 4000)[1]
            assert (blind >= (CONFIG.BLIND_TIME if settled else 24)) == follows, (settled, rise, blind)


def test_counts_that_bend_more_than_a_healthy_wheels_are_a_fault():
    for mean, by, found in (
        (10, 2, 12),  # bent by 8 edges each period, of which 4 count
        (-10, 2, 12),
        (10, 1, 77),  # 4 edges, above 2.5 and the speed's 3/32
        (10, 0.8, None),
        (100, 2.2, 140),  # above 2.5 edges and 6
        (100, 2.0, None),
    ):
        wheel = Wheel(mean)
        wheel.bounds(mean)
        assert wheel.uneven(mean, by) == found, (mean, by, wheel.uneven(mean, by))
    assert Wheel(10, settled=False).uneven(10, 8) is None
    wheel = Wheel(10)
    wheel.bounds(-10)
    assert wheel.uneven(-10, 0.7) == 140, "the wrong way allows no less than standing"
    wheel = Wheel(10)
    wheel.bounds(10)
    wheel.setpoint = wheel.fastest = 0
    assert wheel.uneven(0, 1) is None, "it stands, where an edge comes and goes"


def test_unevenness_is_worked_off_by_even_counts_and_forgotten_by_a_reset():
    for even, found in ((0, 2), (8, 9), (40, 12)):
        wheel = Wheel(10)
        wheel.bounds(10)
        assert wheel.uneven(10, 2, 10) is None
        for _ in range(even):
            wheel.look(10, 0)
        assert wheel.uneven(10, 2) == found, (even, found)
    wheel.watch.reset()
    assert wheel.uneven(10, 2) == 12
    wheel = Wheel(50)
    wheel.bounds(50)
    for edges in (0, 0, 0, 100, 0, 60, 50):  # a knock
        assert wheel.look(edges, 0) == NO_FAULT


def test_time_at_the_bound_is_worked_off_by_twice_the_edges_that_it_makes():
    """It owes two periods of the fastest at most; noise of a period does not pardon that, three of turning do."""
    full = CONFIG.BLIND_TIME
    for first, edges, periods, left in ((0, 50, 2, 2), (0, 50, 3, full), (0, 0, 9, 1), (-5, 50, 4, full)):
        wheel = Wheel(50)
        assert wheel.fault(first, 4000, CONFIG.BLIND_TIME - 1)[0] == NO_FAULT
        for _ in range(periods):
            assert wheel.look(edges, 0) == NO_FAULT
        found, after = wheel.fault(0, 4000)
        assert found == NO_COUNTS, "edges the wrong way are pardoned, too"
        assert after == left, (first, edges, after)
    wheel = Wheel(50)
    wheel.fault(0, 4000, full - 1)
    for edges in (-20,) * 8 + (50,) * 5:
        wheel.look(edges, 0)
    assert wheel.fault(0, 4000)[1] == full, "edges the wrong way are not owed while it is not at the bound"
    wheel = Wheel(50)
    wheel.fault(0, 4000, full - 1)
    wheel.bounds(45)
    assert wheel.fault(45, 4000) == (NO_COUNTS, 20), "as if nothing had been"
