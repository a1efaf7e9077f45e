"""scripts/flash against a pseudo-terminal and a stand-in for mpremote with a folder for the board's files."""

import ast
import importlib
import io
import itertools
import os
import shutil
import signal
import subprocess
import sys
import time
import types
from collections import Counter
from random import Random

import pytest
from firmware_tools import SRC, tool
from flash_board import OLD, VERSION, FakeBoard


@pytest.fixture
def flash(monkeypatch):
    monkeypatch.syspath_prepend(str(SRC))
    return importlib.import_module("robotont_flash.program")


@pytest.fixture
def board(tmp_path, flash, monkeypatch):
    board = FakeBoard(tmp_path)
    monkeypatch.setattr(flash.copying, "tool", lambda name: board.program if name == "mpremote" else tool(name))
    monkeypatch.setattr(flash.boards, "LISTENING", 0.2)
    board.compile_file = flash.copying.compile_file  # it takes seconds
    monkeypatch.setattr(flash.copying, "compile_file", lambda path, target: shutil.copy(str(path), str(target)))
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


def test_other_boards_are_recognised_by_their_usb_number(flash, board, monkeypatch, capsys):
    for vid, pid, words in ((0x0483, 0x5740, "generation 3"), (0x2E8A, 0x0005, "no ST-Link")):  # and a Pico
        entry = types.SimpleNamespace(device=board.port, vid=vid, pid=pid, description="")
        monkeypatch.setattr(flash.boards.list_ports, "comports", lambda entry=entry: [entry])
        assert flash_ours(flash, monkeypatch, board) == 1
        assert words in capsys.readouterr().err
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
    board.profile = board.new_profile = "robotont21"
    assert run(flash, monkeypatch, "--port", board.port, "--yes") == 0
    assert "Wiring profile robotont21" in capsys.readouterr().out
    wiring = (board.files / "robotont_firmware" / "wiring.mpy").read_text()
    assert 'PROFILE = "robotont21"' in wiring


def test_another_profile_than_the_boards_is_reported(flash, board, monkeypatch, capsys):
    board.output = [b"0:0:0;00:0000:0000:0000:030000000:FBCF\n"]
    board.profile = "robotont21"
    monkeypatch.setattr("builtins.input", lambda question: "")
    assert run(flash, monkeypatch, "--port", board.port, "--profile", "ours") == 1
    assert "the board has the profile robotont21 now" in capsys.readouterr().out


def test_boot_gets_the_pins_of_the_profile(flash, board, monkeypatch):
    board.new_profile = "robotont21"
    assert run(flash, monkeypatch, "--port", board.port, "--profile", "robotont21", "--yes") == 0
    boot = (board.files / "boot.py").read_text()
    names = flash.runpy.run_path(str(board.files / "robotont_firmware" / "wiring.mpy"))
    pins = {pwm[0] for pwm in names["PWM"]} | {pin for pair in names["DIRECTIONS"] for pin in pair}
    line = next(line for line in boot.splitlines() if line.startswith("MOTOR_PINS"))
    assert set(ast.literal_eval(line.split(" = ")[1])) == pins


def new_files(flash, folder):
    """What the board has when it was flashed with the profile ours."""
    folder.mkdir(exist_ok=True)
    package, root = flash.folders()
    flash.copying.stage(package, root, *flash.profiles(package)["ours"], folder)
    return {("" if path.suffix == ".py" else "robotont_firmware/") + path.name: path.read_bytes()
            for path in folder.iterdir()}  # fmt: skip


def test_flashes_everything_and_tests_the_board(flash, board, monkeypatch, capsys, tmp_path):
    monkeypatch.setattr(flash.copying, "compile_file", board.compile_file)
    assert flash_ours(flash, monkeypatch, board) == 0
    assert board.asked
    shown = capsys.readouterr().out
    assert "Self-test passed: 50 packets, no tick missed, load 49 % of a period" in shown
    assert f"# robotont_firmware {VERSION} wheels 3 reset button" in shown
    assert "The board has firmware" not in shown, "it did not say which"
    assert board.content() == new_files(flash, tmp_path / "new"), "and nothing else"
    assert [name for name in board.content() if name.endswith(".py")] == ["boot.py", "main.py"]
    data = board.content()["robotont_firmware/wheel_speed.mpy"]
    assert (data[0], data[1], data[2] >> 2, data[2] & 3) == (ord("M"), 6, 7, 3), "machine code for that processor"
    log = board.log()
    assert "uname" in log[0]
    assert log[-1].startswith("reset")


@pytest.mark.parametrize("change", [{"load": 90}, {"missed": True}, {"version": "1.0.0"}, {"new_profile": "vnh"},
                                    {"packet": "0:0:0;{:02X}:0000:0000:0000:0000000000{:03X}0{:02X}:"}])  # fmt: skip
