"""scripts/flash against a pseudo-terminal and a stand-in for mpremote with a folder for the board's files."""

import importlib.machinery
import importlib.util
import os
import pty
import shutil
import stat
import sys
import threading
import tty

import pytest
from firmware_pty import checked
from firmware_tools import BOARD_FILES, PACKAGE, tool

FAKE = """#!{python}
import os, shutil, sys
board = {board!r}
open(board + ".log", "a").write(" ".join(sys.argv[3:5]) + "\\n")
assert sys.argv[1:3] == ["connect", {port!r}]
if os.path.exists(board + ".broken"):
    print("mpremote.transport.TransportError: could not enter raw repl"); sys.exit(1)
action = sys.argv[3]
if action == "exec":
    os.chdir(board); exec(sys.argv[4])
elif action == "fs":
    *sources, target = sys.argv[5:]
    assert target[0] == ":"
    for source in sources:
        shutil.copy(source, os.path.join(board, target[1:]))
elif action == "reset":
    open(board + ".reset", "w").write("now")
"""


class FakeBoard:
    """Answers on a pseudo-terminal: `# repl` when asked rightly, its banner after a reset."""

    def __init__(self, folder, banner=b"# robotont_firmware 9.9.9 wheels 3 reset soft\n"):
        self.files = folder / "board"
        self.files.mkdir()
        (self.files / "main.py").write_text("old")
        self.banner = banner
        self.master, self.slave = pty.openpty()
        tty.setraw(self.slave)
        self.port = os.ttyname(self.slave)
        self.asked = False
        os.mkfifo(str(self.files) + ".reset")
        fake = folder / "mpremote"
        fake.write_text(FAKE.format(python=sys.executable, board=str(self.files), port=self.port))
        fake.chmod(fake.stat().st_mode | stat.S_IEXEC)
        self.program = str(fake)
        threading.Thread(target=self._listen, daemon=True).start()
        threading.Thread(target=self._wait_for_reset, daemon=True).start()

    def _listen(self):
        heard = b""
        while checked("!repl") not in heard:
            heard += os.read(self.master, 100)
        self.asked = True
        os.write(self.master, b"0:0:0;00:0000:0000:0000:1C8B\n# repl\n# robotont_firmware safe mode\n")

    def _wait_for_reset(self):
        with open(str(self.files) + ".reset") as fifo:
            fifo.read()
        self._say_until_heard()

    def _say_until_heard(self):
        for _ in range(100):  # opening the port throws away what was there before
            os.write(self.master, self.banner)
            threading.Event().wait(0.05)

    def log(self):
        with open(str(self.files) + ".log") as log:
            return log.read().splitlines()


@pytest.fixture
def flash():
    loader = importlib.machinery.SourceFileLoader("flash", str(PACKAGE / "scripts" / "flash"))
    module = importlib.util.module_from_spec(importlib.util.spec_from_loader("flash", loader))
    loader.exec_module(module)
    return module


@pytest.fixture
def board(tmp_path, flash, monkeypatch):
    board = FakeBoard(tmp_path)
    monkeypatch.setattr(flash, "tool", lambda name: board.program if name == "mpremote" else tool(name))
    return board


def run(flash, monkeypatch, *arguments):
    monkeypatch.setattr(sys, "argv", ["flash", *arguments])
    return flash.main()


def test_flashes_everything_and_prints_the_banner(flash, board, monkeypatch, capsys):
    assert run(flash, monkeypatch, "--port", board.port) == 0
    assert board.asked
    assert capsys.readouterr().out.endswith("# robotont_firmware 9.9.9 wheels 3 reset soft\n")
    for path in BOARD_FILES:
        there = board.files / ("" if path.name in ("boot.py", "main.py") else "robotont_firmware") / path.name
        assert there.read_bytes() == path.read_bytes()
    log = board.log()
    assert log[0].startswith("exec"), "main.py goes first"
    assert log[-1].startswith("reset")


def test_half_a_copy_leaves_no_main(flash, board, monkeypatch, capsys):
    monkeypatch.setattr(flash, "mpremote", _failing(flash.mpremote, flash.FlashError))
    assert run(flash, monkeypatch, "--port", board.port) == 1
    assert not (board.files / "main.py").exists()
    assert "pulled out" in capsys.readouterr().err


def _failing(real, error):
    def mpremote(port, *arguments):
        if arguments[0] == "fs":
            raise error("pulled out")
        return real(port, *arguments)

    return mpremote


def test_says_how_to_install_micropython(flash, board, monkeypatch, capsys):
    open(str(board.files) + ".broken", "w").close()
    assert run(flash, monkeypatch, "--port", board.port) == 1
    words = capsys.readouterr().err
    assert "No MicroPython answers on " + board.port in words
    assert "st-flash" in words
    assert "NUCLEO_L476RG" in words
    assert "USER" in words


def test_says_when_the_board_stays_silent(flash, board, monkeypatch, capsys):
    monkeypatch.setattr(flash, "restart", lambda port: None)
    assert run(flash, monkeypatch, "--port", board.port) == 1
    assert "does not introduce itself" in capsys.readouterr().err


def test_says_when_there_is_no_port(flash, monkeypatch, capsys):
    assert run(flash, monkeypatch, "--port", "/dev/no_such_port") == 1
    assert "There is no /dev/no_such_port" in capsys.readouterr().err
    monkeypatch.setattr(flash.glob, "glob", lambda pattern: [])
    assert run(flash, monkeypatch) == 1
    assert "No board found" in capsys.readouterr().err
    monkeypatch.setattr(
        flash.glob, "glob", lambda pattern: ["/dev/ttyACM0", "/dev/ttyACM1"] if "ACM" in pattern else []
    )
    assert run(flash, monkeypatch) == 1
    assert "Choose one with --port" in capsys.readouterr().err


@pytest.mark.parametrize(("number", "words"), [(13, "dialout"), (16, "in use"), (5, "does not open")])
def test_says_why_the_port_does_not_open(flash, board, monkeypatch, capsys, number, words):
    def refuse(*_, **__):
        raise flash.serial.SerialException(number, "refused")

    monkeypatch.setattr(flash.serial, "Serial", refuse)
    assert run(flash, monkeypatch, "--port", board.port) == 1
    assert words in capsys.readouterr().err


def test_says_what_does_not_compile(flash, tmp_path):
    bad = tmp_path / "bad.py"
    bad.write_text("def (")
    with pytest.raises(flash.FlashError, match=r"bad\.py does not compile"):
        flash.check_compiles([bad])


def test_finds_its_files_when_installed(flash, tmp_path, monkeypatch):
    share = tmp_path / "share" / "robotont_firmware" / "root"
    share.mkdir(parents=True)
    package = tmp_path / "lib" / "python3" / "dist-packages" / "robotont_firmware"
    package.mkdir(parents=True)
    shutil.copy(str(PACKAGE / "src" / "robotont_firmware" / "__init__.py"), str(package))
    monkeypatch.syspath_prepend(str(package.parent))
    monkeypatch.delitem(sys.modules, "robotont_firmware", raising=False)
    monkeypatch.setattr(flash, "__file__", str(tmp_path / "lib" / "robotont_firmware" / "flash"))
    assert flash.folders() == (package, share)
    monkeypatch.delitem(sys.modules, "robotont_firmware")
