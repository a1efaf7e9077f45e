"""which_robot at a `BoardPort` (conftest.py)."""

import time

from robotont_driver.link import serial_port
from robotont_driver.link.which_robot import main


def test_it_names_the_launch_line_and_sends_nothing(official_board, capsys):
    port = official_board("robotont2")
    begun = time.monotonic()
    assert main([port.link, "--seconds", "20"]) == 0
    assert time.monotonic() - begun < 15
    output = capsys.readouterr().out
    assert f"the board at {port.link} speaks robotont2" in output
    assert f"robot:=robotont2 port:={port.link}" in output
    assert port.heard == []


def test_without_a_port_it_listens_to_each_that_there_is(official_board, capsys, monkeypatch, tmp_path):
    port = official_board("robotont2")
    (tmp_path / "robotont").symlink_to(port.link)
    monkeypatch.setattr(serial_port.glob, "glob", lambda path: [str(tmp_path / "robotont"), port.link]
                        if "robotont" in path else [])
    assert main(["--seconds", "20"]) == 0
    assert capsys.readouterr().out.count("robot:=robotont2 port:=") == 1
    monkeypatch.setattr(serial_port.glob, "glob", lambda path: [])
    assert main([]) == 1
    assert "there is no serial port" in capsys.readouterr().err


def test_a_port_that_is_not_there_and_a_board_that_is_unknown(official_board, capsys, monkeypatch):
    monkeypatch.setattr(serial_port, "serial_ports", lambda: ["/dev/ttyACM1"])
    assert main(["/dev/nothing"]) == 1
    assert "is this the right port? there are /dev/ttyACM1" in capsys.readouterr().err
    port = official_board("robotont2")
    for line, words in ((b"I am a printer\r\n", "I am a printer"), (b"Encoders 1:2:3\r\n", "from before March 2020: ")):
        port.board.advance = lambda now, line=line: line
        assert main([port.link, "--seconds", "0.5"]) == 1
        assert words in capsys.readouterr().err
