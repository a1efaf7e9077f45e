"""which_robot at a `BoardPort` (conftest.py)."""

import time

import pytest

from robotont_driver.link import exclusive_port as serial_port
from robotont_driver.tools.which_robot import main


@pytest.mark.parametrize("name, words", [
    ("robotont2", "robot:=robotont2 port:="), ("robotont2018", "robot:=robotont2018")])
def test_it_names_the_launch_line_and_sends_nothing(official_board, capsys, name, words):
    port = official_board(name)
    begun = time.monotonic()
    assert main([port.link, "--seconds", "20"]) == 0
    assert time.monotonic() - begun < 15
    output = capsys.readouterr().out
    assert all(part in output for part in (f"speaks {name}", words, port.link))
    assert port.heard == []


def test_a_port_that_is_not_there_and_a_board_that_is_unknown(official_board, capsys, monkeypatch):
    monkeypatch.setattr(serial_port, "serial_ports", lambda: ["/dev/ttyACM1"])
    assert main(["/dev/nothing"]) == 1
    assert "is this the right port? there are /dev/ttyACM1" in capsys.readouterr().err
    port = official_board("robotont2")
    port.board.advance = lambda now: b"I am a printer\r\n"
    assert main([port.link, "--seconds", "0.5"]) == 1
    assert "I am a printer" in capsys.readouterr().err
