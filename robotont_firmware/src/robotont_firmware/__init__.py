"""Robotont's firmware: the files of this package run on the board and, unchanged, on a PC.

The package lies under the same name in the board's file system, so `robotont_firmware.protocol` means
the same file on the board, in the tests and in the simulator. Only `board` needs the hardware, and boot.py and main.py,
which lie in the root there: MicroPython runs these two by itself.
"""

__version__ = "2.2.0"
