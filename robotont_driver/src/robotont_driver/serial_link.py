"""A serial port that may come and go: bytes in without polling, newest command out without waiting."""

import contextlib
import errno
import os
import select
import termios
import threading
import time

import serial

from robotont_driver.port_owner import refusal

READ_SIZE = 4096  # [bytes]


class SerialLink:
    """Keeps a serial port open, in one thread, and survives whatever happens to it.

    received(data): called with bytes as they come. changed(trouble): called once per change, with None
    when the port is open and with words when it is not; both are called from the link's thread.
    stop_packet() gives the bytes that are sent once when nothing was sent for `write_timeout` [s].
    """

    def __init__(self, port, baudrate, received, changed, stop_packet, write_timeout=0.5, retry_period=0.5):
        self._name = port
        self._baudrate = baudrate
        self._received = received
        self._changed = changed
        self._stop_packet = stop_packet
        self._write_timeout = write_timeout
        self._retry_period = retry_period
        self._lock = threading.Lock()
        self._port = None
        self._tried = False     # whether it has been attempted to open the port
        self._rest = b""        # of a packet that is half on the line: it must be finished first
        self._waiting = b""     # newest packet that the line had no room for
        self._deadline = None   # [s] when to send the stop packet
        self._closing = False
        self._woken, self._wake = os.pipe()
        os.set_blocking(self._wake, False)
        self.trouble = "not opened yet"  # None while the port is open
        self.opened = 0         # times
        self.sent = 0           # packets
        self.replaced = 0       # packets that a newer one overtook before they were sent
        self.unsent = 0         # packets given while the port was closed
        self.timeouts = 0       # stop packets sent
        self._thread = threading.Thread(target=self._run, daemon=True)
        self._thread.start()

    def send(self, packet):
        """Send bytes as soon as the line takes them. Never blocks; a newer packet replaces a waiting one.

        After `close` nothing is sent any more: its packet is the last one.
        """
        with self._lock:
            if self._closing:
                return
            self._deadline = time.monotonic() + self._write_timeout
            if self._port is None:
                self.unsent += 1
            else:
                self._queue(packet)

    def close(self, packet):
        """Send a last packet, close the port and end the thread."""
        with self._lock:
            if self._port is not None:
                self._queue(packet)
            self._closing = True
        self._notify()
        self._thread.join(self._retry_period + self._write_timeout)

    def _queue(self, packet):
        self.replaced += bool(self._waiting)
        self._waiting = packet
        self._write()
        if self._rest or self._waiting:
            self._notify()  # the thread has to wait for room

    def _write(self):
        """Write what the line takes now."""
        while self._rest or self._waiting:
            if not self._rest:
                self._rest, self._waiting = self._waiting, b""
                self.sent += 1
            try:
                written = os.write(self._port.fileno(), self._rest)
            except BlockingIOError:
                return
            except OSError:
                return  # the thread notices by itself that the port is gone
            self._rest = self._rest[written:]

    def _notify(self):
        with contextlib.suppress(BlockingIOError):  # when full, it has been woken often enough
            os.write(self._wake, b"!")

    def _run(self):
        while not self._closing:
            try:
                check_owner(self._name)
                with serial.Serial(self._name, self._baudrate, timeout=0, exclusive=True) as port:
                    self._opened(port)
                    try:
                        self._serve(port)
                    finally:
                        with self._lock:  # nobody may write to a descriptor that is closed, or opened by others
                            self._port = None
            except (OSError, ValueError, termios.error) as error:  # pyserial's own errors are OSErrors
                self._lost(explain(self._name, error))
                self._wait(self._retry_period)

    def _opened(self, port):
        with self._lock:
            self._port = port
            self._rest = self._waiting = b""
            self._deadline = time.monotonic() + self._write_timeout
            self.opened += 1
            self.trouble = None
        self._changed(None)

    def _lost(self, trouble):
        changed = self.trouble is None or not self._tried
        self._tried = True
        self.trouble = trouble  # may become another one while the port stays closed
        if changed and not self._closing:
            self._changed(trouble)

    def _serve(self, port):
        """Move bytes both ways until the port fails or the link is closed."""
        while True:
            with self._lock:
                self._stop_when_silent()
                unsent = self._rest or self._waiting
                deadline = self._deadline
                if self._closing and not unsent:
                    return
            timeout = None if deadline is None else max(0.0, deadline - time.monotonic())
            if self._closing:
                timeout = self._write_timeout
            readable, writable, _ = select.select(
                [port.fileno(), self._woken], [port.fileno()] if unsent else [], [], timeout)
            if self._woken in readable:
                os.read(self._woken, READ_SIZE)
            if writable:
                with self._lock:
                    self._write()
            if port.fileno() in readable:
                data = os.read(port.fileno(), READ_SIZE)
                if not data:
                    raise OSError("the device is gone")
                self._received(data)
            elif self._closing and not readable and not writable:
                return  # the line took nothing for the whole time-out

    def _stop_when_silent(self):
        if self._deadline is not None and time.monotonic() >= self._deadline:
            self._deadline = None
            self.timeouts += 1
            self._waiting = self._stop_packet()
            self._write()

    def _wait(self, duration):
        if select.select([self._woken], [], [], duration)[0]:
            os.read(self._woken, READ_SIZE)


ADVICE = {
    errno.EACCES: "add your user to the group dialout (sudo usermod -aG dialout $USER) and log in again",
    errno.ENOENT: "is the board plugged in, and is this the right port?",
    errno.EAGAIN: "another program holds it open",
}


class ForeignPortError(OSError):
    """A port that is somebody else's."""


def check_owner(port):
    """Raise ForeignPortError where a port leads to somebody's terminal, or may soon."""
    words = refusal(port)
    if words:
        raise ForeignPortError(words)


def explain(port, error):
    """Words for an error on opening or using a port, with what to do about it."""
    if isinstance(error, ForeignPortError):
        return f"{port}: {error}"
    number = getattr(error, "errno", None)
    advice = ADVICE.get(number, "is the board still plugged in?")
    # pyserial's own words hold the port and the system's words twice
    return f"{port}: {os.strerror(number).lower() if number else error}; {advice}"
