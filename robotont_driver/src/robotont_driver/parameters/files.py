"""Files written whole or not at all, and read up to a size; one process at a time in a folder."""

import contextlib
import errno
import fcntl
import os
import tempfile
from pathlib import Path


@contextlib.contextmanager
def new_file(path, mode=0o644):
    """A binary file to write to, which takes the place of `path` at the end of the `with`; none on an exception.

    It has this mode whatever was there, and is on the disk before it takes the place; a link itself is replaced.
    """
    path = Path(path)
    _refuse_other(path)
    handle, beside = tempfile.mkstemp(dir=str(path.parent), prefix=".new_")
    try:
        with os.fdopen(handle, "wb") as file:
            yield file
            file.flush()
            os.fchmod(handle, mode)
            os.fsync(handle)
        os.replace(beside, str(path))
    except BaseException:
        with contextlib.suppress(OSError):
            os.unlink(beside)
        raise
    flush_folder(path.parent)


def write_file(path, text, mode=0o644):
    """Write a text as UTF-8 (or bytes), by `new_file`."""
    with new_file(path, mode) as file:
        file.write(text if isinstance(text, bytes) else text.encode("utf-8", "surrogateescape"))


def read_file(path, most):
    """The bytes of a file. Raises OSError, also where it is a pipe or a device or has more than `most` bytes."""
    _refuse_other(path)
    with open(str(path), "rb") as file:
        data = file.read(most + 1)
    if len(data) > most:
        raise OSError(errno.EFBIG, f"it has more than {most} bytes", str(path))
    return data


def _refuse_other(path):
    """Raise OSError where a path is there and leads to no file: a pipe waits for ever, a device would be replaced."""
    if os.path.exists(str(path)) and not os.path.isfile(str(path)):
        raise OSError(errno.EINVAL, "it is no file", str(path))


@contextlib.contextmanager
def alone_in(folder):
    """While the block lasts no other process is in such a block for this folder, which is made where it is missing."""
    os.makedirs(str(folder), exist_ok=True)
    handle = os.open(str(folder), os.O_RDONLY)
    try:
        fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)


def flush_folder(folder):
    """Bring a folder's list of names to the disk."""
    handle = os.open(str(folder), os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
