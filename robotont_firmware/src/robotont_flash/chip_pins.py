"""The pins of a NUCLEO-L476RG that a wiring profile may use, by the alternate functions in its data sheet (DS10198)."""

CHANNELS = {  # (timer, channel): {pin: its alternate function}; an inverted output (CH1N) is none
    (1, 1): {"PA8": 1}, (1, 2): {"PA9": 1}, (1, 3): {"PA10": 1}, (1, 4): {"PA11": 1},
    (2, 1): {"PA0": 1, "PA5": 1, "PA15": 1}, (2, 2): {"PA1": 1, "PB3": 1}, (2, 3): {"PB10": 1}, (2, 4): {"PB11": 1},
    (3, 1): {"PA6": 2, "PB4": 2, "PC6": 2}, (3, 2): {"PA7": 2, "PB5": 2, "PC7": 2},
    (3, 3): {"PB0": 2, "PC8": 2}, (3, 4): {"PB1": 2, "PC9": 2},
    (4, 1): {"PB6": 2}, (4, 2): {"PB7": 2}, (4, 3): {"PB8": 2}, (4, 4): {"PB9": 2},
    (5, 1): {"PA0": 2}, (5, 2): {"PA1": 2},
    (8, 1): {"PC6": 3}, (8, 2): {"PC7": 3}, (8, 3): {"PC8": 3}, (8, 4): {"PC9": 3},
    (15, 1): {"PB14": 14}, (15, 2): {"PB15": 14}, (16, 1): {"PA6": 14, "PB8": 14}, (17, 1): {"PA7": 14, "PB9": 14},
}
# Without PA2 and PA3 (the serial line to the PC), PA13 and PA14 (the ST-Link) and the crystals' pins
FREE = {f"P{port}{pin}" for port, pins in (
    ("A", (0, 1, *range(4, 13), 15)), ("B", range(16)), ("C", range(14)), ("D", (2,))) for pin in pins}
FREE_NAMES = "PA0, PA1, PA4 to PA12, PA15, PB0 to PB15, PC0 to PC13, PD2"
ANALOGUE = {f"P{port}{pin}" for port, pins in (
    ("A", (0, 1, *range(4, 8))), ("B", (0, 1)), ("C", range(6))) for pin in pins}


def check(config):
    """Raise ValueError for the first pin of a profile's {name: value} that the board does not have there."""
    for a, b, timer, function in config["ENCODERS"]:
        _check_channel("ENCODERS", a, timer, 1, function)
        _check_channel("ENCODERS", b, timer, 2, function)
    for pin, timer, channel, function in config["PWM"]:
        _check_channel("PWM", pin, timer, channel, function)
    others = {"DIRECTIONS": [pin for pair in config["DIRECTIONS"] for pin in pair], "FAULTS": config["FAULTS"],
              "SAFE_BUTTON": [config["SAFE_BUTTON"]], "LIGHT": [config["LIGHT"]]}
    for name, pins in others.items():
        for pin in pins:
            if pin is not None and pin not in FREE:
                raise ValueError(f"{name}: found {pin!r}, allowed: {FREE_NAMES}")
    if config["BATTERY_PIN"] not in (None, *ANALOGUE):
        raise ValueError(f"BATTERY_PIN: found {config['BATTERY_PIN']!r}, allowed: PA0, PA1, PA4 to PA7, PB0, PB1, PC0 "
                         "to PC5, the analogue inputs")  # fmt: skip


def _check_channel(name, pin, timer, channel, function):
    allowed = CHANNELS.get((timer, channel), {})
    if allowed.get(pin) != function:
        words = ", ".join(f"{one} with {number}" for one, number in allowed.items()) or "none"
        raise ValueError(f"{name}: found {pin!r} with alternate function {function} for channel {channel} of timer "
                         f"{timer}, allowed: {words}")
