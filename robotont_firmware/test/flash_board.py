"""A stand-in for a board that is flashed: its line, and a folder for its files in which MicroPython runs."""

import shutil
import subprocess
from pathlib import Path

from firmware_tools import tool

from robotont_firmware import __version__ as VERSION  # noqa: N812
from robotont_flash.board_check import ASK, LEAVE, FlashError
from robotont_flash.copying import OURS
from robotont_testing.stand_in_board import crc16, sealed

OLD = "# of an older robotont_firmware"
REPL = b"# repl\n# robotont_firmware safe mode\n"


def run_on_the_board(program, folder):
    """What a program prints that MicroPython runs in a folder."""
    return subprocess.run([tool("micropython"), "-c", program], cwd=str(folder), stdout=subprocess.PIPE,
                          stderr=subprocess.STDOUT, check=False, text=True).stdout  # fmt: skip


class Board:
    """Takes the place of the open port and of mpremote. `waiting`: bytes that the PC can read; `steps`: of mpremote."""

    port = "/dev/ttyACM0"

    def __init__(self, folder):
        self.profile, self.version = "", "2.0.0"
        self.new_profile, self.new_version = "ours", VERSION
        self.load, self.missed, self.totals = 49, False, ":0000:0000:0000"
        self.spoilt = 0
        self.machine = "NUCLEO-L476RG with STM32L476RG with MicroPython 1.24.1 for files 7942\n"
        self.banner = "robotont_firmware {} wheels 3 rate 50 units edges/period profile {} reset button"
        self.waiting = self.received = b""
        self.steps, self.fails = [], None
        self.files = Path(folder)
        (self.files / "robotont_firmware").mkdir(parents=True)
        for name in ("boot.py", "main.py", "robotont_firmware/wheel_speed.py"):
            (self.files / name).write_text(OURS.get(name, b"").decode() + OLD)
        self.old = self.content()

    def content(self):
        return {str(path.relative_to(self.files)): path.read_bytes()
                for path in self.files.rglob("*") if path.is_file()}  # fmt: skip

    def mpremote(self, port, action, *arguments):
        """What it prints; FlashError at the step of the number `fails`."""
        assert port == self.port
        self.steps.append(action)
        if len(self.steps) - 1 == self.fails:
            raise FlashError(f"mpremote {action} failed: pulled")
        if action == "reset":
            self.waiting = sealed(self.banner.format(self.new_version, self.new_profile)) + self.packets()
        elif action == "fs":
            *sources, target = arguments[1:]
            for source in sources:
                shutil.copy(source, str(self.files / target[1:]))
        elif "uname" in arguments[0]:
            return self.machine
        else:
            return run_on_the_board(arguments[0], self.files)
        return ""

    def packets(self):
        lines = [f"0:0:0;{number + (self.missed and number > 9):02X}{self.totals}:000000000000"
                 f"{self.load:02X}:".encode() for number in range(60)]  # fmt: skip
        return b"".join(line + b"%04X\n" % (crc16(line) ^ self.spoilt) for line in lines)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        pass

    def write(self, data):
        self.received += data
        if data == ASK and self.profile:
            self.waiting = sealed(f"identity robotont_firmware {self.version} wheels 3 rate 50 units edges/period "
                                   f"profile {self.profile} reset power") + self.waiting  # fmt: skip
        elif data == LEAVE:
            self.waiting = REPL

    def read(self, _):
        data, self.waiting = self.waiting, b""
        return data

    def read_until(self, _):
        line, end, self.waiting = self.waiting.partition(b"\n")
        return line + end
