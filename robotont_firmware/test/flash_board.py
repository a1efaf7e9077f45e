"""A stand-in for a board that is flashed: a pseudo-terminal, and an mpremote with a folder for the board's files."""

import contextlib
import os
import pty
import runpy
import select
import stat
import sys
import threading
import tty

from firmware_pty import checked, crc16
from firmware_tools import SRC, tool

FAKE = """#!{python}
import os, shutil, subprocess, sys, time
board = {board!r}
open(board + ".log", "a").write(" ".join(sys.argv[3:5]).replace("\\n", " ") + "\\n")
assert sys.argv[1:3] == ["connect", {port!r}]
if os.path.exists(board + ".broken"):
    print("mpremote.transport.TransportError: could not enter raw repl"); sys.exit(1)
action = sys.argv[3]
if os.path.exists(board + ".hang"):
    time.sleep(60)
if action == "exec" and "uname" in sys.argv[4]:
    print(open(board + ".machine").read())
elif action == "exec":
    sys.exit(subprocess.call([{micropython!r}, "-c", sys.argv[4]], cwd=board))
elif action == "fs":
    *sources, target = sys.argv[5:]
    assert target[0] == ":"
    for source in sources:
        if os.path.exists(board + ".gone"):
            sys.exit("serial.serialutil.SerialException: device disconnected")
        data = open(source, "rb").read()
        with open(os.path.join(board, target[1:], os.path.basename(source)), "wb") as there:
            for at in range(0, len(data), 256):
                there.write(data[at : at + 256]); there.flush(); time.sleep({pace})
elif action == "reset":
    open(board + ".reset", "w").write("now")
"""
OLD = "# of an older robotont_firmware"
VERSION = runpy.run_path(str(SRC / "robotont_firmware" / "__init__.py"))["__version__"]


class FakeBoard:
    """Answers on a pseudo-terminal: `# repl` when asked rightly; after a reset banner, identity and packets."""

    def __init__(self, folder, pace=0):
        self.output = ()  # lines, one every 20 ms until it is asked for the REPL
        self.profile = self.new_profile = "ours"
        self.packet = "0:0:0;{:02X}:0000:0000:0000:00000000000{:03X}{:02X}"
        self.version, self.load, self.missed = VERSION, 49, False
        self.banner = checked(f"# robotont_firmware {VERSION} wheels 3 reset button")
        self.received = b""
        self.gone = False
        self.plugged = threading.Lock()
        self.files = folder / "board"
        (self.files / "robotont_firmware").mkdir(parents=True)
        for name in ("boot.py", "main.py", "robotont_firmware/wheel_speed.py", "robotont_firmware/board.py"):
            (self.files / name).write_text(OLD)
        self.old = self.content()
        self.machine = folder / "board.machine"
        self.machine.write_text("NUCLEO-L476RG with STM32L476RG (1, 24, 1, '') 7942")
        self.master, self.slave = pty.openpty()
        tty.setraw(self.slave)
        self.port = os.ttyname(self.slave)
        self.asked = False
        os.mkfifo(str(self.files) + ".reset")
        fake = folder / "mpremote"
        fake.write_text(FAKE.format(python=sys.executable, board=str(self.files), port=self.port, pace=pace,
                                    micropython=tool("micropython")))  # fmt: skip
        fake.chmod(fake.stat().st_mode | stat.S_IEXEC)
        self.program = str(fake)
        os.set_blocking(self.master, False)
        threading.Thread(target=self._listen, daemon=True).start()
        threading.Thread(target=self._wait_for_reset, daemon=True).start()

    def content(self):
        """All files of the board: {name: bytes}."""
        return {str(path.relative_to(self.files)): path.read_bytes()
                for path in self.files.rglob("*") if path.is_file()}  # fmt: skip

    def _listen(self):
        turn = 0
        while checked("!repl") not in self.received:
            threading.Event().wait(0.02)
            with self.plugged:
                if self.gone:
                    return
                if select.select([self.master], [], [], 0)[0]:
                    self.received += os.read(self.master, 100)
                elif self.output:
                    self._send(self.output[turn % len(self.output)])
                    turn += 1
                if checked("?") in self.received and self.profile:
                    self._answer("2.0.0", self.profile)
                    self.profile = ""
        self.asked = True
        self._send(b"0:0:0;00:0000:0000:0000:1C8B\n# repl\n# robotont_firmware safe mode\n")

    def _send(self, data):
        with contextlib.suppress(OSError):  # no reader: a real board does not wait either
            os.write(self.master, data)

    def _answer(self, version, profile):
        self._send(checked(f"# identity robotont_firmware {version} wheels 3 rate 50 profile {profile} reset power"))

    def _wait_for_reset(self):
        with open(str(self.files) + ".reset") as fifo:
            fifo.read()
        counter = 0
        while True:
            with self.plugged, contextlib.suppress(BlockingIOError):
                if self.gone:
                    return
                if counter < 50:  # opening the port throws away what was there before
                    self._send(self.banner)
                status = self.packet.format(counter & 0xFF, 1234, self.load)
                packet = status.encode() + b":%04X\n" % crc16(status.encode() + b":")
                self._send(packet[:9])
                if counter % 40 == 39:  # a computer that is late with the rest
                    threading.Event().wait(0.15)
                self._send(packet[9:])
                counter += 2 if self.missed and counter % 30 == 0 else 1
                if checked("?") in os.read(self.master, 100):
                    self._answer(self.version, self.new_profile)
            threading.Event().wait(0.005)

    def vanish(self):
        """The cable is pulled: the port hangs up, and mpremote finds nobody."""
        with self.plugged:
            self.gone = True
            open(str(self.files) + ".gone", "w").close()
            os.close(self.master)
            os.close(self.slave)

    def log(self):
        with open(str(self.files) + ".log") as log:
            return log.read().splitlines()
