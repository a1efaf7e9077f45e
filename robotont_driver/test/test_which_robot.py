import time

import pytest

from robotont_boards import BOARDS
from robotont_driver.link import exclusive_port as serial_port
from robotont_driver.tools.which_robot import main
from robotont_testing.board_port import BoardPort
from robotont_testing.dc_motors import Motors


@pytest.mark.parametrize("name, words", [
    ("robotont2", "robot:=robotont2 port:="), ("robotont2018", "robot:=robotont2018")])
def test_it_names_the_launch_line_and_sends_nothing(tmp_path, capsys, name, words):
    port = BoardPort(str(tmp_path / "board"), lambda now: BOARDS[name](Motors(), start=now))
    port.plug()
    try:
        begun = time.monotonic()
        assert main([port.link, "--seconds", "20"]) == 0
        assert time.monotonic() - begun < 15
    finally:
        port.unplug()
    output = capsys.readouterr().out
    assert all(part in output for part in (f"speaks {name}", words, port.link))
    assert port.heard == []


def test_a_port_that_is_not_there_and_a_board_that_is_unknown(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(serial_port, "serial_ports", lambda: ["/dev/ttyACM1"])
    assert main([str(tmp_path / "nothing")]) == 1
    assert "is this the right port? there are /dev/ttyACM1" in capsys.readouterr().err
    port = BoardPort(str(tmp_path / "board"), lambda now: BOARDS["robotont2"](Motors(), start=now))
    port.board.advance = lambda now: b"I am a printer\r\n"
    port.plug()
    try:
        assert main([port.link, "--seconds", "0.5"]) == 1
    finally:
        port.unplug()
    assert "I am a printer" in capsys.readouterr().err
