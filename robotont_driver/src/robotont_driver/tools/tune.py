"""Steps one lifted wheel after another and proposes numbers for the firmware: `./robotont wheels --tune`.

The board itself ends each step by its own clock, and any that would become faster than the order says (`!test`, see
docs/protocol.md): nothing runs on when this program, or the computer, ends. Nothing is written on the board.
"""

import contextlib
import importlib
import runpy
import select
import signal
import sys
import termios
import time
import tty
from pathlib import Path

from robotont_driver.protocol.board_status import TIMED_OUT
from robotont_driver.protocol.checksum import add_checksum
from robotont_driver.tools.bring_up import MOVED, PATIENCE, BringUp, BringUpError
from robotont_driver.tools.motor_fit import compare, fit_direction, propose

EFFORTS = (*range(100, 1000, 100), 999)  # [effort] of 4000; the board gives a quarter at most
BLIND = 600     # [effort] that turns any free wheel
MARGIN = 0.9    # a step is left out that may come nearer to the greatest speed
SILENCE = 0.3   # [s] without a packet
QUIET = 5       # [periods] without an edge: the wheel rests
ROW = "{:12}{:<12}{:14}{:16}{:16}{}"
QUESTIONS = """\
Lift the robot: no wheel may touch anything. `./robotont wheels --bring-up` should have found all motors right.
Each wheel is stepped forward and backward for half a second, some 20 times, a minute in all, with at most a quarter
of its effort and never above {:.2f} m/s: the board ends what would be faster. Any key ends it.
Press Enter when all wheels are in the air (Ctrl-C ends it): """


class Tune(BringUp):
    """Talks to the firmware over an open serial `line`; pressed(): whether the user wants it to end.

    most: [edges/period] that no wheel may exceed.
    """

    needed = (2, 2)

    def __init__(self, line, wheels, most, pressed=lambda: False, clock=time.monotonic):
        super().__init__(line, wheels, clock)
        self._most = most
        self._pressed = pressed
        self._rest = b""

    @property
    def about(self):
        """(name of the board's wiring profile, measured voltage of the battery [V] or 0)."""
        return self._reader.health.identity.profile, self._reader.health.status.voltage

    def step(self, wheel, sign, effort):
        """Counts ahead per driven period of one step, until its end or the bound on its speed.

        Raises BringUpError on a key, a fault, silence, and on what should not be; the wheels are stopped then.
        """
        try:
            counts = self._step(wheel, sign, effort)
            self._wait_for_rest(wheel)
        except BaseException:
            with contextlib.suppress(OSError):  # without a line the board's clock does it
                self._line.write(add_checksum("!test 0+0:0;"))  # the controllers, which zeros wake, trust the encoders
            raise
        return counts

    def _step(self, wheel, sign, effort):
        self._line.write(add_checksum(f"!test {wheel}{'+' if sign > 0 else '-'}{effort}:{self._most};"))
        counts, driven, others = [], False, [0] * self._wheels
        for packet in self._packets(PATIENCE):
            others = [total + count for total, count in zip(others, packet)]
            if driven:  # from the packet before this one on
                counts.append(sign * packet[wheel])
                self._check_counts(wheel, counts, others)
            was, driven = driven, not self._reader.health.status.flags & TIMED_OUT
            if was and not driven:
                return counts
        raise BringUpError("the board did not obey the order to drive a wheel")

    def _check_counts(self, wheel, counts, others):
        if abs(counts[-1]) > self._most:
            raise BringUpError(f"wheel {wheel} is faster than it may be: {counts[-1]} edges in a period")
        if sum(counts) <= -MOVED:
            raise BringUpError(f"wheel {wheel} counts backward: ./robotont wheels --bring-up finds why")
        for other, total in enumerate(others):
            if other != wheel and abs(total) >= MOVED:
                raise BringUpError(f"wheel {other} turns with wheel {wheel}: it touches something, or their plugs are "
                                   "exchanged (./robotont wheels --bring-up)")

    def _wait_for_rest(self, wheel):
        quiet = 0
        for packet in self._packets(PATIENCE):
            quiet = 0 if any(packet) else quiet + 1
            wheel = next((wheel for wheel, count in enumerate(packet) if count), wheel)
            if quiet == QUIET:
                return
        raise BringUpError(f"wheel {wheel} does not come to rest: noise of its encoder, or something drives it")

    def _packets(self, seconds):
        """One packet after the other, `health` being as that packet told, for a time [s]."""
        start = heard = self._clock()
        while self._clock() < start + seconds:
            if self._pressed():
                raise BringUpError("ended by a key: the wheels are stopped")
            *lines, self._rest = (self._rest + self._line.read(4096)).split(b"\n")
            for line in lines:
                for packet in self._reader.feed(line + b"\n", self._clock()):
                    heard = self._clock()
                    if self._reader.health.fault:
                        raise BringUpError(self._reader.health.fault)
                    yield packet
            if self._clock() > heard + SILENCE:
                raise BringUpError(f"the board is silent for {SILENCE:g} s: cable or supply; its clock ends a step")


