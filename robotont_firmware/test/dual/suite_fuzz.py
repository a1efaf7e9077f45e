"""Random and mutated bytes into the receiver: nothing raises, nothing false is accepted.

The same bytes on every interpreter, the emulated board's 31-bit integers included; the digests must be equal.
"""

from dual_tools import Locked, checked

from robotont_firmware.protocol import Receiver

BYTES = 100000
ALPHABET = b"0123456789.-:;\nABCDEF!"
PRIME = 33554393  # below 2^25, so that 31 times as much, and 24 bits more, are below 2^30


class Random:
    """xorshift of two 16-bit words, period 2^32 - 1: the same numbers on every interpreter."""

    def __init__(self, seed):
        self.older = seed & 0xFFFF
        self.newer = seed >> 16

    def below(self, limit):
        word = self.older ^ (self.older << 5 & 0xFFFF)
        self.older = self.newer
        self.newer = self.newer ^ self.newer >> 1 ^ word ^ word >> 3
        return self.newer % limit


def number(random):
    """Return a command's number and what it is in 1/256 unit."""
    hundredths = random.below(20000) - 10000
    size = abs(hundredths)
    text = "{}{}.{:02d}".format("-" if hundredths < 0 else "", size // 100, size % 100)
    fixed = (size * 512 + 100) // 200
    return text, -fixed if hundredths < 0 else fixed


def mutate(random, line):
    """Return the line with one to four bytes flipped, lost, doubled, inserted, swapped, or its end cut."""
    line = bytearray(line)
    for _ in range(1 + random.below(4)):
        at = random.below(len(line))
        kind = random.below(6)
        if kind == 0:
            line[at] ^= 1 << random.below(8)
        elif kind == 1:
            line[at] = ALPHABET[random.below(len(ALPHABET))]
        elif kind == 2:
            line = line[:at] + line[at + 1 :]
        elif kind == 3:
            line = line[:at] + line[at : at + 1] + line[at:]
        elif kind == 4:
            line = line[:at] + bytes([random.below(256)]) + line[at:]
        else:
            line = line[: at + 1]
        if not line:
            return line
    return line


def fill(data, draw):
    """Return `data` with each byte drawn; no list of them, for which the board's heap has no room in one piece."""
    for at in range(len(data)):
        data[at] = draw()
    return data


def chunk(random, line):
    """Return what arrives in place of the checked command `line`, and whether that leaves it intact."""
    kind = random.below(10)
    if kind == 0:
        return fill(bytearray(random.below(300)), lambda: random.below(256)), False
    if kind == 1:
        return fill(bytearray(random.below(300)), lambda: ALPHABET[random.below(len(ALPHABET))]), False
    if kind < 4:
        return bytearray(b"\n" + line), True
    if kind == 4:
        return bytearray(line[: line.index(b";") + 1] + b"\n"), False  # plain: refused
    return mutate(random, line), False


def test_random_and_mutated_bytes():
    random, receiver = Random(20180521), Receiver(3)
    start = bytearray(checked("0:0:0"))
    receiver.feed(start, len(start))
    assert receiver.checked
    newest = [(0, 0, 0)]
    fed = accepted = intact = digest = 0
    while fed < BYTES:
        numbers = [number(random) for _ in range(3)]
        data, whole = chunk(random, checked(":".join([text for text, _ in numbers])))
        newest = newest[-100:] + [tuple([value for _, value in numbers])]
        with Locked():
            found = receiver.feed(data, len(data))
        fed += len(data)
        accepted += found
        intact += whole
        if found:
            assert tuple(receiver.setpoints) in newest, (receiver.setpoints, bytes(data))
        for value in receiver.setpoints:
            digest = (digest * 31 + (value & 0xFFFFFF)) % PRIME
        digest = (digest * 31 + receiver.dropped) % PRIME
    assert intact <= accepted
    return f"digest {digest:07X} accepted {accepted} dropped {receiver.dropped} of {fed} bytes"
