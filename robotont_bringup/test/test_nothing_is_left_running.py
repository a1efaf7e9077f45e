"""What a command of ./robotont has started ends with it, whatever ends it, and leaves no temporary files.

The simulator is driven before, as its own words say.
"""

import contextlib
import os
import re
import signal
import subprocess
import sys
import urllib.request
import uuid
from pathlib import Path

import pytest

from robotont_testing.harness import free_port, wait_for

ROBOTONT = Path(__file__).resolve().parents[2] / "robotont"
COMMANDS = {  # arguments, and programs that run when the command is in the middle of its work
    "demo": (["--picture", "{folder}/demo.png"], {"rosmaster", "odom_node", "simulator_node"}),
    "bench": (["driver"], {"rosmaster", "serial_com_node", "odom_node"}),
    "sim": (["port:={folder}/board", "web_port:={port}"], {"rosmaster", "odom_node", "simulator_node"}),
}
ENDINGS = [("demo", "SIGHUP"), ("bench", "SIGINT"), ("sim", "SIGKILL"),
           pytest.param("bench", "SIGTERM", marks=pytest.mark.nightly)]  # each once
TERMINAL = {"PATH": "/usr/bin:/bin", "PYTHONUNBUFFERED": "1",  # by lines, as on a terminal
            **{name: os.environ[name] for name in ("HOME", "ROBOTONT_LIFELINE")
                                         if name in os.environ}}  # a terminal without ROS' environment
# Its signals as in a terminal, also where these tests run under nohup or in a shell's background.
IN_A_TERMINAL = """import os, signal, sys
for number in signal.SIGHUP, signal.SIGINT:
    signal.signal(number, signal.SIG_DFL)
os.execv(sys.argv[1], sys.argv[1:])"""


def programs(mark):
    """{process id: set of the names in its command line} of the processes that were started with `mark`."""
    found = {}
    for folder in Path("/proc").iterdir():
        with contextlib.suppress(OSError):
            if folder.name.isdigit() and mark.encode() in (folder / "environ").read_bytes():
                words = (folder / "cmdline").read_bytes().split(b"\0")
                found[int(folder.name)] = {Path(os.fsdecode(word)).name for word in words}
    return found


def drive_as_it_says(log, terminal):
    """What sim prints on how to go on is taken by its word."""
    wait_for(lambda: "Ctrl-C here ends all of it." in log.read_text(), "the hint", 60.0, 0.1)
    assert "[WARN]" not in log.read_text()  # a healthy start
    speaks = r"/serial_com_node: .*/board: the board speaks checked \(this project's firmware"
    wait_for(lambda: re.search(speaks, log.read_text()), "which board it is", 60.0, 0.1)
    page, = re.findall(r"drive the robot in a browser: (\S+)", log.read_text())
    assert b"<html" in urllib.request.urlopen(page, timeout=10.0).read()
    drive, = re.findall(r"by a topic +(.*)", log.read_text())
    tools, = re.findall(r"ROS' tools +(.*?) +\(", log.read_text())
    see = "rostopic echo -n 1 --filter \"m.twist.twist.linear.x > 0.15\" odom && rosrun robotont_driver which_robot -h"
    with subprocess.Popen(["bash", "-c", drive], env=terminal, cwd="/", stdout=subprocess.DEVNULL,
                          start_new_session=True) as driving:
        subprocess.run(["bash", "-c", f"{tools} -c '{see}'"], env=terminal, check=True, stdout=subprocess.DEVNULL,
                       timeout=60.0)
        os.killpg(driving.pid, signal.SIGINT)


@pytest.mark.parametrize("command, ending", ENDINGS)
def test_nothing_is_left(command, ending, tmp_path):
    arguments, in_the_middle = COMMANDS[command]
    temporary, mark = tmp_path / "tmp", uuid.uuid4().hex
    temporary.mkdir()
    environment = {**(TERMINAL if command == "sim" else os.environ), "TMPDIR": str(temporary), "TEST_MARK": mark,
                   "ROS_MASTER_URI": f"http://127.0.0.1:{free_port()}"}
    environment.pop("DISPLAY", None)
    web_port = free_port()
    with open(str(tmp_path / "output"), "wb") as output:
        process = subprocess.Popen([sys.executable, "-c", IN_A_TERMINAL, str(ROBOTONT), command,
                                    *(word.format(folder=tmp_path, port=web_port) for word in arguments)],
                                   env=environment, stdin=subprocess.DEVNULL, stdout=output, stderr=output,
                                   start_new_session=True)
    try:
        wait_for(lambda: in_the_middle <= set().union(*programs(mark).values()), f"the middle of {command}", 60.0, 0.1)
        if command == "sim":
            drive_as_it_says(tmp_path / "output", environment)
        if ending in ("SIGINT", "SIGHUP"):  # a terminal sends these to all of its foreground processes
            os.killpg(process.pid, getattr(signal, ending))
        else:
            os.kill(process.pid, getattr(signal, ending))
        process.wait(60.0)
        wait_for(lambda: not programs(mark), f"the end of {programs(mark)}", 60.0, 0.1)
    finally:
        for left in programs(mark):
            with contextlib.suppress(OSError):
                os.kill(left, signal.SIGKILL)
        process.wait()
    assert list(temporary.iterdir()) == []
    picture = tmp_path / "demo.png"
    assert not picture.exists() or picture.stat().st_size == 0, "it has gone on to its own end"
    if ending == "SIGINT":
        assert "Traceback" not in (tmp_path / "output").read_text()


def test_a_holder_within_another_leaves_no_folder_though_its_keeper_was_killed(tmp_path):
    mark = uuid.uuid4().hex
    inner = "from robotont_testing import lifeline; print(lifeline.hold(), flush=True); import time; time.sleep(60)"
    outer = "import subprocess, sys; from robotont_testing.lifeline import hold; hold(); subprocess.run(sys.argv[1:])"
    environment = {**os.environ, "TMPDIR": str(tmp_path), "TEST_MARK": mark}
    with subprocess.Popen([sys.executable, "-c", outer, sys.executable, "-c", inner], env=environment, text=True,
                          stdout=subprocess.PIPE) as holder:
        folder = holder.stdout.readline().strip()
        # a program that has just begun has no environment in /proc for a moment
        keeper, = wait_for(lambda: [pid for pid, words in programs(mark).items()
                                    if {"lifeline.py", Path(folder).name} <= words], "the keeper", 60.0, 0.1)
        os.kill(keeper, signal.SIGKILL)
        holder.kill()
    wait_for(lambda: not programs(mark) and not list(tmp_path.iterdir()), "the end of all", 60.0, 0.1)
