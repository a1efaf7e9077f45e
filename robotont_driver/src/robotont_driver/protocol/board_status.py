"""What a board reports of itself, in words: the status in checked packets, identity, messages; docs/protocol.md."""

from functools import lru_cache
from typing import NamedTuple, Tuple

TIMED_OUT, WAITS_FOR_ZERO, BATTERY_LOW = 1, 2, 4  # flags
NO_FAULT, DRIVER_FAULT, NO_COUNTS, WRONG_WAY, OVERLOAD, TOO_MANY, NOISE = range(7)  # what is wrong with a wheel

OFF = "; no motor drives until a command of zeros"
FAULTS = {
    DRIVER_FAULT: "wheel {}: its motor driver reports a fault (too much current, heat, or no supply)" + OFF,
    NO_COUNTS: "wheel {}: no counts although it is driven: encoder unplugged, motor without "
               "current, or wheel blocked" + OFF,
    WRONG_WAY: "wheel {}: counts against its direction: encoder or motor leads reversed, or motor without current and "
               "dragged" + OFF,
    TOO_MANY: "wheel {}: counts more than its motor can turn: another encoder or gear than configured, or noise" + OFF,
    NOISE: "wheel {}: counts to and fro while it stands: encoder unplugged, or its cable picks up the motors" + OFF,
}
UNKNOWN = "wheel {}: fault {}, which this driver is too old for" + OFF
NOTICES_KEPT = 8
MOST_LOAD = 90  # [%] of a period


class BoardStatus(NamedTuple):
    """The status field of one packet."""

    flags: int                # TIMED_OUT, WAITS_FOR_ZERO, BATTERY_LOW
    missed: int               # ticks that the board missed, modulo 256
    refused: int              # lines that the board refused, modulo 256
    wheels: Tuple[int, ...]   # one of NO_FAULT .. NOISE per wheel
    voltage: float = 0.0      # [V] of the battery; 0: not measured
    load: int = 0             # [%] of a period that the board's work took at most; 0: not measured

    @classmethod
    @lru_cache(maxsize=8)  # it is the same in almost all packets
    def parse(cls, text, wheels):
        """From the field's hexadecimal text FFMMRRW...VVVLL; without VVVLL from firmware 2.0."""
        end = 6 + wheels
        measured = (int(text[end:end + 3], 16) / 100, int(text[end + 3:], 16)) if len(text) > end else ()
        return cls(*(int(text[at:at + 2], 16) for at in (0, 2, 4)), tuple(int(digit, 16) for digit in text[6:end]),
                   *measured)

    @property
    def fault(self):
        """Description of the fault that stopped the motors; empty without one."""
        return " / ".join(FAULTS.get(fault, UNKNOWN).format(wheel, fault) for wheel, fault in enumerate(self.wheels)
                          if fault not in (NO_FAULT, OVERLOAD))

    @property
    def complaints(self):
        """List of warnings."""
        warnings = [f"wheel {wheel} works too hard (stalled, or overloaded): its motor's current is limited"
                    for wheel, fault in enumerate(self.wheels) if fault == OVERLOAD]
        if self.flags & BATTERY_LOW:
            at = f" ({self.voltage:.1f} V)" if self.voltage else ""
            warnings.append(f"the battery is low{at}: charge it")
        if self.load > MOST_LOAD:
            warnings.append(f"the board's work takes {self.load} % of a period: it may miss ticks")
        if self.flags & WAITS_FOR_ZERO and not self.fault:
            warnings.append("the board waits for a command of zeros: it has restarted")
        elif self.flags & TIMED_OUT:
            warnings.append("no valid commands reach the board: it brakes, then rolls")
        return warnings


