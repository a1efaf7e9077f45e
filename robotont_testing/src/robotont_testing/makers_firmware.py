"""The makers' own firmware, compiled for a computer, as boards like those of robotont_boards.

It lies beside this repository, never in it: ROBOTONT_FIRMWARE names a folder with one shared library per version,
called by its commit in github.com/robotont/robotont-firmware, in which only the drivers of the hardware are replaced:

    void fw_start(int display_ms);
    void fw_receive(const uint8_t *data, int bytes, double us);       // the PC has begun to write at that time
    int fw_until(double us, const int16_t edges[3], char *sent, double efforts[3]);    // returns the bytes in `sent`
"""

import ctypes
import os
import shutil
import tempfile
from pathlib import Path

FOLDER = Path(os.environ.get("ROBOTONT_FIRMWARE", "/nonexistent"))
VERSIONS = {"2.1.3": ("robotont2", "adc1d8e"), "2.1.2": ("robotont2", "2fb002d"),
            "March 2020": ("robotont2", "553addf"), "3": ("robotont3", "3f94c32")}  # protocol, commit
REFUSED = {"November 2018": "15d5c41", "April 2019": "72fd82c", "January 2020": "f9e9170"}
DISPLAY = 25  # [ms] that generation 3 draws its display: 1025 bytes at 400 kHz


def library(commit):
    """Path of a version's library, and why there is none: one of the two is empty."""
    path = FOLDER / (commit + ".so")
    return (path, "") if path.is_file() else (None, f"no {commit}.so in ROBOTONT_FIRMWARE, {FOLDER}")


class CompiledBoard:
    """A board with a library's firmware; the interface is that of robotont_boards. Steps of 1 ms."""

    def __init__(self, path, motors, start=0.0):
        with tempfile.NamedTemporaryFile(suffix=".so") as copy:  # each with variables of its own
            shutil.copy(str(path), copy.name)
            self._firmware = ctypes.CDLL(copy.name)
        self._firmware.fw_receive.argtypes = ctypes.c_char_p, ctypes.c_int, ctypes.c_double
        self._firmware.fw_until.argtypes = ctypes.c_double, *[ctypes.c_void_p] * 3
        self._firmware.fw_start(DISPLAY)
        self._sent, self._efforts = ctypes.create_string_buffer(1 << 16), (ctypes.c_double * 3)()
        self._edges = (ctypes.c_int16 * 3)()
        self._motors, self._start, self._ms = motors, start, 0

    def receive(self, data, now):
        """The PC writes."""
        self._firmware.fw_receive(data, len(data), (now - self._start) * 1e6)

    def advance(self, now):
        """Let time pass; bytes that the board has sent."""
        sent = b""
        while self._ms < int((now - self._start) * 1000 + 1e-6):
            self._ms += 1
            self._edges[:] = self._motors.turn(list(self._efforts), 0.001)
            length = self._firmware.fw_until(self._ms * 1000.0, self._edges, self._sent, self._efforts)
            sent += self._sent.raw[:length]
        return sent
