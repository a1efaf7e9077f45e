"""Other processes that own a port, and what becomes of the names of theirs when they die."""

import contextlib
import os
import pty
import subprocess
import sys


@contextlib.contextmanager
def program(code, *arguments):
    """A process that runs Python `code` with arguments, and has printed its first line; killed at the end."""
    process = subprocess.Popen([sys.executable, "-c", code, *map(str, arguments)], stdout=subprocess.PIPE)
    process.stdout.readline()
    try:
        yield process
    finally:
        process.kill()
        process.wait()
        process.stdout.close()


@contextlib.contextmanager
def given_away(device):
    """Within the block the name of a terminal whose owner is dead belongs to somebody else, as the kernel may do."""
    others = []
    while not os.path.exists(device):
        others.append(pty.openpty())
    try:
        yield
    finally:
        for other in others:
            for end in other:
                os.close(end)
