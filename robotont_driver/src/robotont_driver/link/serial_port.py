"""A serial port: opened as this process' own, who holds it, what is behind it, and what its errors mean."""

import contextlib
import errno
import fcntl
import glob
import os
import termios
import time
from pathlib import Path

import serial
from serial.tools.list_ports import comports

TERMINALS = "/dev/pts/"


def is_pseudo_terminal(port):
    """Whether a port's name leads to one."""
    return os.path.realpath(port).startswith(TERMINALS)


def refusal(port):
    """Why a port must not be opened, with advice: it is somebody's terminal; empty when it may be."""
    device = os.path.realpath(port)
    pid = session_of(device) if is_pseudo_terminal(port) else 0
    return f"leads to {device}, the terminal of process {pid}; choose another port, or remove the link" if pid else ""


def session_of(device):
    """Process id of one whose controlling terminal is `device`; 0 when there is none."""
    try:
        number = os.stat(device).st_rdev
    except OSError:
        return 0
    major, minor = os.major(number), os.minor(number)
    terminal = (minor & 0xFF) | (major << 8) | (minor & ~0xFF) << 12  # as the fifth field of /proc/PID/stat has it
    terminals = ((pid, _read(pid, "stat").rpartition(")")[2].split()[4:5]) for pid in _processes())
    return next((pid for pid, its in terminals if its == [str(terminal)]), 0)


def users_of(port):
    """List of the other processes, of which this user may see it, that have a port open, as text."""
    device = os.path.realpath(port)
    return [f"process {pid} ({_read(pid, 'comm').strip()})" for pid in _processes()
            if pid != os.getpid() and device in _open_files(pid)]


def _processes():
    return [int(name) for name in os.listdir("/proc") if name.isdigit()]


def _read(pid, file):
    """The text of a process' file in /proc, whose name may be cut within a letter; empty without such a process."""
    try:
        return Path(f"/proc/{pid}/{file}").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""


def _open_files(pid):
    """Paths of the files that a process has open, as far as this user may see them."""
    with contextlib.suppress(OSError):
        return [os.path.realpath(f"/proc/{pid}/fd/{descriptor}") for descriptor in os.listdir(f"/proc/{pid}/fd")]
    return ()


ADVICE = {
    errno.EACCES: "add your user to the group dialout (sudo usermod -aG dialout $USER) and log in again",
    errno.ENOENT: "is the board plugged in, and is this the right port?",
}
BUSY = (errno.EAGAIN, errno.EBUSY)  # locked by another program, or marked as its own


class ForeignPortError(OSError):
    """A port that belongs to another process."""


@contextlib.contextmanager
def opened(name, baudrate, timeout=0.0):
    """A port as this process' own: also programs that look at no lock are refused. Yields serial.Serial; OSError."""
    # a pseudo-terminal is only locked: after `kill -9` it would stay marked
    reason = refusal(name)
    if reason:
        raise ForeignPortError(reason)
    try:
        port = serial.Serial(name, baudrate, timeout=timeout, exclusive=True)
    except (ValueError, termios.error) as error:  # pyserial's own are OSErrors
        raise OSError(*error.args) from error
    with port:
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
    """Names of the serial ports at which a board may be, one for each: udev's rules give several."""
    names = sorted(file for kind in ("robotont*", "ttyACM*", "ttyUSB*") for file in glob.glob("/dev/" + kind))
    return list({os.path.realpath(name): name for name in names}.values())


def explain(port, error):
    """Message about an error on opening or using a port, with advice; the ports that there are, where it is none."""
    if isinstance(error, ForeignPortError):
        return f"{port}: {error}"
    number = getattr(error, "errno", None)
    if number in BUSY:
        users = []
        with contextlib.suppress(OSError):  # of /proc, as when this process has too many open files
            users = users_of(port)[:1]
        return ": ".join([f"{port}: another program holds it open", *users])
    advice = ADVICE.get(number, "is it a serial port, and still plugged in?")
    if number == errno.EACCES and is_pseudo_terminal(port):
        advice = "it is another user's simulator, or what is left of it: choose another port"
    if number == errno.ENOENT and serial_ports():
        advice += " there are " + ", ".join(serial_ports())
    # pyserial's own message contains the port and the system's message twice
    return f"{port}: {os.strerror(number).lower() if number else error}; {advice}"
