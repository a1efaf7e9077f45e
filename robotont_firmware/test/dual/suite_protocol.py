"""Packets: golden vectors, every way a line can be wrong, no allocation."""

from array import array

from dual_tools import Locked, checked, crc_slow, golden

from robotont_firmware.protocol import ASK, LEAVE, LINE_SIZE, TEST, Receiver, Sender, crc16, line_of


def feed(receiver, data):
    data = bytearray(data)
    with Locked():
        return receiver.feed(data, len(data))


def test_crc_golden():
    for text, crc in golden()["crc16"]:
        assert crc16(text.encode(), len(text)) == int(crc, 16), text


def test_commands_golden():
    for vector in golden()["commands"]:
        for kind in ("plain", "checked"):
            receiver = Receiver(len(vector["units"]))
            line = vector[kind].encode()
            assert sum([feed(receiver, line[at : at + 1]) for at in range(len(line))]) == 1, vector[kind]
            assert list(receiver.setpoints) == vector["fixed_256"], vector[kind]
            assert receiver.checked == (kind == "checked")
            assert receiver.dropped == 0


def test_bad_commands_golden_in_either_mode():
    for line in golden()["bad_commands"]:
        for first in (b"", checked("5:6:7")):
            receiver = Receiver(3)
            feed(receiver, first)
            before = list(receiver.setpoints)
            assert feed(receiver, line.encode()) == 0, line
            assert list(receiver.setpoints) == before, line
            assert receiver.dropped == 1, line
            assert feed(receiver, checked("1:2:3")) == 1, line


def test_bad_numbers_with_a_right_crc():
    for body in ("1:2", "1:2:3:4", "a:2:3", "1:2:", "1:-:3", "1:2:3.", "1:2:.5", "+1:2:3", "1:2:32768", "1:2:3 ", ""):
        receiver = Receiver(3)
        assert feed(receiver, checked(body)) == 0, body
        assert receiver.dropped == 1, body


def test_feedback_golden():
    for vector in golden()["feedback_with_battery"]:
        sender = Sender(len(vector["counts"]))
        status = [vector["flags"], vector["missed"], vector["refused"]] + vector["faults"]
        status.extend([vector["battery"], vector["load"]])
        status = array("H", status)
        counts, totals = array("i", vector["counts"]), array("H", vector["totals"])
        with Locked():
            length = sender.pack(vector["counter"], counts, totals, status)
        assert bytes(sender.buffer[:length]).decode() == vector["packet"]


def test_longest_feedback_fits():
    for wheels in (3, 8):
        sender = Sender(wheels)
        counts, totals = array("i", [-32768] * wheels), array("H", [65535] * wheels)
        status = array("H", [255] * 3 + [15] * wheels + [0xFFF, 255])
        with Locked():
            length = sender.pack(255, counts, totals, status)
        line = bytes(sender.buffer[:length])
        assert line.endswith(b"%04X\n" % crc_slow(line[:-5]))


def test_lines_one_after_the_other():
    """Each: bytes, commands in them, then speed of all wheels and lines dropped so far."""
    longest = "1:2:3." + "0" * (LINE_SIZE - len("1:2:3.;CCCC"))
    for why, *lines in (
        ("plain is refused after checked until it is released",
         (b"1:1:1;\n", 1, 1, 0), (checked("4:4:4"), 1, 4, 0), (b"1:1:1;\n", 0, 4, 1), (None, 0, 4, 1),
         (b"1:1:1;\n", 1, 1, 1)),
        ("the newest of several wins",
         (checked("1:1:1") + checked("2:2:2") + b"3:3:3;0000\n" + b"4:4:", 2, 2, 1)),
        ("a long line is dropped to its newline",
         (b"1" * (LINE_SIZE + 1), 0, 0, 0), (checked("2:2:2"), 0, 0, 1), (checked("2:2:2"), 1, 2, 1)),
        ("as is a longer one", (b"1" * 5000, 0, 0, 0), (checked("2:2:2"), 0, 0, 1), (checked("2:2:2"), 1, 2, 1)),
        ("the longest is none", (checked(longest.replace("2", "1").replace("3", "1")), 1, 1, 0)),
        ("one byte more is", (checked(longest + "0"), 0, 0, 1)),
        ("empty lines are nothing", (b"\n\n\n", 0, 0, 0)),
    ):
        receiver = Receiver(3)
        for line, accepted, speed, dropped in lines:
            if line is None:
                receiver.checked = False
            else:
                assert feed(receiver, line) == accepted, why
            assert list(receiver.setpoints) == [256 * speed] * 3, why
            assert receiver.dropped == dropped, why


def test_every_decimal_rounds_to_nearest():
    receiver = Receiver(3)
    for hundredths in range(0, 30000, 7):
        text = f"{hundredths // 100}.{hundredths % 100:02d}"
        assert feed(receiver, checked(f"{text}:-{text}:0")) == 1
        nearest = (hundredths * 512 + 100) // 200
        assert list(receiver.setpoints) == [nearest, -nearest, 0], text
    assert feed(receiver, checked("0.998046:0.998047:999.9999999999")) == 1  # 255.4998, 255.5000 of 256
    assert list(receiver.setpoints) == [255, 256, 256000]


def test_an_order_needs_its_crc():
    for order in ("!repl", "?"):
        whole = checked(order)
        for line in (whole[:-2] + b"\n", whole[:-1] + b"0\n", whole[:-5] + b"0000\n", order.encode() + b"\n",
                     b"?" + whole, checked("!rep")):  # fmt: skip
            receiver = Receiver(3)
            assert feed(receiver, line) == 0
            assert receiver.order == 0, line
            assert receiver.dropped == 1


def test_texts_golden():
    for vector in golden()["texts"]:
        assert line_of("# " + vector["words"]).decode() == vector["line"]


def test_orders_golden():
    for line in golden()["orders"]:
        receiver = Receiver(3)
        assert feed(receiver, line.encode()) == 0
        test = TEST + 2 * int(line[6]) + (line[7] == "-") if "test" in line else 0
        order = LEAVE if line.startswith("!r") else ASK if line.startswith("?") else test
        assert receiver.order == order, line
        assert receiver.dropped == 0
    for order in ("!test 3+", "!test 0", "!test 0*", "!test +", "!test 0+0", "!test /+", "!tes 0+", "!test 0+400:50"):
        receiver = Receiver(3)
        feed(receiver, checked(order))
        assert (receiver.order, receiver.dropped) == (0, 1), order
