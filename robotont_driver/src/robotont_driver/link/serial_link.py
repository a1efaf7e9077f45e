"""The loop of the serial port: open, wait, read, feed, publish, write; and again when the port is lost."""

import contextlib
import fcntl
import os
import select
import sys
import termios
import threading
import time
from collections import deque

from robotont_driver.command.command_age import Gaps
from robotont_driver.link.boot_clock import boot_time
from robotont_driver.link.serial_port import explain, opened, usb_id
from robotont_driver.protocol.connection import SILENCE, SILENT

READ_SIZE = 4096     # [bytes]
BITS_OF_A_BYTE = 10  # on the serial line, with start and stop
NOT_TRIED = "not opened yet"
FULL_LINE = 0.005    # [s] after which a driver that still has bytes to send is checked again
MOST_ADDED = 100     # lines that wait
GONE = select.POLLHUP | select.POLLERR | select.POLLNVAL


class SerialLink:
    """Keeps a serial port open, in a thread that reads, and survives whatever happens to it.

    It calls owner.connect(usb_id, now) for a new `Connection` to a port that was opened; owner.on_packet(packet);
    on_change(trouble) with None when the port is open, with a message when it is not; on_protocol(protocol) when the
    board's is known; on_failure(error) with an exception out of these or its own, behind which it opens the port anew.
    When no command came for `write_timeout` [s] the board is sent a stop, and another after each further one.
    """

    def __init__(self, port, baudrate, owner, write_timeout=0.5, retry_period=0.5):
        self._name, self._baudrate, self._owner = port, baudrate, owner
        self._write_timeout, self._retry_period = write_timeout, retry_period
        self._tick_period = write_timeout / 8  # [s] of the watch for gaps
        self._lock = threading.Lock()  # of the following five, and of the connection
        self._port = None       # file descriptor of the open port
        self._outbox = Outbox()
        self.commanded = None   # the newest `Packet` that the board was to follow, until it is too old
        self._deadline = 0.0    # [s] ... as it is then: when to send a stop packet
        self._closing = False
        self._woken, self._wake = os.pipe()  # wakes the thread
        os.set_blocking(self._wake, False)
        self.trouble = NOT_TRIED  # None while the port is open
        self.connection = None  # the newest `Connection`; None before the first
        self.opened = 0         # times
        self.unsent = 0         # packets given while the port was closed
        self.timeouts = 0       # stop packets sent
        self.outdated = 0       # packets that waited for this process for too long
        self.gaps = Gaps(write_timeout, boot_time())  # of this process
        self._thread = threading.Thread(target=self._run, daemon=True)

    sent = property(lambda self: self._outbox.sent, doc="Lines since the port was opened.")

    def start(self):
        """Begin: from now on the callbacks may be called."""
        self._thread.start()

    def send(self, packet):
        """Write a `Packet`, at once where the line takes it. Never blocks; a newer one replaces a waiting one.

        What may have waited for this process for `write_timeout` is not sent, but for zeros, and nothing after `close`.
        """
        if not self.gaps.settled(boot_time()) and any(packet):
            self.outdated += 1
            return
        now = time.monotonic()
        with self._lock:
            if self._port is None:
                self.unsent += 1
                return
            self.commanded, self._deadline = None, now + self._write_timeout
            if not self._closing:
                self._outbox.put(self.connection.encode(packet, now))
                self.commanded = packet if self.connection.drives else None
                with contextlib.suppress(OSError):  # of the port, which the thread finds, too
                    self._outbox.write(self._port, time.monotonic)
            if self._outbox:
                self._notify()

    def add(self, line):
        """Send a line (bytes) when no packet waits."""
        self._outbox.added.append(line)
        self._notify()

    def close(self):
        """Send a last stop, close the port and end the thread."""
        self._closing = True
        self._notify()
        self._thread.join(self._retry_period + self._write_timeout)

    def _notify(self):
        with contextlib.suppress(BlockingIOError):  # when full, it has been woken often enough
            os.write(self._wake, b"!")

    def _run(self):
        while not self._closing:
            try:
                with opened(self._name, self._baudrate) as port:
                    now = time.monotonic()
                    self.connection = connection = self._call("connect", usb_id(self._name), now)
                    self._outbox = Outbox(BITS_OF_A_BYTE / self._baudrate)
                    self.commanded, self._deadline = None, now + self._write_timeout
                    self.opened += 1
                    self.trouble = None
                    try:
                        self._port = port.fileno()
                        self._call("on_change", None)
                        self._serve(self._port, connection)
                    finally:
                        with self._lock:
                            self._port = None
            except OSError as error:  # of the port
                self._lost(explain(self._name, error))
            except Exception as error:  # without this thread nothing would stop the robot
                self._owner.on_failure(error)
                self._lost(f"{self._name}: a fault of this program, {type(error).__name__}: {error}")
            self._rest(self._retry_period)

    def _call(self, name, *args):
        try:
            return getattr(self._owner, name)(*args)
        except OSError as error:  # of the owner, as of a full disk: none of the port
            raise RuntimeError(f"{type(error).__name__}: {error}") from error

    def _serve(self, port, connection):
        """Move bytes both ways until the port fails, the board falls silent or the link is closed."""
        poll, protocol = select.poll(), None
        poll.register(self._woken, select.POLLIN)
        poll.register(port, select.POLLIN)
        while True:
            if connection.protocol is not protocol:
                protocol = connection.protocol
                self._call("on_protocol", protocol)
            now = time.monotonic()
            self.gaps.tick(boot_time())
            if self._closing:
                self._say_goodbye(port, connection)
                return
            if connection.state(now) == SILENT:
                raise OSError(f"no packet for {SILENCE:g} s")
            with self._lock:
                rest = self._write(port, connection, now)
            events = dict(poll.poll(1000 * rest))
            if self._woken in events:
                os.read(self._woken, READ_SIZE)
            data = read(port, events[port]) if port in events else b""
            for line in data.splitlines(keepends=True):  # of a burst, each packet goes out before the next line is read
                for packet in self._feed(port, connection, line):
                    self._call("on_packet", packet)

    def _write(self, port, connection, now):
        """Write what waits, or a stop where the newest command is too old; [s] until more is to do if nothing comes."""
        if now >= self._deadline:
            self.commanded, self._deadline = None, now + self._write_timeout
            stop = connection.stop(now)
            self.timeouts += bool(stop)
            self._outbox.put(stop)
        self._outbox.write(port, time.monotonic)
        left = min(max(0.0, self._deadline - now), self._tick_period)
        return min(left, self._outbox.wait(now) or FULL_LINE) if self._outbox else left

    def _feed(self, port, connection, line):
        """List of `Packet` that a line completes; a board that is known by it is greeted before it gets a command."""
        with self._lock:
            protocol = connection.protocol
            packets = connection.feed(line, time.monotonic())
            if connection.protocol is not protocol:
                self._outbox.pacing = connection.protocol.pacing
                self._outbox.put(connection.protocol.hello)
                self._outbox.write(port, time.monotonic)
        return packets

    def _say_goodbye(self, port, connection):
        """Write a stop twice, for a line may be spoilt, as far as the port takes it in time."""
        with self._lock:  # behind a command that is being written; from now on there are none
            stop = connection.last_stop()
            self._outbox.put(stop)
            self._outbox.added.extend(filter(None, [stop]))
        end = time.monotonic() + self._write_timeout
        while self._outbox and time.monotonic() < end:
            self._outbox.write(port, time.monotonic)
            time.sleep(FULL_LINE if self._outbox else 0.0)

    def _lost(self, trouble):
        changed = self.trouble in (None, NOT_TRIED)
        self.trouble = trouble  # may become another one while the port stays closed
        if self.connection:
            self.connection.trouble = trouble
        if changed and not self._closing:
            try:
                self._owner.on_change(trouble)
            except Exception as error:
                self._owner.on_failure(error)

    def _rest(self, duration):
        end = time.monotonic() + duration
        while not self._closing and time.monotonic() < end:
            time.sleep(min(duration, self._tick_period))
            self.gaps.tick(boot_time())


