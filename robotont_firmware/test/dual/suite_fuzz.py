"""A million random and mutated bytes into the receiver: nothing raises, nothing false is accepted."""

from dual_tools import Locked, checked

from robotont_firmware.protocol import Receiver

BYTES = 1000000
ALPHABET = b"0123456789.-:;\nABCDEF!"


class Random:
    """xorshift32: the same numbers on every interpreter."""

    def __init__(self, seed):
        self.state = seed

    def below(self, limit):
        state = self.state
        state ^= (state << 13) & 0xFFFFFFFF
        state ^= state >> 17
        state ^= (state << 5) & 0xFFFFFFFF
        self.state = state
        return state % limit


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


def test_a_million_bytes():
    random = Random(20180521)
    receiver = Receiver(3)
    start = bytearray(checked("0:0:0"))
    receiver.feed(start, len(start))
    assert receiver.checked
    sent = {(0, 0, 0)}
    recent = []
    fed = accepted = intact = 0
    digest = 2166136261
    while fed < BYTES:
        texts, values = [], []
        for _ in range(3):
            text, value = number(random)
            texts.append(text)
            values.append(value)
        line = checked(":".join(texts))
        kind = random.below(10)
        if kind == 0:
            data = bytearray([random.below(256) for _ in range(random.below(300))])
        elif kind == 1:
            data = bytearray([ALPHABET[random.below(len(ALPHABET))] for _ in range(random.below(300))])
        elif kind < 4:
            data = bytearray(b"\n" + line)
            intact += 1
        elif kind == 4:
            data = bytearray(line[: line.index(b";") + 1] + b"\n")  # plain: refused
        else:
            data = mutate(random, line)
        recent.append((values[0], values[1], values[2]))
        sent.add(recent[-1])
        if len(recent) > 100:
            sent.discard(recent.pop(0))
        with Locked():
            found = receiver.feed(data, len(data))
        fed += len(data)
        accepted += found
        if found:
            got = (receiver.setpoints[0], receiver.setpoints[1], receiver.setpoints[2])
            assert got in sent, (got, bytes(data))
        for value in receiver.setpoints:
            digest = ((digest ^ (value & 0xFFFFFF)) * 16777619) & 0xFFFFFFFF
        digest = ((digest ^ receiver.dropped) * 16777619) & 0xFFFFFFFF
    assert intact <= accepted
    return f"digest {digest:08X} accepted {accepted} dropped {receiver.dropped} of {fed} bytes"
