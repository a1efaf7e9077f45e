"""roslaunch for ./robotont: launch.py FILE ARGUMENT ...

Where a part cannot start, the reason is the last line, and the exit status 1: roslaunch buries it, and its own
status is 0 when a required node has died. With simulation.launch it prints how to go on, once the robot runs.
"""

# ruff: noqa: E402
import signal

signal.signal(signal.SIGINT, signal.SIG_DFL)  # ends without a traceback while nothing is there yet

import contextlib
import os
import re
import socket
import subprocess
import sys
import threading
import time
import tty
from pathlib import Path

import rospkg

ROBOTONT = Path(__file__).resolve().parents[3] / "robotont"
COLOUR = re.compile("\x1b\\[[0-9;]*m")
LOG_LINE = re.compile(r"\[(\w+)\] \[[^]]*\]( /\S+)?: ")  # rospy's
REFUSED = ("RLException: ", "Value error: ", "Resource not found: ")  # roslaunch's, of a launch file
TRACEBACK = ("Traceback (most recent", "During handling of", "The above exception")
USUAL_MASTER = ("", "http://localhost:11311", "http://127.0.0.1:11311")
NEXT_STEPS = """
The robot runs. In another terminal{master}:
  by keys      {robotont} keys{remapping}
  by a topic   {robotont} shell -c 'rostopic pub -r 10 {namespace}cmd_vel/default geometry_msgs/Twist "{{linear: {{x: 0.2}}, angular: {{z: 0.5}}}}"'
  see it       {robotont} rviz{argument}
{navigation}  ROS' tools   {robotont} shell    (in it rostopic, rosnode, rosrun find the robot and its packages)
Ctrl-C here ends all of it.
"""  # noqa: E501
NAVIGATION = """  navigate     {robotont} shell -c 'roslaunch robotont_bringup navigation.launch {arguments}'
               then click a goal: the page's target button, or 2D Nav Goal in RViz
"""


class Errors:
    """Standard error of this process and of all that it starts: passed on, and searched for what ends the whole."""

    def __init__(self):
        self.fatal = []      # words of nodes that cannot start
        self.failed = False  # whether that has ended the whole
        self._plain = []     # other lines, but for the log
        self._required = ""  # name of the process whose end has ended the whole
        self._refused = False
        self._shown = os.dup(2)
        # a terminal for a terminal: nodes ask for one before they colour their lines
        self._reader, writer = os.openpty() if os.isatty(2) else os.pipe()
        if os.isatty(writer):
            tty.setraw(writer)
        os.dup2(writer, 2)
        os.close(writer)
        self._thread = threading.Thread(target=self._pass_on, daemon=True)
        self._thread.start()

    def close(self):
        """Wait for the last lines; returns what has ended the whole, where that is not the last of them."""
        os.dup2(self._shown, 2)
        self._thread.join(2.0)
        return (self.fatal or self._plain[-5:]) if self.failed and not self._refused else []

    def _pass_on(self):
        rest, held = "", []
        with contextlib.suppress(OSError):  # that is a terminal's end
            for data in iter(lambda: os.read(self._reader, 4096), b""):
                *lines, rest = (rest + data.decode(errors="replace")).split("\n")
                if COLOUR.fullmatch(rest):  # the end of a colour stands behind its line
                    lines, rest = [*lines[:-1], "".join((*lines[-1:], rest))], ""
                for line in lines:
                    held.append(line)
                    text = COLOUR.sub("", line)
                    if text.startswith(TRACEBACK) or (len(held) > 1 and (not text or text.startswith("  "))):
                        continue  # up to the line that names the exception
                    if len(held) == 1 or not text.startswith("KeyboardInterrupt"):  # of what was loading at a Ctrl-C
                        for one in held:
                            self._look(COLOUR.sub("", one).strip())
                        self._show(held)
                    held = []
        self._show([*held, rest] if rest else held)

    def _show(self, lines):
        if not (self._refused and self._plain):  # what follows only names the launch files' lines
            os.write(self._shown, "".join(line + "\n" for line in lines).encode())

    def _look(self, text):
        logged = LOG_LINE.match(text)
        if text.startswith(REFUSED):
            self.failed = self._refused = True
        elif "REQUIRED process [" in text:
            self.failed = True
            self._required = re.sub(r".*REQUIRED process \[(.*?)(-\d+)?\].*", r"\1", text)
        elif self.failed and text.startswith("process has died [") and "exit code -" in text:  # without a last word
            self.fatal.append(f"{self._required} was killed; start it all again")
        elif text == "process has finished cleanly":  # such as RViz, when its window was closed
            self.failed = False
        elif logged and logged[1] == "FATAL":
            self.fatal.append(text[logged.end():])
        elif text and not logged and not self.failed:
            self._plain.append(text)


def show_next_steps(arguments, errors):
    """Print them once the simulated robot runs, and its page is there."""
    given = dict(argument.partition(":=")[::2] for argument in arguments)
    name = given.get("namespace", "").strip("/")
    namespace = f"/{name}/" if name else "/"
    odometry = ["rostopic", "echo", "-n", "1", namespace + "odom"]  # ends at once without a master; with one it waits
    while subprocess.call(odometry, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL):
        time.sleep(1.0)
    while given.get("teleop") == "true" and not errors.fatal:
        with contextlib.suppress(OSError, ValueError):
            socket.create_connection(("127.0.0.1", int(given.get("web_port", 8100)))).close()
            break
        time.sleep(0.5)
    if not (errors.fatal or errors.failed):
        master = os.environ.get("ROS_MASTER_URI", "")
        print(NEXT_STEPS.format(
            robotont=ROBOTONT, namespace=namespace, navigation=navigation_step(given),
            remapping=f" __ns:=/{name}" if name else "", argument=f" --namespace {name}" if name else "",
            master="" if master in USUAL_MASTER else f", after  export ROS_MASTER_URI={master}"), flush=True)


def navigation_step(given):
    """How to navigate in a world that has a map, where the navigation stack is installed; empty elsewhere.

    By the ground truth: amcl would begin at the world's start, wherever the robot has been driven since.
    """
    if given.get("world", "empty") == "empty" or "move_base" not in rospkg.RosPack().list():
        return ""
    arguments = " ".join(["localization:=fake", *(f"{name}:={given[name]}" for name in ("world", "namespace")
                                                  if name in given)])
    return NAVIGATION.format(robotont=ROBOTONT, arguments=arguments)


def interrupt(number, _frame):
    """End at once before roslaunch has its own handler, which calls this one when it has ended all that it started.

    It would take it for another fault, and wait for the master that it has just ended, for 10 s.
    """
    if signal.getsignal(number) is interrupt:
        signal.signal(number, signal.SIG_DFL)
        os.kill(os.getpid(), number)
    end = threading.Timer(2.0, os._exit, [130])
    end.daemon = True
    end.start()
    raise KeyboardInterrupt


def main():
    """Run roslaunch; returns the exit status."""
    file, *arguments = sys.argv[1:]
    import roslaunch
    errors = Errors()
    if Path(file).name == "simulation.launch":
        threading.Thread(target=show_next_steps, args=(arguments, errors), daemon=True).start()
    status = 0
    signal.signal(signal.SIGINT, interrupt)
    try:
        roslaunch.main(["roslaunch", "--no-summary", "--skip-log-check", file, *arguments])
    except KeyboardInterrupt:
        status = 130
    except SystemExit as end:
        status = end.code
    words = errors.close()
    if words:
        print("", *words, sep="\nrobotont: ", file=sys.stderr)
    return 1 if errors.failed else status


if __name__ == "__main__":
    sys.exit(main())
