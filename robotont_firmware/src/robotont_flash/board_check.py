"""Which board is at a port, found out without changing it."""

import glob
import os
import re
import time
from pathlib import Path

import serial
from serial.tools import list_ports

BAUDRATE = 115200
LEAVE = b"\n!repl;D35D\n"  # asks the running firmware for the REPL; see robotont_firmware/protocol.py
ASK = b"\n?;8F9C\n"  # asks it for its identity
LISTENING = 1.5  # [s] the official firmware sends something every 20 ms
ST_LINK, GENERATION_3 = 0x0483, (0x0483, 0x5740)  # USB vendor; and product: an ST-Link has another one

# Output of boards, from the beginning of a line: pattern, and firmware with the driver's option for it.
FIRMWARES = (
    (rb"Setpoints |Encoders ", "the firmware of June 2018"),
    (rb"ODOM:|\*\*\*\* MAIN|RANGE:|POWER:|BATSTATE:", "the official firmware of generation 2 or 3"),
    (rb"-?[0-9]+(\.[0-9]+)?(:-?[0-9]+(\.[0-9]+)?)+; *\r?$", "the thesis' packets (packets:=plain)"),
)
OWN = rb"# robotont_firmware|-?[0-9]+(:-?[0-9]+)+;[0-9A-F]{2}(:[0-9A-F]{4,})+\r?$"
NO_FLASHING = """\
{port} has {firmware}, which sends: {line}
It needs no flashing: this project's driver supports it, too.
    roslaunch robotont_bringup robot.launch port:={port}
Flashed with wiring that is not its own, a robot may run away or burn. Docs: docs/firmware.md"""
UNKNOWN = """\
{port} sends something that no firmware known here sends: {line}
Is it the right port? A board with MicroPython and a program of your own: hold USER, press and
release RESET, let USER go when the green LED has blinked twice (safe mode), and run this again."""
NO_ST_LINK = """\
{port} is no ST-Link, as a NUCLEO-L476RG has one, but USB {vid:04x}:{pid:04x} ({name})."""


class FlashError(Exception):
    """Message for the user; the exit status is 1."""


def find_port(requested):
    """Return the serial port to use; FlashError states why there is none."""
    if requested:
        if not os.path.exists(requested):
            raise FlashError(f"There is no {requested}. Is the board's USB cable (the ST-Link's) plugged in?")
        return requested
    links = sorted(glob.glob("/dev/serial/by-id/*STLink*") + glob.glob("/dev/serial/by-id/*STLINK*"))
    ports = links or sorted(glob.glob("/dev/ttyACM*"))
    if not ports:
        raise FlashError("No board found. Plug in the ST-Link's USB cable, or name the port with --port.")
    if len(ports) > 1:
        raise FlashError("Several ports: {}. Choose one with --port.".format(", ".join(ports)))
    return ports[0]


def open_port(port):
    """Return the open port; FlashError states why it cannot be opened."""
    try:
        return serial.Serial(port, BAUDRATE, timeout=0.1, write_timeout=2.0, exclusive=True)
    except serial.SerialException as error:
        number = getattr(error, "errno", None)
        if number == 13 or "Permission" in str(error):
            message = f"You may not use {port}: sudo usermod -aG dialout $USER, then log in again."
        elif number in (11, 16) or "lock" in str(error):
            message = f"{port} is in use. Stop the driver (or whatever uses it) first."
        else:
            message = f"{port} does not open: {error}"
        raise FlashError(message) from None


def check_board(port):
    """Listen before anything is written; return (profile, version) of our own firmware, "" where it reports none.

    FlashError for a board that must not be flashed.
    """
    found = [entry for entry in list_ports.comports() if entry.device == os.path.realpath(port)]
    if any((entry.vid, entry.pid) == GENERATION_3 for entry in found):
        raise FlashError(NO_FLASHING.format(port=port, firmware="the USB number of generation 3", line="(not asked)"))
    for entry in found:
        if entry.vid not in (None, ST_LINK):
            raise FlashError(NO_ST_LINK.format(port=port, vid=entry.vid, pid=entry.pid, name=entry.description))
    with open_port(port) as line:
        refuse_others(port)
        kind, firmware, example = recognise(listen(line, LISTENING))
        if kind == "official":
            raise FlashError(NO_FLASHING.format(port=port, firmware=firmware, line=example))
        if kind == "unknown":
            raise FlashError(UNKNOWN.format(port=port, line=example))
        if kind == "silent":
            return "", ""
        identity = ask(line)
    return (identity["profile"], identity["version"]) if identity else ("", "")


def ask(line):
    """Return what our own firmware reports about itself, {version, wheels, profile ...}; {} without an answer."""
    line.write(ASK)
    words = (wait_for_line(line, b"# identity", 1.0) or "").split(";")[0].split()[2:]
    return dict(zip(["version", *words[2::2]], words[1::2])) if words else {}


def refuse_others(port):
    """FlashError when another program has the port open, also one that looks at no lock."""
    device = os.path.realpath(port)
    for link in glob.glob("/proc/[0-9]*/fd/*"):
        process = link.split("/")[2]
        try:
            if os.readlink(link) == device and int(process) != os.getpid():
                name = Path("/proc", process, "comm").read_text(encoding="utf-8").strip()
                raise FlashError(f"{port} is in use by {name} (process {process}). Stop it first.")
        except OSError:
            continue  # it has just ended, or is another user's


def recognise(lines):
    """Return ("official", firmware, line), ("own", "", line), ("unknown", "", line) or ("silent", "", "")."""
    for line in lines:
        for pattern, firmware in FIRMWARES:
            if re.match(pattern, line):
                return "official", firmware, line.decode("ascii", "replace").strip()
    for line in lines:
        if re.match(OWN, line):
            return "own", "", line.decode("ascii", "replace").strip()
    others = [line for line in lines if line.strip()]
    return ("unknown", "", repr(others[-1][:60])) if others else ("silent", "", "")


def listen(line, seconds):
    """Return the lines (bytes) that come within a time, the beginning of the first perhaps missing."""
    received = b""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        received += line.read(4096)
    return received.split(b"\n")[:-1]  # the last one is not whole


def wait_for_line(line, start, seconds):
    """Return the first line that begins with `start`, or None when the time is over."""
    rest = b""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        rest += line.read_until(b"\n")  # not further: the next line is for the next wait
        if rest.endswith(b"\n"):
            if rest.startswith(start):
                return rest.strip().decode("ascii", "replace")
            rest = b""
    return None


def free_repl(port):
    """Ask a running firmware to stop its motors and leave the REPL free; without one nothing happens."""
    with open_port(port) as line:
        line.write(LEAVE)
        if wait_for_line(line, b"# repl", 1.0):
            print("The running firmware stops and gives the REPL.")
            wait_for_line(line, b"# robotont_firmware safe mode", 5.0)
