"""Ends the children of a process with it, whatever ended it: its end, Ctrl-C, SIGTERM, a closed terminal, SIGKILL.

A program holds a lifeline by `hold()`; a shell script by `lifeline.py PID FOLDER &` with its own process id and
`export ROBOTONT_LIFELINE=FOLDER`. Either way there is a folder for temporary files, and a keeper: a small process that
sleeps until the holder is dead. Then the keeper ends every process that has the folder in its environment, whichever
session or parent that process has by now (roslaunch gives each node a session of its own), and removes the folder.

Only the standard library, so that the file runs by its path before anything is built.
"""

import contextlib
import ctypes
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

VARIABLE = "ROBOTONT_LIFELINE"  # the folders of all holders above a process, separated by ":"
PR_SET_PDEATHSIG = 1            # of linux/prctl.h

# How the processes are asked, and for how long [s] each time before the next way
ATTEMPTS = 20  # to remove the folder
FAREWELLS = ((signal.SIGINT, 8.0), (signal.SIGTERM, 2.0), (signal.SIGKILL, 2.0))

_held = None  # (process id, folder): a forked process is no holder


def hold():
    """Folder (Path) for temporary files of this process; from now on all that it starts ends with it."""
    global _held  # noqa: PLW0603
    if _held is None or _held[0] != os.getpid():
        outer = os.environ.get(VARIABLE, "")
        # within that of the holder above, which may end this one's keeper, and removes what that has not
        folder = tempfile.mkdtemp(prefix="robotont_", dir=outer.rpartition(":")[2] or None)
        os.environ[VARIABLE] = f"{outer}:{folder}" if outer else folder
        subprocess.Popen([sys.executable, __file__, str(os.getpid()), folder], start_new_session=True,
                         stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
        _held = os.getpid(), folder
    return Path(_held[1])


def holding(folder):
    """Process ids, but for this one, of all that have the folder in their lifeline."""
    found = []
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit() and int(entry.name) != os.getpid():
            with contextlib.suppress(OSError):  # it has ended, or belongs to another user
                for setting in (entry / "environ").read_bytes().split(b"\0"):
                    name, _, value = setting.partition(b"=")
                    if name == VARIABLE.encode() and folder in os.fsdecode(value).split(":"):
                        found.append(int(entry.name))
    return found


def end_all(folder):
    """End all processes that have the folder in their lifeline, politely first; whether none is left."""
    asked = set()
    for how, patience in FAREWELLS:
        end = time.monotonic() + patience
        asked.clear()
        absent = 0  # looks in a row that found none: a process that forks and ends may hide behind one look
        while time.monotonic() < end:
            left = holding(folder)
            absent = 0 if left else absent + 1
            if absent > 1:
                return True
            for process in set(left) - asked:
                asked.add(process)
                with contextlib.suppress(OSError):
                    os.kill(process, how)
            time.sleep(0.05)
    return False


def keep(holder, folder):
    """Sleep until the process `holder`, this one's parent, is dead; then end its children and remove the folder."""
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM, signal.SIGHUP})
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGTERM)
    while os.getppid() == holder:  # it is also sent when only the thread ends that has started this process
        signal.sigwait({signal.SIGTERM})
    if not end_all(folder):
        print(f"still running after {holder}: {holding(folder)}", file=sys.stderr)
    for _ in range(ATTEMPTS):
        shutil.rmtree(folder, ignore_errors=True)
        if not Path(folder).exists():
            break
        time.sleep(0.05)  # a process that was just ending has written another file


if __name__ == "__main__":
    keep(int(sys.argv[1]), sys.argv[2])
