"""scripts/flash against a pseudo-terminal and a stand-in for mpremote with a folder for the board's files."""

import ast
import contextlib
import importlib.machinery
import importlib.util
import io
import os
import pty
import select
import shutil
import stat
import subprocess
import sys
import threading
import tty
import types

import pytest
from firmware_pty import checked
from firmware_tools import BOARD_FILES, PACKAGE, tool

FAKE = """#!{python}
import os, shutil, sys
board = {board!r}
open(board + ".log", "a").write(" ".join(sys.argv[3:5]).replace("\\n", " ") + "\\n")
assert sys.argv[1:3] == ["connect", {port!r}]
if os.path.exists(board + ".broken"):
    print("mpremote.transport.TransportError: could not enter raw repl"); sys.exit(1)
action = sys.argv[3]
if os.path.exists(board + ".hang"):
    import time; time.sleep(60)
if action == "exec" and "uname" in sys.argv[4]:
    print(open(board + ".machine").read())
elif action == "exec":
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

    def __init__(self, folder, output=(), banner=b"# robotont_firmware 9.9.9 wheels 3 reset button\n"):
        self.output = output  # lines, one every 20 ms until it is asked for the REPL
        self.profile = "ours"
        self.received = b""
        self.gone = False
        self.files = folder / "board"
        self.files.mkdir()
        (self.files / "main.py").write_text("# of an older robotont_firmware")
        self.machine = folder / "board.machine"
        self.machine.write_text("NUCLEO-L476RG with STM32L476RG (1, 24, 1, '')")
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
        os.set_blocking(self.master, False)
        threading.Thread(target=self._listen, daemon=True).start()
        threading.Thread(target=self._wait_for_reset, daemon=True).start()

    def _listen(self):
        turn = 0
        while checked("!repl") not in self.received and not self.gone:
            if select.select([self.master], [], [], 0.02)[0]:
                self.received += os.read(self.master, 100)
            elif self.output:
                with contextlib.suppress(BlockingIOError):  # no reader: a real board does not wait either
                    os.write(self.master, self.output[turn % len(self.output)])
                turn += 1
            if checked("?") in self.received and self.profile:
                about = f"# identity robotont_firmware 2.0.0 wheels 3 profile {self.profile} reset power"
                os.write(self.master, checked(about))
                self.profile = ""
        if self.gone:
            return
        self.asked = True
        os.write(self.master, b"0:0:0;00:0000:0000:0000:1C8B\n# repl\n# robotont_firmware safe mode\n")

    def _wait_for_reset(self):
        with open(str(self.files) + ".reset") as fifo:
            fifo.read()
        self._send_until_received()

    def _send_until_received(self):
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
    monkeypatch.setattr(flash, "LISTENING", 0.2)
    board.check_compiles = flash.check_compiles  # it takes seconds
    monkeypatch.setattr(flash, "check_compiles", lambda files: None)
    yield board
    board.gone = True


def run(flash, monkeypatch, *arguments):
    monkeypatch.setattr(sys, "argv", ["flash", *arguments])
    return flash.main()


def flash_ours(flash, monkeypatch, board):
    return run(flash, monkeypatch, "--port", board.port, "--profile", "ours", "--yes")


OFFICIAL = {
    "2018": [b"Setpoints 0:0:0\r\nEncoders 1:2:3\r\n\r\n"],
    "2": [b"ODOM:0.000000:0.000000:0.000000:0.000000:0.000000:0.000000\r\n"],
    "2, starting": [b"**** MAIN ****\r\n"],
    "2, ranges": [b"RANGE:1:2:3:4:5:6:7:8:9:10:11:12\r\n"],
    "3": [b"BATSTATE:12.1:5.0:0.0:15.2\n", b"ODOM:nan:0.0:0.0:0.0:0.0:0.0\r\n"],
    "thesis": [b"0:-12:13;\n"],
    "2, with noise": [b"\xff\x00\xf0\n", b"ODOM:0.1:0.2:0.3:0.0:0.0:0.0\r\n"],
}


@pytest.mark.parametrize("generation", OFFICIAL)
def test_a_robot_with_official_firmware_is_refused_and_nothing_written(flash, board, monkeypatch, capsys, generation):
    board.output = OFFICIAL[generation]
    assert flash_ours(flash, monkeypatch, board) == 1
    message = capsys.readouterr().err
    assert "needs no flashing" in message
    assert "roslaunch robotont_bringup robot.launch port:=" + board.port in message
    assert board.received == b""
    assert not os.path.exists(str(board.files) + ".log"), "mpremote was called"


def test_a_board_with_unknown_output_is_refused_and_nothing_written(flash, board, monkeypatch, capsys):
    board.output = [b"Hello, world\r\n", b"\x83\xf1\n"]
    assert flash_ours(flash, monkeypatch, board) == 1
    assert "no firmware known here" in capsys.readouterr().err
    assert board.received == b""


def test_generation_3_is_recognised_by_its_usb_number(flash, board, monkeypatch, capsys):
    entry = types.SimpleNamespace(device=board.port, vid=0x0483, pid=0x5740)
    monkeypatch.setattr(flash.list_ports, "comports", lambda: [entry])
    assert flash_ours(flash, monkeypatch, board) == 1
    assert "generation 3" in capsys.readouterr().err
    assert board.received == b""


@pytest.mark.parametrize("answer", ["", "yes", "robotont21"])
def test_nothing_is_written_without_the_right_answer(flash, board, monkeypatch, capsys, answer):
    monkeypatch.setattr("builtins.input", lambda question: answer)
    assert run(flash, monkeypatch, "--port", board.port, "--profile", "ours") == 1
    shown = capsys.readouterr()
    assert "Wiring profile ours" in shown.out
    assert "PB6, PB7" in shown.out
    assert "Nothing was written" in shown.err
    assert board.received == b""


def test_without_a_terminal_it_must_be_confirmed_with_yes(flash, board, monkeypatch, capsys):
    monkeypatch.setattr("sys.stdin", io.StringIO(""))
    assert run(flash, monkeypatch, "--port", board.port, "--profile", "ours") == 1
    assert "--yes" in capsys.readouterr().err


def test_a_board_that_does_not_report_its_profile_needs_one(flash, board, monkeypatch, capsys):
    for arguments in ((), ("--profile", "theirs")):
        assert run(flash, monkeypatch, "--port", board.port, "--yes", *arguments) == 1
        message = capsys.readouterr().err
        assert "--profile" in message
        assert "ours" in message
        assert "FOUR ENCODER WIRES MOVED" in message
    assert board.received == b""


@pytest.mark.parametrize("packet", [b"0:0:0;00:0000:0000:0000:1C8B\n", b"0:0:0;00:0000:0000:0000:030000000:FBCF\n"])
def test_our_own_firmware_keeps_its_profile(flash, board, monkeypatch, capsys, packet):
    board.output = [packet]
    board.profile = "robotont21"
    assert run(flash, monkeypatch, "--port", board.port, "--yes") == 0
    assert "Wiring profile robotont21" in capsys.readouterr().out
    wiring = (board.files / "robotont_firmware" / "wiring.py").read_text()
    assert 'PROFILE = "robotont21"' in wiring


def test_another_profile_than_the_boards_is_reported(flash, board, monkeypatch, capsys):
    board.output = [b"0:0:0;00:0000:0000:0000:030000000:FBCF\n"]
    board.profile = "robotont21"
    monkeypatch.setattr("builtins.input", lambda question: "")
    assert run(flash, monkeypatch, "--port", board.port, "--profile", "ours") == 1
    assert "the board has the profile robotont21 now" in capsys.readouterr().out


def test_boot_gets_the_pins_of_the_profile(flash, board, monkeypatch):
    assert run(flash, monkeypatch, "--port", board.port, "--profile", "robotont21", "--yes") == 0
    boot = (board.files / "boot.py").read_text()
    names = flash.runpy.run_path(str(board.files / "robotont_firmware" / "wiring.py"))
    pins = {pwm[0] for pwm in names["PWM"]} | {pin for pair in names["DIRECTIONS"] for pin in pair}
    line = next(line for line in boot.splitlines() if line.startswith("MOTOR_PINS"))
    assert set(ast.literal_eval(line.split(" = ")[1])) == pins


def test_flashes_everything_and_prints_the_banner(flash, board, monkeypatch, capsys):
    assert {path.name for path in BOARD_FILES} == {
        "__init__.py", "board.py", "boot.py", "check_wiring.py", "compat.py", "config.py", "fault_watch.py",
        "gain_bounds.py", "main.py", "main_loop.py", "protocol.py", "wheel_speed.py", "wiring.py",
        "wiring_robotont21.py", "wiring_vnh.py",
    }  # fmt: skip
    monkeypatch.setattr(flash, "check_compiles", board.check_compiles)
    assert flash_ours(flash, monkeypatch, board) == 0
    assert board.asked
    assert capsys.readouterr().out.endswith("# robotont_firmware 9.9.9 wheels 3 reset button\n")
    for path in BOARD_FILES:
        if path.name.startswith("wiring_"):
            continue  # another robot's
        there = board.files / ("" if path.name in ("boot.py", "main.py") else "robotont_firmware") / path.name
        assert there.read_bytes() == path.read_bytes()
    log = board.log()
    assert "uname" in log[0]
    assert "main.py" in log[1], "main.py goes first"
    assert log[-1].startswith("reset")


def test_half_a_copy_leaves_no_main(flash, board, monkeypatch, capsys):
    (board.files / "boot.py").write_text("# robotont: old")
    monkeypatch.setattr(flash, "mpremote", _failing(flash.mpremote, flash.FlashError))
    assert flash_ours(flash, monkeypatch, board) == 1
    assert not (board.files / "main.py").exists()
    assert (board.files / "boot.py").read_text() == "# robotont: old", "whole"
    message = capsys.readouterr().err
    assert "pulled out" in message
    assert "main.py is gone from the board" in message


@pytest.mark.parametrize("machine", [
    "Raspberry Pi Pico with RP2040 (1, 24, 0, '')", "NUCLEO-F446RE with STM32F446xx (1, 24, 0, '')",
    "NUCLEO-L476RG with STM32L476RG (1, 19, 1)", "what is that"])  # fmt: skip
def test_another_board_is_refused_and_stays_as_it_is(flash, board, monkeypatch, capsys, machine):
    board.machine.write_text(machine)
    before = {path.name: path.read_text() for path in board.files.iterdir()}
    assert flash_ours(flash, monkeypatch, board) == 1
    message = capsys.readouterr().err
    assert "Nothing was written" in message
    assert machine.split(" (")[0] in message
    assert {path.name: path.read_text() for path in board.files.iterdir()} == before


def test_the_owners_files_stay(flash, board, monkeypatch, capsys):
    for name in ("boot.py", "main.py"):
        (board.files / name).write_text("print('mine')")
    assert flash_ours(flash, monkeypatch, board) == 0
    assert "The board's own main.py stays, as main.py.kept" in capsys.readouterr().out
    assert {(board.files / (name + ".kept")).read_text() for name in ("boot.py", "main.py")} == {"print('mine')"}


def test_a_step_that_hangs_ends(flash, board, monkeypatch, capsys):
    open(str(board.files) + ".hang", "w").close()
    monkeypatch.setattr(flash, "STEP_TIME", {"exec": 0.5, "fs": 0.5, "reset": 0.5})
    assert flash_ours(flash, monkeypatch, board) == 1
    assert "did not end within 0.5 s" in capsys.readouterr().err


def test_the_users_message_is_no_traceback(flash, board, monkeypatch, capsys):
    (board.files / "robotont_firmware").write_text("a file where a folder should be")
    assert flash_ours(flash, monkeypatch, board) == 1
    message = capsys.readouterr().err
    assert "Traceback" not in message
    assert "failed: " in message


def test_a_port_that_a_program_holds_without_a_lock_is_refused(flash, board, monkeypatch, capsys):
    program = "import sys; f = open(sys.argv[1]); print(flush=True); sys.stdin.read()"
    with subprocess.Popen([sys.executable, "-c", program, board.port],
                          stdin=subprocess.PIPE, stdout=subprocess.PIPE) as holder:  # fmt: skip
        holder.stdout.readline()
        assert flash_ours(flash, monkeypatch, board) == 1
        holder.communicate()
    message = capsys.readouterr().err
    assert "in use by python" in message
    assert f"(process {holder.pid})" in message
    assert board.received == b""


def test_versions_are_compared(flash, board, monkeypatch, capsys):
    board.output = [b"0:0:0;00:0000:0000:0000:030000000:FBCF\n"]
    assert flash_ours(flash, monkeypatch, board) == 0
    assert "The board has firmware 2.0.0, the same as the 2.0.0" in capsys.readouterr().out


def _failing(real, error):
    def mpremote(port, *arguments):
        if arguments[0] == "fs":
            raise error("pulled out")
        return real(port, *arguments)

    return mpremote


def test_explains_how_to_install_micropython(flash, board, monkeypatch, capsys):
    open(str(board.files) + ".broken", "w").close()
    assert flash_ours(flash, monkeypatch, board) == 1
    message = capsys.readouterr().err
    assert "No MicroPython answers on " + board.port in message
    assert "st-flash" in message
    assert "NUCLEO_L476RG" in message
    assert "USER" in message


def test_reports_when_the_board_stays_silent(flash, board, monkeypatch, capsys):
    monkeypatch.setattr(flash, "restart", lambda port: None)
    assert flash_ours(flash, monkeypatch, board) == 1
    assert "does not introduce itself" in capsys.readouterr().err


def test_reports_when_there_is_no_port(flash, monkeypatch, capsys):
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


@pytest.mark.parametrize(("number", "message"), [(13, "dialout"), (16, "in use"), (5, "does not open")])
def test_reports_why_the_port_does_not_open(flash, board, monkeypatch, capsys, number, message):
    def refuse(*_, **__):
        raise flash.serial.SerialException(number, "refused")

    monkeypatch.setattr(flash.serial, "Serial", refuse)
    assert flash_ours(flash, monkeypatch, board) == 1
    assert message in capsys.readouterr().err


def test_reports_what_does_not_compile(flash, tmp_path):
    bad = tmp_path / "bad.py"
    bad.write_text("def (")
    flash.check_compiles([PACKAGE / "src" / "robotont_firmware" / "wiring_robotont21.py"])
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
