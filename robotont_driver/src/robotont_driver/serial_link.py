"""A serial port that may come and go: bytes in without polling, newest command out without waiting."""

import contextlib
import errno
import fcntl
import os
import select
import struct
import termios
import threading
import time

import serial

from robotont_driver.outbox import Outbox
from robotont_driver.port_owner import refusal

READ_SIZE = 4096    # [bytes]
FULL_LINE = 0.005   # [s] after which a driver that still has bytes to send is checked again
ADVICE = {
    errno.EACCES: "add your user to the group dialout (sudo usermod -aG dialout $USER) and log in again",
    errno.ENOENT: "is the board plugged in, and is this the right port?",
    errno.EAGAIN: "another program holds it open",
}


class SerialLink:
    """Keeps a serial port open, in one thread, and survives whatever happens to it.

    received(data): called with bytes as they come. changed(trouble): called once per change, with None
    when the port is open and with a message when it is not; both are called from the link's thread.
    stop_packet() gives the bytes that are sent once when nothing was sent for `write_timeout` [s]; it may give none.
    Lines are never joined in one write, and with `pace` no line follows another too soon.
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
        self._rest = b""        # of a line that is half written: it must be finished first
        self._outbox = Outbox()  # what waits behind it
        self._deadline = None   # [s] when to send the stop packet
        self._closing = False
        self._close_by = None   # [s] when to give up sending the last packet
        self._woken, self._wake = os.pipe()
        os.set_blocking(self._wake, False)
        self.trouble = "not opened yet"  # None while the port is open
        self.opened = 0         # times
        self.sent = 0           # lines
        self.unsent = 0         # packets given while the port was closed
        self.timeouts = 0       # stop packets sent
        self._thread = threading.Thread(target=self._run, daemon=True)

    def start(self):
        """Begin: from now on the callbacks may be called."""
        self._thread.start()

    @property
    def replaced(self):
        """Packets that a newer one overtook before they were sent."""
        return self._outbox.replaced

    def pace(self, pacing):
        """From now on let at least `pacing` [s] pass between the beginnings of two lines; 0: as fast as may be."""
        with self._lock:
            self._outbox.pacing = pacing

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
                self._queue(self._outbox.put, packet)

    def hurry(self, line, pause):
        """Send a line before all packets, then nothing for `pause` [s]."""
        self._send_line(self._outbox.hurry, line, pause)

    def add(self, line):
        """Send a line when no packet waits."""
        self._send_line(self._outbox.add, line)

    def _send_line(self, put, *arguments):
        with self._lock:
            if self._port is not None and not self._closing:
                self._queue(put, *arguments)

    def close(self, packet, goodbye=b"", pause=0.0):
        """Send `goodbye`, after a pause [s] a last packet, close the port and end the thread."""
        with self._lock:
            if self._port is not None:
                self._outbox.hurry(goodbye, pause)
                self._queue(self._outbox.put, packet)
            self._closing = True
            self._close_by = time.monotonic() + self._write_timeout + pause
        self._notify()
        self._thread.join(self._retry_period + self._write_timeout + pause)

    def _queue(self, put, *arguments):
        put(*arguments)
        self._write()
        if self._rest or self._outbox:
            self._notify()  # the thread has to wait for room, or for the time

    def _write(self):
        """Write what the line takes now."""
        while True:
            if not self._rest:
                self._rest = self._next_line()
                if not self._rest:
                    return
                self.sent += 1
            try:
                written = os.write(self._port.fileno(), self._rest)
            except BlockingIOError:
                return
            except OSError:
                return  # the thread notices by itself that the port is gone
            self._rest = self._rest[written:]

    def _next_line(self):
        """The line to write now; empty when it is too early, or a paced line would join another in the driver."""
        if self._outbox.pacing and self._outbox and waiting_bytes(self._port):
            return b""
        return self._outbox.take(time.monotonic())

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
                        with self._lock:  # no thread may write to a descriptor that is closed, or opened by others
                            self._port = None
            except (OSError, ValueError, termios.error) as error:  # pyserial's own errors are OSErrors
                self._lost(explain(self._name, error))
                self._wait(self._retry_period)

    def _opened(self, port):
        with self._lock:
            self._port = port
            self._rest = b""
            self._outbox.clear()
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
                if not self._rest:
                    self._write()  # lines whose time has come
                blocked = bool(self._rest)
                timeout = self._time_to_rest(time.monotonic())
                if self._closing and (timeout == 0.0 or not (blocked or self._outbox)):
                    return
            readable, writable, _ = select.select(
                [port.fileno(), self._woken], [port.fileno()] if blocked else [], [], timeout)
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

    def _time_to_rest(self, now):
        """[s] until something has to be done although nothing comes; None: never."""
        if self._closing:
            left = max(0.0, self._close_by - now)
        else:
            left = None if self._deadline is None else max(0.0, self._deadline - now)
        if not self._rest and self._outbox and left != 0.0:
            due = self._outbox.wait(now) or FULL_LINE
            left = due if left is None else min(left, due)
        return left

    def _stop_when_silent(self):
        if self._deadline is not None and time.monotonic() >= self._deadline:
            self._deadline = None
            packet = self._stop_packet()
            if packet and not self._closing:
                self.timeouts += 1
                self._outbox.put(packet)
                self._write()

    def _wait(self, duration):
        if select.select([self._woken], [], [], duration)[0]:
            os.read(self._woken, READ_SIZE)


def waiting_bytes(port):
    """Bytes written to a port that its driver has not sent yet."""
    return struct.unpack("@i", fcntl.ioctl(port.fileno(), termios.TIOCOUTQ, b"\0\0\0\0"))[0]


def usb_id(port):
    """The id "vendor:product" of the USB device behind a port such as /dev/ttyACM0; empty when there is none."""
    folder = os.path.realpath(os.path.join("/sys/class/tty", os.path.basename(os.path.realpath(port)), "device"))
    while len(folder) > len("/sys"):
        with contextlib.suppress(OSError):
            return ":".join(read_text(os.path.join(folder, name)) for name in ("idVendor", "idProduct"))
        folder = os.path.dirname(folder)
    return ""


def read_text(file):
    """Contents of a small file, without surrounding white space."""
    with open(file, encoding="ascii") as stream:
        return stream.read().strip()


class ForeignPortError(OSError):
    """A port that belongs to another process."""


def check_owner(port):
    """Raise ForeignPortError where a port leads to a user's terminal, or may soon."""
    reason = refusal(port)
    if reason:
        raise ForeignPortError(reason)


def explain(port, error):
    """Message about an error on opening or using a port, with advice."""
    if isinstance(error, ForeignPortError):
        return f"{port}: {error}"
    number = getattr(error, "errno", None)
    advice = ADVICE.get(number, "is the board still plugged in?")
    # pyserial's own message contains the port and the system's message twice
    return f"{port}: {os.strerror(number).lower() if number else error}; {advice}"