def measure(tuned, wheel, most):
    """([efforts], [counts]) of both directions, {1: ..., -1: ...}, of one wheel, by steps of a growing effort."""
    found = {1: ([], []), -1: ([], [])}
    for effort in EFFORTS:
        for sign, (efforts, steps) in found.items():
            ends = [_end(counts) for counts in steps[-2:]]
            if ends and (2 * ends[-1] - (ends[0] if len(ends) > 1 else 0) > MARGIN * most
                         or len(steps[-1]) < len(steps[0])):  # the board has ended it
                continue
            counts = tuned.step(wheel, sign, effort)
            if ends and _end(counts) < ends[-1] / 2 and sum(steps[-1]) >= MOVED:
                raise BringUpError(f"wheel {wheel} counts less with more effort: encoder, motor cable or driver")
            efforts.append(effort)
            steps.append(counts)
        if effort >= BLIND:
            for sign, (_, steps) in found.items():
                if sum(steps[-1]) < MOVED:
                    raise BringUpError(f"wheel {wheel} does not turn {'forward' if sign > 0 else 'backward'} with "
                                       f"{effort} of 4000: ./robotont wheels --bring-up finds why")
    return found


def _end(counts):
    """Speed at the end of a step [edges/period]."""
    last = counts[len(counts) * 3 // 4:]
    return sum(last) / max(1, len(last))


def tune(tuned, wheels, rate, most, print_line):
    """Measure all wheels by `tuned`, a prepared `Tune`, and print what follows; whether there is a proposal."""
    fits, right = [], True
    print_line(ROW.format("wheel", "turns from", "friction", "at 800", "time constant", "counts off by")
               + "\n" + ROW.format("", "[effort]", "[effort]", "[edges/period]", "[ms]", "[edges]"))
    for wheel in range(wheels):
        pair = []
        for sign, (efforts, steps) in measure(tuned, wheel, most).items():
            name = f"{wheel} {'forward' if sign > 0 else 'backward'}"
            try:
                fit = fit_direction(efforts, steps)
            except ValueError as error:
                print_line(f"{name:12}NO FIT: {error}")
                right = False
                continue
            pair.append(fit)
            right = right and not fit.fault
            tau = (1000 * value / rate for value in fit.tau)
            print_line(ROW.format(name, fit.turns, "{:.0f} +- {:.0f}".format(*fit.friction), f"{fit.speed(800):.1f}",
                                  "{:.1f} +- {:.1f}".format(*tau), f"{fit.residual:.1f}"))
            if fit.fault:
                print_line(f"{'':12}DOES NOT HOLD: {fit.fault}")
        fits.append(tuple(pair))
    differences = compare(fits) if all(len(pair) == 2 for pair in fits) else []
    for line in differences:
        print_line(line)
    if differences or not right:
        print_line("nothing is proposed: these wheels would not do with common numbers. See above.")
        return False
    for line in _proposal(fits, *tuned.about):
        print_line(line)
    return True


def _proposal(fits, profile, measured):
    present = present_numbers(profile)
    battery = present.get("BATTERY", 12000) / 1000
    leads = {name: present[name] for name in ("LEAD", "TURN_LEAD") if name in present}
    file = "pin_profile.py" if profile == "ours" else f"pin_profile_{profile}.py"
    yield f"proposed for {file}, as of 12 V (docs/firmware.md), and what it has now:"
    for name, number in propose(fits, measured or battery, leads).items():
        yield f"    {name + ' =':13}{number:<8}# now {present.get(name, 'unknown')}"
    if measured:
        yield f"The battery had {measured:.1f} V; BATTERY stands for {battery:.1f} V."
    elif present:
        yield f"The battery is taken to have {battery:.1f} V, as BATTERY says: with less all numbers are too large."
    if not present:
        yield f"The sources here have no profile {profile}: the numbers are for BATTERY = 12000, and LEAD is left out."
    yield "Nothing was written: enter them, then ./robotont flash."


def present_numbers(profile):
    """{name: number} of the firmware's configuration with that wiring profile, from its sources here; else {}."""
    try:
        package = importlib.import_module("robotont_firmware")
    except ImportError:  # a robot needs none
        return {}
    folder = next(path for path in map(Path, package.__path__) if (path / "pin_profile.py").is_file())
    for file in (folder / "pin_profile.py", *sorted(folder.glob("pin_profile_*.py"))):
        names = runpy.run_path(str(file))
        if names["PROFILE"] == profile:
            return {**runpy.run_path(str(folder / "config.py")), **names}
    return {}


@contextlib.contextmanager
def keys():
    """`pressed()`: whether a key of the terminal was hit. SIGTERM and SIGHUP end the program as Ctrl-C does.

    Raises EOFError without a terminal.
    """
    if not sys.stdin.isatty():
        raise EOFError
    before = termios.tcgetattr(sys.stdin)
    handlers = {number: signal.signal(number, _leave) for number in (signal.SIGTERM, signal.SIGHUP)}
    try:
        tty.setcbreak(sys.stdin)
        yield lambda: bool(select.select([sys.stdin], [], [], 0)[0])
    finally:
        termios.tcsetattr(sys.stdin, termios.TCSAFLUSH, before)
        for number, handler in handlers.items():
            signal.signal(number, handler)


def _leave(number, _):
    sys.exit(128 + number)
