"""What a board shall show after it was flashed: who it is, and that it keeps its time."""

import re

from robotont_firmware.protocol import crc16
from robotont_flash.board_check import FlashError, ask, wait_for_line

PACKETS = 50
# counter, ticks missed, load (the last of the status), CRC
PACKET = re.compile(
    r"[-0-9:]+;([0-9A-F]{2})(?::[0-9A-F]{4})+:[0-9A-F]{2}([0-9A-F]{2})[0-9A-F]+([0-9A-F]{2}):([0-9A-F]{4})"
)
MOST_LOAD = 80  # [%] of a period


def self_test(line, version, profile):
    """Return what the board reports about itself, in words; FlashError for what is not as it should be."""
    banner = wait_for_line(line, b"# robotont_firmware", 5.0)
    if banner is None:
        raise FlashError(f"The board does not introduce itself. See its output: mpremote connect {line.port}")
    identity = ask(line)
    found = (identity.get("version"), identity.get("profile"))
    if found != (version, profile):
        raise FlashError(f"The board should have firmware {version} with profile {profile}, and reports {identity}.")
    counters, missed, load, broken = [], [], 0, 0
    for _ in range(4 * PACKETS):
        text = wait_for_line(line, b"", 1.0) or ""
        match = PACKET.fullmatch(text)
        if match and int(match.group(4), 16) == crc16(text.encode(), len(text) - 4):
            counters.append(int(match.group(1), 16))
            missed.append(int(match.group(2), 16))
            load = max(load, int(match.group(3), 16))
        elif match:
            broken += 1
        if not text or len(counters) > PACKETS:
            break
    lost = sum((after - before - 1) % 256 for before, after in zip(counters, counters[1:]))
    ticks = (missed[-1] - missed[0]) % 256 if missed else 0
    if len(counters) <= PACKETS or lost or broken or ticks or load > MOST_LOAD:
        raise FlashError(f"Self-test failed: {len(counters)} packets came, {lost} were lost, {broken} spoilt, {ticks} "
                         f"ticks missed, load {load} % of a period (allowed: {MOST_LOAD} %).")  # fmt: skip
    return f"{banner}\nSelf-test passed: {PACKETS} packets, no tick missed, load {load} % of a period."
