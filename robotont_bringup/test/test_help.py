"""Every program explains itself: `-h` needs no ROS master, and nodes name a wrong argument.

Every number that a user may set has bounds: without them a slip of the pen drives on, or takes the machine down.
"""

import ast
import importlib
import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PROGRAMS = sorted(file for file in ROOT.glob("robotont_*/scripts/*") if file.is_file())  # no __pycache__
NODES = {"driver_node", "serial_com_node", "odom_node", "simulator_node", "cmd_vel_mux", "joy_watch",
          "keyboard_teleop", "web_teleop_node", "navigation_monitor", "recorder_node"}


def run(program, argument, monkeypatch):
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


def test_the_first_command_reads_its_arguments_before_anything_is_installed():
    """On a new computer `./robotont sim` has Python alone."""
    program = ROOT / "robotont_bringup" / "src" / "robotont_bringup" / "launch_arguments.py"
    bare = (f"import runpy, sys; sys.modules.update(dict.fromkeys(('yaml', 'numpy', 'rospkg', 'rospy')))\n"
            f"sys.argv = ['', 'sim', 'simulation,robot', '--', 'world:=office']\n"
            f"runpy.run_path({str(program)!r}, run_name='__main__')")
    result = subprocess.run([sys.executable, "-c", bare], capture_output=True, text=True,
                            check=False, timeout=20)
    assert (result.returncode, result.stdout) == (0, "world:=office\n"), result.stderr


def test_nothing_depends_on_what_python_omits_when_it_optimises():
    """PYTHONOPTIMIZE=2: no assert, and __doc__ is None."""
    for file in ROOT.glob("robotont_*/src/**/*.py"):
        if "robotont_testing" not in file.parts:
            for node in ast.walk(ast.parse(file.read_text())):
                assert not isinstance(node, ast.Assert), file
                parts = [getattr(node, name, None) for name in ("left", "right", "value")]
                assert not any(isinstance(part, ast.Name) and part.id == "__doc__" for part in parts
                               if not isinstance(node, ast.keyword)), file


@pytest.mark.parametrize("program", [file for file in PROGRAMS if file.name in NODES], ids=lambda file: file.name)
def test_every_number_of_a_node_has_bounds(program):
    module, = re.findall(r"^from (\S+) import (?:main|\w+Node|PARAMETERS, \w+)$", program.read_text(), re.MULTILINE)
    for parameter in importlib.import_module(module).PARAMETERS:
        if parameter.is_numeric:
            assert None not in (parameter.minimum, parameter.maximum), parameter.name
            assert parameter.default != parameter.default or parameter.accepts(parameter.default), parameter.name
            assert not parameter.accepts(type(parameter.default)(1e10)), parameter.name
