"""Ownership of a pseudo-terminal: a marker file beside the link of a simulated port, and a check before opening one.

The kernel gives the name of a pseudo-terminal whose owner has died to the next terminal window. A link that such an
owner left behind leads into a user's shell.
"""

import contextlib
import os
from pathlib import Path
from typing import NamedTuple

TERMINALS = "/dev/pts/"


class Owner(NamedTuple):
    """The process that made a link to a pseudo-terminal."""

    pid: int
    started: int  # [clock ticks after boot], for process ids are used again
    device: str   # what the link leads to

    @property
    def lives(self):
        """Whether the process still runs."""
        return self.started > 0 and start_of(self.pid) == self.started


def marker(link):
    """Path of the marker beside a link."""
    return Path(f"{link}.owner")


def sign(link, device):
    """Write the marker which shows that this process owns `link` to `device`. Raises OSError."""
    new = Path(f"{marker(link)}.{os.getpid()}")
    new.write_text(f"{os.getpid()} {start_of(os.getpid())} {device}\n")
    os.replace(str(new), str(marker(link)))


def read_owner(link):
    """`Owner` of a link; None without a readable marker beside it."""
    try:
        pid, started, device = marker(link).read_text().split()
        return Owner(int(pid), int(started), device)
    except (OSError, ValueError):
        return None


def remove(link):
    """Remove a link and its marker, where they exist. Raises OSError."""
    for path in (str(link), str(marker(link))):
        with contextlib.suppress(FileNotFoundError):
            os.unlink(path)


def refusal(port):
    """Why a port must not be opened, with advice; empty when it may be.

    Only pseudo-terminals are checked: one whose owner has died, and the terminal of a session.
    """
    device = os.path.realpath(port)
    if not is_pseudo_terminal(device):
        return ""
    owner = read_owner(port) if os.path.islink(port) else None
    if owner and owner.device == device and not owner.lives:
        return f"left behind by process {owner.pid}, which has ended; start the simulator again, or remove the link"
    pid = session_of(device)
    if pid:
        return f"leads to {device}, the terminal of process {pid}; choose another port, or remove the link"
    return ""


def is_pseudo_terminal(port):
    """Whether a port's name leads to a pseudo-terminal."""
    return os.path.realpath(port).startswith(TERMINALS)


def users_of(port):
    """List of the other processes that have a port open, as text; without those of which this user may see nothing."""
    device = os.path.realpath(port)
    return [f"process {pid} ({name_of(pid)})" for pid in _processes()
            if pid != os.getpid() and device in _open_files(pid)]


def name_of(pid):
    """Name of a process' program; empty when there is no such process."""
    try:
        return Path(f"/proc/{pid}/comm").read_text().strip()
    except OSError:
        return ""


def _processes():
    return [int(name) for name in os.listdir("/proc") if name.isdigit()]


def _open_files(pid):
    """Paths of the files that a process has open, as far as this user may see them."""
    files = set()
    with contextlib.suppress(OSError):
        for descriptor in os.listdir(f"/proc/{pid}/fd"):
            with contextlib.suppress(OSError):
                files.add(os.readlink(f"/proc/{pid}/fd/{descriptor}"))
    return files


def session_of(device):
    """Process id of one whose controlling terminal is `device`; 0 when there is none."""
    try:
        number = os.stat(device).st_rdev
    except OSError:
        return 0
    major, minor = os.major(number), os.minor(number)
    terminal = (minor & 0xFF) | (major << 8) | (minor & ~0xFF) << 12  # as /proc/PID/stat writes it
    for pid in _processes():
        if _stat(pid)[4:5] == [str(terminal)]:
            return pid
    return 0


def start_of(pid):
    """When a process was started [clock ticks after boot]; 0 when there is no such process."""
    fields = _stat(pid)
    return int(fields[19]) if len(fields) > 19 and fields[0] != "Z" else 0


def _stat(pid):
    """Fields of /proc/PID/stat from the third, the state, on; none when there is no such process."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return []
