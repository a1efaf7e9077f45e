"""The NUCLEO-L476RG behind the board interface of robotont_firmware.controller; nothing else knows it.

Everything that allocates happens in the constructor; the methods below it run with the heap locked.
"""

import os
from array import array

import machine
import pyb

_SAFE_FLAG = "stay_in_repl"  # a file with this name keeps main.py from starting the motors once


def motors_off(config):
    """Drive every pin that could turn a motor low; in reset they float (hence the pull-downs)."""
    for pin, _ in config.PWM:
        pyb.Pin(pin, pyb.Pin.OUT_PP, value=0)
    for pins in config.DIRECTIONS:
        for pin in pins:
            pyb.Pin(pin, pyb.Pin.OUT_PP, value=0)


def wants_safe_mode(config):
    """Return True when the USER button is held or the PC asked for the REPL before this start."""
    if pyb.Pin(config.SAFE_BUTTON, pyb.Pin.IN).value() == 0:
        return True
    if _SAFE_FLAG in os.listdir():
        os.remove(_SAFE_FLAG)
        return True
    return False


def restart_into_repl():
    """Reset the board, which then stays in the REPL: the watchdog allows no REPL without a reset."""
    with open(_SAFE_FLAG, "w"):
        pass
    os.sync()
    machine.reset()


def reset_cause():
    """Return why the board started, in one word."""
    causes = {
        machine.PWRON_RESET: "power",
        machine.HARD_RESET: "button",
        machine.WDT_RESET: "watchdog",
        machine.SOFT_RESET: "soft",
    }
    return causes.get(machine.reset_cause(), "other")


class Board:
    """Claims timers, pins, the serial line and the watchdog as `config` says.

    From here on USART2 carries packets and no REPL, and the watchdog resets the board when `feed` is
    not called within config.WATCHDOG ms.
    """

    def __init__(self, config):
        self._motors = len(config.PWM)
        self._config = config
        self._ticks = 0  # written by the tick's interrupt alone
        self._seen = 0
        self._latched = array("H", [0] * self._motors)
        self._encoders = [_encoder(*wiring) for wiring in config.ENCODERS]
        motors_off(config)
        self._forward = [pyb.Pin(pins[0], pyb.Pin.OUT_PP) for pins in config.DIRECTIONS]
        self._backward = [pyb.Pin(pins[1], pyb.Pin.OUT_PP) for pins in config.DIRECTIONS]
        pwm = pyb.Timer(config.PWM_TIMER, prescaler=0, period=config.FULL_EFFORT - 1)
        self._pwm = [
            pwm.channel(channel, pyb.Timer.PWM, pin=pyb.Pin(pin), pulse_width=0)
            for pin, channel in config.PWM
        ]
        self._faults = [pyb.Pin(pin, pyb.Pin.IN, pyb.Pin.PULL_UP) for pin in config.FAULTS]
        pyb.repl_uart(None)  # also keeps a 0x03 on the line from raising KeyboardInterrupt
        self._uart = pyb.UART(config.UART, config.BAUDRATE)
        self._on_tick = self._tick  # making the bound method in the interrupt would allocate
        self._timer = pyb.Timer(config.TICK_TIMER, freq=config.RATE)
        self._timer.callback(self._on_tick)
        self._watchdog = machine.WDT(timeout=config.WATCHDOG)

    def _tick(self, _):
        """Latch all encoders at one moment, in the timer's interrupt."""
        for motor in range(self._motors):
            self._latched[motor] = self._encoders[motor].counter()
        self._ticks = (self._ticks + 1) & 0xFFFF

    def wait_tick(self):
        """Sleep until the next tick; return how many there were since the last call."""
        while self._ticks == self._seen:
            pyb.wfi()
        ticks = self._ticks
        periods = (ticks - self._seen) & 0xFFFF
        self._seen = ticks
        return periods

    def counts(self, totals):
        """Copy the encoder counters of the latest tick, 0..65535 each."""
        for motor in range(self._motors):
            totals[motor] = self._latched[motor]

    def drive(self, wheel, effort):
        """Set direction and pulse width; 0 leaves both direction pins low."""
        self._forward[wheel].value(effort > 0)
        self._backward[wheel].value(effort < 0)
        self._pwm[wheel].pulse_width(abs(effort))

    def fault(self, wheel):
        """Return True while the motor driver pulls its fault line low."""
        return self._faults[wheel].value() == 0

    def read(self, buffer):
        """Read what waits, at most len(buffer) bytes; return how many."""
        size = min(self._uart.any(), len(buffer))
        if size == 0:
            return 0
        return self._uart.readinto(buffer, size) or 0

    def write(self, buffer, size):
        """Send buffer[0:size]; takes 87 us a byte."""
        self._uart.write(buffer, size)

    def feed(self):
        """Feed the watchdog."""
        self._watchdog.feed()

    def stop(self):
        """Switch the motors off for good: no pulses, then plain pins held low, also after this program."""
        for motor in range(self._motors):
            self.drive(motor, 0)
        motors_off(self._config)


def _encoder(pin_a, pin_b, timer, function):
    """Return a 16-bit hardware counter of every edge of both channels."""
    for pin in (pin_a, pin_b):
        pyb.Pin(pin, pyb.Pin.AF_PP, pull=pyb.Pin.PULL_NONE, alt=function)
    counter = pyb.Timer(timer, prescaler=0, period=0xFFFF)
    counter.channel(1, pyb.Timer.ENC_AB)
    return counter
