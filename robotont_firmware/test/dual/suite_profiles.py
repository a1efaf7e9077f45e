"""Wrong profiles: each is refused with words before the watchdog is armed, or runs. None loops."""

import fake_hardware
from dual_tools import Config, checked, profile
from fake_hardware import ADC, UART, Timer, levels, log
from suite_fuzz import Random

fake_hardware.install()

from robotont_firmware import board, config, pin_profile_robotont21  # noqa: E402
from robotont_firmware.main_loop import Controller  # noqa: E402

PROFILES, PERIODS = 500, 150
LINES = [checked(body) for body in ("0:0:0", "999.999:-999.999:0.004", "3:-3:9.5", "0:0:0:0", "1:-2:3:150")]
LISTS = ("ENCODERS", "BACKWARD_ENCODERS", "PWM", "DIRECTIONS", "FAULTS")
NAMES = [name for name in sorted(dir(config)) if name[0].isupper() and name not in ("PROFILE", "DESCRIPTION")]
VALUES = (0, 1, -1, 2, 3, 4, 5, 6, 7, 8, 15, 50, 100, 300, 4000, 20000, 262208, (1 << 30) - 1, None, True, "", "PA0")


def replaced(entries, at, entry):
    entries = list(entries)
    entries[at] = entry
    return tuple(entries)


def spoil(random, settings):
    """Change one thing: the length or an entry of a list, or a number."""
    name = NAMES[random.below(len(NAMES))] if random.below(2) else LISTS[random.below(len(LISTS))]
    value, other = getattr(settings, name), VALUES[random.below(len(VALUES))]
    kind = random.below(4)
    if type(value) is tuple and value and kind < 3:
        at = random.below(len(value))
        if kind == 0:
            other = value[:-1] if at else value + value[:1]
        elif type(value[at]) is tuple and kind == 1:
            other = replaced(value, at, replaced(value[at], random.below(len(value[at])), other))
        else:
            other = replaced(value, at, other)
    elif type(value) is int and kind < 3:
        other = (value + 1, value - 1, value * 2, value // 2)[random.below(4)]
    setattr(settings, name, other)


def run(settings):
    """Return the words of the refusal, or "" after PERIODS periods."""
    fake_hardware.reset()
    ADC.value = 4095
    try:
        made = board.Board(settings)
        controller = Controller(made, settings, reset_cause="test")
        made.start(controller)
    except ValueError as error:
        assert not [line for line in log if line.startswith("watchdog")]
        return str(error)
    for period in range(PERIODS):
        log.clear()
        for timer in Timer.all.values():
            timer.count = period * 3571 & 0xFFFF
        for pin in settings.FAULTS:
            levels[pin] = period != 70
        UART.last.arrive(LINES[period // 7 % len(LINES)])
        made._tick(None)
        controller.step(made.wait_tick())
        made.feed()
        UART.last.outbox = b""
    made.stop()
    return ""


def test_500_random_profiles():
    random = Random(20181101)
    fake_hardware.strict[0] = False
    refused = 0
    for number in range(PROFILES):
        settings = profile(pin_profile_robotont21) if number % 2 else Config()
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
    assert 80 < refused < PROFILES - 80, refused
    return f"{refused} of {PROFILES} refused, the others ran {PERIODS} periods each"


def test_the_profiles_that_came_loose():
    """Each passed the check of older firmware, and looped for ever or counted nonsense."""
    for name, value in (
        ("FAULTS", config.FAULTS[:2]), ("FAULTS", None), ("ENCODERS", config.ENCODERS[:2]),
        ("PWM", config.PWM + config.PWM[:1]), ("DIRECTIONS", ()), ("BACKWARD_ENCODERS", (False, False)),
        ("TICK_TIMER", 3), ("TICK_TIMER", 8), ("WATCHDOG", 5), ("WATCHDOG", 40000), ("RATE", 100), ("BAUDRATE", 300),
        ("PWM_FREQUENCY", 0), ("DRIVER", "coast"),  # at 20 kHz
        ("MASS", 25000), ("INERTIA", 8000000),
    ):  # fmt: skip
        assert run(Config(**{name: value})), (name, value)
    assert run(Config(BATTERY_PIN="PC0", BATTERY_DIVIDER=262209))
    assert run(Config(BATTERY_PIN="PC0", BATTERY_DIVIDER=262144)) == ""
    assert run(Config(FAULTS=())) == ""
    assert run(Config()) == run(profile(pin_profile_robotont21)) == ""
