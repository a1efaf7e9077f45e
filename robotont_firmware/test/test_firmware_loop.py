"""The firmware in real time on a pseudo-terminal, under MicroPython with the heap locked.

FIRMWARE_LOOP_SECONDS sets how long (default 10). How even the periods are is printed, not judged: it is this machine's
doing, not the board's.
"""

import os

from firmware_pty import Firmware, Pc, jitter

SECONDS = float(os.environ.get("FIRMWARE_LOOP_SECONDS", "10"))


def talk():
    """Return (packets, the firmware's output) of one conversation, after checking that nothing was lost."""
    periods = round(SECONDS * 50)
    with Firmware(periods) as firmware:
        firmware.start()
        pc = Pc(firmware.port, "-18.90:5.25:30.00")
        pc.talk(lambda: firmware.process.poll() is not None)
        output = firmware.finish()
    assert pc.lines[0].startswith(b"# robotont_firmware ")
    assert [line for line in pc.lines[1:] if line.startswith(b"#")] == [], "nothing dropped, no timeout"
    packets = pc.packets()
    assert abs(len(packets) + packets[-1].missed - periods) <= 2, output
    sums, begin = [0, 0, 0], packets[0].counter - packets[0].missed
    for index, packet in enumerate(packets):
        sums = [a + b for a, b in zip(sums, packet.counts)]
        assert packet.counter == (begin + index + packet.missed) & 0xFF, f"packet {index} is missing"
        assert packet.totals == [b"%04X" % (total & 0xFFFF) for total in sums]
    for wheel, wished in enumerate((-18.9, 5.25, 30.0)):
        steady = [packet.counts[wheel] for packet in packets[100:]]
        ticks = len(steady) + packets[-1].missed - packets[99].missed
        assert abs(sum(steady) / ticks - wished) < 0.03
    return packets, output


def test_talks_at_50_hz_and_loses_nothing():
    packets, output = talk()
    print(f"{len(packets)} packets, p99 of the period within {1000 * jitter(output):.2f} ms")
