"""A serial port that may come and go: bytes in without polling, newest command out without waiting."""

import contextlib
import os
import select
import termios
import threading
import time

from robotont_driver.link.exclusive_port import explain, opened
from robotont_driver.link.line_writer import LineWriter
from robotont_driver.timing.starvation import StallWatch

READ_SIZE = 4096    # [bytes]
BITS_OF_A_BYTE = 10  # on the serial line, with start and stop
NOT_TRIED = "not opened yet"
FULL_LINE = 0.005   # [s] after which a driver that still has bytes to send is checked again


class SerialLink:
    """Keeps a serial port open, in one thread, and survives whatever happens to it.

    It calls received(data) with bytes as they come; changed(trouble) once per change, with None when the port is open
    and with a message when it is not; failed(error) with an exception out of these or its own, and goes on.
    stop_packet() gives the bytes that are sent once when nothing was sent for `write_timeout` [s]; it may give none.
    """

    def __init__(self, port, baudrate, received, changed, stop_packet, failed, write_timeout=0.5, retry_period=0.5):
        self._name = port
        self._baudrate = baudrate
        self._received = received
        self._changed = changed
        self._stop_packet = stop_packet
        self._failed = failed
        self._write_timeout = write_timeout
        self._retry_period = retry_period
        self._tick_period = write_timeout / 8  # [s] of the watch for stalls
        self._lock = threading.Lock()
        self.writer = LineWriter(BITS_OF_A_BYTE / baudrate, self._stop_when_silent)
        self._deadline = None   # [s] when to send the stop packet
        self._closing = False
        self._close_by = None   # [s] when to give up sending the last packet
        self._woken, self._wake = os.pipe()
        os.set_blocking(self._wake, False)
        self.trouble = NOT_TRIED  # None while the port is open
        self.opened = 0         # times
        self.unsent = 0         # packets given while the port was closed
        self.timeouts = 0       # stop packets sent
        self.outdated = 0       # packets that waited for this process for too long
        self.failures = 0       # exceptions out of callbacks, and of this class
        self.failure = ""       # description of the newest
        self.stalls = StallWatch(write_timeout / 2, time.monotonic())  # of this process
        self._thread = threading.Thread(target=self._run, daemon=True)

    def start(self):
        """Begin: from now on the callbacks may be called."""
        self._thread.start()

    def pace(self, pacing):
        """From now on let at least `pacing` [s] pass between the beginnings of two lines; 0: as fast as may be."""
        with self._lock:
            self.writer.outbox.pacing = pacing

    def send(self, packet):
        """Send bytes as soon as the line takes them. Never blocks; a newer packet replaces a waiting one.

        What may have waited for this process for `write_timeout` is not sent, and nothing after `close`.
        """
        with self._lock:
            if self._closing:
                return
            now = time.monotonic()
            deadline = self.stalls.earliest_arrival(now) + self._write_timeout
            if deadline <= now:
                self.outdated += 1
                return
            self._deadline = deadline
            if self.writer.descriptor is None:
                self.unsent += 1
            else:
                self._queue(self.writer.outbox.put, packet)

    def hurry(self, line, pause):
        """Send a line before all packets, then nothing for `pause` [s]."""
        self._send_line(self.writer.outbox.hurry, line, pause)

    def add(self, line):
        """Send a line when no packet waits."""
        self._send_line(self.writer.outbox.add, line)

    def _send_line(self, put, *arguments):
        with self._lock:
            if self.writer.descriptor is not None and not self._closing:
                self._queue(put, *arguments)

    def close(self, packet, goodbye=b"", pause=0.0):
        """Send `goodbye`, after a pause [s] a last packet, close the port and end the thread."""
        with self._lock:
            if self.writer.descriptor is not None:
                self.writer.outbox.hurry(goodbye, pause)
                self._queue(self.writer.outbox.put, packet)
            self._closing = True
            self._close_by = time.monotonic() + self._write_timeout + pause
        self._notify()
        self._thread.join(self._retry_period + self._write_timeout + pause)

    def _queue(self, put, *arguments):
        waited = self.writer.waits
        put(*arguments)
        self.writer.write()
        if not waited and self.writer.waits:
            self._notify()  # the thread has to wait for room, or for the time, from now on

    def _notify(self):
        with contextlib.suppress(BlockingIOError):  # when full, it has been woken often enough
            os.write(self._wake, b"!")

    def _run(self):
        while not self._closing:
            try:
                with opened(self._name, self._baudrate) as port:
                    self._opened(port.fileno())
                    try:
                        self._serve(port.fileno())
                    finally:
                        with self._lock:  # no thread may write to a descriptor that is closed, or opened by others
                            self.writer.descriptor = None
            except (OSError, ValueError, termios.error) as error:  # pyserial's own errors are OSErrors
                self._lost(explain(self._name, error))
            except Exception as error:  # without this thread nothing would stop the robot
                self._note_failure(error)
                self._lost(f"{self._name}: {self.failure}")
            self._wait(self._retry_period)

    def _call(self, callback, *arguments):
        """Result of a callback; None where it raises."""
        try:
            return callback(*arguments)
        except Exception as error:  # a fault in there is not one of the port, and must not end the thread
            self._note_failure(error)
            return None

    def _note_failure(self, error):
        self.failures += 1
        self.failure = f"{type(error).__name__}: {error}"
        self._failed(error)

    def _opened(self, descriptor):
        with self._lock:
            self.writer.open(descriptor)
            self._deadline = time.monotonic() + self._write_timeout
            self.opened += 1
            self.trouble = None
        self._call(self._changed, None)

    def _lost(self, trouble):
        changed = self.trouble in (None, NOT_TRIED)
        self.trouble = trouble  # may become another one while the port stays closed
        if changed and not self._closing:
            self._call(self._changed, trouble)

    def _serve(self, descriptor):
        """Move bytes both ways until the port fails or the link is closed."""
        while True:
            with self._lock:
                now = time.monotonic()
                self.stalls.tick(now)
                self._stop_when_silent(now)
                if self.writer.outbox and not self.writer.blocked:
                    self.writer.write()  # lines whose time has come
                blocked = self.writer.blocked
                timeout = self._time_to_rest(now)
                if self._closing and (timeout == 0.0 or not self.writer.waits):
                    return
            readable, writable, _ = select.select(
                [descriptor, self._woken], [descriptor] if blocked else [], [], timeout)
            if self._woken in readable:
                os.read(self._woken, READ_SIZE)
            if writable:
                with self._lock:
                    self.writer.write()
            if descriptor in readable:
                data = os.read(descriptor, READ_SIZE)
                if not data:
                    raise OSError("the device is gone")
                self._call(self._received, data)

    def _time_to_rest(self, now):
        """[s] until something has to be done although nothing comes."""
        if self._closing:
            left = max(0.0, self._close_by - now)
        else:
            left = self._tick_period if self._deadline is None else max(0.0, self._deadline - now)
        if self.writer.outbox and not self.writer.blocked and left != 0.0:
            left = min(left, self.writer.outbox.wait(now) or FULL_LINE)
        return min(left, self._tick_period)

    def _stop_when_silent(self, now):
        """Replace the command by the stop packet when it is too old."""
        if self._deadline is not None and now >= self._deadline and not self._closing:
            self._deadline = None
            packet = self._call(self._stop_packet) or b""
            self.timeouts += bool(packet)
            self.writer.outbox.put(packet)

    def _wait(self, duration):
        end = time.monotonic() + duration
        while not self._closing:
            with self._lock:
                now = time.monotonic()
                self.stalls.tick(now)
            if now >= end:
                return
            if select.select([self._woken], [], [], min(end - now, self._tick_period))[0]:
                os.read(self._woken, READ_SIZE)
