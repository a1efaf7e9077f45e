"""./robotont flash against a stand-in for the board."""

import ast
import io
import itertools
import runpy
import shutil
import sys
import types

import pytest
from flash_board import VERSION, Board, run_on_the_board

from robotont_driver.kinematics.wheel_params import read_wheels
from robotont_flash import board_check, copying, program
from robotont_flash.board_check import FlashError
from robotont_testing.robots import SHIPPED

OWN = b"0:0:0;00:0000:0000:0000:030000000:FBCF\n"
MINE = "from robotont_firmware.pin_profile import *\nPROFILE = 'mine'\n"
UNTOUCHED = "Nothing was written: the board has what it had.\n"


@pytest.fixture
def board(tmp_path, monkeypatch):
    board = Board(tmp_path / "board")
    clock = itertools.count()
    monkeypatch.setattr(board_check, "time", types.SimpleNamespace(monotonic=lambda: next(clock) / 20))
    monkeypatch.setattr(board_check, "opened", lambda *_: board)
    monkeypatch.setattr(board_check, "heard", lambda *_: [board.read(0)])
    monkeypatch.setattr(board_check, "find_port", lambda port: board.port)
    monkeypatch.setattr(board_check, "usb_id", lambda port: "")
    monkeypatch.setattr(copying, "mpremote", board.mpremote)
    board.compile_file = copying.compile_file  # it takes seconds
    monkeypatch.setattr(copying, "compile_file",
                        lambda path, target: target.write_bytes(b"#\x06\x1f\n" + path.read_bytes()))
    return board


@pytest.fixture
def flash(board, monkeypatch, capsys):
    """A function: (exit status, what it prints, what it prints on standard error) of flash with some arguments."""
    def run(arguments):
        monkeypatch.setattr(sys, "argv", ["flash", *arguments.split()])
        return (program.main(), *capsys.readouterr())
    return run


@pytest.mark.parametrize(("sent", "words"), [
    (b"Setpoints 0:0:0\r\nEncoders 1:2:3\r\n\r\n", "before March 2020"),
    (b"ODOM:0.000000:0.000000:0.000000:0.000000:0.000000:0.000000\r\n", "generations 2 and 2.1"),
    (b"\xff\x00\xf0\n**** MAIN ****\r\n", "generations 2 and 2.1"),
    (b"0:-12:13;\n" * 2, "the thesis' packets"),
    (b"Hello, world\r\n\x83\xf1\n", "lines come, but"),
    (b"x\n0:0:0;00:0000:0000:0000:1C8B\r\n", ""), (OWN, ""), (b"\r\n", ""), (b">>> ", "")])  # fmt: skip
def test_what_a_board_sends_tells_its_firmware(board, sent, words):
    board.waiting = sent
    if words:
        with pytest.raises(FlashError, match=words):
            board_check.check_board(board.port)
    else:
        assert board_check.check_board(board.port) is None
    assert board.received == (board_check.ASK if b"0:0:0;00" in sent else b"")


@pytest.mark.parametrize(("sent", "usb", "arguments", "words"), [
    (b"**** MAIN ****\r\n", "", "--profile ours", ["This command does not flash it", "./robotont which /dev/ttyACM0"]),
    (b"Hello, world\r\n", "", "--profile ours", ["of no known protocol", "safe mode"]),
    (b"", "0483:5740", "--profile ours", ["generation 3"]),
    (b"", "2e8a:0005", "--profile ours", ["no ST-Link"]),  # a Pico
    (b"", "", "", ["--profile", "FOUR ENCODER WIRES MOVED"]),  # it reports no profile
    (b"", "", "--profile theirs", ["--profile", "FOUR ENCODER WIRES MOVED"]),
    (OWN, "", "--profile ours", ["Wiring profile ours", "PB6, PB7", "the board has the profile robotont21 now",
                                     "--yes"])])  # fmt: skip
@pytest.mark.parametrize("answer", ["", "robotont21\n"])  # without a terminal, and a wrong one
def test_what_must_not_be_flashed_is_refused_and_nothing_written(board, flash, monkeypatch, sent, usb, arguments,
                                                                 words, answer):
    board.waiting, board.profile = sent, "robotont21" if sent == OWN else ""
    monkeypatch.setattr(board_check, "usb_id", lambda port: usb)
    monkeypatch.setattr("sys.stdin", io.StringIO(answer))
    status, shown, message = flash(arguments)
    assert status == 1
    assert all(word in shown + message for word in words)
    assert message.endswith(UNTOUCHED)
    assert not board.steps
    assert board.received == (board_check.ASK if sent == OWN else b"")


