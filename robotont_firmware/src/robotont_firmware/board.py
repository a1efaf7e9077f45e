"""The NUCLEO-L476RG behind the board interface of robotont_firmware.main_loop; no other module depends on it.

Everything that allocates happens in the constructor and in `start`; the methods below run with the heap locked.
"""

from array import array

import machine
import pyb

from robotont_firmware import check_wiring
from robotont_firmware import gain_bounds as bounds

TIMER_CLOCK = 80000000  # [Hz]
_FULL_SCALE = 4095  # of the analogue input, 3.3 V

# A note to the next start, in a backup register of the real-time clock: it outlives every reset but a power
# cut, costs no file system, and MicroPython itself uses none of these registers.
_NOTE = 0x400028CC  # RTC_BKP31R
REPL_WISHED = 0x524F4231
CRASHED = 0x524F4232
_STARTS = 0x400028C8  # RTC_BKP30R: how many starts in a row have ended before LASTING periods
IN_VAIN = 3  # such starts; the next one leaves the REPL free
_LASTING = 100  # [periods]

# Counter timers, for the filter registers that pyb does not reach; TIMx_CCMR1 is at 0x18 of each.
_TIMERS = {1: 0x40012C00, 2: 0x40000000, 3: 0x40000400, 4: 0x40000800, 5: 0x40000C00, 8: 0x40013400}
_CCMR1 = 0x18
_FILTER = 0xF0F0  # both inputs: 8 samples at 1/32 of the clock, 3.2 us; a state lasts 100 us at 500 rpm


def motors_off(config):
    """Drive every pin that could turn a motor low; in reset they float (hence the pull-downs)."""
    for wiring in config.PWM:
        pyb.Pin(wiring[0], pyb.Pin.OUT_PP, value=0)
    for pins in config.DIRECTIONS:
        for pin in pins:
            pyb.Pin(pin, pyb.Pin.OUT_PP, value=0)


def take_note():
    """Return the note that the last run left for this start, and forget it."""
    note = machine.mem32[_NOTE]
    machine.mem32[_NOTE] = 0
    return note & 0xFFFFFFFF


def leave_note(note):
    """Leave REPL_WISHED or CRASHED for the next start."""
    machine.mem32[_NOTE] = note


def starts_in_vain(cause):
    """Return how many starts in a row have ended at once by a crash or the watchdog; `cause` of this one."""
    if cause not in ("crash", "watchdog"):
        machine.mem32[_STARTS] = 0
    return machine.mem32[_STARTS]


def forget_starts():
    """Let the next start try again."""
    machine.mem32[_STARTS] = 0


def button_pressed(config):
    """Return True while the USER button is held."""
    return pyb.Pin(config.SAFE_BUTTON, pyb.Pin.IN).value() == 0


def restart_into_repl():
    """Reset the board, which then stays in the REPL: the watchdog allows no REPL without a reset."""
    leave_note(REPL_WISHED)
    machine.reset()


def reset_cause(note):
    """Return why the board started, in one word; `note` is what take_note returned.

    A reset by software looks like the reset button to the chip.
    """
    if note == CRASHED:
        return "crash"
    causes = {
        machine.PWRON_RESET: "power",
        machine.HARD_RESET: "button",
        machine.WDT_RESET: "watchdog",
        machine.SOFT_RESET: "soft",
    }
    return causes.get(machine.reset_cause(), "other")


