"""board.py, boot.py and main.py on stand-ins for the hardware modules."""

import sys
from array import array

import fake_hardware
from dual_tools import Config, Locked, checked, profile  # it needs the real heap lock, so it comes before the stand-ins
from fake_hardware import ADC, UART, WDT, Machine, Pyb, Reset, Timer, levels, log, pins

fake_hardware.install()

from robotont_firmware import board, check_pin_profile, config, pin_profile_robotont21  # noqa: E402
from robotont_firmware.main_loop import Controller  # noqa: E402

ROOT = sys.path[1] + "/robotont_firmware/"  # the runner puts src/ second


def make(settings=None, **changes):
    """Return a board that runs, with settings or with some values changed."""
    fake_hardware.reset()
    settings = settings or Config(**changes)
    made = board.Board(settings)
    made.start(Controller(made, settings, reset_cause="test"))
    UART.last.outbox = b""
    return made


def start(name):
    with open(ROOT + name) as file:
        exec(file.read(), {"__name__": "__main__"})


def counted(made):
    totals = array("H", [0] * 3)
    with Locked():
        made.counts(totals)
    return list(totals)


def tick(made):
    with Locked():
        made._on_tick(None)
        made.wait_tick()


FILTERS = {1: 0x40012C18, 2: 0x40000018, 3: 0x40000418, 4: 0x40000818}


def test_encoders():
    for settings, timers, expected in (
        (Config(), (4, 3, 2), [7, 1007, 2007]),
        (Config(BACKWARD_ENCODERS=(False, True, False)), (4, 3, 2), [7, 65536 - 1007, 2007]),
        (profile(pin_profile_robotont21), (2, 3, 1), [7, 1007, 2007]),
    ):
        made = make(settings)
        for index, timer in enumerate(timers):
            counter = Timer.all[timer]
            assert (counter.period, counter.channels[1][0]) == (0xFFFF, Timer.ENC_AB)
            assert Machine.mem16[FILTERS[timer]] == 0xF0F0, "both inputs filtered"
            counter.count = 1000 * index + 7
        for pin_a, pin_b, _, function in settings.ENCODERS:
            assert pins[pin_a] == pins[pin_b] == ["af", function, "up" if settings.ENCODER_PULL_UPS else "none"]
        assert counted(made) == [0, 0, 0], "counters are latched at the tick, not read later"
        tick(made)
        assert counted(made) == expected


def test_counts_are_of_one_tick():
    """They are taken, with the number of ticks, while no interrupt can come: the next is before that, or behind."""
    for moment, ticks in (("disable_irq", 2), ("enable_irq", 1)):
        made, before = make(), getattr(Pyb, moment)

        def come(*_):
            for timer in (4, 3, 2):
                Timer.all[timer].count += 100
            made._tick(None)  # noqa: B023

        come()
        setattr(Pyb, moment, staticmethod(come))
        try:
            assert made.wait_tick() == ticks, moment
        finally:
            setattr(Pyb, moment, staticmethod(before))
        assert counted(made) == [100 * ticks] * 3, moment


def test_tick():
    made = make()
    timer = Timer.all[config.TICK_TIMER]
    assert timer.freq == 50
    assert made._ticks == made._seen
    waits = [0]

    def wait():
        waits[0] += 1
        if waits[0] == 3:
            timer.handler(timer)

    Pyb.on_wait = wait
    with Locked():
        periods = made.wait_tick()
    assert periods == 1
    assert waits[0] == 3
    timer.handler(timer)
    timer.handler(timer)
    assert made.wait_tick() == 2
    made._ticks = made._seen = 0xFFFF
    timer.handler(timer)
    assert made.wait_tick() == 1


