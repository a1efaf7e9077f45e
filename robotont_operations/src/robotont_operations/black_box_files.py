"""The last minute of recorded messages, in bag files of a second each that survive kill -9 and a loss of power.

Each file is written whole under another name, flushed to the disk, and only then renamed, by `new_file`: a file named
.bag is complete and opens with stock rosbag. Every start of the recorder begins a folder of its own, so that a restart
does not overwrite what led to it.
"""

import contextlib
import errno
import os
import re
import shutil
import time
from collections import deque
from pathlib import Path
from types import SimpleNamespace
from typing import Mapping, NamedTuple

import genpy
import rosbag

from robotont_driver.parameters.files import flush_folder, new_file

SIZE = 64_000_000      # [bytes] of all runs together
RUN_SIZE = 15_000_000  # [bytes] of one, and a file: four fit
MOST_RUNS = 50         # however short
FULL = {errno.ENOSPC, errno.EDQUOT}  # no room: the oldest file gives way


class Record(NamedTuple):
    """One message as it came over the line: time of its arrival [s], serialised bytes, and its connection's header."""

    topic: str
    time: float
    data: bytes
    header: Mapping[str, str]


class BlackBox:
    """Writes records into a folder and keeps the newest ones: of this run those of the last `keep` [s].

    Raises OSError where the folder cannot be written.
    """

    def __init__(self, folder, keep=60.0):
        self._keep = keep
        folder = Path(folder)
        folder.mkdir(parents=True, exist_ok=True)
        old = runs_in(folder)
        kept = RUN_SIZE  # [bytes], this one's
        for age, run in enumerate(reversed(old), 1):
            kept += sum(path.stat().st_size for path in bags_of(run))
            if kept > SIZE or age >= MOST_RUNS:
                shutil.rmtree(run, ignore_errors=True)  # another user's: the new run is wanted all the same
        number = int(old[-1].name.split("_")[1]) + 1 if old else 1
        self.folder = folder / f"run_{number:06d}_{time.strftime('%Y-%m-%dT%H-%M-%SZ', time.gmtime())}"
        self.folder.mkdir()
        flush_folder(folder)
        self._files = deque()  # (time of the end, size, path), the oldest first
        self._number = 0

    def write(self, records, now):
        """Keep these records, at monotonic time `now` [s]; all but those that nobody could read are on the disk then.

        Returns how many were left out. A folder that was deleted is made again. Raises OSError.
        """
        while self._files and (self._files[0][0] < now - self._keep
                               or sum(size for _, size, _ in self._files) > RUN_SIZE):
            self._drop_oldest()
        if not records:
            return 0
        self._number += 1
        path = self.folder / f"{self._number:06d}.bag"
        try:
            if not self.folder.exists():
                self.folder.mkdir(parents=True)
                flush_folder(self.folder.parent)
            with new_file(path) as file:
                left_out = write_bag(file.fileno(), records)
        except OSError as error:
            if error.errno in FULL:
                self._drop_oldest()
            raise
        self._files.append((now, path.stat().st_size, path))
        return left_out

    def _drop_oldest(self):
        if self._files:
            with contextlib.suppress(FileNotFoundError):  # somebody else has deleted it
                self._files.popleft()[2].unlink()


def runs_in(folder):
    """Folders of the recorder's runs, the oldest first; links and files of such names are not its own."""
    found = [path for path in Path(folder).glob("run_*_*")
             if re.match("run_[0-9]+_", path.name) and path.is_dir() and not path.is_symlink()]
    return sorted(found, key=lambda path: (int(path.name.split("_")[1]), path.name))


def bags_of(run):
    """Complete bag files of a run, the oldest first."""
    return sorted(path for path in Path(run).glob("*.bag") if os.path.isfile(str(path)) and not path.is_symlink())


def write_bag(handle, records):
    """Write Records as a bag, without those whose publisher does not say what its type is, and of a second type.

    handle: of an open file. rosbag keeps one type for a topic: such a record would spoil the others. Returns how many
    were left out.
    """
    kinds, left_out = {}, 0  # by topic
    # LZ4: a third of the size, no slower
    with open(handle, "w+b", closefd=False) as file, rosbag.Bag(file, "w", compression=rosbag.Compression.LZ4) as bag:
        for topic, time_, data, header in records:
            known, definition = header["md5sum"], header.get("message_definition")
            if not definition or kinds.setdefault(topic, known) != known:
                left_out += 1
            else:
                kind = SimpleNamespace(_md5sum=known, _full_text=definition)
                bag.write(topic, (header["type"], data, known, kind), genpy.Time.from_sec(time_), raw=True)
    return left_out


def merge(bags, output, kept):
    """Write into one file what kept(topic, raw) leaves of the messages of several bag files: a message, or None.

    Returns (number of messages, [words on each file that could not be read, or not to its end, or not all of it]).
    """
    count, unread = 0, []
    with rosbag.Bag(str(output), "w", compression=rosbag.Compression.BZ2) as merged:
        for path in bags:
            name, spoilt = f"{path.parent.name}/{path.name}", 0
            try:
                with rosbag.Bag(str(path)) as bag:
                    for topic, raw, stamp in bag.read_messages(raw=True):
                        try:
                            message = kept(topic, raw)
                        except Exception:  # what its publisher has sent is not of the type that it has said
                            spoilt += 1
                            continue
                        if message is not None:
                            merged.write(topic, message, stamp)
                            count += 1
            except Exception as error:  # a corrupt bag can raise whatever rosbag and its decompressors raise
                unread.append(f"{name}: {type(error).__name__}")  # its words may hold anything
            if spoilt:
                unread.append(f"{name}: {spoilt} messages")
    return count, unread