def test_a_board_that_fails_its_test_is_reported(flash, board, monkeypatch, capsys, change):
    vars(board).update(change)
    assert flash_ours(flash, monkeypatch, board) == 1
    message = capsys.readouterr().err
    assert "Self-test failed" in message or "The board should have firmware" in message
    assert message.endswith("The new firmware is on the board, whole.\n")


CUT = """
import os as real
class os:
    listdir, stat, sync = real.listdir, real.stat, lambda: None
def cut(function):
    def step(*arguments):
        global left
        left -= 1
        if left < 0:
            raise SystemExit
        return function(*arguments)
    return step
left = {}
for name in ("remove", "rename", "rmdir", "mkdir"):
    setattr(os, name, cut(getattr(real, name)))
"""


def test_wherever_it_is_cut_the_board_has_the_old_firmware_or_the_new_one_or_none_that_runs(flash, tmp_path):
    """The power fails after each step of each program that runs on the board; and then it is flashed again."""
    package, root = flash.folders()
    (tmp_path / "staged").mkdir()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(flash.copying, "compile_file", lambda path, target: shutil.copy(str(path), str(target)))
        staged = flash.copying.stage(package, root, *flash.profiles(package)["ours"], tmp_path / "staged")
    sizes = {path.name: path.stat().st_size for path in staged}
    programs = flash.copying.PREPARE, flash.copying.EXCHANGE.format(sizes=sizes)
    seen = set()
    for cut in itertools.count():
        whole = []
        board = tmp_path / f"board{cut}"
        old = {"boot.py": OLD, "main.py": OLD, "robotont_firmware/wheel_speed.py": OLD}
        (board / "robotont_firmware").mkdir(parents=True)
        for name, text in old.items():
            (board / name).write_text(text)
        for attempt in (cut, 1000):
            left = attempt
            for program in programs:
                code = CUT.format(left) + program.replace("import os", "") + "\nprint(left)"
                run = subprocess.run([tool("micropython"), "-c", code], cwd=str(board), stdout=subprocess.PIPE,
                                     stderr=subprocess.STDOUT, check=False, text=True)  # fmt: skip
                assert "Error" not in run.stdout, run.stdout
                if not run.stdout.strip().isdigit():
                    break
                left = int(run.stdout)
                if program is programs[0]:
                    for path in staged:
                        shutil.copy(str(path), str(board / "robotont_new"))
            else:
                whole.append(attempt)
            found = {str(path.relative_to(board)): path.read_text() for path in board.rglob("*.*") if path.is_file()}
            package_there = {name: text for name, text in found.items() if name.startswith("robotont_firmware/")}
            kind = ("none" if "main.py" not in found else
                    "old" if {**package_there, "boot.py": found["boot.py"], "main.py": found["main.py"]} == old else
                    "new" if len(package_there) == len(staged) - 2 and OLD not in found.values() else "mixture")
            assert kind == "new" if attempt == 1000 else kind != "mixture", (cut, found.keys())
            assert "boot.py" in found
            seen.add(kind)
        if cut in whole:  # behind the last step
            break
    assert seen == {"old", "none", "new"}


CHILD = """
import os, shutil, sys
sys.path[:0] = [{src!r}]
from robotont_flash import boards, copying, program
tool = copying.tool
copying.tool = lambda name: {program!r} if name == "mpremote" else tool(name)
copying.compile_file = lambda path, target: shutil.copy(str(path), str(target))
boards.LISTENING = 0.05
boards.refuse_others = lambda port: None  # the stand-in has it open, too
sys.argv[1:] = ["--port", {port!r}, "--profile", "ours", "--yes"]
sys.exit(program.main())
"""


def judge(board, new):
    """What runs on the board: old, new, none, or mixture."""
    found = board.content()
    there = {name: data for name, data in found.items() if not name.startswith(("robotont_new/", "main.new"))}
    return "none" if "main.py" not in there else "old" if there == board.old else "new" if there == new else "mixture"


def trials(moments, seen, folder):
    """(latest moment [s], board, program that flashes it), until both ends are seen: later on a slow machine."""
    for number in itertools.count():
        if number >= moments and min(seen["old"], seen["new"]):
            return
        own = folder / str(number)
        own.mkdir()
        board = FakeBoard(own, pace=0.0005)
        yield 2.5 + number / 5, board, CHILD.format(src=str(SRC), program=board.program, port=board.port)


