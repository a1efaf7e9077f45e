from robotont_driver.link.serial_link import Outbox


def test_of_commands_only_the_newest_waits():
    outbox = Outbox()
    outbox.put(b"one")
    outbox.put(b"two")
    assert outbox.take(0.0) == b"two"
    assert outbox.take(0.0) == b""
    assert not outbox


def test_a_line_that_can_wait_goes_when_no_command_does():
    outbox = Outbox()
    outbox.added.append(b"light")
    outbox.put(b"command")
    assert [outbox.take(0.0), outbox.take(0.0), outbox.take(0.0)] == [b"command", b"light", b""]
    assert not outbox


def test_a_pause_begins_when_its_line_is_out():
    outbox = Outbox()
    outbox.pacing = 0.03
    outbox.put(b"one")
    assert outbox.take(1.0) == b"one"
    outbox.written(1.02)  # this process was kept from writing for so long
    outbox.put(b"two")
    assert outbox.take(1.049) == b""
    assert outbox.take(1.05) == b"two"


def test_a_line_waits_until_its_predecessor_has_left_the_serial_line():
    outbox = Outbox(byte_time=0.001)
    outbox.put(b"0123456789")
    assert outbox.take(1.0) == b"0123456789"
    outbox.put(b"stop")
    assert outbox.take(1.009) == b""
    assert abs(outbox.wait(1.009) - 0.001) < 1e-9
    assert outbox.take(1.01) == b"stop"


def test_a_board_that_needs_pauses_gets_them_behind_the_end_of_a_long_line():
    """The last byte of a line of lights is late, and a board that executes one line per loop swallows the next one."""
    outbox = Outbox(byte_time=0.001)
    outbox.pacing = 0.03
    outbox.added.append(b"0123456789")
    assert outbox.take(1.0) == b"0123456789"
    outbox.put(b"stop")
    assert outbox.take(1.039) == b""
    assert outbox.take(1.041) == b"stop"