class Board:
    """Claims timers and pins as in `config`; `start` also takes the serial line and arms the watchdog.

    Until `start` the REPL works, so that an error in the configuration can be reported. Raises ValueError when
    the configuration cannot work.
    """

    def __init__(self, config):
        check_wiring.check(config)
        motors_off(config)
        self._motors = len(config.PWM)
        self._config = config
        self._full = config.FULL_EFFORT
        self._ticks = 0  # written by the tick's interrupt alone
        self._seen = 0
        self._young = _LASTING
        self._latched = array("H", [0] * self._motors)  # written by the tick's interrupt alone
        self._taken = array("H", [0] * self._motors)  # what was latched at the tick that wait_tick has seen
        pull = pyb.Pin.PULL_UP if config.ENCODER_PULL_UPS else pyb.Pin.PULL_NONE
        self._encoders = [_encoder(pull, *wiring) for wiring in config.ENCODERS]
        self._backward_encoders = list(config.BACKWARD_ENCODERS)
        self._forward = [pyb.Pin(pins[0], pyb.Pin.OUT_PP) for pins in config.DIRECTIONS]
        self._backward = [pyb.Pin(pins[1], pyb.Pin.OUT_PP) for pins in config.DIRECTIONS]
        divider = TIMER_CLOCK // config.PWM_FREQUENCY  # [ticks] of a PWM period
        prescaler = divider >> 16
        self._width = divider // (prescaler + 1)
        timers = {}
        for wiring in config.PWM:
            if wiring[1] not in timers:
                timers[wiring[1]] = pyb.Timer(wiring[1], prescaler=prescaler, period=self._width - 1)
        self._pwm = [
            timers[timer].channel(channel, pyb.Timer.PWM, pin=pyb.Pin(pin), pulse_width=0)
            for pin, timer, channel, _ in config.PWM
        ]
        self._faults = [pyb.Pin(pin, pyb.Pin.IN, pyb.Pin.PULL_UP) for pin in config.FAULTS]
        self._uart = None
        if config.BATTERY_PIN is not None:
            self._adc = pyb.ADC(pyb.Pin(config.BATTERY_PIN))
            self.battery = self._battery  # a board that does not measure has no such method

    def start(self):
        """From here on USART2 carries packets and no REPL, ticks come, and last the watchdog is armed.

        It resets the board when `feed` is not called within config.WATCHDOG ms, and nothing disarms it.
        """
        config = self._config
        self._on_tick = self._tick  # making the bound method in the interrupt would allocate
        self._try()
        self._timer = pyb.Timer(config.TICK_TIMER, freq=config.RATE)
        self._timer.callback(self._on_tick)
        repl = pyb.repl_uart()
        pyb.repl_uart(None)  # also keeps a 0x03 on the line from raising KeyboardInterrupt
        try:
            if config.UART == check_wiring.REPL_UART:
                self._uart = pyb.UART(config.UART, config.BAUDRATE)
            else:
                self._uart = pyb.UART(config.UART, config.BAUDRATE, rxbuf=bounds.line_bytes(config))
            machine.mem32[_STARTS] += 1
            self._watchdog = machine.WDT(timeout=config.WATCHDOG)
        except Exception:
            pyb.repl_uart(repl)
            raise

    def _try(self):
        """Do once what the loop does: an error ends in the REPL as long as the watchdog sleeps."""
        self._on_tick(None)
        self.wait_tick()
        self.counts(array("H", [0] * self._motors))
        for wheel in range(self._motors):
            self.fault(wheel)
            self.drive(wheel, 0)
        if self._config.BATTERY_PIN is not None:
            self._battery()

    def _tick(self, _):
        """Latch all encoders at one moment, in the timer's interrupt."""
        for motor in range(self._motors):
            self._latched[motor] = self._encoders[motor].counter()
        self._ticks = (self._ticks + 1) & 0xFFFF

    def wait_tick(self):
        """Sleep until the next tick; return how many there were since the last call."""
        while self._ticks == self._seen:
            pyb.wfi()
        ticks = -1
        while ticks != self._ticks:  # again when the next tick came in between
            ticks = self._ticks
            for motor in range(self._motors):
                self._taken[motor] = self._latched[motor]
        periods = (ticks - self._seen) & 0xFFFF
        self._seen = ticks
        return periods

    def counts(self, totals):
        """Copy the encoder counters of that tick, 0..65535 each, up while the motor drives forward."""
        for motor in range(self._motors):
            count = self._taken[motor]
            totals[motor] = -count & 0xFFFF if self._backward_encoders[motor] else count

    def drive(self, wheel, effort):
        """Set direction and pulse width; 0 leaves both direction pins low."""
        self._forward[wheel].value(effort > 0)
        self._backward[wheel].value(effort < 0)
        self._pwm[wheel].pulse_width(abs(effort) * self._width // self._full)

    def fault(self, wheel):
        """Return True while the motor driver pulls its fault line low; False where none is connected."""
        return len(self._faults) > 0 and self._faults[wheel].value() == 0

    def _battery(self):
        """Return the battery's voltage [mV]."""
        return self._adc.read() * self._config.BATTERY_DIVIDER // _FULL_SCALE

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
        """Feed the watchdog, after every period."""
        self._watchdog.feed()
        if self._young > 0:
            self._young -= 1
            if self._young == 0:
                machine.mem32[_STARTS] = 0

    def stop(self):
        """Switch the motors off for good: no pulses, then plain pins held low, also after this program."""
        for motor in range(self._motors):
            self.drive(motor, 0)
        motors_off(self._config)


def _encoder(pull, pin_a, pin_b, timer, function):
    """Return a 16-bit hardware counter of every edge of both channels, with the inputs' filters on."""
    for pin in (pin_a, pin_b):
        pyb.Pin(pin, pyb.Pin.AF_PP, pull=pull, alt=function)
    counter = pyb.Timer(timer, prescaler=0, period=0xFFFF)
    counter.channel(1, pyb.Timer.ENC_AB)
    machine.mem16[_TIMERS[timer] + _CCMR1] |= _FILTER
    return counter