@pytest.mark.parametrize("moments", [6, pytest.param(50, marks=pytest.mark.long)])
def test_killed_at_random_moments(flash, tmp_path, monkeypatch, moments):
    monkeypatch.setattr(flash.copying, "compile_file", lambda path, target: shutil.copy(str(path), str(target)))
    new = new_files(flash, tmp_path / "new")
    random = Random(20181102)
    seen = Counter()
    for latest, board, child in trials(moments, seen, tmp_path):
        with subprocess.Popen([sys.executable, "-c", child], start_new_session=True, stdout=subprocess.PIPE,
                              stderr=subprocess.STDOUT) as process:  # fmt: skip
            try:
                process.wait(random.uniform(0.2, latest))
            except subprocess.TimeoutExpired:
                os.killpg(process.pid, signal.SIGKILL)  # with mpremote and what runs on the board
            process.stdout.read()
        seen[judge(board, new)] += 1
        board.gone = True
    print(dict(seen))
    assert not seen["mixture"]


@pytest.mark.parametrize("moments", [6, pytest.param(50, marks=pytest.mark.long)])
def test_a_port_that_vanishes(flash, tmp_path, monkeypatch, moments):
    """The cable is pulled at a random moment: an end in time, with words about what is on the board, which is true."""
    monkeypatch.setattr(flash.copying, "compile_file", lambda path, target: shutil.copy(str(path), str(target)))
    new = new_files(flash, tmp_path / "new")
    random = Random(20181103)
    seen = Counter()
    for latest, board, child in trials(moments, seen, tmp_path):
        with subprocess.Popen([sys.executable, "-c", child], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                              text=True) as process:  # fmt: skip
            time.sleep(random.uniform(0.1, latest))
            board.vanish()
            message = process.communicate(timeout=20)[1]
        kind = judge(board, new)
        assert "Traceback" not in message, message
        assert process.returncode in (0, 1)
        if process.returncode:
            promised = {"Nothing was written": ("old",), "The board has the files that it had": ("old",),
                        "The board has the old firmware, or the new one": ("old", "new", "none"),
                        "The new firmware is on the board": ("new",)}  # fmt: skip
            (kinds,) = [kinds for words, kinds in promised.items() if words in message]
            assert kind in kinds, message
        seen[kind] += 1
    print(dict(seen))
    assert not seen["mixture"]


@pytest.mark.parametrize("machine", [
    "Raspberry Pi Pico with RP2040 (1, 24, 0, '') 4870", "NUCLEO-F446RE with STM32F446xx (1, 24, 0, '') 7942",
    "NUCLEO-L476RG with STM32L476RG (1, 19, 1) 7430", "NUCLEO-L476RG with STM32L476RG (1, 40, 0, '') 7943",
    "what is that"])  # fmt: skip
def test_another_board_is_refused_and_stays_as_it_is(flash, board, monkeypatch, capsys, machine):
    board.machine.write_text(machine)
    assert flash_ours(flash, monkeypatch, board) == 1
    message = capsys.readouterr().err
    assert "The board has the files that it had" in message
    assert ("reads 7.3" if "(1, 40" in machine else machine.split(" (")[0]) in message
    assert board.content() == board.old
    assert board.log()[-1].startswith("reset"), "the program that may have run on it starts again"


def test_the_owners_files_stay(flash, board, monkeypatch, capsys):
    for name in ("boot.py", "main.py"):
        (board.files / name).write_text("print('mine')")
        (board.files / (name + ".kept")).write_text("print('mine, too')")
    assert flash_ours(flash, monkeypatch, board) == 0
    assert "The board's own main.py stays, as main.py.kept.kept" in capsys.readouterr().out
    kept = {path.name: path.read_text() for path in board.files.glob("*.kept")}
    assert kept == {"boot.py.kept": "print('mine, too')", "boot.py.kept.kept": "print('mine')",
                    "main.py.kept": "print('mine, too')", "main.py.kept.kept": "print('mine')"}  # fmt: skip


def test_a_step_that_hangs_ends(flash, board, monkeypatch, capsys):
    open(str(board.files) + ".hang", "w").close()
    monkeypatch.setattr(flash.copying, "STEP_TIME", {"exec": 0.5, "fs": 0.5, "reset": 0.5})
    assert flash_ours(flash, monkeypatch, board) == 1
    assert "did not end within 0.5 s" in capsys.readouterr().err


def test_the_users_message_is_no_traceback(flash, board, monkeypatch, capsys):
    (board.files / "robotont_new").write_text("a file where a folder should be")
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


@pytest.mark.parametrize(("there", "word"), [
    ("1.9.9", "older than"), (VERSION, "the same as"), ("99.0.0", "newer than")])  # fmt: skip
def test_versions_are_compared(flash, capsys, there, word):
    flash.compare(there, VERSION)
    assert f"The board has firmware {there}, {word} the {VERSION}" in capsys.readouterr().out


