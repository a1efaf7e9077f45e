"""Every program explains itself: `-h` needs no ROS master, and nodes name a wrong argument."""

import runpy
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PROGRAMS = sorted(file for file in ROOT.glob("robotont_*/scripts/*") if file.is_file())  # no __pycache__
NODES = {"driver_node", "serial_com_node", "odom_node", "robotont_node", "simulator_node", "cmd_vel_mux",
          "gamepad_teleop", "keyboard_teleop", "web_teleop_node", "localization_monitor", "recorder_node"}


def run(program, argument, monkeypatch):
    """Exit status of a program's script."""
    monkeypatch.setattr(sys, "argv", [str(program), argument])
    monkeypatch.setenv("ROS_MASTER_URI", "http://127.0.0.1:1")
    try:
        runpy.run_path(str(program), run_name="__main__")
    except SystemExit as end:
        return end.code
    return 0


@pytest.mark.parametrize("program", PROGRAMS, ids=lambda program: program.name)
def test_help(program, monkeypatch, capsys):
    assert run(program, "-h", monkeypatch) in (0, None)
    text = capsys.readouterr().out
    assert text.startswith("usage:")
    if program.name in NODES:
        assert "(default: " in text
        assert "~diagnostic_period" in text
        assert run(program, "--unheard-of", monkeypatch) == 2
        assert "--unheard-of" in capsys.readouterr().err
