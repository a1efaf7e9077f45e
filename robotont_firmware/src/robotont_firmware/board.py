"""The NUCLEO-L476RG behind the board interface of robotont_firmware.main_loop; only main.py imports it.

Everything that allocates happens in the constructor and in `start`; the methods below run with the heap locked.
"""

from array import array
from time import ticks_cpu, ticks_diff

import machine
import pyb

from robotont_firmware import check_pin_profile
from robotont_firmware.compat import micropython, ptr16
from robotont_firmware.robot_numbers import FULL_EFFORT

TIMER_CLOCK = 80000000  # [Hz]
# A note to the next start, in a backup register of the real-time clock (RTC_BKP31R): it outlives every reset but a
# power cut, costs no file system, and MicroPython itself does not use it.
NOTE = 0x400028CC
REPL_WISHED, CRASHED = 0x524F4231, 0x524F4232

_CCMR1 = 0x18  # of a timer's registers, its inputs' filter: pyb does not reach it
_FILTER = 0xF0F0  # both inputs: 8 samples at 1/32 of the clock, 3.2 us; a state lasts 100 us at 500 rpm


def start_cause(config):
    """Return why the board started, in one word, and forget the note.

    `repl`: the last run was asked for it, or USER is held. A reset by software looks like the reset button to the chip.
    """
    note = machine.mem32[NOTE] & 0xFFFFFFFF
    machine.mem32[NOTE] = 0
    if note == REPL_WISHED or pyb.Pin(config.SAFE_BUTTON, pyb.Pin.IN).value() == 0:
        return "repl"
    return "crash" if note == CRASHED else {
        machine.PWRON_RESET: "power", machine.HARD_RESET: "button", machine.WDT_RESET: "watchdog",
        machine.SOFT_RESET: "soft"}.get(machine.reset_cause(), "other")


