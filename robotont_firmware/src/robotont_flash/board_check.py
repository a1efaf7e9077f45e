"""Which board is at a port, found out without changing it; and what one shall show after it was flashed."""

import sys
import time

from robotont_driver.link.serial_port import heard, opened, serial_ports, usb_id
from robotont_driver.protocol.board_status import Identity
from robotont_driver.protocol.checked import QUESTION, Checked, CheckedPacket, add_checksum
from robotont_driver.protocol.connection import Listener, explained
from robotont_driver.protocol.official_boards import USB_ID as GENERATION_3
from robotont_driver.protocol.official_boards import Robotont3
from robotont_driver.protocol.protocol import PacketError

BAUDRATE = 115200
LEAVE = b"\n" + add_checksum("!repl;")  # asks the running firmware for the REPL
ASK = b"\n" + QUESTION
PATIENCE = 1.0  # [s] for the rest of a line
LISTENING = 1.5  # [s] the official firmware sends something every 20 ms
ST_LINK = "0483:"  # USB vendor
PACKETS = 50  # of a self-test
MOST_LOAD = 80  # [%] of a period
NO_FLASHING = """\
{port} has {firmware}.
This command does not flash it. If the driver speaks with it, this prints how to start it: ./robotont which {port}
Flashed with wiring that is not its own, a robot may run away or burn. Docs: docs/firmware.md"""
SAFE_MODE = ("hold USER, press and release RESET, let USER go when the green LED has blinked twice (safe mode; three "
             "blinks would erase the files), and run this again, with --profile.")  # fmt: skip


class FlashError(Exception):
    """Message for the user; the exit status is 1."""


def find_port(requested):
    """Return the serial port to use; FlashError states why there is none."""
    ports = [requested] if requested else [port for port in serial_ports() if usb_id(port).startswith(ST_LINK)]
    if len(ports) != 1:
        raise FlashError(f"boards of the ST-Link's USB vendor found: {', '.join(ports) or 'none'}. Plug in one by USB, "
                         "or name its port: --port.")
    return ports[0]


def check_board(port):
    """Listen before anything is written; return the `Identity` of our own firmware, None where none is reported.

    FlashError for a board that must not be flashed; OSError.
    """
    usb = usb_id(port)
    if usb and not usb.startswith(ST_LINK):
        raise FlashError(f"{port} is no ST-Link, as a NUCLEO-L476RG has one, but USB {usb}.")
    listener, received, name = Listener(usb), b"", Robotont3.name if usb == GENERATION_3 else None
    for data in () if name else heard(port, BAUDRATE, LISTENING):
        received += data
        name = name or listener.feed(data)
    if name not in (None, Checked.name):
        raise FlashError(NO_FLASHING.format(port=port, firmware=explained(name)))
    if name:
        with opened(port, BAUDRATE, PATIENCE) as line:
            line.write(ASK)
            answer = wait_for_line(line, b"# identity ", 4.0) or ""
            return Identity.parse(answer[len("# identity "):].split(";")[0])
    if any(line.strip() for line in received.split(b"\n")[:-1]):  # the last one is not whole
        raise FlashError(f"{port}: {listener.heard}\nWith MicroPython and a program of your own: {SAFE_MODE}")
    return None


def wait_for_line(line, start, seconds):
    """Return the first line that begins with `start`, or None when the time is over."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        text = line.read_until(b"\n")  # not further: the next line is for the next wait
        if text.startswith(start) and text.endswith(b"\n"):
            return text.strip().decode("ascii", "replace")
    return None


def free_repl(port):
    """Ask a running firmware to stop its motors and leave the REPL free; without one nothing happens."""
    with opened(port, BAUDRATE, PATIENCE) as line:
        line.write(LEAVE)
        if wait_for_line(line, b"# repl", 1.0):
            print("The running firmware stops and gives the REPL.")
            wait_for_line(line, b"# robotont_firmware safe mode", 5.0)


def self_test(port, version, profile):
    """Return what the board reports about itself, in words; FlashError for what is not as it should be."""
    with opened(port, BAUDRATE, PATIENCE) as line:
        banner = wait_for_line(line, b"# robotont_firmware", 5.0) or "# nothing"
        identity = Identity.parse(banner[len("# "):].split(";")[0])
        if identity is None or (identity.version, identity.profile) != (version, profile):
            raise FlashError(f"The board should introduce itself, with firmware {version} and profile {profile}: found "
                             f"{banner}. See its output: {sys.executable} -m mpremote connect {port}")  # fmt: skip
        packets = []
        try:
            while len(packets) <= PACKETS:
                packets.append(CheckedPacket(wait_for_line(line, b"", PATIENCE) or "", identity.wheels))
        except PacketError as error:
            raise FlashError(f"Self-test failed: after {len(packets)} packets came {error}.") from error
    lost = sum(after.missed_since(before)[0] for before, after in zip(packets, packets[1:]))
    load = max(packet.status.load for packet in packets)
    if lost or load > MOST_LOAD:
        raise FlashError(f"Self-test failed: of {PACKETS} packets {lost} were lost, load {load} % of a period "
                         f"(allowed: {MOST_LOAD} %).")  # fmt: skip
    return f"{banner}\nSelf-test passed: {PACKETS} packets, no tick missed, load {load} % of a period."
