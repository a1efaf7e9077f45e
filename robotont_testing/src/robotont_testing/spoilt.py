"""Files and lines with errors, for fuzz tests."""

import random

INSERTED = (b"\n", b":", b";", b",", b'"', b"-", b".", b"[", b"{", b"&a *a", b"nan", b"1e999", b"9" * 400, b"\xff",
            b"\x00" * 4)


def spoilt(data, seed, most=8):
    """The bytes with up to `most` places changed, lost, doubled, or with something inserted."""
    chance = random.Random(seed)
    data = bytearray(data)
    for _ in range(chance.randint(0, most)):
        at = chance.randrange(len(data) + 1)
        length = chance.randint(0, 5)
        data[at:at + length] = chance.choice((
            b"", data[at:at + 20], bytes([chance.randrange(256)]), chance.choice(INSERTED)))
    return bytes(data)
