"""Random and mutated bytes into the receiver: nothing raises, nothing false is accepted.

The same bytes on every interpreter, the emulated board's 31-bit integers included; the digests must be equal.
"""

from dual_tools import Locked, checked

from robotont_firmware.receiver import Receiver

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


class Fuzz:
    """A receiver under random and mutated commands; `digest` holds what it made of all of them."""

    def __init__(self):
        self.random = Random(20180521)
        self.receiver = Receiver(3)
        start = bytearray(checked("0:0:0"))
        self.receiver.feed(start, len(start))
        assert self.receiver.checked
        self.sent = [(0, 0, 0)]  # the newest commands
        self.fed = self.accepted = self.intact = self.digest = 0

    def feed(self):
        """Feed BYTES bytes; return what came of them."""
        while self.fed < BYTES:
            self._feed_one()
        assert self.intact <= self.accepted
        return (
            f"digest {self.digest:07X} accepted {self.accepted} dropped {self.receiver.dropped} of {self.fed} bytes"
        )

    def _feed_one(self):
        numbers = [number(self.random) for _ in range(3)]
        data, intact = chunk(self.random, checked(":".join([text for text, _ in numbers])))
        self.sent = self.sent[-100:] + [tuple([value for _, value in numbers])]
        with Locked():
            found = self.receiver.feed(data, len(data))
        self.fed += len(data)
        self.accepted += found
        self.intact += intact
        if found:
            got = tuple(self.receiver.setpoints)
            assert got in self.sent, (got, bytes(data))
        for value in self.receiver.setpoints:
            self._note(value & 0xFFFFFF)
        self._note(self.receiver.dropped)

    def _note(self, value):
        self.digest = (self.digest * 31 + value) % PRIME


def test_random_and_mutated_bytes():
    return Fuzz().feed()