def test_explains_how_to_install_micropython(flash, board, monkeypatch, capsys):
    open(str(board.files) + ".broken", "w").close()
    assert flash_ours(flash, monkeypatch, board) == 1
    message = capsys.readouterr().err
    assert "No MicroPython answers on " + board.port in message
    assert "st-flash" in message
    assert "NUCLEO_L476RG" in message
    assert "USER" in message


def test_reports_when_the_board_stays_silent(flash, board, monkeypatch, capsys):
    board.banner = b"Traceback"
    board.packet = "{0}{1}{2}"
    module, wait = sys.modules["robotont_flash.self_test"], flash.boards.wait_for_line
    monkeypatch.setattr(module, "wait_for_line", lambda line, start, seconds: wait(line, start, seconds / 10))
    assert flash_ours(flash, monkeypatch, board) == 1
    message = capsys.readouterr().err
    assert "does not introduce itself" in message
    assert "The new firmware is on the board, whole" in message


def test_reports_when_there_is_no_port(flash, monkeypatch, capsys):
    assert run(flash, monkeypatch, "--port", "/dev/no_such_port") == 1
    assert "There is no /dev/no_such_port" in capsys.readouterr().err
    monkeypatch.setattr(flash.boards.glob, "glob", lambda pattern: [])
    assert run(flash, monkeypatch) == 1
    assert "No board found" in capsys.readouterr().err
    monkeypatch.setattr(
        flash.boards.glob, "glob", lambda pattern: ["/dev/ttyACM0", "/dev/ttyACM1"] if "ACM" in pattern else []
    )
    assert run(flash, monkeypatch) == 1
    assert "Choose one with --port" in capsys.readouterr().err


@pytest.mark.parametrize(("number", "message"), [(13, "dialout"), (16, "in use"), (5, "does not open")])
def test_reports_why_the_port_does_not_open(flash, board, monkeypatch, capsys, number, message):
    def refuse(*_, **__):
        raise flash.boards.serial.SerialException(number, "refused")

    monkeypatch.setattr(flash.boards.serial, "Serial", refuse)
    assert flash_ours(flash, monkeypatch, board) == 1
    assert message in capsys.readouterr().err


def test_reports_what_does_not_compile(flash, tmp_path):
    bad = tmp_path / "bad.py"
    bad.write_text("def (")
    with pytest.raises(flash.FlashError, match=r"bad\.py does not compile"):
        flash.copying.compile_file(bad, tmp_path / "bad.mpy")


@pytest.mark.parametrize(("line", "message"), [
    ("MAX_SPEDE = 90", "found MAX_SPEDE, which the firmware does not know"),
    ("del FAULTS", "FAULTS is missing"),
    ("TICK_TIMER = 4", "config.TICK_TIMER: found 4, allowed: a timer of its own"),
])  # fmt: skip
def test_a_profile_that_cannot_work_is_refused_and_nothing_written(flash, board, tmp_path, monkeypatch, capsys, line,
                                                                   message):  # fmt: skip
    package, root = flash.folders()
    copied = shutil.copytree(package, tmp_path / "package")
    text = (package / "wiring.py").read_text().replace('"ours"', '"wrong"')
    (copied / "wiring_wrong.py").write_text(f"{text}\n{line}\n")
    monkeypatch.setattr(flash, "folders", lambda: (copied, root))
    assert run(flash, monkeypatch, "--port", board.port, "--profile", "wrong", "--yes") == 1
    error = capsys.readouterr().err
    assert f"wiring_wrong.py: {message}" in error
    assert error.endswith("Nothing was written: the board has what it had.\n")
    assert not board.asked
    assert board.content() == board.old


def test_a_file_that_is_not_whole_exchanges_nothing(flash, board, monkeypatch, capsys):
    copy = flash.copying.copy

    def lose_a_part(port, files):
        copy(port, files)
        (board.files / "robotont_new" / "wheel_speed.mpy").write_bytes(b"M")

    monkeypatch.setattr(flash.copying, "copy", lose_a_part)
    assert flash_ours(flash, monkeypatch, board) == 1
    assert "wheel_speed.mpy is not whole" in capsys.readouterr().err
    there = {name: data for name, data in board.content().items() if not name.startswith("robotont_new/")}
    assert there == board.old


def test_finds_its_files_when_installed(flash, tmp_path, monkeypatch):
    share = tmp_path / "share" / "robotont_firmware" / "root"
    share.mkdir(parents=True)
    (share / "boot.py").touch()
    package = tmp_path / "lib" / "python3" / "dist-packages" / "robotont_firmware"
    package.mkdir(parents=True)
    (package / "wiring.py").touch()
    monkeypatch.setattr(flash.robotont_firmware, "__path__", [str(package)])
    assert flash.folders() == (package, share)