@pytest.mark.parametrize("arguments, status, words", [
    ("--check --profile four robot:=four_wheels", 0, ["PC12", "INERTIA: 1104000 in the profile", "1130400\n",
                                                       "can work, and has the numbers of four_wheels"]),
    ("--check --profile ours", 0, ["Profile ours can work."]),
    ("--check --profile four robot:=thesis", 1, ["WHEELS: 4 in the profile, 3 by the robot", "GEAR: 3000",
                                                 "MASS: 3768"]),
    ("--check --profile ours robot:=nobody", 1, ["robot: found 'nobody'"]),
    ("--check", 1, ["Choose with --profile"]),
])
def test_a_profile_is_checked_without_a_board(flash, monkeypatch, arguments, status, words):
    monkeypatch.setattr(board_check, "find_port", lambda port: pytest.fail("a board was looked for"))
    found, shown, message = flash(arguments)
    assert found == status
    assert all(word in shown + message for word in words)


def test_wheels_in_another_order_or_round_are_not_even():
    """Which the board believes of the profile, and the simulator works out of the folder."""
    assert program.numbers_of(read_wheels(SHIPPED))["EVEN"] == 1
    for change in ({"wheelRads": [*SHIPPED["wheelRads"][1::-1], SHIPPED["wheelRads"][2]]},
                   {"wheelRads": [0.9, 2.2, 4.0]}):
        assert program.numbers_of(read_wheels({**SHIPPED, **change}))["EVEN"] == 0


@pytest.mark.parametrize("text, words", [
    ("PROFILE = (", ["profile mine: cannot be read: SyntaxError"]),
    ("from robotont_firmware.pin_profile_four import *", ["PROFILE: found 'four', allowed: 'mine'"]),
    ("PROFILE = 'mine'", ["profile mine: ", " is missing, or not known"]),
    (MINE + "MAX_SPEDE = 90", ["profile mine: MAX_SPEDE is missing, or not known"]),
    (MINE + "del FAULTS", ["profile mine: FAULTS is missing, or not known"]),
    (MINE + "TICK_TIMER = 4", ["profile mine: config.TICK_TIMER: found 4, allowed: a timer of its own"]),
    (MINE + "PWM = (4, 5, 6)", ["profile mine: config.PWM: found (4, 5, 6)"]),
    (MINE + "FAULTS = ('PZ2',) + FAULTS[1:]", ["profile mine: FAULTS: found 'PZ2', allowed: PA0, PA1, PA4 to"]),
    (MINE + "LIGHT = 'PA3'", ["profile mine: LIGHT: found 'PA3'"]),  # the serial line
    (MINE + "SAFE_BUTTON = 'PA3'", ["profile mine: SAFE_BUTTON: found 'PA3', allowed: PA0, PA1, PA4 to"]),
    (MINE + "SAFE_BUTTON = 'PZ9'", ["profile mine: SAFE_BUTTON: found 'PZ9', allowed: PA0, PA1, PA4 to"]),
    (MINE + "BATTERY_PIN, BATTERY_DIVIDER = 'PB10', 16500", [
        "profile mine: BATTERY_PIN: found 'PB10', allowed: PA0, PA1, PA4 to PA7, PB0, PB1, PC0 to PC5"]),
    (MINE + "RATE = 40", ["profile mine: config.RATE: found 40, allowed: more: a period of 259 bytes at most"]),
    (MINE + "RATE, BAUDRATE = 40, 57600", ["profile mine: BAUDRATE: found 57600, allowed: 115200"]),
    (MINE + "ENCODERS = ENCODERS[:2] + (('PA10', 'PA9', 1, 1),)", [
        "ENCODERS: found 'PA10' with alternate function 1 for channel 1 of timer 1, allowed: PA8 with 1"]),
    (MINE + "PWM = PWM[:2] + (('PC8', 8, 3, 2),)", ["PWM: found 'PC8' with alternate function 2", "PC8 with 3"]),
    (MINE + "MAX_TORQUE = 400", ["profile mine: CONTINUOUS_TORQUE: found 800, allowed: up to MAX_TORQUE, 400"]),
])
def test_a_bad_file_of_a_profile_spoils_no_other(board, flash, monkeypatch, tmp_path, text, words):
    package = tmp_path / "robotont_firmware"
    shutil.copytree(str(program.PACKAGE), str(package))
    (package / "pin_profile_mine.py").write_text(text)
    monkeypatch.setattr(program, "PACKAGE", package)
    status, shown, message = flash("--yes --profile mine")
    assert status == 1
    assert all(word in shown + message for word in words)
    assert message.endswith(UNTOUCHED)
    assert not board.steps
    assert "\n  mine " in flash("--check --profile theirs")[2]
    assert flash("--check --profile four")[0] == 0


