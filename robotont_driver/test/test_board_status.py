import pytest

from robotont_driver.protocol.board_status import BoardHealth, BoardStatus, Identity

WHO = "robotont_firmware 2.0.0 wheels 3 rate 50 units edges/period profile ours reset power"


def health(*texts):
    made = BoardHealth(3, 50.0)
    made.hear_text("identity " + WHO)
    for text in texts:
        made.hear_status(BoardStatus.parse(text, 3))
    return made


@pytest.mark.parametrize("text, fault, warning", [
    ("000000100", "wheel 0: its motor driver reports a fault", ""),
    ("000000020", "wheel 1: no counts although it is driven", ""),
    ("000000003", "wheel 2: counts against its direction", ""),
    ("000000023", "wheel 1: no counts although it is driven", ""),
    ("00000000F", "wheel 2: fault 15", ""),
    ("000000004", "", "wheel 2 works too hard"),
    ("040000000", "", "battery is low"),
    ("020000000", "", "waits for a command of zeros"),
    ("010000000", "", "no valid commands reach the board"),
])
def test_each_fault_and_each_complaint_has_words(text, fault, warning):
    made = health(text)
    made.hear_text(WHO)
    made.hear_status(BoardStatus.parse(text, 3))
    made.report()
    errors, warnings, values = made.report()
    assert (len(errors), len(warnings)) == (bool(fault), bool(warning))
    assert warning in "".join(warnings)
    assert values["board profile"] == "ours"
    if fault:
        assert fault in errors[-1]
        assert "until a command of zeros" in errors[-1]
        assert values["faults of the wheels"] == ":".join(str(int(digit, 16)) for digit in text[6:])


def test_voltage_and_load():
    made = BoardHealth(3, 50.0)
    made.hear_status(BoardStatus.parse("0400000004D231", 3))
    _, warnings, values = made.report()
    assert "the battery is low (12.3 V): charge it" in warnings
    assert (values["battery [V]"], values["load of the board [% of a period]"]) == ("12.34", 49)
    made.hear_status(BoardStatus.parse("0000000004D25B", 3))
    assert "takes 91 % of a period" in made.report()[1][0]
    old = BoardStatus.parse("000000000", 3)
    assert (old.voltage, old.load) == (0, 0)
    made.hear_status(old)
    assert "battery [V]" not in made.report()[2]


def test_ticks_and_refusals_are_counted_past_their_overflow():
    made = health("00FEFF000", "000203000")
    _, warnings, values = made.report()
    assert "the board missed 4 ticks" in warnings
    assert "the board refused 4 lines: check cable and baudrate" in warnings
    assert (values["ticks missed"], values["lines refused by the board"]) == (4, 4)
    assert not [words for words in made.report()[1] if "ticks" in words or "lines" in words]


def test_a_fault_is_reported_once_although_it_is_over():
    made = health("020000200", "000000000")
    errors, warnings, _ = made.report()
    assert errors == []
    assert "the board has reported: wheel 0: no counts" in warnings[0]
    assert "no motor drives" not in warnings[0]
    assert made.report()[:2] == ([], [])
    made.hear_status(BoardStatus.parse("020000200", 3))
    assert made.report()[:2] == ([made.fault], [])
    made.hear_status(BoardStatus.parse("000000000", 3))
    assert made.report()[:2] == ([], []), "it was seen while it stood"


def test_identity():
    known = Identity.parse(WHO)
    assert known == ("2.0.0", 3, 50, "edges/period", "ours", "power")
    assert known.obstacle(3, 50.0) == ""
    assert known.obstacle(4, 40.0) == ("the board drives 3 wheels, wheelAmount is 4; "
                                       "the board controls at 50 Hz, pidControlFrequency is 40"
                                       ": robot:= one with 3 wheels and 50 Hz (docs/robots.md)")
    assert "in turns" in known._replace(units="turns").obstacle(3, 50.0)
    assert Identity.parse(WHO.replace(" rate", " colour blue rate") + " motors 3 new") == known, "of a later firmware"
    for words in ("", "robotont_firmware", WHO.replace("3", "three"), "robotont_firmware 1.0.0 wheels 3",
                  WHO.replace(" rate", "")):
        assert Identity.parse(words) is None
