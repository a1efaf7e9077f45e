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


def test_unbounded_while_the_robot_changes_its_motion_unless_it_is_slow_and_gets_no_faster():
    assert Wheel(50, settled=False).bounds(30)[1] == FAR, "60 % are not slow"
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
    ):
        assert Wheel(50, settled=settled, limited=limited).fault(ahead, push)[0] == NO_FAULT, why
    assert Wheel(50).fault(0, bound - (bound >> 3)) == (NO_COUNTS, CONFIG.BLIND_TIME)
    assert Wheel(50, limited=True).fault(0, CONFIG.STATIC + CONFIG.MAX_LOAD)[0] == NO_COUNTS, "slow, and limited"
    assert Wheel(50, limited=True).fault(0, CONFIG.STATIC + CONFIG.MAX_LOAD // 2)[0] == NO_FAULT, "it hardly works"


def test_the_wrong_way_takes_16_edges():
    assert Wheel(50).fault(-5, 4000)[0] == WRONG_WAY, "5 a period are 70 in the time"
    assert Wheel(50).fault(-1, 4000)[0] == NO_COUNTS, "a tremor"
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


def test_time_at_the_bound_is_worked_off_by_edges():
    """Noise of a period does not pardon what is owed; some periods of honest turning do."""
    for edges, periods in ((20, 1), (100, 12)):
        wheel = Wheel(100)
        assert wheel.fault(0, 4000, CONFIG.BLIND_TIME - 2)[0] == NO_FAULT
        for _ in range(periods):
            wheel.look(edges, 0)
        after = wheel.fault(0, 4000)[1]
        assert (after <= 8) == (periods == 1), (edges, after)
