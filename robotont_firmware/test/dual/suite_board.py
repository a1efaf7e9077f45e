"""board.py, boot.py and main.py on stand-ins for the hardware modules."""

import os
import sys

import fake_hardware
from dual_tools import Locked, checked  # it needs the real heap lock, so it comes before the stand-ins
from fake_hardware import UART, Machine, Pyb, Reset, Timer, levels, log, pins

fake_hardware.install()

from robotont_firmware import board, config  # noqa: E402

ROOT = sys.path[1] + "/../root/"  # the runner puts src/ second


def make():
    fake_hardware.reset()
    return board.Board(config)


def start(name):
    """Run boot.py or main.py as MicroPython would."""
    with open(ROOT + name) as file:
        exec(file.read(), {"__name__": "__main__"})


def test_encoders():
    made = make()
    for index, timer in ((0, 4), (1, 3), (2, 2)):
        counter = Timer.all[timer]
        assert counter.period == 0xFFFF
        assert counter.channels[1][0] == Timer.ENC_AB
        counter.count = 1000 * index + 7
    assert [pins[name][:2] for name in ("PB6", "PB7", "PA6", "PA7", "PA0", "PA1")] == [
        ["af", 2],
        ["af", 2],
        ["af", 2],
        ["af", 2],
        ["af", 1],
        ["af", 1],
    ]
    totals = [None] * 3
    made.counts(totals)
    assert totals == [0, 0, 0], "counters are latched at the tick, not read later"
    with Locked():
        made._on_tick(None)
    made.counts(totals)
    assert totals == [7, 1007, 2007]


def test_tick():
    made = make()
    timer = Timer.all[config.TICK_TIMER]
    assert timer.freq == 50
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
    made = make()
    pwm = Timer.all[8]
    assert (pwm.prescaler, pwm.period) == (0, 3999), "20 kHz at 80 MHz"
    for wheel, forward, backward in ((0, "PB8", "PB9"), (1, "PB12", "PB13"), (2, "PB14", "PB15")):
        for effort, expected in ((1234, (1, 0, 1234)), (-4000, (0, 1, 4000)), (0, (0, 0, 0))):
            with Locked():
                made.drive(wheel, effort)
            assert (levels[forward], levels[backward], pwm.channels[wheel + 1][1].width) == expected
    assert [pins[name][0] for name in ("PC6", "PC7", "PC8")] == ["af"] * 3


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
    uart.inbox = bytearray(b"abcdef")
    assert (made.read(buffer), bytes(buffer)) == (4, b"abcd")
    assert (made.read(buffer), bytes(buffer)) == (2, b"efcd")
    made.write(b"0:0:0", 3)
    assert uart.outbox == b"0:0"


def test_watchdog():
    made = make()
    assert "watchdog 300" in log
    made.feed()
    assert log[-1] == "feed"


def motor_pins_are_low():
    names = ("PC6", "PC7", "PC8", "PB8", "PB9", "PB12", "PB13", "PB14", "PB15")
    return all(pins[name][0] == "out" and levels[name] == 0 for name in names)


def test_stop():
    made = make()
    made.drive(1, 3000)
    made.stop()
    assert motor_pins_are_low()
    assert Timer.all[8].channels[2][1].width == 0


def test_boot_holds_the_motors():
    fake_hardware.reset()
    start("boot.py")
    assert motor_pins_are_low()


def test_button_means_safe_mode():
    fake_hardware.reset()
    levels["PC13"] = 0
    start("main.py")
    assert Timer.all == {}
    assert not [line for line in log if line.startswith("watchdog")]


def run_main(lines):
    """Run main.py with some bytes on the line until it ends; return what it sent."""
    fake_hardware.reset()
    lines = [bytearray(line) for line in lines]

    def wait():
        UART.last.inbox += lines.pop(0)
        timer = Timer.all[config.TICK_TIMER]
        timer.handler(timer)

    Pyb.on_wait = wait
    try:
        start("main.py")
    except Exception as error:
        return UART.last.outbox, error
    return UART.last.outbox, None


def test_main_gives_the_repl_when_asked():
    try:
        sent, error = run_main([b"", checked("30:30:30"), b"", checked("!repl")])
        assert isinstance(error, Reset), repr(error)
        assert log[-1] == "reset"
        lines = sent.split(b"\n")
        assert lines[0].startswith(b"# robotont_firmware ")
        assert lines[0].endswith(b" wheels 3 reset watchdog")
        assert lines[1] == b"0:0:0;00:0000:0000:0000:1C8B"
        assert b"# repl\n" in sent
        assert motor_pins_are_low()
        assert board._SAFE_FLAG in os.listdir()
        fake_hardware.reset()
        start("main.py")  # stays in the REPL once
        assert Timer.all == {}
        assert board._SAFE_FLAG not in os.listdir()
    finally:
        if board._SAFE_FLAG in os.listdir():
            os.remove(board._SAFE_FLAG)


def test_main_stops_the_motors_when_it_crashes():
    sent, error = run_main([checked("30:30:30"), b"", b""])  # then the stand-in's list is empty
    assert isinstance(error, IndexError)
    assert log.index("heap_lock") < log.index("heap_unlock")
    assert motor_pins_are_low()
    assert b"# crash IndexError" in sent


def test_reset_causes():
    for cause, word in ((1, "power"), (2, "button"), (3, "watchdog"), (0, "soft"), (4, "other")):
        Machine.cause = cause
        assert board.reset_cause() == word
