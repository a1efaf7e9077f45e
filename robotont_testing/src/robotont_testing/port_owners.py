"""Other processes that own a port."""

import contextlib
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
