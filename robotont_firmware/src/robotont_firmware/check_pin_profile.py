"""What a wiring profile may be: lists as long as the wheels, timers and pins used once, times that can be kept.

Whatever passes cannot raise in the loop, where an error would end in a reset after the other.
"""

from robotont_firmware import robot_numbers as bounds

DRIVERS = {  # kind: (least, most) [Hz] of the PWM
    "brake": (100, 40000),  # in the off phase current goes on: speed follows the duty
    "coast": (50, 200),  # all switches open: pulses shorter than the current's rise give no torque
}
_REPL_RING = 259  # [bytes] that fit into that of the REPL's own UART, which nothing enlarges
_COUNTERS = (1, 2, 3, 4, 5, 8)  # timers with an encoder mode
_TIMERS = (1, 2, 3, 4, 5, 6, 7, 8, 15, 16, 17)
_FULL_SCALE = 4095  # of the analogue input
_LOAD = 80  # [%] of a period that reading, calculating and sending may take


def check(config):
    """Raise ValueError, with what was found and what is allowed, for the first thing that cannot work."""
    bounds.check(config)
    wheels, number = config.WHEELS, bounds.check_number
    _list(config, "ENCODERS", wheels, (str, str, int, int))
    _list(config, "PWM", wheels, (str, int, int, int))
    _list(config, "DIRECTIONS", wheels, (str, str))
    _list(config, "BACKWARD_ENCODERS", wheels, bool)
    _list(config, "FAULTS", wheels, str, config.FAULTS != () and config.FAULTS != [])  # noqa: PLR1714

    encoders = [wiring[2] for wiring in config.ENCODERS]
    pulses = [(wiring[1], wiring[2]) for wiring in config.PWM]
    _require("ENCODERS", encoders, _unique(encoders) and all(timer in _COUNTERS for timer in encoders),
             f"a timer of {_COUNTERS} each")  # fmt: skip
    fit = [timer in _TIMERS and timer not in encoders and 1 <= channel <= 4 for timer, channel in pulses]
    _require("PWM", pulses, _unique(pulses) and all(fit), "a channel (1 to 4) of a timer without encoder each")
    free = [timer for timer in _TIMERS if timer not in encoders + [timer for timer, _ in pulses]]
    tick = config.TICK_TIMER
    _require("TICK_TIMER", tick, type(tick) is int and tick in free, "a timer of its own")

    pins = [pin for wiring in config.ENCODERS for pin in wiring[:2]] + [wiring[0] for wiring in config.PWM]
    pins += [pin for pair in config.DIRECTIONS for pin in pair] + list(config.FAULTS) + [config.SAFE_BUTTON]
    pins += [pin for pin in (config.LIGHT, config.BATTERY_PIN) if pin is not None]
    for pin in pins:
        _require("pins", pin, type(pin) is str and pins.count(pin) == 1, "a pin's name, used once")

    if config.BATTERY_PIN is not None:
        number(config, "BATTERY_DIVIDER", 1, bounds.LARGEST // _FULL_SCALE)
    number(config, "BATTERY_LOW", 0, config.BATTERY)
    kind = config.DRIVER
    _require("DRIVER", kind, type(kind) is str and kind in DRIVERS, "brake or coast")
    number(config, "PWM_FREQUENCY", *DRIVERS[kind], f" [Hz] with drivers that {kind}")
    _require("ENCODER_PULL_UPS", config.ENCODER_PULL_UPS, type(config.ENCODER_PULL_UPS) is bool, "True or False")

    # A period has to be long enough for its work, and the watchdog for some periods.
    number(config, "BAUDRATE", 9600, 1000000)
    room = bounds.line_bytes(config)
    _require("RATE", config.RATE, room <= _REPL_RING, f"a period of {_REPL_RING} bytes at most: or less BAUDRATE")
    period = 1000000 // config.RATE  # [us]
    work = 1500 + 1450 * wheels + (20 + 11 * wheels) * 10000000 // config.BAUDRATE
    _require("RATE", config.RATE, work * 100 <= period * _LOAD, f"a period of {work * 100 // _LOAD} us or more")
    number(config, "WATCHDOG", 3000 // config.RATE + 20, bounds.MAX_PERIODS * 1000 // config.RATE)


def _list(config, name, wheels, kinds, full=True):
    """Check a list with one entry, or tuple of entries, of the given types for every wheel."""
    value = getattr(config, name, None)
    fits = type(value) in (tuple, list) and len(value) == (wheels if full else 0)
    if fits and type(kinds) is tuple:
        for entry in value:
            fits = fits and type(entry) in (tuple, list) and [type(part) for part in entry] == list(kinds)
    elif fits:
        fits = all(type(entry) is kinds for entry in value)
    wanted = kinds if type(kinds) is tuple else (kinds,)
    _require(name, value, fits, "for each of {} wheels: {}".format(wheels, ", ".join([k.__name__ for k in wanted])))


def _unique(entries):
    return len(set(entries)) == len(entries)


def _require(name, value, fits, allowed):
    if not fits:
        raise ValueError(f"config.{name}: found {value!r}, allowed: {allowed}")