class Identity(NamedTuple):
    """Which firmware a board has, and for which robot."""

    version: str
    wheels: int
    rate: int     # [Hz] control periods per second
    units: str
    profile: str  # wiring profile
    reset: str    # why the board started last

    @classmethod
    def parse(cls, text):
        """From `robotont_firmware VERSION NAME VALUE ...`, a banner or the answer to `?;`; None from other text."""
        name, version, *words = [*text.split(" "), ""]
        said = dict(zip(words[::2], words[1::2]), version=version)
        if name != "robotont_firmware":
            return None
        try:
            return cls(*(kind(said[field]) for field, kind in cls.__annotations__.items()))
        except (KeyError, ValueError):
            return None

    def obstacle(self, wheels, rate):
        """Why this board cannot be driven with that many wheels at that rate [Hz]; empty when it can."""
        faults = []
        if self.wheels != wheels:
            faults.append(f"the board drives {self.wheels} wheels, wheelAmount is {wheels}")
        if abs(self.rate - rate) > 1e-6:
            faults.append(f"the board controls at {self.rate} Hz, pidControlFrequency is {rate:g}")
        if self.units != "edges/period":
            faults.append(f"the board counts in {self.units}, this driver in edges/period")
        fitting = f": robot:= one with {self.wheels} wheels and {self.rate} Hz (docs/robots.md)" if faults else ""
        return "; ".join(faults) + fitting


class BoardHealth:
    """Collects what a board reports, for a robot of `wheels` wheels at `rate` [Hz]."""

    def __init__(self, wheels, rate):
        self._wheels, self._rate = wheels, rate
        self._counted = self._reported = 0, 0  # ticks that it missed, lines that it refused; up to the last report
        self.notices = []       # newest messages of the board
        self._news = []         # messages and faults since the last report
        self.banner = self.obstacle = ""
        self.status, self.identity = None, None  # until they come
        self.wants_identity = False  # whether the board is able to identify itself and has not done so yet

    fault = property(lambda self: self.status.fault if self.status else "", doc="What has stopped the motors.")

    def hear_status(self, status):
        """Another BoardStatus than before came in a packet."""
        if self.status is not None:
            self._counted = [count + (new - old) % 256 for count, new, old in zip(
                self._counted, status[1:3], self.status[1:3])]
        self.status, self.wants_identity = status, self.identity is None
        self._tell(status.fault)

    def hear_text(self, text):
        """Take a line of text. Returns whether it is the banner of a board that has just started."""
        self.notices = [*self.notices, text][-NOTICES_KEPT:]
        starts, answers = text.startswith("robotont"), text.startswith("identity")
        if not starts and not answers:
            self._tell(text)
        if starts:
            self.banner, self.status = text, None
        if starts or answers:
            self.identity = Identity.parse(text[len("identity "):] if answers else text)
            self.wants_identity = answers and self.identity is None
            self.obstacle = self.identity.obstacle(self._wheels, self._rate) if self.identity else ""
        return starts

    def _tell(self, text):
        self._news = [*self._news, text][-NOTICES_KEPT:] if text and text not in self._news else self._news

    def report(self):
        """(errors, warnings, values) since the last call: two lists of messages, of faults that are over, too."""
        errors = [message for message in (self.obstacle, self.fault) if message]
        warnings = self.status.complaints if self.status else []
        missed, refused = (new - old for new, old in zip(self._counted, self._reported))
        self._reported = self._counted
        if missed:
            warnings.append(f"the board missed {missed} ticks")
        if refused:
            warnings.append(f"the board refused {refused} lines: check cable and baudrate")
        news, self._news = self._news, []
        warnings += [f"the board has reported: {text.replace(OFF, '')}" for text in news if text not in errors]
        if self.wants_identity:
            warnings.append("the board has not identified itself yet: it is not driven until then")
        values = {"board": self.banner, "board's newest messages": " | ".join(self.notices)}
        if self.identity:
            values.update({"board " + name: value for name, value in self.identity._asdict().items()})
        if self.status:
            values.update({"ticks missed": self._counted[0], "lines refused by the board": self._counted[1],
                           "faults of the wheels": ":".join(map(str, self.status.wheels))})
            if self.status.voltage:
                values["battery [V]"] = f"{self.status.voltage:.2f}"
            if self.status.load:
                values["load of the board [% of a period]"] = self.status.load
        return errors, warnings, values