@pytest.mark.parametrize("text, words", [("RATE = 51", "RATE: 51 in the profile, 50 by the robot"),
                                         ("EDGES = 65", "EDGES: 65 in the profile, 64 by the robot"),
                                         ("INERTIA = 1", "INERTIA: 1 in the profile"),
                                         ("TIME_CONSTANT = 260", "TIME_CONSTANT: 260 in the profile")])
def test_numbers_that_the_others_do_not_explain_are_refused(flash, monkeypatch, tmp_path, text, words):
    package = tmp_path / "robotont_firmware"
    shutil.copytree(str(program.PACKAGE), str(package))
    (package / "pin_profile_mine.py").write_text(MINE + text)
    monkeypatch.setattr(program, "PACKAGE", package)
    status, _, message = flash("--check --profile mine robot:=thesis")
    assert (status, words in message, UNTOUCHED in message) == (1, True, False)


def test_our_own_firmware_keeps_its_profile_and_boot_gets_its_pins(board, flash):
    board.waiting = OWN
    board.profile = board.new_profile = "robotont21"
    status, shown, _ = flash("--yes")
    assert status == 0
    assert f"The board has firmware 2.0.0; it gets {VERSION} now." in shown
    names = runpy.run_path(str(board.files / "robotont_firmware" / "pin_profile.mpy"))
    assert names["PROFILE"] == "robotont21"
    pins = {pwm[0] for pwm in names["PWM"]} | {pin for pair in names["DIRECTIONS"] for pin in pair}
    boot = (board.files / "boot.py").read_text()
    line = next(line for line in boot.splitlines() if line.startswith("MOTOR_PINS"))
    assert set(ast.literal_eval(line.split(" = ")[1])) == pins


def new_files(folder):
    """What the board has when it was flashed with the profile ours."""
    folder.mkdir()
    _, ours = program.choose_profile(program.PACKAGE, "ours")
    return {("" if path.suffix == ".py" else "robotont_firmware/") + path.name: path.read_bytes()
            for path in copying.stage(program.PACKAGE, ours, folder)}  # fmt: skip


def test_flashes_everything_and_tests_the_board(board, flash, monkeypatch, tmp_path):
    monkeypatch.setattr(copying, "compile_file", board.compile_file)
    status, shown, _ = flash("--profile ours --yes")
    assert status == 0
    assert "Self-test passed: 50 packets, no tick missed, load 49 % of a period" in shown
    assert f"# robotont_firmware {VERSION} wheels 3" in shown
    assert "The board has firmware" not in shown, "it did not say which"
    assert board.content() == new_files(tmp_path / "new"), "and nothing else"
    assert [name for name in board.content() if name.endswith(".py")] == ["boot.py", "main.py"]
    data = board.content()["robotont_firmware/wheel_speed.mpy"]
    assert (data[0], data[1], data[2] >> 2, data[2] & 3) == (ord("M"), 6, 7, 3), "machine code for that processor"
    assert board.steps == ["exec", "exec", "fs", "exec", "reset"]


@pytest.mark.parametrize(("change", "words", "last", "kept"), [
    ({"fails": 0}, "pulled", program.STOPPED, True), ({"fails": 1}, "pulled", program.EXCHANGING, True),
    ({"fails": 2}, "pulled", program.EXCHANGING, False), ({"fails": 3}, "pulled", program.EXCHANGING, False),
    ({"fails": 4}, "pulled", program.NEW, False),
    ({"load": 90}, "load 90 %", program.NEW, False), ({"missed": True}, "1 were lost", program.NEW, False),
    ({"totals": ""}, "0 packets came", program.NEW, False),
    ({"spoilt": 1}, "wrong checksum", program.NEW, False), ({"banner": "x"}, "introduce itself", program.NEW, False),
    ({"new_version": "1.0.0"}, "found # robotont_firmware 1.0.0", program.NEW, False),
    ({"new_profile": "vnh"}, "profile vnh", program.NEW, False),
    ({"packets": lambda: b"x\n"}, "0 packets came", program.NEW, False),
    *(({"machine": machine}, machine, program.RESTARTED, True) for machine in (
        "Raspberry Pi Pico with RP2040 with MicroPython 1.24.0 for files 4870",
        "NUCLEO-F446RE with STM32F446xx with MicroPython 1.24.0 for files 7942",
        "NUCLEO-L476RG with STM32L476RG with MicroPython 1.19.1 for files 7430",
        "NUCLEO-L476RG with STM32L476RG with MicroPython 1.40.0 for files 7943",
        "what is that"))])  # fmt: skip
