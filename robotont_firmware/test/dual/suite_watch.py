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
        return self.watch.look(self.setpoint, self.setpoint, int(ahead * 256), push, self.limited, periods,
                               self.settled, self.fastest)  # fmt: skip

    def fault(self, ahead, push, periods=100):
        """Return (fault, after so many periods) or (NO_FAULT, periods)."""
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
    assert CONFIG.BLOCKED_INTEGRAL == CONFIG.MAX_LOAD, "the integral of a bounded wheel holds its load, and no more"
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
    for ahead, periods, then, lesser in (
        (100, 1, None, 62.5), (100, 2, None, 75), (100, 4, None, 100),  # a quarter of the way in each
        (100, 6, 150, 112.5), (100, 8, 150, 112.5),  # no more than all of the way
    ):  # fmt: skip
        wheel = Wheel(10)
        wheel.bounds(50)
        wheel.look(ahead, 0, periods)
        if then:
            wheel.look(then, 0)
        assert wheel.watch.bound(FAR) == free(lesser) + CONFIG.MAX_LOAD, (ahead, periods)
    assert wheel.watch.bound(100) == 100, "within its bounds"
    wheel.fastest = 0  # not told
    wheel.look(112.5, 0)
    assert wheel.watch.bound(FAR) == free(112.5) + CONFIG.MAX_LOAD
    wheel = Wheel(10)
    wheel.bounds(50)
    wheel.look(0, 0)
    assert wheel.watch.bound(FAR) == CONFIG.STATIC + CONFIG.MAX_LOAD


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


def test_faults_at_their_edges():
    """Each: edges and effort in so many periods before; then edges and effort, what is found, after how many."""
    full, bound = CONFIG.BLIND_TIME, Wheel(50).bounds()[1]
    load, held = CONFIG.STATIC + CONFIG.MAX_LOAD, free(45) + CONFIG.MAX_LOAD * 5 // 8
    for why, wheel, before, edges, push, fault, after in (
        ("at the bound", Wheel(50), (), 0, 4000, NO_COUNTS, full),
        ("backward", Wheel(-50), (), 0, -4000, NO_COUNTS, full),
        ("while the robot changes its motion", Wheel(50, settled=False), (), 0, 4000, NO_COUNTS, 24),
        ("seven eighths of the bound", Wheel(50), (), 0, bound - (bound >> 3), NO_COUNTS, full),
        ("less than that", Wheel(50), (), 0, bound - (bound >> 3) - 1, NO_FAULT, 100),
        ("as fast as it should be", Wheel(50), (), 50, 4000, NO_FAULT, 100),
        ("60 % while the robot changes its motion", Wheel(50, settled=False), (), 30, 4000, NO_FAULT, 100),
        ("dragged backward while it brakes", Wheel(50, limited=True), (), -20, -100, NO_FAULT, 100),
        ("faster than it should be, as it is driven", Wheel(50), (), 60, 4000, NO_FAULT, 100),
        ("faster, and held back, while it changes", Wheel(50, settled=False), (), 60, -4000, NO_FAULT, 100),
        ("slower, and held back", Wheel(50), [(40, 0, 30)], 40, -4000, NO_FAULT, 100),
        ("that is not held against it", Wheel(50), [(40, -4000, 100), (0, 0, 9)], 0, 4000, NO_COUNTS, full),
        ("90 % are not slow, and it is not at the bound", Wheel(50, limited=True), (), 45, held - 40, NO_FAULT, 100),
        ("slow, and limited", Wheel(50, limited=True), (), 0, load, NO_COUNTS, full),
        ("it hardly works", Wheel(50, limited=True), (), 0, load - CONFIG.MAX_LOAD // 2, NO_FAULT, 100),
        ("60 % are slow", Wheel(50, limited=True), (), 30, free(30) + CONFIG.MAX_LOAD * 5 // 8, NO_COUNTS, 19),
        ("the wrong way it need not work much", Wheel(50, limited=True), (), -20, 100, WRONG_WAY, full),
        ("it owes 16 edges", Wheel(5), [(4, 0, 30)], 4, 4000, NO_COUNTS, 16),
        ("two periods of the fastest", Wheel(50, 100), [(40, 0, 30)], 40, 4000, NO_COUNTS, 20),
        ("two periods of its own", Wheel(50), [(45, 0, 30)], 45, 4000, NO_COUNTS, 20),
        ("one edge a period too many", Wheel(10), [(11, 0, 30)], 11, -4000, WRONG_WAY, 21),
        ("70 edges the wrong way", Wheel(50), (), -5, 4000, WRONG_WAY, full),
        ("14 are a tremor", Wheel(50), (), -1, 4000, NO_COUNTS, full),
        ("edges ahead count as far as two periods", Wheel(50), [(40, 0, 30), (40, 4000, 8)], -30, 4000, WRONG_WAY, 6),
        ("nor do more the wrong way", Wheel(50), [(-60, 4000, 3), (50, 0, 3)], 12, 4000, NO_COUNTS, 11),
        ("faster although it is held back", Wheel(10), (), 30, -load, WRONG_WAY, 15),
        ("six eighths do not hold it back", Wheel(10), (), 30, -load * 6 // 8, NO_FAULT, 100),
        ("two periods of turning are noise", Wheel(50), [(0, 4000, full - 1), (50, 4000, 2)], 0, 4000, NO_COUNTS, 2),
        ("three are worked off", Wheel(50), [(0, 4000, full - 1), (50, 4000, 3)], 0, 4000, NO_COUNTS, full),
        ("time is not forgotten", Wheel(50), [(0, 4000, full - 1), (0, 0, 9)], 0, 4000, NO_COUNTS, 1),
        ("the wrong way is pardoned", Wheel(50), [(-5, 4000, full - 1), (50, 4000, 4)], 0, 4000, NO_COUNTS, full),
        ("nor owed", Wheel(50), [(0, 4000, full - 1), (-20, 0, 8), (50, 0, 5)], 0, 4000, NO_COUNTS, full),
        ("as if nothing had been", Wheel(50), [(0, 4000, full - 1), (45, 0, 30)], 45, 4000, NO_COUNTS, 20),
    ):
        for ahead, effort, periods in before:
            assert wheel.fault(ahead, effort, periods) == (NO_FAULT, periods), why
        found = wheel.fault(edges, push)
        assert found == (fault, after), (why, found)
    assert Wheel(50).look(0, 4000, full) == NO_COUNTS, "missed ticks count"


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
    for mean, wheel, by, found in (
        (10, Wheel(10), 2, 12),  # bent by 8 edges each period, of which 4 count
        (-10, Wheel(-10), 2, 12),
        (10, Wheel(10), 1, 77),  # 4 edges, above 2.5 and the speed's 3/32
        (10, Wheel(10), 0.8, None),
        (100, Wheel(100), 2.2, 140),  # above 2.5 edges and 6
        (100, Wheel(100), 2.0, None),
        (-10, Wheel(10), 0.7, 140),  # the wrong way allows no less than standing
        (10, Wheel(10, settled=False), 8, None),
    ):
        wheel.bounds(mean)
        assert wheel.uneven(mean, by) == found, (mean, by)
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
