"""Who uses a port: whether it is the terminal of a session, and which programs have it open.

The kernel gives the name of a pseudo-terminal whose program has died to the next terminal window. So the link of a
simulator that was killed may lead into a user's shell.
"""

import contextlib
import os
from pathlib import Path

TERMINALS = "/dev/pts/"


def is_pseudo_terminal(port):
    """Whether a port's name leads to a pseudo-terminal."""
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
    """List of the other processes that have a port open, as text; without those of which this user may see nothing."""
    device = os.path.realpath(port)
    return [f"process {pid} ({_read(pid, 'comm').strip()})" for pid in _processes()
            if pid != os.getpid() and device in _open_files(pid)]


def _processes():
    return [int(name) for name in os.listdir("/proc") if name.isdigit()]


def _read(pid, file):
    """The text of a process' file in /proc; empty when there is no such process."""
    try:
        return Path(f"/proc/{pid}/{file}").read_text()
    except OSError:
        return ""


def _open_files(pid):
    """Paths of the files that a process has open, as far as this user may see them."""
    files = set()
    with contextlib.suppress(OSError):
        for descriptor in os.listdir(f"/proc/{pid}/fd"):
            with contextlib.suppress(OSError):
                files.add(os.readlink(f"/proc/{pid}/fd/{descriptor}"))
    return files