def test_what_fails_ends_with_words_about_what_the_board_has(board, flash, change, words, last, kept):
    vars(board).update(change)
    status, _, message = flash("--profile ours --yes")
    assert status == 1
    assert words in message
    assert message.endswith(last + "\n")
    assert (board.content() == board.old) == kept
    assert ("main.py" in board.content()) == (board.fails not in (2, 3)), "nothing drives a motor"
    assert (board.steps[-1] == "reset") == (board.fails in (None, 4)), "else the program that may have run stands still"


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


def flash_until(cut, there, staged):
    """Whether both programs, and the copying between them, came to their end before as many steps were done."""
    for code, files in ((copying.PREPARE, staged), (copying.FINISH, ())):
        output = run_on_the_board(f"{CUT.format(cut)}{code.replace('import os', '')}\nprint(left)", there.files).strip()
        assert "Error" not in output
        if not output.isdigit():
            return False
        cut = int(output)
        for path in files[:cut]:
            shutil.copy(str(path), str(there.files / "robotont_firmware"))
        cut -= len(files)
        if cut < 0:
            return False
    return True


def test_wherever_it_is_cut_the_board_has_the_old_firmware_or_the_new_one_or_none_that_runs(board, tmp_path):
    """The power fails after each step of each program that runs on the board; and then it is flashed again."""
    new = new_files(tmp_path / "new")
    staged, seen = sorted((tmp_path / "new").iterdir()), []
    for cut in range(100):
        there = Board(tmp_path / f"board{cut}")
        whole = flash_until(cut, there, staged)
        found = there.content()
        seen.append("none" if "main.py" not in found else "old" if found == there.old else "new")
        assert seen[-1] != "new" or found == new, (cut, found.keys())
        assert "boot.py" in found
        assert flash_until(1000, there, staged)
        assert there.content() == new
        if whole:
            break
    assert sorted(set(seen)) == ["new", "none", "old"]
    assert whole


def test_the_owners_files_stay(board, flash):
    for name in ("boot.py", "main.py"):
        (board.files / name).write_text("print('mine on robotont')")
        (board.files / (name + ".kept")).write_text("print('mine, too')")
    status, shown, _ = flash("--profile ours --yes")
    assert status == 0
    assert "The board's own main.py stays, as main.py.kept.kept" in shown
    kept = {path.name: path.read_text() for path in board.files.glob("*.kept")}
    assert kept == {"boot.py.kept": "print('mine, too')", "boot.py.kept.kept": "print('mine on robotont')",
                    "main.py.kept": "print('mine, too')", "main.py.kept.kept": "print('mine on robotont')"}  # fmt: skip


@pytest.mark.parametrize(("program", "words"), [
    ("sleep 60", "did not end within 0.5 s"), ("echo could not enter raw repl; exit 1", "Flash it"),
    ("echo; echo OSError: 5; exit 1", "failed: OSError: 5"),
    (r"printf 'OSError: \377'; exit 1", "failed: OSError: \ufffd"), ("exit 1", "failed: no reason given")])  # fmt: skip
def test_mpremote_that_fails_is_explained(tmp_path, monkeypatch, program, words):
    fake = tmp_path / "python3"
    fake.write_text(f"#!/bin/sh\n{program}\n")
    fake.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(fake))
    monkeypatch.setattr(copying, "STEP_TIME", 0.5)
    with pytest.raises(FlashError, match=words):
        copying.mpremote("/dev/ttyACM0", "exec", "")


@pytest.mark.parametrize(("ports", "found"), [
    ({}, "found: none"), ({"/dev/ttyACM0": "2e8a:0005"}, "found: none"),
    ({"/dev/ttyACM0": "0483:374b", "/dev/ttyACM1": "0483:374b"}, "found: /dev/ttyACM0, /dev/ttyACM1. "),
    ({"/dev/ttyACM0": "2e8a:0005", "/dev/ttyACM1": "0483:374b"}, "")])  # fmt: skip
def test_the_port_is_the_only_st_link(monkeypatch, ports, found):
    monkeypatch.setattr(board_check, "serial_ports", lambda: list(ports))
    monkeypatch.setattr(board_check, "usb_id", ports.get)
    if found:
        with pytest.raises(FlashError, match=found):
            board_check.find_port(None)
    else:
        assert board_check.find_port(None) == "/dev/ttyACM1"
    assert board_check.find_port("/dev/no_such_port") == "/dev/no_such_port"


def test_a_port_that_is_not_there_is_explained(flash, monkeypatch):
    monkeypatch.undo()
    status, _, message = flash("--profile ours --port /dev/no_such_port")
    assert status == 1
    assert "/dev/no_such_port: no such file" in message


def test_reports_what_does_not_compile(tmp_path):
    bad = tmp_path / "bad.py"
    bad.write_text("def (")
    with pytest.raises(FlashError, match=r"bad\.py does not compile"):
        copying.compile_file(bad, tmp_path / "bad.mpy")