def read(port, events):
    """The bytes that have come; empty where another reader was faster. Raises OSError where the port is gone."""
    try:
        data = os.read(port, READ_SIZE)
    except BlockingIOError:
        data = b""
    if not data and events & GONE:
        raise OSError("the device is gone")
    return data


class Outbox:
    """The newest command that was `put`, until it is written; one line at a time.

    added: lines (bytes) that wait until no command does; any thread may append. byte_time: [s] of a byte on the line.
    """

    def __init__(self, byte_time=0.0):
        self.pacing = 0.0  # [s] least time from a line's end to the next one's beginning
        self._byte_time = byte_time
        self._command = b""
        self.added = deque(maxlen=MOST_ADDED)
        self._free_at = self._pause = 0.0  # [s] from when on a line may be written; behind the newest one
        self._rest = b""         # of a line that is half written: it must be finished first
        self.sent = 0            # lines

    def __bool__(self):
        """Whether anything has still to be written."""
        return bool(self._rest or self._command or self.added)

    def put(self, command):
        """A command (bytes), which replaces one that still waits."""
        self._command = command

    def write(self, descriptor, clock):
        """Write to a port what it takes now; no line while the driver has bytes of one before: it would wait."""
        with contextlib.suppress(BlockingIOError):
            while self._rest or (self and not waiting_bytes(descriptor)):
                self._rest = self._rest or self.take(clock())
                if not self._rest:
                    return
                self._rest = self._rest[os.write(descriptor, self._rest):]
                self.written(clock())

    def take(self, now):
        """The line to write now [s]; empty when there is none, or it is too early."""
        if now < self._free_at or not (self._command or self.added):
            return b""
        line, self._command = self._command or self.added.popleft(), b""
        self._pause = self.pacing + len(line) * self._byte_time
        self.sent += 1
        self.written(now)
        return line

    def written(self, now):
        """A line or a part is out: the pause behind it begins now."""
        self._free_at = now + self._pause

    def wait(self, now):
        """[s] until the next line may be written."""
        return max(0.0, self._free_at - now)


def waiting_bytes(descriptor):
    """Bytes written to a port that its driver has not sent yet."""
    return int.from_bytes(fcntl.ioctl(descriptor, termios.TIOCOUTQ, b"\0\0\0\0"), sys.byteorder)
