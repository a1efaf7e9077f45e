"""Wrong profiles: each is refused with words before the watchdog is armed, or runs with the heap locked. None loops."""

import sys

from dual_tools import Config, Locked, checked
from suite_fuzz import Random

PROFILES, PERIODS = 500, 150
LINES = [checked(body) for body in ("0:0:0", "999.999:-999.999:0.004", "3:-3:9.5", "0:0:0:0", "1:-2:3:150")]


class Chip:
    """`pyb` and `machine`, and every peripheral of them: allocates nothing once it was made."""

    IN, OUT_PP, AF_PP, PULL_NONE, PULL_UP, ENC_AB, PWM = range(7)
    PWRON_RESET, HARD_RESET, WDT_RESET, SOFT_RESET = range(4)
    ticks = 0
    armed = False
    line = None

    def __init__(self, *_, **__):
        pass

    def channel(self, *_, **__):
        return self

    def pulse_width(self, width):
        assert 0 <= width <= 0xFFFF

    def counter(self):
        return Chip.ticks * 3571 & 0xFFFF

    def value(self, _=None):
        return Chip.ticks % 97 != 0  # now and then a fault

    def read(self):
        return 4095

    def callback(self, _):
        pass

    def any(self):
        return len(LINES[Chip.ticks // 7 % len(LINES)])

    def readinto(self, buffer, size):
        line = LINES[Chip.ticks // 7 % len(LINES)]
        for at in range(size):
            buffer[at] = line[at]
        return size

    def write(self, _, __):
        pass

    def feed(self):
        pass


class Registers:
    """All the chip's registers are one."""

    def __getitem__(self, _):
        return 0

    def __setitem__(self, _, __):
        pass


class Pyb:
    Pin = Timer = UART = ADC = Chip

    @staticmethod
    def repl_uart(*_):
        pass

    @staticmethod
    def wfi():
        raise AssertionError("no tick")


class Machine:
    mem16 = mem32 = Registers()

    @staticmethod
    def WDT(timeout):
        Chip.armed = True
        return Chip()


sys.modules["pyb"], sys.modules["machine"] = Pyb, Machine

from robotont_firmware import board, config, wiring_robotont21  # noqa: E402
from robotont_firmware.main_loop import Controller  # noqa: E402

LISTS = ("ENCODERS", "BACKWARD_ENCODERS", "PWM", "DIRECTIONS", "FAULTS")
NAMES = [name for name in sorted(dir(config)) if name[0].isupper() and name not in ("PROFILE", "DESCRIPTION")]
VALUES = (0, 1, -1, 2, 3, 4, 5, 6, 7, 8, 15, 50, 100, 300, 4000, 20000, 262208, (1 << 30) - 1, None, True, "", "PA0")


def robotont21():
    names = [name for name in dir(wiring_robotont21) if name[0].isupper()]
    return {name: getattr(wiring_robotont21, name) for name in names}


def spoil(random, settings):
    """Change one thing: the length or an entry of a list, or a number."""
    name = NAMES[random.below(len(NAMES))] if random.below(2) else LISTS[random.below(len(LISTS))]
    value = getattr(settings, name)
    kind = random.below(4)
    if type(value) is tuple and value and kind < 3:
        entries = list(value)
        at = random.below(len(entries))
        if kind == 0:
            entries = entries[:-1] if random.below(2) else entries + entries[:1]
        elif type(entries[at]) is tuple and kind == 1:
            parts = list(entries[at])
            parts[random.below(len(parts))] = VALUES[random.below(len(VALUES))]
            entries[at] = tuple(parts)
        else:
            entries[random.below(len(entries))] = VALUES[random.below(len(VALUES))]
        value = tuple(entries)
    elif type(value) is int and kind < 3:
        value = (value + 1, value - 1, value * 2, value // 2)[random.below(4)]
    else:
        value = VALUES[random.below(len(VALUES))]
    setattr(settings, name, value)


def run(settings):
    """Return the words of the refusal, or "" after PERIODS periods."""
    Chip.ticks, Chip.armed = 0, False
    try:
        made = board.Board(settings)
        controller = Controller(made, settings, reset_cause="test")
        made.start()
    except ValueError as error:
        assert not Chip.armed
        return str(error)
    controller.start()
    with Locked():
        for _ in range(PERIODS):
            Chip.ticks += 1
            made._tick(None)
            controller.step(made.wait_tick())
            made.feed()
    made.stop()
    return ""


def test_500_random_profiles():
    random = Random(20181101)
    refused = ran = 0
    for number in range(PROFILES):
        settings = Config(**(robotont21() if number % 2 else {}))
        for _ in range(1 + random.below(2)):
            spoil(random, settings)
        try:
            words = run(settings)
        except Exception as error:
            raise AssertionError((number, repr(error))) from None
        if words:
            assert words.startswith("config."), words
            assert words.find(": found ") < words.find(", allowed: "), words
            refused += 1
        else:
            ran += 1
    assert min(refused, ran) > 80, (refused, ran)
    return f"{refused} refused, {ran} ran {PERIODS} periods each"


def test_the_profiles_that_came_loose():
    """Each passed the check of older firmware, and looped for ever or counted nonsense."""
    for name, value in (
        ("FAULTS", config.FAULTS[:2]),
        ("FAULTS", None),
        ("ENCODERS", config.ENCODERS[:2]),
        ("PWM", config.PWM + config.PWM[:1]),
        ("DIRECTIONS", ()),
        ("BACKWARD_ENCODERS", (False, False)),
        ("TICK_TIMER", 3),
        ("TICK_TIMER", 8),
        ("WATCHDOG", 5),
        ("WATCHDOG", 40000),
        ("RATE", 100),
        ("BAUDRATE", 300),
        ("DRIVER", "coast"),  # at 20 kHz
        ("PWM_FREQUENCY", 0),
    ):
        words = run(Config(**{name: value}))
        assert words, (name, value)
    assert run(Config(BATTERY_PIN="PC0", BATTERY_DIVIDER=262209))
    assert run(Config(BATTERY_PIN="PC0", BATTERY_DIVIDER=262144)) == ""
    assert run(Config(FAULTS=())) == ""
    assert run(Config()) == run(Config(**robotont21())) == ""