class Board:
    """Claims timers and pins as in `config`; `start` also takes the serial line and arms the watchdog.

    Until `start` the REPL works, so that an error in the configuration can be reported. Raises ValueError when
    the configuration cannot work.
    """

    def __init__(self, config):
        check_pin_profile.check(config)
        self._motor_pins = check_pin_profile.motor_pins(config)
        self._motors = len(config.PWM)
        self._config = config
        self._ticks = 0  # written by the tick's interrupt alone
        self._seen = 0
        self._latched = array("H", [0] * self._motors)  # written by the tick's interrupt alone,
        self._taken = array("H", [0] * self._motors)  # and what it wrote at the tick that wait_tick has seen
        pull = pyb.Pin.PULL_UP if config.ENCODER_PULL_UPS else pyb.Pin.PULL_NONE
        self._encoders = [_encoder(pull, *wiring).counter for wiring in config.ENCODERS]
        self._backward_encoders = array("H", [int(backward) for backward in config.BACKWARD_ENCODERS])
        divider = TIMER_CLOCK // config.PWM_FREQUENCY  # [ticks] of a PWM period
        prescaler = divider >> 16
        self._width = divider // (prescaler + 1)
        timers = {}
        for wiring in config.PWM:
            if wiring[1] not in timers:
                timers[wiring[1]] = pyb.Timer(wiring[1], prescaler=prescaler, period=self._width - 1)
        self._outputs = [  # functions of each wheel
            (pyb.Pin(forward, pyb.Pin.OUT_PP).value, pyb.Pin(backward, pyb.Pin.OUT_PP).value, timers[timer].channel(
                channel, pyb.Timer.PWM, pin=pyb.Pin(pin), pulse_width=0).pulse_width)
            for (forward, backward), (pin, timer, channel, _) in zip(config.DIRECTIONS, config.PWM)
        ]
        self._faults = [pyb.Pin(pin, pyb.Pin.IN, pyb.Pin.PULL_UP).value for pin in config.FAULTS]
        if config.BATTERY_PIN is not None:
            self._adc = pyb.ADC(pyb.Pin(config.BATTERY_PIN))
            self.battery = self._battery  # a board that does not measure has no such method
        if config.LIGHT is not None:
            self.light = pyb.Pin(config.LIGHT, pyb.Pin.OUT_PP).value
        self._hundredth = TIMER_CLOCK // config.RATE // 100  # [cycles] of a period
        self._began = self._tick_began = ticks_cpu()
        self._longest = 0  # [cycles] from a tick to the end of its work, since `load` was asked last

    def start(self, loop):
        """From here on USART2 carries packets and no REPL, ticks come, and last the watchdog is armed.

        It resets the board when `feed` is not called within config.WATCHDOG ms, and nothing disarms it. So the first
        period of the `loop` comes before: an error in it ends in the REPL.
        """
        config, repl = self._config, pyb.repl_uart()
        self._on_tick = self._tick  # making the bound method in the interrupt would allocate
        try:
            self._on_tick(None)
            self._timer = pyb.Timer(config.TICK_TIMER, freq=config.RATE)
            self._timer.callback(self._on_tick)
            pyb.repl_uart(None)  # also keeps a 0x03 on the line from raising KeyboardInterrupt
            self._uart = pyb.UART(2, config.BAUDRATE)
            self.write = self._uart.write  # buffer, size; takes 87 us a byte
            loop.start()
            loop.step(self.wait_tick())
            self.feed = machine.WDT(timeout=config.WATCHDOG).feed
        except Exception:
            self.stop()
            pyb.repl_uart(repl)
            raise

    @micropython.native
    def _tick(self, _):
        """Latch all encoders at one moment, in the timer's interrupt."""
        self._tick_began = ticks_cpu()
        latched = self._latched
        encoders = self._encoders
        for motor in range(self._motors):
            latched[motor] = encoders[motor]()
        self._ticks = (self._ticks + 1) & 0xFFFF

    @micropython.native
    def wait_tick(self):
        """Sleep until the next tick; return how many there were since the last call."""
        spent = ticks_diff(ticks_cpu(), self._began)
        if spent > self._longest:  # noqa: PLR1730 (a call would cost more)
            self._longest = spent
        while self._ticks == self._seen:
            pyb.wfi()
        interrupts = pyb.disable_irq()  # else the next tick might come in between
        self._latched, self._taken = self._taken, self._latched
        ticks = self._ticks
        self._began = self._tick_began
        pyb.enable_irq(interrupts)
        periods = (ticks - self._seen) & 0xFFFF
        self._seen = ticks
        return periods

    @micropython.viper
    def counts(self, totals):
        """Copy the encoder counters of that tick, 0..65535 each, up while the motor drives forward."""
        there = ptr16(totals)
        taken = ptr16(self._taken)
        backward = ptr16(self._backward_encoders)
        for motor in range(int(self._motors)):
            there[motor] = 0 - taken[motor] & 0xFFFF if backward[motor] else taken[motor]

    def load(self):
        """Return the longest work since the last call [% of a period], 255 at most."""
        longest = min(self._longest // self._hundredth, 255)
        self._longest = 0
        return longest

    def drive(self, wheel, effort):
        """Set direction and pulse width; 0 leaves both direction pins low."""
        forward, backward, pwm = self._outputs[wheel]
        forward(effort > 0)
        backward(effort < 0)
        pwm((effort if effort > 0 else -effort) * self._width // FULL_EFFORT)

    def fault(self, wheel):
        """Return True while the motor driver pulls its fault line low; False where none is connected."""
        return self._faults and self._faults[wheel]() == 0

    def _battery(self):
        """Return the battery's voltage [mV]."""
        return self._adc.read() * self._config.BATTERY_DIVIDER // check_pin_profile.FULL_SCALE

    def read(self, buffer):
        """Read what waits, at most len(buffer) bytes; return how many."""
        uart = self._uart
        size = uart.any()
        if size == 0:
            return 0
        return uart.readinto(buffer, min(size, len(buffer))) or 0

    def stop(self):
        """Switch the motors off for good: their pins are plain ones, held low, also after this program."""
        for pin in self._motor_pins:  # which float in a reset (hence the pull-downs)
            pyb.Pin(pin, pyb.Pin.OUT_PP, value=0)


def _encoder(pull, pin_a, pin_b, timer, function):
    """Return a 16-bit hardware counter of every edge of both channels, with the inputs' filters on."""
    for pin in (pin_a, pin_b):
        pyb.Pin(pin, pyb.Pin.AF_PP, pull=pull, alt=function)
    counter = pyb.Timer(timer, prescaler=0, period=0xFFFF)
    counter.channel(1, pyb.Timer.ENC_AB)
    machine.mem16[check_pin_profile.COUNTERS[timer] + _CCMR1] |= _FILTER
    return counter
