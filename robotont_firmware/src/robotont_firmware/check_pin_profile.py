"""What a wiring profile may be: lists as long as the wheels, timers and pins used once, times that can be kept.

Whatever passes cannot raise in the loop, where an error would end in a reset after the other.
"""

from robotont_firmware import robot_numbers as bounds

DRIVERS = {  # kind: (least, most) [Hz] of the PWM
    "brake": (100, 40000),  # in the off phase current goes on: speed follows the duty
    "coast": (50, 200),  # all switches open: pulses shorter than the current's rise give no torque
}
_REPL_RING = 259  # [bytes] that fit into that of the REPL's own UART, which nothing enlarges
COUNTERS = {  # timers with an encoder mode: their registers
    1: 0x40012C00, 2: 0x40000000, 3: 0x40000400, 4: 0x40000800, 5: 0x40000C00, 8: 0x40013400}
_TIMERS = (1, 2, 3, 4, 5, 6, 7, 8, 15, 16, 17)
FULL_SCALE = 4095  # of the analogue input, 3.3 V
_LOAD = 80  # [%] of a period that reading, calculating and sending may take


def check(config):
    """Raise ValueError, with what was found and what is allowed, for the first thing that cannot work."""
    bounds.check(config)
    wheels, number, require = config.WHEELS, bounds.check_number, bounds.require
    _list(config, "ENCODERS", wheels, str, str, int, int)
    _list(config, "PWM", wheels, str, int, int, int)
    _list(config, "DIRECTIONS", wheels, str, str)
    _list(config, "BACKWARD_ENCODERS", wheels, bool)
    _list(config, "FAULTS", wheels if config.FAULTS else 0, str)

    encoders = [wiring[2] for wiring in config.ENCODERS]
    pulses = [(wiring[1], wiring[2]) for wiring in config.PWM]
    require("ENCODERS", encoders, len(set(encoders) & set(COUNTERS)) == wheels, f"a timer of {sorted(COUNTERS)} each")
    fit = {(timer, channel) for timer, channel in pulses
           if timer in _TIMERS and timer not in encoders and 1 <= channel <= 4}
    require("PWM", pulses, len(fit) == wheels, "a channel (1 to 4) of a timer without encoder each")
    tick, taken = config.TICK_TIMER, encoders + [timer for timer, _ in pulses]
    require("TICK_TIMER", tick, type(tick) is int and tick in _TIMERS and tick not in taken, "a timer of its own")

    pins = motor_pins(config) + [pin for wiring in config.ENCODERS for pin in wiring[:2]] + list(config.FAULTS)
    pins += [config.SAFE_BUTTON] + [pin for pin in (config.LIGHT, config.BATTERY_PIN) if pin is not None]
    for pin in pins:
        require("pins", pin, type(pin) is str and pins.count(pin) == 1, "a pin's name, used once")

    if config.BATTERY_PIN is not None:
        number(config, "BATTERY_DIVIDER", 1, bounds.LARGEST // FULL_SCALE)
    number(config, "BATTERY_LOW", 0, config.BATTERY)
    kind = config.DRIVER
    require("DRIVER", kind, type(kind) is str and kind in DRIVERS, "brake or coast")
    number(config, "PWM_FREQUENCY", *DRIVERS[kind], f" [Hz] with drivers that {kind}")
    require("ENCODER_PULL_UPS", config.ENCODER_PULL_UPS, type(config.ENCODER_PULL_UPS) is bool, "True or False")

    # A period has to be long enough for its work, and the watchdog for some periods.
    room = bounds.line_bytes(config)
    require("RATE", config.RATE, room <= _REPL_RING, f"more: a period of {_REPL_RING} bytes at most")
    period = 1000000 // config.RATE  # [us]
    work = 1500 + 1450 * wheels + (20 + 11 * wheels) * 10000000 // config.BAUDRATE
    require("RATE", config.RATE, work * 100 <= period * _LOAD, f"a period of {work * 100 // _LOAD} us or more")
    number(config, "WATCHDOG", 3000 // config.RATE + 20, bounds.MAX_PERIODS * 1000 // config.RATE)


def motor_pins(config):
    """Return the names of the pins that could turn a motor."""
    return [wiring[0] for wiring in config.PWM] + [pin for pair in config.DIRECTIONS for pin in pair]


def _list(config, name, wheels, *kinds):
    """Check a list with one entry, or tuple of entries, of the given types for every wheel."""
    value = getattr(config, name, None)
    fits = type(value) in (tuple, list) and len(value) == wheels
    for entry in value if fits else ():
        parts = entry if len(kinds) > 1 and type(entry) in (tuple, list) else [entry]
        fits = fits and [type(part) for part in parts] == list(kinds)
    kinds = ", ".join([kind.__name__ for kind in kinds])
    bounds.require(name, value, fits, f"for each of {wheels} wheels: {kinds}" + (", or ()" if name == "FAULTS" else ""))
