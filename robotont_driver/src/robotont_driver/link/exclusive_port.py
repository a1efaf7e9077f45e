"""A serial port: who holds it, what is behind it, and what its errors mean."""

import contextlib
import errno
import fcntl
import glob
import os
import sys
import termios
import time

import serial
from serial.tools.list_ports import comports

from robotont_driver.link.port_owner import is_pseudo_terminal, refusal, users_of

ADVICE = {
    errno.EACCES: "add your user to the group dialout (sudo usermod -aG dialout $USER) and log in again",
    errno.ENOENT: "is the board plugged in, and is this the right port?",
}
BUSY = (errno.EAGAIN, errno.EBUSY)  # locked by another program, or marked as its own


def waiting_bytes(descriptor):
    """Bytes written to a port that its driver has not sent yet."""
    return int.from_bytes(fcntl.ioctl(descriptor, termios.TIOCOUTQ, b"\0\0\0\0"), sys.byteorder)


class ForeignPortError(OSError):
    """A port that belongs to another process."""


@contextlib.contextmanager
def opened(name, baudrate, timeout=0.0):
    """A port as this process' own: also programs that look at no lock are refused. Yields serial.Serial.

    Raises OSError, and ForeignPortError where it leads to a user's terminal, or may soon. A pseudo-terminal is only
    locked: after `kill -9` it would stay marked for as long as its other end lives; a real port loses the mark.
    """
    reason = refusal(name)
    if reason:
        raise ForeignPortError(reason)
    with serial.Serial(name, baudrate, timeout=timeout, exclusive=True) as port:
        if is_pseudo_terminal(name):
            yield port
            return
        if users_of(name):
            raise OSError(errno.EBUSY, os.strerror(errno.EBUSY))
        fcntl.ioctl(port.fileno(), termios.TIOCEXCL)
        try:
            yield port
        finally:
            with contextlib.suppress(OSError):  # the device is gone
                fcntl.ioctl(port.fileno(), termios.TIOCNXCL)


def heard(port, baudrate, seconds):
    """Yield the bytes that come within a time [s]. Raises OSError."""
    end = time.monotonic() + seconds
    with opened(port, baudrate, 0.1) as line:
        while time.monotonic() < end:
            yield line.read(line.in_waiting or 1)


def usb_id(port):
    """The id "vendor:product" of the USB device behind a port such as /dev/ttyACM0; empty when there is none."""
    device = os.path.realpath(port)
    return next((f"{info.vid:04x}:{info.pid:04x}" for info in comports() if info.device == device and info.vid), "")


def serial_ports():
    """Names of the serial ports at which a board may be."""
    return sorted(file for kind in ("robotont*", "ttyACM*", "ttyUSB*") for file in glob.glob("/dev/" + kind))


def explain(port, error):
    """Message about an error on opening or using a port, with advice; the ports that there are, where it is none."""
    if isinstance(error, ForeignPortError):
        return f"{port}: {error}"
    number = getattr(error, "errno", None)
    if number in BUSY:
        return ": ".join([f"{port}: another program holds it open", *users_of(port)[:1]])
    advice = ADVICE.get(number, "is the board still plugged in?")
    if number == errno.ENOENT and serial_ports():
        advice += " there are " + ", ".join(serial_ports())
    # pyserial's own message contains the port and the system's message twice
    return f"{port}: {os.strerror(number).lower() if number else error}; {advice}"
