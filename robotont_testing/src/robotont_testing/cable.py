"""A board's end of a pseudo-terminal that can be plugged and unplugged, served by a thread in real time."""

import os
import select
import threading
import time
import tty


class Cable:
    """The port `link`. What is made of it has `due` [s], the time of its next turn, `hear(data, now)` and `turn(now)`.

    The thread goes on while it is unplugged, and ends with `close`.
    """

    def __init__(self, link):
        self.link = link
        self.connected = False  # whether a process has the port open
        self._woken = self._wake = None  # the ends of a pipe that wakes the thread
        self._master = None     # its end of the port, in use by the thread
        self._wanted = None     # the one that the thread is to use
        self._taken = threading.Event()  # it does
        self._thread = None

    def plug(self):
        """Appear at the port's name."""
        master, slave = os.openpty()
        tty.setraw(slave)
        os.set_blocking(master, False)
        if os.path.islink(self.link):
            os.unlink(self.link)
        os.symlink(os.ttyname(slave), self.link)
        os.close(slave)
        if self._thread is None:
            self._woken, self._wake = os.pipe()
            self._thread = threading.Thread(target=self._run, daemon=True)
            self._thread.start()
        self._use(master)

    def unplug(self):
        """Vanish: the port's name and the line."""
        os.unlink(self.link)
        master = self._master
        self._use(None)
        os.close(master)

    def _use(self, master):
        """Let the thread use another end of the port, or none."""
        self._taken.clear()
        self._wanted = master
        os.write(self._wake, b"!")
        self._taken.wait()

    def close(self):
        """Unplug, if not unplugged already, and switch off."""
        if self._master is not None:
            Cable.unplug(self)
        if self._thread is not None:
            os.write(self._wake, b"0")
            self._thread.join()
            self._thread = None
            os.close(self._woken)
            os.close(self._wake)

    def __enter__(self):
        """Plug in."""
        self.plug()
        return self

    def __exit__(self, *_):
        """Switch off."""
        self.close()

    def send(self, data):
        """Write bytes to the line now; lost when no process has the port open."""
        try:
            while data:
                data = data[os.write(self._master, data):]
        except (OSError, TypeError):
            pass  # unplugged, full, or closed at the other end: a real board does not wait either

    def arrived(self, _now):
        """Number of bytes that the line can have brought until now."""
        return 4096

    def _run(self):
        poller = select.poll()
        poller.register(self._woken, select.POLLIN)
        while True:
            ready = dict(poller.poll(max(0.0, self.due - time.monotonic()) * 1000))
            now = time.monotonic()
            if self._woken in ready:
                if os.read(self._woken, 1) == b"0":
                    return
                if self._master is not None:
                    poller.unregister(self._master)
                self._master = self._wanted
                if self._master is not None:
                    poller.register(self._master, select.POLLIN)
                self._taken.set()
                continue
            events = ready.get(self._master, 0)
            data = self._read(self.arrived(now)) if events & select.POLLIN else b""
            now = time.monotonic()  # not before the read: what came while this thread was kept came no earlier
            if data:
                self.hear(data, now)
            self.connected = self._master is not None and not events & select.POLLHUP
            if ready and not data:
                time.sleep(0.001)  # port closed, or line slow: poll() would return at once
            self.turn(now)

    def _read(self, amount):
        try:
            return os.read(self._master, amount) if amount else b""
        except OSError:
            return b""