def test_drive():
    for settings, prescaler, width, wheels in (
        (Config(), 0, 4000,  # 20 kHz at 80 MHz
         ((8, 1, "PB8", "PB9"), (8, 2, "PB12", "PB13"), (8, 3, "PB14", "PB15"))),
        (profile(pin_profile_robotont21), 12, 61538,  # 100 Hz
         ((8, 1, "PC9", "PC8"), (15, 1, "PB1", "PB15"), (4, 1, "PA7", "PB12"))),
    ):
        made = make(settings)
        for wheel, (timer, channel, forward, backward) in enumerate(wheels):
            pwm = Timer.all[timer]
            kind, output = pwm.channels[channel]
            assert (pwm.prescaler, pwm.period, kind) == (prescaler, width - 1, Timer.PWM)
            for effort, expected in ((1000, (1, 0, width // 4)), (-4000, (0, 1, width)), (0, (0, 0, 0))):
                with Locked():
                    made.drive(wheel, effort)
                assert (levels[forward], levels[backward], output.width) == expected


def test_fault():
    made = make()
    for wheel, pin in enumerate(("PC9", "PC10", "PC11")):
        assert pins[pin] == ["in", None, "up"]
        assert not made.fault(wheel)
        levels[pin] = 0
        assert made.fault(wheel)


def test_line():
    made = make()
    uart = UART.last
    assert (uart.number, uart.baudrate) == (2, 115200)
    buffer = bytearray(4)
    assert made.read(buffer) == 0
    uart.arrive(b"abcdef")
    assert (made.read(buffer), bytes(buffer)) == (4, b"abcd")
    assert (made.read(buffer), bytes(buffer)) == (2, b"efcd")
    made.write(b"0:0:0", 3)
    assert uart.outbox == b"0:0"


def motor_pins_are_low():
    names = ("PC6", "PC7", "PC8", "PB8", "PB9", "PB12", "PB13", "PB14", "PB15")
    return all(pins[name][0] == "out" and levels[name] == 0 for name in names)


class StillPin:
    """Stands in for Pin, and allocates nothing."""

    OUT_PP = "out"

    def __call__(self, name, mode, value):
        levels[name] = value


def test_the_stop_allocates_nothing():
    made, before = make(), Pyb.Pin
    for name in check_pin_profile.motor_pins(config):
        levels[name] = 1
    Pyb.Pin = StillPin()
    try:
        with Locked():
            made.stop()
    finally:
        Pyb.Pin = before
    assert [levels[name] for name in check_pin_profile.motor_pins(config)] == [0] * 9


def run_main(lines, look=None, cause=2):
    """Run main.py with some bytes on the line until it ends; return what it sent and the error."""
    fake_hardware.reset()
    Machine.cause = cause
    lines = [bytearray(line) for line in lines]

    def wait():
        if look:
            look()
        UART.last.arrive(lines.pop(0))
        timer = Timer.all[config.TICK_TIMER]
        timer.handler(timer)

    Pyb.on_wait = wait
    try:
        start("main.py")
    except Exception as error:
        return UART.last.outbox, error
    return UART.last.outbox, None


def test_main_gives_the_repl_when_asked():
    sent, error = run_main([b"", checked("0:0:0"), checked("30:30:30"), b"", checked("!repl")])
    assert isinstance(error, Reset), repr(error)
    assert log.index("reset") > log.index("heap_unlock")
    lines = sent.split(b"\n")
    assert lines[0].startswith(b"# robotont_firmware ")
    assert b" wheels 3 rate 50 units edges/period profile ours reset button;" in lines[0]
    assert lines[1].startswith(b"0:0:0;00:0000:0000:0000:03000000000000:")
    assert lines[-2] + b"\n" == checked("# repl"), lines
    assert motor_pins_are_low()
    fake_hardware.reset()
    start("main.py")  # stays in the REPL once
    assert Timer.all == {}
    sent, error = run_main([checked("!repl")])
    assert b"# robotont_firmware " in sent, "and only once"
    assert Machine.mem32[0x40002800 + 0xCC] == board.REPL_WISHED, "in RTC_BKP31R: a file could be damaged"
    board.start_cause(config)


def test_main_stops_the_motors_when_it_crashes():
    sent, error = run_main([checked("0:0:0"), checked("30:30:30"), b""])  # then the stand-in's list is empty
    assert isinstance(error, IndexError)
    assert log.index("heap_lock") < log.index("heap_unlock")
    assert motor_pins_are_low()
    last = sent.split(b"\n")[-2]
    assert last.startswith(b"# crash IndexError")
    assert checked(last.decode().rsplit(";", 1)[0]) == last + b"\n"


def test_after_any_reset_a_zero_command_comes_first():
    for cause, word in ((1, "power"), (2, "button"), (3, "watchdog"), (0, "soft"), (4, "other"), (2, "crash")):
        if word == "crash":  # a reset by software looks like the button, were it not for the note
            run_main([b""])
        commands = [checked("30:30:30")] * 30 + [checked("0:0:0")] + [checked("30:30:30")] * 2 + [checked("!repl")]
        levels_seen = []
        sent, error = run_main(commands, lambda: levels_seen.append(levels.get("PB8")), cause)  # noqa: B023
        assert isinstance(error, Reset), (word, error)
        board.start_cause(config)
        assert b" reset " + word.encode() + b";" in sent, word
        assert not any(levels_seen[:31]), (word, "the PC's command still stood")
        assert levels_seen[-1], word


def test_ctrl_c_is_off_until_the_repl_is_free():
    for name in ("boot.py", "main.py"):
        fake_hardware.reset()
        levels["PC13"] = 0  # the button: safe mode
        start(name)
        assert log[0] == "kbd_intr -1", name
    assert log[-1] == "kbd_intr 3"
    assert Timer.all == {}
    assert not [line for line in log if line.startswith("watchdog")]


def test_an_error_before_the_watchdog_is_armed_ends_in_the_repl():
    """A wrong number; whatever the loop does, for it is done once before; a chip without a watchdog."""

    def broken(*_):
        if "broken" not in log:
            log.append("broken")
            raise IndexError

    for holder, name, value in (
        (config, "GEAR", 0), (WDT, "broken", True), (board.Board, "counts", broken),
        (board.Board, "fault", broken), (board.Board, "drive", broken), (board.Board, "_tick", broken),
    ):  # fmt: skip
        fake_hardware.reset()
        before = getattr(holder, name)
        setattr(holder, name, value)
        try:
            start("boot.py")
            start("main.py")
            raise AssertionError(name)
        except (ValueError, IndexError, OSError):
            assert motor_pins_are_low(), name
        finally:
            setattr(holder, name, before)
        taken = [line for line in log if line.startswith(("watchdog", "repl_uart"))]
        assert taken in ([], ["repl_uart before"], ["repl_uart None", "repl_uart before"]), (name, taken)


def test_no_command_is_cut_or_refused():
    """A whole period's bytes fit: 125 commands a second, as the page's slider and a client may send."""
    made = make()
    controller = Controller(made, config, reset_cause="test")
    controller.start()
    line, lost = checked("-179.55:0.00:179.55"), 0
    for period in range(100):
        for _ in range(3 if period & 1 else 2):
            lost += UART.last.arrive(line)
        made._tick(None)
        controller.step(made.wait_tick())
        UART.last.outbox = b""
    assert lost == controller._receiver.dropped == 0, lost


def test_boot_holds_the_motors_and_has_the_pins_of_the_profile():
    fake_hardware.reset()
    start("boot.py")
    assert motor_pins_are_low()
    with open(ROOT + "boot.py") as file:
        assert "robotont_firmware" not in file.read().split('"""', 2)[2], "it needs no other file"
    held = set(pins)
    assert held == {wiring[0] for wiring in config.PWM} | {pin for pair in config.DIRECTIONS for pin in pair}


def test_load_is_the_longest_work_since_it_was_asked_and_counts_from_the_tick():
    made = make()
    for work in (400000, 800000, 80000):  # [cycles] of 1 600 000
        made._on_tick(None)
        made.wait_tick()
        fake_hardware.cycles[0] += work
        Pyb.on_wait = lambda: made._on_tick(None)
        made.wait_tick()
    with Locked():
        assert made.load() == 50
    fake_hardware.cycles[0] += 16000
    made._on_tick(None)  # the next tick comes before the work is done
    fake_hardware.cycles[0] += 1600000
    made.wait_tick()
    assert made.load() == 101, "from its own tick to its end"
    fake_hardware.cycles[0] += 10000000
    made.wait_tick()
    assert made.load() == 255


def test_battery_and_light_where_they_are_wired():
    assert not hasattr(make(LIGHT=None), "light")
    assert not hasattr(make(), "battery")
    made = make(BATTERY_PIN="PC0", BATTERY_DIVIDER=20475)
    ADC.value = 2400
    with Locked():
        voltage = made.battery()
    assert voltage == 12000
    for on in (1, 0):
        made.light(on)
        assert levels["PA5"] == on
